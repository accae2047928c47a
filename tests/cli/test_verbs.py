"""The verbs in this process: what they print, what they refuse, what they leave."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from PIL import Image

from femflex import view
from femflex.cli.render import place_of_camera
from femflex.results import open_run

PLOTS = "[pictures]\nplots = ['attitude/angles', 'q:boom.delta1']\n"
VERBS = ("run", "modes", "body", "render", "plot", "check", "info", "schema")


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_explains_itself_with_an_example(verb: str, femflex: Callable[..., tuple[int, str, str]]):
    code, out, _ = femflex(verb, "--help")
    assert code == 0 and f"Example: femflex {verb}" in " ".join(out.split())


@pytest.mark.parametrize(("verb", "table"), [("run", "[campbell]"), ("converge", "[study]")])
def test_tables_named_in_a_help_text_are_not_taken_for_its_markup(
    verb: str, table: str, femflex: Callable[..., tuple[int, str, str]]
):
    for words in ((verb, "--help"), ("--help",)):
        code, out, _ = femflex(*words)
        assert code == 0 and table in out, words


def test_the_version_is_told(femflex: Callable[..., tuple[int, str, str]]):
    assert femflex("--version")[:2] == (0, "femflex 0.2.0\n")


def test_an_unknown_verb_or_option_is_bad_input(femflex: Callable[..., tuple[int, str, str]]):
    assert femflex("simulate")[0] == 2
    assert femflex("run", "--fast")[0] == 2
    assert femflex("run")[0] == 2


def test_run_prints_what_it_did_and_leaves_a_complete_file(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    expect = "[expect.tip]\nof = 'peak'\nchannel = 'markers/boom.tip/deflection'\nabove = '1 mm'\n"
    code, out, err = femflex("run", write_case(craft + expect), "-o", "run.h5")
    assert (code, err) == (0, "")
    for told in (
        "hub with a boom",
        "6.49581",
        "effective mass",
        "orbit       none",
        "attitude    hub free",
        "dop853",
        "expected    tip",
    ):
        assert told in out
    with h5py.File(tmp_path / "run.h5") as file:
        assert file.attrs["complete"] and len(file["time"]) == 201
        assert file["time"][-1] == 10.0 and np.isfinite(file["q"]).all()
    assert not list(tmp_path.glob("*.part"))


def test_an_existing_output_is_refused_without_force(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path], tmp_path: Path
):
    case = write_case()
    (tmp_path / "craft.h5").write_text("mine")
    code, _, err = femflex("run", case)
    assert code == 2 and "craft.h5 exists" in err and "--force" in err
    assert (tmp_path / "craft.h5").read_text() == "mine"
    assert femflex("run", case, "--force")[0] == 0


def test_existing_pictures_are_refused_before_the_run(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    (tmp_path / "craft_attitude_angles.png").write_text("mine")
    code, _, err = femflex("run", write_case(craft + "[pictures]\nplots = ['attitude/angles']\n"))
    assert code == 2 and "craft_attitude_angles.png exists" in err
    assert not (tmp_path / "craft.h5").exists()


def test_the_plots_a_case_asks_for_are_left_beside_the_run(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    code, out, _ = femflex("run", write_case(craft + PLOTS), "-o", "a.h5")
    assert code == 0 and "picture     a_attitude_angles.png" in out
    assert "picture     a_q_boom.delta1.png" in out
    assert all(re.fullmatch(r"[\w.-]+", path.name, re.ASCII) for path in tmp_path.iterdir()), "a name not portable"
    assert (tmp_path / "a_attitude_angles.png").stat().st_size > 5000
    assert femflex("plot", "a.h5", "markers/boom.tip/deflection", "--spectrum", "-o", "tip.svg")[0] == 0
    assert (tmp_path / "tip.svg").read_text().startswith("<?xml")
    code, _, err = femflex("plot", "a.h5", "markers/boom.tip/deflexion")
    assert code == 2 and "markers/boom.tip/deflection" in err
    code, _, err = femflex("plot", "a.h5", "-o", "tip.svg")
    assert code == 2 and "tip.svg exists" in err


def test_bad_input_is_told_on_standard_error_and_nothing_is_written(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    case = write_case(craft.replace("mass = 200", "mass = -200").replace('group = "TIP"', 'group = "END"'))
    before = sorted(tmp_path.iterdir())
    for verb in (("run", case), ("check", case), ("modes", case), ("body", case, "boom"), ("info", case)):
        code, out, err = femflex(*verb)
        assert (code, out) == (2, "")
        assert "femflex: craft.toml: bodies.hub.mass: found -200 kg" in err
        assert "femflex: craft.toml: bodies.boom.markers.tip.group: found 'END'" in err
        assert "Traceback" not in err
    assert sorted(tmp_path.iterdir()) == before


def test_a_doubtful_rate_is_warned_of_and_run(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path]
):
    code, _, err = femflex("check", write_case(craft.replace('rates = ["2 deg/s", 0, 0.01]', "rates = [36, 0, 0]")))
    assert code == 0
    assert (
        err.startswith("femflex: warning: attitude.rates: 36 is read as 36 rad/s")
        and '"36 deg/s" (0.6283 rad/s)' in err
    )


def test_check_tells_what_a_sound_case_is(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path]
):
    code, out, err = femflex("check", write_case())
    assert (code, err) == (0, "")
    first, *others = out.splitlines()
    assert first == "craft.toml: no problems; 2 bodies, 202.952 kg, 10 degrees of freedom, 4 of them elastic"
    assert len(others) == 1 and others[0].startswith("body        boom: strain is linear: turning at 0.0418 rad/s")


def test_a_motion_that_runs_away_ends_with_code_3_and_keeps_its_file(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    """A heavy hub spins faster than the boom's lowest frequency: with linear strain the boom diverges exponentially."""
    text = craft.replace('"2 deg/s", 0, 0.01', '0, 0, "100 rad/s"').replace("[120, 100, 140]", "[1e9, 1e9, 1e9]")
    text = text.replace("[bodies.boom]", '[bodies.boom]\nstrain = "linear"')
    code, _, err = femflex("run", write_case(text.replace("mass = 200", "mass = 1e7")), "-o", "run.h5")
    assert code == 3
    assert "in boom.delta" in err and "the motion diverges" in err and "marked incomplete" in err
    told = re.search(r"body 'boom' turned at up to 100 rad/s: a stiffening of (\d+)% .*\((\S+) Hz, not (\S+) Hz", err)
    assert told is not None and err.index(told[0]) < err.index("the run stopped")
    assert float(told[3]) / float(told[2]) == pytest.approx(1 + float(told[1]) / 100, abs=0.01)
    with open_run(tmp_path / "run.h5") as kept:
        assert not kept.complete and "diverges" in kept.ended
        assert 0 < len(kept) < 201 and np.isfinite(kept["q"]).all()


