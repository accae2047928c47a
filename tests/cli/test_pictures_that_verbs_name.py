"""What verbs draw of studies, modes and linear models, what they say of it, and what they say together."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.cli import converge_report, craft_modes, linearize
from femflex.cli.converge_report import StudyOutputs
from femflex.studies.linear import StateSpace


class Finding(SimpleNamespace):
    """A study over modes, which its level and verdict are all that is read of."""

    def to_dict(self) -> dict[str, Any]:
        return {"over": self.over}


def finding(over: str, recommended: int | None, levels: tuple[int, ...]) -> Any:
    return Finding(over=over, recommended=recommended, levels=np.array(levels), n_resolved=len(levels) - 1)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """What `plot_studies` was called with."""
    calls: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        "femflex.view.side_by_side.plot_studies", lambda *words, force: calls.append((*words, force)) or words[1]
    )
    return calls


BOTH = (
    "Choose modes = 4, mesh = 2: each study used the results of the ones before it. Over mesh the tolerance is not "
    "reached."
)


def test_several_studies_are_summed_up_and_drawn_where_they_are_complete(
    drawn: list[tuple[Any, ...]], capsys: pytest.CaptureFixture[str]
):
    found = [finding("modes", 4, (2, 4, 8)), finding("mesh", None, (0, 1, 2, 3))]
    wanted = StudyOutputs(None, False, Path("a.svg"), "dark", True)
    wanted.report(found, {"boom": "a note"}, complete=True)
    text = capsys.readouterr().out
    assert " ".join(text.split()) == f"together {BOTH} picture a.svg"
    assert drawn == [(found, Path("a.svg"), BOTH, "dark", True)]
    wanted.report(found, {"boom": "a note"}, complete=False)
    assert " ".join(capsys.readouterr().out.split()) == f"together {BOTH}" and len(drawn) == 1
    wanted.report(found[:1], {"boom": "a note"}, complete=True)
    assert capsys.readouterr().out == "picture     a.svg\n" and drawn[1][0] == found[:1]
    StudyOutputs(None, False, None, "dark", True).report(found[:1], {}, complete=True)
    assert capsys.readouterr().out == "" and len(drawn) == 2


def test_the_json_of_studies_has_no_lines_about_pictures(
    drawn: list[tuple[Any, ...]], capsys: pytest.CaptureFixture[str]
):
    found = [finding("modes", 4, (2, 4, 8)), finding("mesh", None, (0, 1, 2, 3))]
    wanted = StudyOutputs(None, True, Path("a.png"), "light", False)
    wanted.report(found, {"boom": "a note"}, complete=True)
    assert json.loads(capsys.readouterr().out) == {
        "studies": [{"over": "modes"}, {"over": "mesh"}],
        "choice": {"modes": 4, "mesh": 2},
        "verdict": BOTH,
        "notes": {"boom": "a note"},
    }
    wanted.report(found[1:], {"boom": "a note"}, complete=True)
    assert json.loads(capsys.readouterr().out) == {"over": "mesh", "notes": {"boom": "a note"}}
    assert [call[0] for call in drawn] == [found, found[1:]]
    wanted.begin({"boom": "a note"})
    wanted.say(found[0])
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("over", "printer"), [("strain", "print_forms"), ("functions", "print_kinds"), ("mesh", "print_study")]
)
def test_each_study_is_printed_in_its_own_way(over: str, printer: str, monkeypatch: pytest.MonkeyPatch):
    printed: list[tuple[str, Any]] = []
    for name in ("print_forms", "print_kinds", "print_study"):
        monkeypatch.setattr(converge_report, name, lambda one, name=name: printed.append((name, one)))
    found = finding(over, 1, (1, 2))
    StudyOutputs(None, False, None, "light", False).say(found)
    assert printed == [(printer, found)]


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -0.5, 2.0, float("nan")])
def test_a_tolerance_lies_between_nothing_and_all(tolerance: float):
    with pytest.raises(ValueError, match=f"--tolerance is {tolerance:g}; give a relative error between 0 and 1"):
        StudyOutputs(tolerance, False, None, "light", False).check()


# modes of a craft


def craft(known: list[bool]) -> Any:
    n = len(known)
    return SimpleNamespace(
        known=np.array(known),
        names=[f"mode {chr(97 + k)}" for k in range(n)],
        frequencies=np.linspace(0.123456, 1.2, n),
        growing=np.arange(n) == 2,
        skin=lambda chosen: ("skin", chosen),
    )


@pytest.fixture
def pictures(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    calls: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        "femflex.view.craft_montage",
        lambda skin, captions, path, title, force: calls.append((skin, captions, path, title, force)) or path,
    )
    monkeypatch.setattr(
        "femflex.view.craft_movie",
        lambda skin, caption, path, force, progress: calls.append((skin, caption, path, force)) or path,
    )
    return calls


def test_a_montage_shows_the_first_modes_that_are_not_rigid(pictures: list[tuple[Any, ...]]):
    montage = craft_modes.Drawing(Path("a.png"), None, None, True)
    assert montage.make(craft([True, False, False]), "a craft") == [("picture", Path("a.png"))]
    captions = ["2 · mode b · 0.6617 Hz", "3 · mode c · 1.2 Hz · grows"]
    assert pictures == [(("skin", [2, 3]), captions, Path("a.png"), "a craft", True)]
    montage.make(craft([False, *[True] * 3, *[False] * 14]), "a craft")
    assert pictures[1][0] == ("skin", [1, *range(5, 16)]) and len(pictures[1][1]) == 12
    with pytest.raises(ValueError, match=r"^the craft has only rigid-body modes, which are not drawn$"):
        montage.make(craft([True, True]), "a craft")


def test_a_movie_shows_the_mode_that_is_named_or_the_first_that_is_not_rigid(pictures: list[tuple[Any, ...]]):
    found = craft([True, False, False])
    for mode, shown in ((None, 2), (1, 1), (3, 3)):
        movie = craft_modes.Drawing(None, Path("a.mp4"), mode, False)
        assert movie.make(found, "a craft") == [("movie", Path("a.mp4"))]
        text = craft_modes.caption(found, shown)
        assert pictures[-1] == (("skin", [shown]), text, Path("a.mp4"), False)
    craft_modes.Drawing(None, Path("a.mp4"), None, False).make(craft([True, True]), "")
    assert pictures[-1][0] == ("skin", [1])
    with pytest.raises(ValueError, match=r"^--mode is 4; the modes of the craft are 1 to 3$"):
        craft_modes.Drawing(None, Path("a.mp4"), 4, False).make(found, "a craft")


# linear models


def two_by_two() -> StateSpace:
    """Two oscillators, one driven by each input and seen by each output."""
    A = np.array([[0, 1, 0, 0], [-4, -0.4, 0, 0], [0, 0, 0, 1], [0, 0, -25, -0.5]], float)
    B = np.array([[0, 0], [2, 0], [0, 0], [0.5, 3]], float)
    C = np.array([[1, 0, 0, 0], [0, 0, 0, 1]], float)
    names = (("a", "m"), ("b", "m/s"), ("c", "rad"), ("d", "rad/s"))
    return StateSpace(A, B, C, np.zeros((2, 2)), names, (("f", "N"), ("g", "N m")), (("x", "m"), ("w", "rad/s")))


def test_pictures_of_a_model_have_a_curve_for_each_pair_under_its_own_name(monkeypatch: pytest.MonkeyPatch):
    calls: dict[str, tuple[Any, ...]] = {}
    monkeypatch.setattr(
        "femflex.view.bode.plot_bode", lambda *words, force: calls.update(bode=(*words, force)) or words[2]
    )
    monkeypatch.setattr(
        "femflex.view.bode.plot_nichols", lambda *words, force: calls.update(nichols=(*words, force)) or words[1]
    )
    monkeypatch.setattr(
        "femflex.studies.linear.save_model", lambda *words: calls.update(saved=words) or Path(str(words[1]))
    )
    model, files = two_by_two(), {"model": Path("a.mat"), "picture": Path("a.png")}
    made = linearize.written(model, files, "a title", ("dark", True, False))
    assert made == [("model", Path("a.mat")), ("picture", Path("a.png"))]
    assert calls["saved"] == (model, Path("a.mat"), True) and "nichols" not in calls
    omega, pairs, *rest = calls["bode"]
    assert rest == [Path("a.png"), "dark", "a title", True]
    s = 1j * omega
    first, second = 2 / (s**2 + 0.4 * s + 4), s / (s**2 + 0.5 * s + 25)
    wanted = {"x / f": first, "w / f": 0.5 * second, "x / g": 0 * s, "w / g": 3 * second}
    assert list(pairs) == list(wanted)
    for name, curve in wanted.items():
        np.testing.assert_allclose(pairs[name], curve, rtol=1e-9, atol=1e-15)
    assert linearize.written(model, {"picture": Path("b.svg")}, "b", ("light", False, True)) == [
        ("picture", Path("b.svg"))
    ]
    assert list(calls["nichols"][0]) == list(wanted) and calls["nichols"][1:] == (Path("b.svg"), "light", "b", False)
    assert linearize.written(model, {}, "c", ("light", False, False)) == []


def test_the_json_of_a_model_has_its_matrices_names_and_zeros():
    model: Any = two_by_two()
    about: Any = SimpleNamespace(about=None, left_out=("load 'a'", "load 'b'"))
    found = linearize.model_data(about, model, zeros=True)
    assert list(found) == [
        "states", "inputs", "outputs", "about", "left_out", "poles", "A", "B", "C", "D", "zeros"
    ]  # fmt: skip
    assert found["states"] == ["a", "b", "c", "d"] and found["left_out"] == ["load 'a'", "load 'b'"]
    assert found["inputs"] == [{"name": "f", "unit": "N"}, {"name": "g", "unit": "N m"}]
    assert found["outputs"] == [{"name": "x", "unit": "m"}, {"name": "w", "unit": "rad/s"}]
    assert found["about"] == "an instant of a motion"
    assert {key: found[key] for key in "ABCD"} == {key: getattr(model, key).tolist() for key in "ABCD"}
    assert np.allclose(found["zeros"], [[0, 0]], atol=1e-12)
    slow, fast = found["poles"]
    assert (slow["real"], slow["imag"]) == pytest.approx((-0.2, np.sqrt(4 - 0.04)), rel=1e-12)
    assert (fast["real"], fast["imag"]) == pytest.approx((-0.25, np.sqrt(25 - 0.0625)), rel=1e-12)
    assert slow["damping_ratio"] == pytest.approx(0.1) and fast["damping_ratio"] == pytest.approx(0.05)
    assert [set(pole["participation"]) for pole in (slow, fast)] == [{"a", "b"}, {"c", "d"}]
    about.about = object()
    found = linearize.model_data(about, model, zeros=False)
    assert found["about"] == "equilibrium" and "zeros" not in found
