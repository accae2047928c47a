"""`femflex modes`, `body` and `info`: frequencies and effective masses with closed forms, body files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from support.hub_beam import exact_frequencies
from support.small_craft import CRAFT

EXACT = exact_frequencies(0.1, 0.1, 0.5, False) / (2 * np.pi)


def test_craft_modes_solve_transcendental_equation(femflex, hub_and_beam):
    code, out, _ = femflex("modes", hub_and_beam(), "--json")
    data = json.loads(out)
    assert code == 0 and data["stable"]
    rigid, elastic = ([mode for mode in data["modes"] if (mode["Hz"] == 0.0) is flag] for flag in (True, False))
    assert len(rigid) == 6 and data["rigid"]
    damped = EXACT * np.sqrt(1 - np.array([mode["damping ratio"] for mode in elastic[:3]]) ** 2)
    assert [mode["Hz"] for mode in elastic[:3]] == pytest.approx(damped, rel=5e-5)
    for mode in elastic[:3]:
        assert 0.01 < mode["damping ratio"] < 0.05  # of the beam alone 0.01; on a light hub it is damped more
        assert sum(mode["kinetic energy"].values()) == pytest.approx(1.0)


@pytest.mark.slow
def test_converge_finds_exact_frequency_of_craft(femflex, hub_and_beam):
    code, out, _ = femflex("converge", hub_and_beam(damping=0), "--over", "modes", "--json")
    data = json.loads(out)
    values = [row["value"] for row in data["modes"]["rows"]]
    assert code == 0 and "[Hz]" in data["modes"]["title"]
    # static shapes of its joint make two modes enough (2e-10); four go without them (6e-6)
    assert values == pytest.approx([EXACT[0]] * len(values), rel=2e-5)


@pytest.mark.slow
def test_montage_and_movie_of_craft_modes_are_drawn(femflex, hub_and_beam, tmp_path):
    code, _, err = femflex("modes", hub_and_beam(modes=2), "-o", "m.png", "-o", "m.mp4", "--mode", "7")
    assert code == 0, err
    picture = imread(tmp_path / "m.png")
    assert picture.shape[0] > 300 and picture[..., :3].std() > 0.02
    assert (tmp_path / "m.mp4").stat().st_size > 5000


def test_modes_of_tube_have_closed_form(femflex, write_case):
    """First bending frequency 3.51602 sqrt(EI / m' L^4) / 2 pi; E I / m' of a thin rod is E (R^2 + r^2) / 4 rho."""
    code, out, _ = femflex("modes", write_case(), "--bodies", "--json")
    rows = json.loads(out)["boom"]["effective mass"]
    exact = 3.51602 / (2 * np.pi * 3.0**2) * np.sqrt(70e9 / 2700 * (0.030**2 + 0.028**2) / 4)
    assert code == 0 and len(rows) == 5 and rows[-1]["mode"] == "sum"
    assert [row["Hz"] for row in rows[:2]] == pytest.approx([exact, exact], rel=5e-4)  # less by the inertia of rotation
    running = json.loads(femflex("modes", write_case(), "--bodies", "-v", "--json")[1])["boom"]["effective mass"]
    sums = np.array([[row[direction]["sum"] for direction in "xyz"] for row in running])
    assert np.all(np.diff(sums, axis=0) >= 0) and sums[-1, 1] == pytest.approx(rows[-1]["y"])
    assert rows[-1]["y"] == pytest.approx(61.31 + 18.83, abs=0.5)  # effective masses of two modes in a plane


def test_flat_boom_has_effective_masses_of_clamped_beam(femflex, write_case):
    """20 mm along y, 60 mm along z: its first mode moves 61.31 % of its mass along y, the next as much along z.

    These turn about z and y: (int x phi dm)^2 is 97.07 % of the inertia of a bar about its clamped end.
    """
    flat = CRAFT.replace(
        '"tube"\nouter_radius = "30 mm"\nthickness = "2 mm"', '"rectangle"\nwidth = 0.02\nheight = 0.06'
    ).replace('material = "aluminium" }', 'material = "aluminium", options = { orientation = [0, 1, 0] } }')
    rows = json.loads(femflex("modes", write_case(flat), "--bodies", "--json")[1])["boom"]["effective mass"][:-1]
    stiff = int(np.argmin([abs(row["Hz"] / rows[0]["Hz"] - 3) for row in rows]))
    for mode, (translation, rotation) in ((0, ("y", "rz")), (stiff, ("z", "ry"))):
        for direction, share in ((translation, 61.31), (rotation, 97.07)):
            assert rows[mode][direction] == pytest.approx(share, abs=0.2)


def test_body_file_has_modes_of_its_case(femflex, write_case):
    case = write_case()
    assert femflex("body", case, "boom")[0] == 0
    assert femflex("body", case, "boom")[0] == 2  # it is there now
    saved, fresh = (json.loads(femflex("modes", file, "--bodies", "--json")[1])["boom"] for file in ("boom.h5", case))
    assert saved == fresh and saved["effective mass"]
    mac = json.loads(femflex("modes", case, "--mac", "boom.h5", "--json")[1])["boom"]["modal assurance"]
    assert [row[str(row["mode"])] for row in mac] == pytest.approx([1.0] * len(mac), rel=1e-12)
    code, _, err = femflex("modes", "boom.h5", "-n", "9")
    assert code == 2 and "4" in err


def test_info_lists_channels_of_a_case_before_its_run(femflex, run_folder):
    """They are those of the run, but for the number of instants."""
    code, out, err = femflex("info", "craft.toml", "--channels")
    assert code == 0, err
    run = femflex("info", "run.h5")[1].splitlines()
    first_row = next(k for k, line in enumerate(run) if line == "attitude")
    n = run[first_row + 1].split()[1]
    assert out.splitlines()[1:] == [line.replace(f"  {n} ", "  n ") for line in run[first_row:]]
    assert "boom.delta1" in out


def test_info_describes_files_of_every_kind(femflex, run_folder):
    """Mass of the tube: 2700 pi (0.03^2 - 0.028^2) 3 = 2.95184 kg."""
    assert femflex("body", "craft.toml", "boom")[0] == 0
    expected = {
        "boom.inp": ("mesh", "BOOM", "ROOT", "TIP"),
        "craft.toml": ("boom", "hub", "push"),
        "boom.h5": ("2.95184 kg", "tip", "(3, 0, 0)"),
        "run.h5": ("201", "10 s", "boom.tip"),
    }
    for name, words in expected.items():
        code, out, _ = femflex("info", name)
        assert code == 0 and all(word in out for word in words), out
    code, out, err = femflex("check", "craft.toml")
    assert (code, err) == (0, "") and "202.952 kg" in out and "10 degrees of freedom" in out


def test_copy_with_advice_is_a_sound_case_and_overwrites_nothing(femflex, write_case, tmp_path):
    case = write_case()
    original = case.read_text()
    assert femflex("check", case, "--write-advice")[0] == 0
    (copy,) = set(tmp_path.glob("*.toml")) - {case}
    assert case.read_text() == original and femflex("check", copy)[0] == 0
    copy.write_text("mine")
    assert femflex("check", case, "--write-advice")[0] == 2 and copy.read_text() == "mine"


@pytest.mark.slow
def test_pictures_have_the_requested_size(femflex, run_folder):
    words = ("render", "run.h5", "--at", "1", "--size", "320x240", "--scale", "20", "-o", "a.png")
    assert femflex(*words)[0] == 0
    image = imread(Path("a.png"))
    assert image.shape[:2] == (240, 320) and image.std() > 0.02
    assert femflex("modes", "craft.toml", "-o", "m.png")[0] == 0
    assert imread(Path("m.png")).std() > 0.02