def test_numbers_that_overflow_end_with_code_3_and_without_nan(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    text = craft.replace(
        "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "torque = [[0, 1e30, 0], [0, 1e30, 0]]\ntimes = [5, 20]"
    )
    code, _, err = femflex("run", write_case(text), "-o", "run.h5")
    assert code == 3 and "the run stopped at t = 5 s in" in err
    with open_run(tmp_path / "run.h5") as kept:
        assert not kept.complete and kept.time[-1] == 5.0 and np.isfinite(kept["q"]).all()


def test_modes_prints_frequencies_and_running_sums(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path]
):
    case = write_case()
    code, out, _ = femflex("modes", case, "--bodies", "--json")
    data = json.loads(out)["boom"]
    assert code == 0 and len(data["frequency_hz"]) == 4
    running = np.array(data["running_sum"])
    np.testing.assert_allclose(running[-1, 1], np.square(data["participation"])[:, 1].sum() / data["total"][1])
    assert np.all(np.diff(running[:, :3], axis=0) >= 0) and running[-1, 1] == pytest.approx(
        0.8, abs=0.01
    )  # two modes a plane
    code, out, _ = femflex("modes", case, "--bodies", "-n", "6")
    assert code == 0 and "6.49581" in out and "61.29" in out


def test_modes_names_the_directions_that_a_flat_boom_bends_in(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path], craft: str
):
    """20 mm along y, 60 mm along z: its first mode moves 61.31 % of its mass along y, the next as much along z.

    These turn about z and y: (int x phi dm)^2 is 97.07 % of the inertia of a bar about its clamped end.
    """
    flat = craft.replace(
        '"tube"\nouter_radius = "30 mm"\nthickness = "2 mm"', '"rectangle"\nwidth = 0.02\nheight = 0.06'
    )
    case = write_case(
        flat.replace('material = "aluminium" }', 'material = "aluminium", options = { orientation = [0, 1, 0] } }')
    )
    data = json.loads(femflex("modes", case, "--bodies", "--json")[1])["boom"]
    shares = np.array(data["effective_mass"]) / np.array(data["total"])
    table = femflex("modes", case, "--bodies")[1].split("effective mass")[1].splitlines()
    heads = [line.split() for line in table if "Hz" in line.split() or line.startswith("mode")]
    head = ["mode", "Hz", *heads[0][2:], *heads[1][1:]]  # folded into two tables
    halves = [cells for line in table if len(cells := re.findall(r"([\d.]+) \([\d.]+\)", line)) == 3]
    rows = [left + right for left, right in zip(halves[: len(halves) // 2], halves[len(halves) // 2 :], strict=True)]
    assert max(len(line) for line in table if line[:1].isdigit()) <= 80
    stiff = int(np.argmin(np.abs(np.array(data["frequency_hz"]) / data["frequency_hz"][0] - 3)))
    for mode, (moved, turned) in ((0, ("y", "rz")), (stiff, ("z", "ry"))):
        for direction, part in ((moved, 0.6131), (turned, 0.9707)):
            assert shares[mode][data["directions"].index(direction)] == pytest.approx(part, abs=2e-3)
            assert float(rows[mode][head.index(direction) - 2]) == pytest.approx(100 * part, abs=0.2)


def test_modes_of_an_unknown_or_rigid_body_are_answered(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path]
):
    case = write_case()
    assert "no body 'bom'; did you mean 'boom'?" in femflex("modes", case, "--body", "bom")[2]
    assert "body 'hub' has no elastic modes" in femflex("modes", case, "--body", "hub")[2]


def test_a_saved_body_has_the_modes_it_was_saved_with(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path], tmp_path: Path
):
    case = write_case()
    code, out, _ = femflex("body", case, "boom")
    assert code == 0 and out.startswith("boom.h5: 2.95184 kg, 4 elastic coordinates")
    assert femflex("body", case, "boom")[0] == 2  # it is there now
    saved, fresh = (json.loads(femflex("modes", file, "--bodies", "--json")[1])["boom"] for file in ("boom.h5", case))
    assert fresh.pop("note").startswith("strain is linear") and saved.pop("note") == ""  # the case's, not the body's
    assert saved == fresh
    mac = json.loads(femflex("modes", case, "--mac", "boom.h5", "--json")[1])["boom"]["mac"]
    np.testing.assert_allclose(np.diag(mac), 1.0, rtol=1e-12)
    assert femflex("modes", "boom.h5", "-n", "4")[0] == 0
    code, _, err = femflex("modes", "boom.h5", "-n", "9")
    assert code == 2 and "the body file holds 4" in err
    assert "marker  tip at (3, 0, 0) m" in femflex("info", "boom.h5")[1]


def test_info_tells_meshes_cases_runs_and_refuses_the_rest(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path], tmp_path: Path
):
    case = write_case()
    assert (
        "boom.inp: mesh" in femflex("info", tmp_path / "boom.inp")[1]
        and "BOOM" in femflex("info", tmp_path / "boom.inp")[1]
    )
    assert "body    boom: flexible from boom.inp" in femflex("info", case)[1]
    assert femflex("run", case, "-o", "run.h5")[0] == 0
    assert "201 instants, 0 to 10 s" in femflex("info", "run.h5")[1]
    assert femflex("info", "nothing.msh")[0] == 2
    assert femflex("info", tmp_path)[0] == 2
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    assert "neither a run nor a body" in femflex("info", "other.h5")[2]


