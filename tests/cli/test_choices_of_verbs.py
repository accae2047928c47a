"""Small choices of the verbs: errors, warnings, outputs and studies, on values made up for them."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.case import parse_case
from femflex.cli.campbell import axis_over, diagram_paths
from femflex.cli.campbell import with_options as campbell_options
from femflex.cli.converge import checked_levels, read_levels
from femflex.cli.converge_report import print_forms, print_kinds, print_study
from femflex.cli.errors import meaning
from femflex.cli.outputs import outputs
from femflex.cli.second_run import second_output
from femflex.cli.stability import one_axis, with_options
from femflex.numba_interfaces import NEEDED, missing

HUB = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"


def test_errors_have_the_exit_status_of_their_cause():
    assert meaning(OSError(errno.ENOSPC, "No space left", "a.h5")) == (3, ["a.h5: no space left"])
    assert meaning(OSError(errno.EIO, "Input/output error", "a.h5"))[0] == 3
    assert meaning(PermissionError(errno.EACCES, "Permission denied", "b.h5")) == (2, ["b.h5: permission denied"])
    assert meaning(FileExistsError("c.h5 exists")) == (2, ["c.h5 exists (--force)"])
    code, (text,) = meaning(MemoryError("whatever"))
    assert code == 3 and text.startswith("there is not enough memory for this")
    assert meaning(np.linalg.LinAlgError("Singular matrix")) == (3, ["the numerics failed: Singular matrix"])
    code, lines = meaning(TypeError("odd"))
    assert code == 1 and lines[0] == "this is a fault of femflex itself: TypeError in femflex: odd"


def test_outputs_go_by_their_suffix_and_once_each():
    kinds = {"table": (".csv",), "picture": (".png", ".svg")}
    assert outputs([Path("a.SVG"), Path("b.csv")], kinds) == {"picture": Path("a.SVG"), "table": Path("b.csv")}
    with pytest.raises(
        ValueError, match=r"-o a.txt: found the suffix '.txt'; expected .csv for a table; .png, .svg for"
    ):
        outputs([Path("a.txt")], kinds)
    with pytest.raises(ValueError, match=r"found -o a.png and -o b.svg, both for the picture; give one"):
        outputs([Path("a.png"), Path("b.svg")], kinds)
    assert diagram_paths(Path("out/run.v1.h5")) == (Path("out/run.v1_campbell.csv"), Path("out/run.v1_campbell.png"))


def test_a_second_run_is_named_after_what_it_leaves_out():
    for more, name in (
        ("", None),
        ("plots = ['time']", None),
        ("linearised = true", "r_linearised.h5"),
        ("without = ['a']", "r_without.h5"),
    ):
        found = second_output(parse_case(HUB + f"[pictures]\n{more}\n"), Path("r.h5"))
        assert found == (None if name is None else Path(name))
    assert second_output(parse_case(HUB), Path("r.h5")) is None


def test_options_of_a_diagram_replace_those_of_the_case():
    case = parse_case(HUB + "[campbell]\nspeeds = '0:40 rpm:5'\naxis = [0, 0, 1]\nmodes = 3\norders = [1, 2]\n")
    found = campbell_options(case, "0:2 rev/s:3", 7, "2, 5").campbell
    assert found is not None and found.axis == (0, 0, 1) and (found.modes, found.orders) == (7, (2, 5))
    assert list(found.speeds) == pytest.approx([0, 2 * np.pi, 4 * np.pi]) and found.speeds.unit == "rev/s"
    same = campbell_options(case, None, None, None).campbell
    assert same is not None and (same.modes, same.orders, len(same.speeds)) == (3, (1, 2), 5)
    assert campbell_options(parse_case(HUB), None, 3, None).campbell is None
    with pytest.raises(ValueError, match="--orders is '0,1'; give whole numbers from 1 on"):
        campbell_options(case, None, None, "0,1")
    with pytest.raises(ValueError, match="--speeds: found 'x:y'"):
        campbell_options(case, "x:y", None, None)
    with pytest.raises(ValueError, match="found --vary and --speeds"):
        axis_over(case, "a=1:2:3", "0:1:2")
    assert axis_over(case, "a=1:2:3", None) == ("a", {"between": [1.0, 2.0], "points": 3})
    assert axis_over(case, None, None) is None and axis_over(parse_case(HUB), None, None) is None
    varied = parse_case(HUB + "[stability]\nvary = { mass = { between = ['1 kg', '2 kg'], points = 4 } }\n")
    assert axis_over(varied, None, None) == ("mass", {"between": ["1 kg", "2 kg"], "points": 4})
    assert axis_over(varied, None, "0:1:2") is None


def test_options_of_stability_replace_those_of_the_case():
    given = "[stability]\nof = 'motion'\nperiod = 3\ninertia = 'hub'\n"
    given += "vary = { k_roll = { between = [0, 0.5] }, k_yaw = { between = [0, 1] } }\n"
    case = parse_case(HUB + given)
    found: Any = with_options(case, ["a.b=1:2:9"], False, "2 min", True, ["flexibility, ,K2", "gyroscopic"]).stability
    assert list(found.vary) == ["a.b"] and (found.vary["a.b"].between, found.vary["a.b"].points) == ([1, 2], 9)
    assert (found.of, found.period, found.shooting, found.inertia) == ("motion", 120, True, None)
    assert found.without == ["flexibility", "K2", "gyroscopic"]
    kept: Any = with_options(case, None, False, None, False, None).stability
    assert (kept.period, kept.inertia, kept.shooting, list(kept.vary)) == (3, "hub", False, ["k_roll", "k_yaw"])
    plain: Any = with_options(parse_case(HUB), ["a=1:2:9", "b=3:4:5"], True, None, False, None).stability
    assert plain.of == "motion" and list(plain.vary) == ["a", "b"]
    assert with_options(parse_case(HUB), None, False, None, False, None).stability is None


@pytest.mark.parametrize("text", ["=0:1:3", " =0:1:3", "a=0:1", "a=0:1:2:3", "a=0:1:x", "a=0:1:-3", "a:0:1:3"])
def test_an_axis_has_a_key_two_ends_and_a_number(text: str):
    with pytest.raises(
        ValueError, match=f"--vary: found '{text}'; give KEY=FIRST:LAST:NUMBER, such as joints.0.damping="
    ):
        one_axis(text)


def test_switches_are_off_and_options_empty_unless_they_are_given():
    """But for the few whose value is in the help."""
    from typer.main import get_command

    from femflex.cli.app import app

    given = {}
    for name, command in get_command(app).commands.items():  # type: ignore[attr-defined]
        for option in command.params:
            if option.param_type_name == "option" and option.default not in (None, False):
                given[name, option.opts[0]] = option.default
    themes = {(name, "--theme"): "light" for name in ("campbell", "converge", "linearize", "plot", "render")}
    themes |= {(name, "--theme"): "light" for name in ("stability", "sweep", "terms")}
    assert given == themes | {
        ("converge", "--over"): "modes",
        ("info", "--units"): "m-kg-s",
        ("render", "--fps"): 25.0,
        ("render", "--scale"): "1",
        ("render", "--colour"): "displacement",
        ("render", "--size"): "1280x720",
        ("render", "--edges"): "auto",
    }


FORCED = [
    ("body", "c.toml hub -o {}", "a.h5"), ("campbell", "c.toml -o {}", "a.csv"), ("campbell", "c.toml -o {}", "a.png"),
    ("converge", "c.toml -o {}", "a.png"),
    ("equilibrium", "c.toml -o {}", "a.h5"), ("linearize", "c.toml -o {}", "a.npz"), ("modes", "c.toml -o {}", "a.png"),
    ("modes", "c.toml -o {}", "a.mp4"), ("new", "{}", "a.toml"), ("run", "c.toml", "c.h5"),
    ("stability", "c.toml -o {}", "a.csv"), ("sweep", "s.toml -o {}", "a.png"), ("terms", "r.h5 -o {}", "a.png"),
    ("stress", "r.h5 -o {}", "a.csv"),
]  # fmt: skip


@pytest.mark.parametrize(("verb", "words", "name"), FORCED, ids=[f"{verb} {name}" for verb, _, name in FORCED])
def test_no_verb_overwrites_a_file_unless_it_is_forced(verb: str, words: str, name: str, femflex: Any, tmp_path: Path):
    (tmp_path / "c.toml").write_text(HUB)
    (tmp_path / name).write_text("mine")
    code, _, err = femflex(verb, *words.format(name).split())
    assert code == 2 and f"{name} exists" in err and (tmp_path / name).read_text() == "mine"


def test_levels_are_whole_numbers_of_one_study():
    assert read_levels("1, 2 4") == [1, 2, 4] and checked_levels(None, ["modes"]) is None
    assert checked_levels("1,2", ["mesh"]) == [1, 2]
    for varied in (["strain"], ["modes", "mesh"]):
        with pytest.raises(ValueError, match=f"found --over {','.join(varied)}"):
            checked_levels("1,2", varied)
    with pytest.raises(ValueError, match=r"--levels is '1,2.5'; give whole numbers"):
        read_levels("1,2.5")


@pytest.fixture
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """A screen on which no table is folded."""
    monkeypatch.setattr("femflex.cli.tables.screen_width", lambda: 200)


def study(**more: Any) -> Any:
    found = {
        "title": "peak", "unit": "m", "over": "modes", "levels": [1, 2, 4], "counts": np.array([7, 9, 13]),
        "derivatives": np.array([0, 0, 0]), "followers": np.array([0, 0, 0]), "values": np.array([1.5, 1.25, 1.125]),
        "changes": np.array([np.nan, -0.25, -0.125]), "errors": np.array([0.3, 0.11, np.nan]), "recommended": 2,
        "left_out": ["level 8: too large"], "verdict": "two are enough",
    }  # fmt: skip
    return SimpleNamespace(**found | more)


def rows(capsys: pytest.CaptureFixture[str]) -> list[list[str]]:
    return [line.split() for line in capsys.readouterr().out.splitlines()]


def test_a_study_is_printed_level_by_level(wide: None, capsys: pytest.CaptureFixture[str]):
    print_study(study())
    text = rows(capsys)
    assert text[0] == ["peak", "[m]"] and ["modes", "coordinates", "value", "change", "error"] in text
    assert ["1", "7", "1.5", "3.00e-01"] in text and ["2", "9", "1.25", "-2.500e-01", "1.10e-01", "<-"] in text
    assert ["4", "13", "1.125", "-1.250e-01"] in text
    assert ["left", "out", "level", "8:", "too", "large"] in text and ["verdict", "two", "are", "enough"] in text
    print_study(study(over="mesh", unit="1"))
    text = rows(capsys)
    assert text[0] == ["peak"] and ["refined", "dofs", "value", "change", "error"] in text
    print_study(study(derivatives=np.array([1, 2, 3])))
    text = rows(capsys)
    assert ["modes", "coordinates", "vibration", "derivatives", "value", "change", "error"] in text
    assert ["4", "13", "10", "3", "1.125", "-1.250e-01"] in text
    print_study(study(over="derivatives", derivatives=np.array([0, 0, 0]), followers=np.array([1, 2, 3])))
    text = rows(capsys)
    assert ["derivatives", "shapes", "vibration", "derivatives", "dependent", "value", "change", "error"] in text
    assert ["2", "9", "7", "0", "2", "1.25", "-2.500e-01", "1.10e-01", "<-"] in text


def test_forms_of_strain_are_printed_with_their_differences(wide: None, capsys: pytest.CaptureFixture[str]):
    def form(strain: str, n: int, derivatives: int, followers: int, value: float) -> Any:
        return SimpleNamespace(
            strain=strain, coordinates=n, derivatives=derivatives, followers=followers, value=value, seconds=1.25
        )

    forms = [form("linear", 4, 0, 0, 1.5), form("condensed", 4, 0, 3, 1.25), form("nonlinear", 9, 5, 0, np.nan)]
    off = {"linear": 0.25, "condensed": 0.0, "nonlinear": np.nan}
    found: Any = SimpleNamespace(
        title="peak",
        unit="m",
        forms=forms,
        recommended="condensed",
        verdict="take it",
        difference=lambda f: off[f.strain],
    )
    print_forms(found)
    text = rows(capsys)
    assert ["linear", "4", "4", "0", "0", "1.5", "2.50e-01", "1.25"] in text
    assert ["condensed", "4", "4", "0", "3", "1.25", "0.00e+00", "1.25", "<-"] in text
    assert ["nonlinear", "9", "4", "5", "0"] in text


def test_kinds_of_functions_are_printed_with_the_chosen_one(wide: None, capsys: pytest.CaptureFixture[str]):
    one = SimpleNamespace(levels=[2, 3], counts=[4, 6], values=np.array([1.5, 1.25]))
    found: Any = SimpleNamespace(
        title="peak", unit="m", with_values=[("polynomial", one)], reference=1.0, chosen=("polynomial", 3),
        differences=lambda s: s.values - 1.0, verdict="three",
    )  # fmt: skip
    print_kinds(found)
    text = rows(capsys)
    assert ["polynomial", "2", "4", "1.5", "5.00e-01"] in text and [
        "polynomial",
        "3",
        "6",
        "1.25",
        "2.50e-01",
        "<-",
    ] in text
    found.reference = None
    print_kinds(found)
    assert ["polynomial", "2", "4", "1.5", "0.00e+00"] in rows(capsys)


def test_the_schema_goes_to_a_file_or_to_the_screen(femflex: Any, tmp_path: Path):
    code, out, _ = femflex("schema", "-o", "s.json")
    assert (code, out) == (0, "schema      s.json\n")
    assert json.loads((tmp_path / "s.json").read_text())["title"] == "femflex case"
    (tmp_path / "s.json").write_text("mine")
    assert femflex("schema", "-o", "s.json")[0] == 2 and (tmp_path / "s.json").read_text() == "mine"


def test_problems_of_a_check_are_listed_for_programs(femflex: Any, tmp_path: Path):
    (tmp_path / "a.toml").write_text(HUB.replace("mass = 2", "mas = 2"))
    code, out, _ = femflex("check", "a.toml", "--json")
    assert code == 2
    (problem,) = json.loads(out)["problems"]
    assert problem["where"] == "bodies.hub.mas" and "did you mean 'mass'" in problem["text"]


def test_what_the_compiler_lacks_is_reported_by_its_place(monkeypatch: pytest.MonkeyPatch):
    asked = missing.__wrapped__
    monkeypatch.delenv("FEMFLEX_PLAIN_NUMBA", raising=False)
    assert asked() == ""
    monkeypatch.setenv("FEMFLEX_PLAIN_NUMBA", "0")
    assert asked() == ""
    monkeypatch.setenv("FEMFLEX_PLAIN_NUMBA", "")
    assert asked() == ""
    monkeypatch.setitem(NEEDED, "numba.core.serialize", (("dumps", ("swim",)),))
    assert asked() == "numba.core.serialize.dumps.swim"
    monkeypatch.setitem(NEEDED, "numba.core.serialize", (("sing", ()),))
    assert asked() == "numba.core.serialize.sing"
    monkeypatch.delitem(NEEDED, "numba.core.serialize")
    monkeypatch.setitem(NEEDED, "numba.core.nowhere", ())
    assert asked() == "numba.core.nowhere"
    monkeypatch.setenv("FEMFLEX_PLAIN_NUMBA", "1")
    assert asked() == "FEMFLEX_PLAIN_NUMBA"
