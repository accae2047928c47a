"""Loops and constraints in case files: mistakes get their sentence."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.cli.app import app
from femflex.results import open_run

CASES = Path(__file__).parents[2] / "cases"
FOUR_BAR = (CASES / "four_bar.toml").read_text(encoding="utf-8")
SLEIGH = (CASES / "chaplygin_sleigh.toml").read_text(encoding="utf-8")


MISTAKES = [
    (
        FOUR_BAR,
        'pivot = { position = ["2 m"',
        'pivot = { position = ["6 m"',
        "cannot close",
        "bending would move it by",
    ),
    (
        FOUR_BAR,
        'parent = "coupler"\nparent_marker = "tip"',
        'parent = "rocker"\nparent_marker = "tip"',
        "loops[closure]",
        "'rocker' joined to itself",
    ),
    (
        FOUR_BAR,
        'parent = "coupler"\nparent_marker = "tip"',
        'parent = "copler"\nparent_marker = "tip"',
        "loops[closure].parent",
        "did you mean 'coupler'?",
    ),
    (
        FOUR_BAR,
        'parent = "coupler"\nparent_marker = "tip"',
        'parent = "coupler"\nparent_marker = "tp"',
        "loops[closure].parent_marker",
        "no marker of body 'coupler'",
    ),
    (
        FOUR_BAR,
        'name = "closure"',
        'name = "closure"\nangle = 0.3',
        "loops[closure].angle",
        "has no coordinates of its own",
    ),
    (
        FOUR_BAR,
        'child = "rocker"\nchild_marker = "tip"',
        'child = "rocker"\nchild_marker = "tip"\nmotion = { angle = "locked" }',
        "loops[closure].motion",
        "has no coordinates of its own",
    ),
    (FOUR_BAR, 'name = "closure"', 'name = "closure"\nplay = "3 deg"', "loops[closure].play", "expected a length"),
    (FOUR_BAR, 'name = "closure"', 'name = "closure"\nplay = -1e-6', "loops[closure].play", "-1e-06"),
    (FOUR_BAR, 'name = "closure"', 'name = "closure"\nplay = "1 cm"', "play of loop 'closure' is 0.01 m", "0.1%"),
    (
        FOUR_BAR,
        'name = "drive"',
        'name = "drive"\nplay = "1 um"',
        "joints[drive].play",
        "belongs to an entry of [[loops]]",
    ),
    (FOUR_BAR, 'keep = ["drive"]', 'keep = ["drvie"]', "initial.keep", "did you mean 'drive'?"),
    (FOUR_BAR, 'keep = ["drive"]', 'keep = ["drive", "ground-rocker"]', "'closure'", "'ground-rocker' kept as given"),
    (FOUR_BAR, 'keep = ["drive"]', "", "initial", "neither `from` nor `keep`"),
    (FOUR_BAR, 'keep = ["drive"]', 'keep = ["drive"]\nfrom = "eq.h5"', "initial", "closes every loop already"),
    (SLEIGH, 'body = "sleigh"', 'body = "sleigh"\nparent = "sleigh"', "constraints[blade]", "joined to itself"),
    (SLEIGH, 'kind = "knife_edge"', 'kind = "rolling_disc"\nradius = 0', "constraints[blade].radius", "above 0 m"),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "fragments"), [(t, o, n, f) for t, o, n, *f in MISTAKES], ids=range(len(MISTAKES))
)
def test_mistakes_are_told_and_nothing_is_written(tmp_path, text, old, new, fragments):
    assert old in text
    file, output = tmp_path / "case.toml", tmp_path / "run.h5"
    file.write_text(text.replace(old, new), encoding="utf-8")
    done = CliRunner().invoke(app, ["run", str(file), "-o", str(output)])
    assert done.exit_code == 2
    assert not output.exists()
    told = " ".join(done.stderr.split())
    for fragment in fragments:
        assert fragment in told


@pytest.mark.slow
def test_a_run_says_how_many_rows_follow_from_others(tmp_path):
    file, output = tmp_path / "case.toml", tmp_path / "run.h5"
    file.write_text(
        FOUR_BAR.replace('duration = "5 s"\nsamples = 1001', 'duration = "5 ms"\nsamples = 3'), encoding="utf-8"
    )
    done = CliRunner().invoke(app, ["run", str(file), "-o", str(output)])
    assert "5 constraint rows, of which 1 is redundant" in " ".join(done.stdout.split())
    with open_run(output) as found:
        assert {"loops/closure/force", "joints/drive/torque", "monitors/constraint_rank"} <= set(found.channels)


def begun(tmp_path, text):
    """What a short run of a case says, and the open result file."""
    file, output = tmp_path / "case.toml", tmp_path / "run.h5"
    file.write_text(text, encoding="utf-8")
    done = CliRunner().invoke(app, ["run", str(file), "-o", str(output), "--no-pictures", "--force"])
    assert done.exit_code == 0
    return " ".join(done.stdout.split()), open_run(output)


@pytest.mark.slow
def test_initial_values_that_the_loop_moves_are_told_and_kept_in_the_file(tmp_path):
    short = FOUR_BAR.replace('duration = "5 s"\nsamples = 1001', 'duration = "5 ms"\nsamples = 3')
    said, opened = begun(tmp_path, short.replace('keep = ["drive"]', 'keep = ["ground-rocker"]'))
    with opened as run:
        turned = np.rad2deg(run["q"][0, run.names("q").index("drive.angle")])
        rate = run["u"][0, run.names("u").index("drive.angle_rate")]
        moved = run.attributes["start_moved"]
    assert abs(turned - 20) > 0.1 and abs(rate - 4) > 0.1
    for told in (f"drive.angle 20 -> {turned:.4g} deg", f"drive.angle_rate 4 -> {rate:.4g} rad/s"):
        assert told in said and told in moved
    assert "start made consistent: " in said and "ground-rocker" not in moved
    said, opened = begun(tmp_path, short)
    with opened as run:
        assert "drive" not in run.attributes["start_moved"]  # kept


@pytest.mark.slow
def test_a_misfit_within_the_play_is_told_and_kept_in_the_file(tmp_path):
    short = FOUR_BAR.replace('duration = "5 s"\nsamples = 1001', 'duration = "5 ms"\nsamples = 3')
    askew = short.replace('position = ["2 m", 0, 0]', 'position = ["2 m", 0, "0.4 um"]')
    assert askew != short
    said, opened = begun(tmp_path, askew.replace('name = "closure"', 'name = "closure"\nplay = "1 um"'))
    told = "loop 'closure': the smallest gap that its joints reach is 4e-07 m and 0 rad, within its `play` of 1e-06 m"
    with opened as run:
        assert told in said and told in run.attributes["start_taken_up"]
        assert run["monitors/constraint_position"].max() < 1e-12


def test_nothing_is_told_of_a_start_that_is_consistent(tmp_path):
    short = SLEIGH.replace('duration = "5 s"\nsamples = 251', 'duration = "5 ms"\nsamples = 3')
    said, opened = begun(tmp_path, short.split("[pictures]")[0])
    with opened as run:
        assert "start " not in said and run.attributes["start_moved"] == ""