def test_a_complete_run_is_said_to_be_one_and_left_alone(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path], tmp_path: Path
):
    case = write_case()
    assert "result file craft.h5 does not exist" in femflex("run", case, "--resume")[2]
    assert femflex("run", case)[0] == 0
    before = (tmp_path / "craft.h5").read_bytes()
    told = "done        craft.h5 is complete already; there is nothing to resume (--force runs it anew)\n"
    assert femflex("run", case, "--resume") == (0, told, "")
    assert (tmp_path / "craft.h5").read_bytes() == before


def test_alike_bodies_are_told_once(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path]
):
    boom = craft[craft.index("[bodies.boom]") : craft.index("[[joints]]")]
    second = boom.replace("[bodies.boom]", "[bodies.mast]")
    joint = '[[joints]]\nkind = "weld"\nparent = "hub"\nchild = "mast"\nchild_marker = "ROOT"\n'
    code, out, _ = femflex("modes", write_case(craft + second + joint), "--bodies")
    assert code == 0 and out.count("effective mass") == 1 and out.startswith("boom, mast: ")
    code, out, _ = femflex("modes", write_case(craft + second.replace("modes = 4", "modes = 3") + joint), "--bodies")
    assert code == 0 and out.count("effective mass") == 2


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("option", "value", "told"),
    [
        ("--at", "soon", "--at: found 'soon'"),
        ("--at", "3 m", "a length; expected a time"),
        ("--view", "1,2", "--view: found '1,2'; expected 3 numbers"),
        ("--size", "big", "--size: found"),
        ("--scale", "huge", "--scale: found 'huge'"),
        ("--theme", "blue", "blue"),
        ("--at", "99", "outside the run"),
    ],
)
def test_render_answers_bad_options(
    option: str, value: str, told: str, femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path]
):
    assert femflex("run", write_case(), "-o", "run.h5")[0] == 0
    code, _, err = femflex("render", "run.h5", option, value)
    assert code == 2 and told in err


def test_the_schema_knows_units_and_refuses_unknown_keys(femflex: Callable[..., tuple[int, str, str]]):
    schema = json.loads(femflex("schema")[1])
    assert schema["additionalProperties"] is False and set(schema["required"]) == {"run", "bodies"}
    orbit, run = schema["$defs"]["OrbitTable"]["properties"], schema["$defs"]["RunTable"]["properties"]
    assert "m^3/s^2" in json.dumps(orbit["mu"]) and "Height of the perigee" in orbit["perigee_altitude"]["description"]
    assert '"unit": "s"' in json.dumps(run["duration"])
    assert len(schema["$defs"]) > 30


@pytest.mark.slow
def test_pictures_of_a_run_and_of_modes_have_the_size_asked_for(
    femflex: Callable[..., tuple[int, str, str]], write_case: Callable[..., Path], tmp_path: Path
):
    case = write_case()
    assert femflex("run", case, "-o", "run.h5")[0] == 0
    code, out, _ = femflex("render", "run.h5", "--at", "1", "--size", "320x240", "--scale", "20", "-o", "a.png")
    assert (code, out) == (0, "picture     a.png\n")
    image = np.asarray(Image.open(tmp_path / "a.png"))
    assert image.shape[:2] == (240, 320) and image.std() > 5
    assert femflex("modes", case, "-o", "m.png")[0] == 0
    assert np.asarray(Image.open(tmp_path / "m.png")).std() > 5
    code, _, err = femflex("modes", case, "-o", "m.png")
    assert code == 2 and "m.png exists" in err


def test_where_nothing_can_be_drawn_the_run_is_kept_and_said(
    femflex: Callable[..., tuple[int, str, str]],
    craft: str,
    write_case: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
):
    def cannot(*_: object, **__: object) -> None:
        raise view.NoRenderer("no OpenGL here")

    monkeypatch.setattr(view, "render_picture", cannot)
    code, _, err = femflex("run", write_case(craft + "[pictures]\npicture = true\n"), "-o", "run.h5")
    assert (code, err) == (0, "femflex: no pictures: no OpenGL here; the run is kept in run.h5\n")
    with open_run(tmp_path / "run.h5") as kept:
        assert kept.complete


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ("--force", "interrupted before the first row; run.h5 is still that of an earlier run"),
        ("--resume", "interrupted; run.h5 keeps 3 rows, to 0.1 s, and --resume goes on from there"),
    ],
)
def test_an_interrupt_does_not_take_the_file_of_an_earlier_run_for_its_own(
    femflex: Callable[..., tuple[int, str, str]],
    craft: str,
    write_case: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
    option: str,
    told: str,
):
    case = write_case(craft.replace('duration = "10 s"', 'duration = "0.1 s"'))
    assert femflex("run", case, "-o", "run.h5")[0] == 0
    with h5py.File("run.h5", "r+") as file:  # as an interrupt leaves it
        file.attrs["complete"], file.attrs["ended"] = False, "interrupted"

    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("femflex.pipeline.integrate", stopped)
    code, _, err = femflex("run", case, "-o", "run.h5", option)
    assert code == 130 and told in err


@pytest.mark.slow
def test_a_case_may_ask_for_spectra(
    femflex: Callable[..., tuple[int, str, str]], craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    asked = "[pictures]\nspectra = ['markers/boom.tip/deflection']\nhighest = '20 Hz'\n"
    code, out, _ = femflex("run", write_case(craft + asked), "-o", "run.h5")
    picture = tmp_path / "run_markers_boom.tip_deflection_spectrum.png"
    assert code == 0 and picture.name in out
    assert np.ptp(np.asarray(Image.open(picture).convert("RGB"), int), axis=2).max() > 80  # coloured lines
    wrong = asked.replace("boom.tip", "boom.top")
    code, _, err = femflex("check", write_case(craft + wrong))
    assert (
        code == 2 and "pictures.spectra[0]: found 'markers/boom.top/deflection', which the run will not report" in err
    )


@pytest.mark.parametrize(
    ("text", "camera", "view", "placed"),
    [
        ('[pictures]\nview = [0, -1, 0.3]\nfit = "picture"', None, None, ("auto", (0.0, -1.0, 0.3), "picture")),
        ('[pictures]\ncamera = "fixed"', None, None, ("fixed", None, "picture")),
        ('[pictures]\ncamera = "fixed"', "body", None, ("body", None, None)),
        ("[pictures]\nof_another_version = 1", None, None, ("auto", None, "picture")),
        ("", None, (1.0, 0.0, 0.0), ("auto", (1.0, 0.0, 0.0), None)),
    ],
)
def test_the_camera_stands_where_the_case_has_it_unless_it_is_told(text, camera, view, placed):
    found = place_of_camera(SimpleNamespace(case_text=text), camera, view)
    assert (found["camera"], found["view"], found.get("fit")) == placed
