"""Whole texts and JSON of the verbs, of made-up results whose numbers are all different: nothing is left unread."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_printed_numbers import Rows, campbell, lines, modes_of

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors, rigid_body
from femflex.case import parse_case
from femflex.cli import backbone, craft_modes, equilibrium, linearize, modes, run_report, stability
from femflex.dynamics.equilibria.equilibrium import EquilibriumError
from femflex.dynamics.equilibria.small_motions import GROWING, growth_rule
from femflex.reduction import save_body
from femflex.studies import BackboneError
from femflex.studies.backbone_curve import Backbone

HUB = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"
RULE = growth_rule()


def raising(error: Exception) -> Any:
    """A function of femflex that raises: what it raises is no fault of femflex."""
    made: dict[str, Any] = {"__name__": "femflex.made", "error": error}
    exec("def failing(*words):\n    raise error", made)
    return made["failing"]


@pytest.fixture
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """A screen on which no table is folded."""
    monkeypatch.setattr("femflex.cli.tables.screen_width", lambda: 200)


def test_the_rule_of_growth_has_the_threshold_of_the_judgement():
    assert RULE == (
        f"unstable above {GROWING:g} of the larger of |eigenvalue| and the rate of the frame, and above rounding"
    )


# equilibria


def rest(names: list[tuple[str, str]], **more: Any) -> Any:
    """An equilibrium with coordinates 0.5, 1.5, ..., two markers and one loop."""
    seen = {
        "time": np.zeros((1, 1)),
        "markers/rod.end/position": np.array([[1.5, -2.25, 1e-14]]),
        "markers/rod.end/deflection": np.array([[0.0, 3e-14, 0.125]]),
        "markers/rod.end/rotation": np.array([[7.0, 8.0, 9.0]]),
        "markers/hub.rim/position": np.array([[0.1, 0.2, 0.3]]),
        "markers/hub.rim/deflection": np.array([[1e-3, 0.0, -2e-3]]),
        "loops/closure/force": np.array([[3.0, -4.0, 12.0]]),
        "loops/closure/torque": np.array([[0.5, 1.0, -1.0]]),
    }
    system = SimpleNamespace(
        coordinate_names=lambda: names,
        segments={"boom": ["boom.1", "boom.2"]},
        frame=SimpleNamespace(kind="spinning", rate=[0, -1.25, 2]),
        orbit=None,
        varying={},
        loops=[SimpleNamespace(label="closure")],
    )
    model = SimpleNamespace(system=system, observe=lambda times, x: seen, constraints=object())
    found = {
        "model": model, "q": 0.5 + np.arange(len(names)), "x": np.zeros(2), "residual": 1.234e-11, "iterations": 7,
        "gap": 2.5e-13, "left": None, "verdict": "unstable: it grows", "stable": False, "share": 1.0,
        "neutral": ("a.b",),
        "growth": 0.12345, "growth_threshold": 1e-8, "eigenvalues": np.array([-0.5 + 2j, 0.25]),
        "motions": SimpleNamespace(known=[SimpleNamespace(name="turn")]),
    }  # fmt: skip
    return SimpleNamespace(**found | more)


MARKERS = [
    "marker   x, m   y, m  z, m  deflection x, m  deflection y, m  deflection z, m",
    "─" * 77,
    "rod.end   1.5  -2.25     0                0                0            0.125",
    "hub.rim   0.1    0.2   0.3            0.001                0           -0.002",
    "",
]


def test_an_unstable_equilibrium_is_printed_with_all_that_is_known_of_it(capsys: pytest.CaptureFixture[str]):
    equilibrium.print_equilibrium(rest([("hinge.angle", "rad"), ("boom.1.delta2", "kg^1/2 m")]))
    assert lines(capsys) == [
        "coordinate     value  unit",
        "─" * 30,
        "hinge.angle      0.5  rad",
        "boom.1.delta2    1.5  kg^1/2 m",
        "",
        *MARKERS,
        "frame       at rest in the frame that spins at [0, -1.25, 2] rad/s",
        "residual    1.23e-11 of the largest force, after 7 iterations",
        "loop        closure carries 13 N and 1.5 N m",
        "loops       closed to 2.5e-13 m",
        "stability   unstable: it grows",
        f"growth      0.123 1/s at most; {RULE}",
        "rigid       turn: neither grow nor decay",
        "            --stable leaves it, along the motion that grows",
    ]


def test_places_of_markers_below_rounding_of_the_largest_are_printed_as_nothing():
    """The largest lies on the negative side, or belongs to another marker."""
    seen = {
        "markers/rod.end/position": np.array([[-1000.0, 0.9e-10, -1.1e-10]]),
        "markers/rod.end/deflection": np.array([[-0.9e-10, 0.25, -2.0]]),
        "markers/rod.end/rotation": np.array([[0.1, 0.2, 0.3]]),
        "markers/rod/position": np.array([[0.9e-10, -0.5, 1.1e-10]]),
        "bodies/rod/position": np.array([[-1e9, 0.0, 0.0]]),
    }
    model = SimpleNamespace(observe=lambda times, x: seen)
    assert equilibrium.markers(SimpleNamespace(model=model, x=np.zeros(2))) == {  # type: ignore[arg-type]
        "rod.end": {"position": [-1000.0, 0.0, -1.1e-10], "deflection": [0.0, 0.25, -2.0]},
        "rod": {"position": [0.0, -0.5, 1.1e-10]},
    }


@pytest.mark.parametrize(("joints", "left_out"), [(24, "2 elastic"), (25, "3 other")])
def test_many_coordinates_are_printed_without_those_of_segments(
    joints: int, left_out: str, capsys: pytest.CaptureFixture[str]
):
    names = [("boom.1.delta1", "m"), *((f"link{k}.angle", "rad") for k in range(joints)), ("boom.2.delta9", "m")]
    left = SimpleNamespace(verdict="unstable: it swings up", growth=0.5)
    found = rest(names, stable=True, verdict="stable", left=left, eigenvalues=np.zeros(0, complex), share=0.5)
    found.model.constraints = None
    equilibrium.print_equilibrium(found)
    text = lines(capsys)
    assert [line.split() for line in text[2:26]] == [[f"link{k}.angle", f"{k + 1.5}", "rad"] for k in range(24)]
    assert text[26:] == [
        "",
        f"and {left_out} coordinates, which --json and the result file hold",
        "",
        *MARKERS,
        "frame       at rest in the frame that spins at [0, -1.25, 2] rad/s",
        "residual    1.23e-11 of the largest force, after 7 iterations",
        "left        an equilibrium that is unstable: it swings up",
        "stability   stable",
    ]


def test_a_craft_without_coordinates_has_no_table_of_them(capsys: pytest.CaptureFixture[str]):
    equilibrium.print_equilibrium(rest([], stable=True))
    assert lines(capsys)[: len(MARKERS)] == MARKERS


def test_lengths_that_stay_are_reported_wherever_an_equilibrium_is(monkeypatch: pytest.MonkeyPatch, capsys: Any):
    lengths = {"boom": 2.5, "mast": 1.23456789}
    monkeypatch.setattr("femflex.system.fixed_length.fixed_lengths", lambda system: lengths)
    told = ["length      of boom stays at 2.5 m", "length      of mast stays at 1.23457 m"]
    found = rest([])
    equilibrium.print_equilibrium(found)
    craft_modes.print_modes(parse_case(HUB), modes_of(about=found), None, {})
    model: Any = SimpleNamespace(states=[0], about=found, left_out=())
    linearize.print_model(model, SimpleNamespace(states=[0]), {"poles": [], "inputs": [], "outputs": []})  # type: ignore[arg-type]
    assert [line for line in lines(capsys) if line.startswith("length")] == told * 3
    assert equilibrium.equilibrium_data(found)["lengths"] == lengths


def test_equal_rigid_motions_are_counted(capsys: pytest.CaptureFixture[str]):
    known = [SimpleNamespace(name=name) for name in ("turn", "drift x", "turn", "turn")]
    equilibrium.print_stability(rest([], motions=SimpleNamespace(known=known)))
    assert lines(capsys)[2] == "rigid       turn (3 directions), drift x: neither grow nor decay"
    equilibrium.print_stability(rest([], motions=SimpleNamespace(known=[])))
    assert len(lines(capsys)) == 2


def test_the_json_of_an_equilibrium_has_every_number():
    names = [("hinge.angle", "rad"), ("boom.1.delta2", "kg^1/2 m")]
    data = equilibrium.equilibrium_data(rest(names, left=SimpleNamespace(growth=0.75)))
    assert data == {
        "coordinates": {"hinge.angle": 0.5, "boom.1.delta2": 1.5},
        "markers": {
            "rod.end": {"position": [1.5, -2.25, 0.0], "deflection": [0.0, 0.0, 0.125]},
            "hub.rim": {"position": [0.1, 0.2, 0.3], "deflection": [1e-3, 0.0, -2e-3]},
        },
        "frame": "spinning",
        "lengths": {},
        "residual": 1.234e-11,
        "iterations": 7,
        "loops": {"closure": {"force": [3.0, -4.0, 12.0], "torque": [0.5, 1.0, -1.0]}},
        "gap": 2.5e-13,
        "neutral": ["a.b"],
        "stable": False,
        "growth": 0.12345,
        "growth_threshold": 1e-8,
        "rigid": ["turn"],
        "left_growth": 0.75,
        "eigenvalues": [[-0.5, 2.0], [0.25, 0.0]],
    }
    partial = rest(names, share=0.5)
    partial.model.constraints = None
    data = equilibrium.equilibrium_data(partial)
    assert (data["rigid"], data["left_growth"], data["loops"]) == ([], None, {})


def test_what_is_at_rest_is_printed_or_kept_and_failures_are_reported(
    femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    """The verb itself: options on their way to the solver and to the file."""
    (tmp_path / "c.toml").write_text(HUB)
    asked, kept = [], []
    found, last = rest([("hinge.angle", "rad")], stable=True), rest([])
    decided = SimpleNamespace(
        notes={"hub": "a note", "b": ""}, advice=[], system=SimpleNamespace(bodies={"hub": SimpleNamespace(n_modes=0)})
    )
    place = "femflex.pipeline.balanced"
    monkeypatch.setattr(f"{place}.decided_at_rest", lambda case: decided)
    monkeypatch.setattr(f"{place}.balanced", lambda *words: asked.append(words) or found)
    monkeypatch.setattr(f"{place}.keep", lambda *words, **more: kept.append((words, more)))
    code, out, _ = femflex("equilibrium", "c.toml", "--at", "2 min", "--stable", "-o", "e.h5", "--force")
    text = out.splitlines()
    assert code == 0 and text[:3] == ["c.toml", "body        hub: a note", "coordinate   value  unit"]
    assert text[-1] == "kept        e.h5" and asked == [(decided, 120.0, True)]
    ((state, case, path), more) = kept[0]
    assert (state, path, case.path.name) == (found, Path("e.h5"), "c.toml")
    assert more == {"force": True, "decided": decided}
    code, out, _ = femflex("equilibrium", "c.toml", "--json")
    assert code == 0 and asked[1] == (decided, None, False) and len(kept) == 1
    assert json.loads(out)["bodies"] == {} and json.loads(out)["coordinates"] == {"hinge.angle": 0.5}

    monkeypatch.setattr(f"{place}.balanced", raising(EquilibriumError("nothing was found.", last)))
    assert femflex("equilibrium", "c.toml") == (3, "", "femflex: nothing was found.\n")
    code, _, err = femflex("equilibrium", "c.toml", "-o", "f.h5")
    sentence = "nothing was found. f.h5 keeps the last state, and is marked incomplete."
    assert (code, err) == (3, f"femflex: {sentence}\n")
    ((state, case, path), more) = kept[1]
    assert (state, path) == (last, Path("f.h5"))
    assert more == {"force": False, "ended": "nothing was found.", "decided": decided}
    (tmp_path / "g.h5").touch()
    assert femflex("equilibrium", "c.toml", "-o", "g.h5")[0] == 2 and len(kept) == 2


# modes of a craft


def test_the_table_of_a_crafts_modes_is_whole(capsys: pytest.CaptureFixture[str]):
    text = HUB + (
        "[expect.second]\nof = 'system_frequency'\nmode = 2\nvalue = '1.5 Hz'\nrelative_tolerance = 0.5\nsource = 'x'\n"
    )
    found = modes_of(about=rest([]), frequency=lambda mode: 1.25, left_out=("load 'a'",))
    craft_modes.print_modes(parse_case(text), found, None, {})
    head = "mode  name              Hz  rad/s  damping ratio  kinetic energy"
    printed = lines(capsys)
    verdict = printed.pop()
    assert [line.split() for line in printed[:6]] == [
        head.split(),
        ["─" * len(printed[1])],
        ["1", "hub", "rotation", "0", "0", "0", "hub", "100", "%"],
        ["2", "boom", "bending", "y", "1.23457", "7.757", "0.0129", "boom", "80", "%,", "hub", "20", "%"],
        ["3", "boom", "bending", "z", "2.5", "15.7", "-0.013*", "boom", "50", "%,", "mast.1", "45", "%"],
        ["4", "mast", "torsion", "7", "44", "0.009", "mast.1", "91", "%,", "hub", "5", "%"],
    ]
    assert printed[6:] == [
        "",
        "*           the motion grows",
        "about       at rest in the frame that spins at [0, -1.25, 2] rad/s",
        "left out    load 'a'. Use --at TIME to evaluate them at a time",
        "stability   unstable: it grows",
        f"growth      0.123 1/s at most; {RULE}",
        "rigid       turn: neither grow nor decay",
    ]
    assert verdict.startswith("expected    second: 1.25 Hz, expected 1.5 +- 0.75") and verdict.endswith(": holds")


@pytest.mark.parametrize(
    ("more", "text"),
    [("", "; `band` in [run] adds those below it"), ("band = '500 Hz'\n", " and those below 500 Hz")],
)
def test_frequencies_that_are_assessed_are_counted_where_more_are_found(
    more: str, text: str, capsys: pytest.CaptureFixture[str]
):
    case = parse_case(HUB.replace("duration = 4\n", f"duration = 4\n{more}"))
    meshed: Any = {"a": SimpleNamespace(origin=SimpleNamespace(source=None)),
                   "b": SimpleNamespace(origin=SimpleNamespace(source="mesh"))}  # fmt: skip
    n = 6
    found = modes_of(
        about=rest([]), names=["m"] * n, frequencies=np.ones(n), eigenvalues=1j * np.ones(n), growing=np.zeros(n, bool),
        damping_ratios=np.zeros(n), known=np.array([True, True, False, False, False, False]), energy={"a": np.ones(n)},
    )  # fmt: skip
    craft_modes.print_modes(case, found, None, meshed)
    line = f"assessed    with richer sets of shapes: the first 3 of 4 elastic frequencies{text}"
    assert line in lines(capsys)
    found.known = np.array([True] * 3 + [False] * 3)  # no more than are assessed anyway
    craft_modes.print_modes(case, found, None, meshed)
    assert not any(line.startswith("assessed") for line in lines(capsys))
    found.known = np.zeros(n, bool)
    craft_modes.print_modes(case, found, None, {"a": meshed["a"]})
    assert not any(line.startswith("assessed") for line in lines(capsys))


def test_the_note_on_damping_is_whole_and_of_bodies_that_are_given_some():
    text = (
        "[run]\nduration = 1\n[bodies.boom]\nkind = 'analytic'\nlength = 1\nEA = 1\nEIy = 1\nEIz = 1\nGJ = 1\n"
        "mass = 1\nfunctions = { y = 1 }\ndamping = "
    )
    case = parse_case(text + "{ ratio = 0.01 }\n")
    share = {"boom": np.array([0.2, 0.049, 0.6, 0.5]), "hub": np.array([0.8, 0.951, 0.4, 0.5])}
    none = np.zeros(4, bool)
    found = modes_of(energy=share, known=none, damping_ratios=np.array([0.0101, 0.5, 0.0089, 0.5]))
    assert craft_modes.damping_note(case, found) == (
        "mode 3 has a ratio of 0.0089, and body 'boom' is given 0.01: that of the modes of its own set. Where its root "
        "moves otherwise it changes, and dampers of joints add to it"
    )
    for ratios in ([0.0, 1.0, 1.0, -0.2], [0.0109, 0.5, 0.0091, 0.0]):
        assert craft_modes.damping_note(case, modes_of(energy=share, known=none, damping_ratios=np.array(ratios))) == ""
    plain = modes_of(energy=share, known=none, damping_ratios=np.full(4, 0.5))
    assert craft_modes.damping_note(parse_case(text + "{ ratio = 0 }\n"), plain) == ""
    assert craft_modes.damping_note(parse_case(HUB), plain) == ""
    assert craft_modes.damping_note(case, modes_of(energy={"hub": np.ones(4)}, known=none)) == ""


def test_shares_of_energy_begin_at_a_twentieth():
    found = modes_of(energy={"a": np.array([0.05]), "b": np.array([0.0499]), "c": np.array([0.9])})
    assert craft_modes.kinetic_energy_text(found, 0) == "c 90 %, a 5 %"


def test_modes_of_a_craft_are_found_drawn_and_printed(femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "c.toml").write_text(HUB)
    asked, drawn = [], []
    system = SimpleNamespace(bodies={})
    decided = SimpleNamespace(notes={"hub": "a note"}, advice=[], system=system, known={})
    found = modes_of(about=rest([]), to_dict=lambda: {"modes": [1, 2]})
    monkeypatch.setattr("femflex.pipeline.balanced.decided_at_rest", lambda case: decided)
    monkeypatch.setattr("femflex.pipeline.balanced.case_modes", lambda *words: asked.append(words) or found)
    monkeypatch.setattr(
        craft_modes.Drawing, "make", lambda self, *words: drawn.append((self, words)) or [("movie", Path("m.mp4"))]
    )
    code, out, _ = femflex("modes", "c.toml", "--at", "1 min", "-o", "m.mp4", "-n", "2", "--mode", "3", "--force")
    text = out.splitlines()
    assert code == 0 and text[:2] == ["c.toml", "body        hub: a note"] and text[-1] == "movie       m.mp4"
    assert asked == [(decided, 60.0)] and "and 2 modes above, which -n and --json list" in text
    assert drawn == [(craft_modes.Drawing(None, Path("m.mp4"), 3, True), (found, "c"))]
    code, out, _ = femflex("modes", "c.toml", "--json", "-o", "p.png")
    assert code == 0 and json.loads(out) == {"modes": [1, 2], "bodies": {}}
    assert drawn[1] == (craft_modes.Drawing(Path("p.png"), None, None, False), (found, "c"))
    (tmp_path / "titled.toml").write_text("title = 'a hub'\n" + HUB)
    assert femflex("modes", "titled.toml")[1].splitlines()[0] == "a hub" and drawn[2][1][1] == "a hub"


# modes of a body


def two_masses(kinds: tuple[str, ...], **more: Any) -> FlexibleBody:
    """Masses of 2 and 3 kg at two points, and shapes that move them; the stiffness makes omega 3 and 7 rad/s."""
    m, r = np.array([2.0, 3.0]), np.array([[1.0, 0.5, -0.25], [-0.5, 2.0, 0.75]])
    phi = np.array([[[0.5, 0.1, 0.2], [0.2, -0.3, 0.1]], [[0.1, 0.4, -0.3], [-0.2, 0.1, 0.45]]])
    first = np.einsum("p,apk,bpk->ab", m, phi, phi)
    L = np.linalg.cholesky(first)
    phi = np.einsum("ab,bpk->apk", np.linalg.inv(L), phi)  # mass-normalised
    z = np.concatenate([r[None], phi])
    moments = MassMoments(5.0, np.einsum("p,apk->ak", m, z), np.einsum("p,apk,bpl->akbl", m, z, z))
    omega = np.array([3.0, 7.0])
    skin = Skin(r, {"line": np.array([[0, 1]])}, phi)
    found = FlexibleBody(
        moments, StrainTensors.linear(np.diag(omega**2)), np.zeros((2, 2)),
        {"tip": Marker(r[1], phi[:, 1].T, np.zeros((3, 2)))}, skin, kinds, omega, **more,
    )  # fmt: skip
    return found


def participations(body: FlexibleBody) -> tuple[np.ndarray, np.ndarray]:
    """Participation (n, 6) of its shapes and total (6,), summed over the points of mass."""
    m, r, phi = np.array([2.0, 3.0]), body.skin.points, body.skin.shapes  # type: ignore[union-attr]
    move = np.einsum("p,apk->ak", m, phi)
    turn = np.einsum("p,apk->ak", m, np.cross(r[None], phi))
    inertia = (m[:, None] * (np.sum(r**2, axis=1, keepdims=True) - r**2)).sum(axis=0)
    return np.hstack([move, turn]), np.array([5.0, 5.0, 5.0, *inertia])


def test_a_bodys_modes_are_printed_with_participation_and_effective_mass(
    wide: None, capsys: pytest.CaptureFixture[str]
):
    body = two_masses(("vibration", "vibration"))
    modes.print_modes("wing", body)
    text, (part, total) = lines(capsys), participations(body)
    assert text[0] == "wing: 5 kg, 2 elastic coordinates; participation in kg^1/2 and kg^1/2 m"
    rows = [line.split() for line in text[1:]]
    assert rows[0] == ["mode", "Hz", "x", "y", "z", "rx", "ry", "rz"] == rows[6]
    sign = np.sign(np.array([[float(v) for v in row[2:]] for row in rows[2:4]])[:, 0] * part[:, 0])
    for k, omega in enumerate((3.0, 7.0)):
        hertz = f"{omega / (2 * np.pi):.6g}"
        assert rows[2 + k][:2] == [str(k + 1), hertz] == rows[8 + k][:2]
        assert [float(v) for v in rows[2 + k][2:]] == pytest.approx(sign[k] * part[k], abs=6e-5)
        share, running = 100 * part[k] ** 2 / total, 100 * (part[: k + 1] ** 2).sum(axis=0) / total
        assert " ".join(rows[8 + k][2:]) == " ".join(f"{s:.2f} ({r:.2f})" for s, r in zip(share, running, strict=True))
    assert text[6] == "effective mass in % of the body's mass and inertia (running sum)"
    modes.print_modes("wing, fin", body)
    assert lines(capsys)[0].startswith("wing, fin: 5 kg each, 2 elastic coordinates; participation")


def test_kinds_of_shapes_are_counted_and_shown_where_they_differ(capsys: pytest.CaptureFixture[str]):
    modes.print_modes("wing", two_masses(("static", "vibration")))
    text = lines(capsys)
    assert text[0].startswith("wing: 5 kg, 2 elastic coordinates (1 static, 1 vibration); participation")
    assert text[1].split()[-1] == "kind" and [line.split()[-1] for line in text[3:5]] == ["static", "vibration"]


def test_a_body_of_a_file_is_cut_compared_and_told_in_json(femflex: Any, tmp_path: Path):
    body = two_masses(("vibration", "vibration"))
    save_body(tmp_path / "wing.h5", body)
    part, total = participations(body)
    code, out, _ = femflex("modes", "wing.h5", "--json", "--mac", "wing.h5")
    data = json.loads(out)["wing"]
    assert code == 0 and np.array(data.pop("mac")) == pytest.approx(_mac(body), abs=1e-9)
    assert np.abs(data.pop("participation")) == pytest.approx(np.abs(part))
    assert np.array(data.pop("effective_mass")) == pytest.approx(part**2)
    assert data.pop("total") == pytest.approx(total)
    assert np.array(data.pop("running_sum")) == pytest.approx(np.cumsum(part**2, axis=0) / total)
    assert data.pop("frequency_hz") == pytest.approx([3 / (2 * np.pi), 7 / (2 * np.pi)])
    assert data == {
        "mass_kg": 5.0, "kinds": ["vibration"] * 2, "mode_kinds": ["vibration"] * 2, "strain": "linear",
        "directions": ["x", "y", "z", "rx", "ry", "rz"], "note": "",
    }  # fmt: skip
    code, out, _ = femflex("modes", "wing.h5", "-n", 1, "--mac", "wing.h5")
    text = out.splitlines()
    assert code == 0 and text[0].startswith("wing: 5 kg, 1 elastic coordinates")
    at = text.index("modal assurance against wing.h5")
    assert text[at + 1].split() == ["mode", "1", "2"]
    assert text[at + 3].split() == ["1", *(f"{value:.4f}" for value in _mac(body)[0])]
    sentence = "3 modes were requested; the body file holds 2"
    assert femflex("modes", "wing.h5", "-n", 3) == (2, "", f"femflex: {sentence}\n")
    assert femflex("modes", "wing.h5", "-n", 2)[0] == 0


def _mac(body: FlexibleBody) -> np.ndarray:
    """(a.b)^2 / (a.a)(b.b) of the shapes at the points of the skin."""
    phi = body.skin.shapes.reshape(2, -1)  # type: ignore[union-attr]
    dot = phi @ phi.T
    return dot**2 / np.outer(np.diag(dot), np.diag(dot))


def test_bodies_of_a_case_are_reported_one_after_the_other_with_their_notes(
    femflex: Any, monkeypatch: pytest.MonkeyPatch
):
    one, other = two_masses(("vibration",) * 2), two_masses(("static", "vibration"))
    bodies = {"left": one, "boom": other, "right": one}
    notes = {"left": "strain of left", "right": "strain of left", "boom": "strain of boom"}
    asked = []
    monkeypatch.setattr(modes, "flexible_bodies", lambda *words: asked.append(words) or (bodies, notes))
    code, out, _ = femflex("modes", "c.toml", "--bodies", "-n", 2)
    text = out.splitlines()
    assert code == 0 and asked == [(Path("c.toml"), None, 2)]
    heads = [k for k, line in enumerate(text) if "participation in" in line]
    assert [text[k].partition(":")[0] for k in heads] == ["left, right", "boom"] and heads[0] == 0
    assert text[heads[1] - 1] == "" and text.count("strain of left") == 1
    assert text.index("strain of left") < heads[1] < text.index("strain of boom")
    data = json.loads(femflex("modes", "c.toml", "--body", "left", "--json")[1])
    assert list(data) == ["left", "boom", "right"] and data["boom"]["note"] == "strain of boom"
    assert asked[1] == (Path("c.toml"), "left", None)


# backbone curves


def curve(**more: Any) -> Backbone:
    found = {
        "mode": 1, "small": 4.0 * np.pi, "place": np.array([1.5, 0.0, -2.25]), "direction": np.array([0.0, 1.0, 0.0]),
        "amplitudes": np.array([0.01, 0.02]), "omega": np.array([5.0, 6.0]) * np.pi, "harmonics": np.zeros((2, 1, 2)),
        "path": (SimpleNamespace(amplitude=0.01, omega=5 * np.pi), SimpleNamespace(amplitude=0.015, omega=2 * np.pi)),
        "gaps": np.array([[0.011, 0.0125]]),
    }  # fmt: skip
    return Backbone(**found | more)  # type: ignore[arg-type]


NOTE = (
    "linear strain: its force is proportional to the amplitude, so that the frequency cannot change with it; give the "
    "body strain = 'condensed' or 'nonlinear' to see what a large amplitude does"
)
CURVE = [
    "free vibration in mode 1 by its amplitude at (1.5, 0, -2.25) m, frame held",
    "amplitude m   Hz  over small motion",
    "─" * 35,
    "0.01         2.5            1.25000",
    "0.02           3            1.50000",
    "",
    "between 0.011 and 0.0125 m a higher harmonic is in internal resonance with another mode; the curve is not computed"
    " there",
]
DATA = {
    "place_m": [1.5, 0.0, -2.25],
    "direction": [0.0, 1.0, 0.0],
    "amplitude_m": [0.01, 0.02],
    "frequency_hz": pytest.approx([2.5, 3.0]),
    "small_hz": pytest.approx(2.0),
    "gaps_m": [[0.011, 0.0125]],
    "path": [[0.01, pytest.approx(2.5)], [0.015, pytest.approx(1.0)]],
    "note": NOTE,
}


def test_a_backbone_is_reported_as_far_as_it_was_found(femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    save_body(tmp_path / "wing.h5", two_masses(("vibration",) * 2))
    asked = []
    monkeypatch.setattr(
        "femflex.studies.backbone", lambda body, mode, at: asked.append((body.n_modes, mode, at)) or curve()
    )
    code, out, _ = femflex("modes", "wing.h5", "--backbone", "1 cm, 0.02")
    assert code == 0 and out.splitlines()[-len(CURVE) - 1 :] == [*CURVE, NOTE] and asked == [(2, 1, [0.01, 0.02])]
    assert json.loads(femflex("modes", "wing.h5", "--backbone", "0.1", "--json")[1])["wing"]["backbone"] == DATA

    monkeypatch.setattr("femflex.studies.backbone", raising(BackboneError("none beyond 20 mm", curve())))
    code, out, err = femflex("modes", "wing.h5", "--backbone", "0.02")
    assert (code, err) == (3, "femflex: none beyond 20 mm\n") and out.splitlines()[-len(CURVE) - 1 :] == [*CURVE, NOTE]
    code, out, err = femflex("modes", "wing.h5", "--backbone", "0.02", "--json")
    assert (code, err) == (3, "femflex: none beyond 20 mm\n")
    assert json.loads(out)["wing"]["backbone"] == DATA

    monkeypatch.setattr("femflex.studies.backbone", raising(BackboneError("none at all", None)))
    code, out, err = femflex("modes", "wing.h5", "--backbone", "0.02")
    assert (code, err) == (3, "femflex: none at all\n") and out.splitlines()[-1] == NOTE
    assert "free vibration" not in out
    code, out, err = femflex("modes", "wing.h5", "--backbone", "0.02", "--json")
    assert (code, err) == (3, "femflex: none at all\n") and json.loads(out)["wing"]["backbone"] == {}


def test_a_body_that_stiffens_has_no_note_on_its_backbone(monkeypatch: pytest.MonkeyPatch, capsys: Any):
    monkeypatch.setattr("femflex.studies.backbone", lambda *words: curve(gaps=np.zeros((0, 2))))
    backbone.print_backbone(SimpleNamespace(strain_form="condensed"), [0.01])  # type: ignore[arg-type]
    assert lines(capsys) == CURVE[:-1]


# the heading of a run


def test_the_heading_of_a_run_tells_what_it_is_made_of(capsys: pytest.CaptureFixture[str]):
    case = parse_case(
        "title = 'a craft'\n" + HUB + "[attitude]\nheld = true\n"
        "[wheels.w]\nbody = 'hub'\ninertia = 0.25\naxis = [0, 0, 1]\ninertia_in_body = 'contained'\n"
    )
    wing = two_masses(("vibration",) * 2)
    segment = SimpleNamespace(n_modes=3)
    system = SimpleNamespace(
        segments={"boom": ["boom.1", "boom.2", "boom.3"]}, root="boom.2", orbit=None,
        bodies={f"boom.{k}": segment for k in (1, 2, 3)} | {"wing": wing, "stiff": rigid_body(1.0, np.eye(3))},
        environment=SimpleNamespace(gravity=np.array([0.0, 0.0, -1.625])), frame=SimpleNamespace(kind="orbital"),
        joint_of=lambda name: SimpleNamespace(kind={"boom.2": "free"}.get(name, "weld")),
    )  # fmt: skip
    angles = np.radians([[12.5, -0.0, 7.0]])
    model = SimpleNamespace(
        omitted=("gyroscopic", "K3"), x0=np.array([1.0, 2.0]),
        constraints=SimpleNamespace(text=lambda t, x: f"two rows at {t:g} {x.sum():g}"),
        observe=lambda times, x: {"attitude/angles": angles[: len(times)]},
        channels={"attitude/angles": SimpleNamespace(names=("pitch", "yaw", "roll"))},
    )  # fmt: skip
    prepared: Any = SimpleNamespace(
        case=case, system=system, model=model, decided=SimpleNamespace(notes={"wing": "condensed strain", "stiff": ""}),
        times=np.array([0.0, 0.5, 1.25]), reason="bdf: it is stiff", taken_up=("a gap of 1 mm",), moved=["a to 2"],
    )  # fmt: skip
    run_report.print_run_heading(prepared)
    text = lines(capsys)
    assert text[:3] == ["a craft", "without gyroscopic, K3", ""]
    assert text[3].startswith("wing: 5 kg, 2 elastic coordinates; participation")
    own = [
        "",
        "body        boom is cut into 3 segments of 3 elastic coordinates each",
        "body        wing: condensed strain",
        "craft       Wheel w is contained in hub: its axial inertia of 0.25 kg m^2 was taken out of the body's.",
        "orbit       none",
        "gravity     (0, 0, -1.625) m/s^2, inertial axes",
        "attitude    boom held in the orbital frame: pitch 12.5, yaw 0, roll 7 deg",
        "integrator  bdf: it is stiff",
        "constraints two rows at 0 3",
        "constraints a gap of 1 mm",
        "start       made consistent: a to 2",
        "output      3 rows to 1.25 s",
    ]
    assert text[-len(own) :] == own
    plain = parse_case(HUB)
    prepared.case, model.omitted, model.constraints, system.root = plain, (), None, "hub"
    system.segments, system.bodies = {}, {}
    run_report.print_run_heading(prepared)
    assert lines(capsys) == [
        "case.toml",
        "",
        *own[2:3],
        *own[4:6],
        "attitude    hub weld in the orbital frame: pitch 12.5, yaw 0, roll 7 deg",
        own[7],
        own[-1],
    ]


def test_what_is_expected_of_the_modes_is_judged_after_a_run(monkeypatch: pytest.MonkeyPatch, capsys: Any):
    text = ""
    for name, mode, value in (("low", 1, 1.5), ("high", 2, 3.0)):
        text += f"[expect.{name}]\nof = 'system_frequency'\nmode = {mode}\nvalue = '{value} Hz'\n"
        text += "relative_tolerance = 0.01\nsource = 'x'\n"
    case = parse_case(HUB + text)
    found = SimpleNamespace(frequency=lambda mode: {1: 1.5, 2: 4.0}[mode])
    monkeypatch.setattr("femflex.pipeline.balanced.case_modes", lambda read: found)
    assert run_report.print_modes_verdicts(case) == ["high"]
    printed = lines(capsys)
    assert [line.split(": ")[0] for line in printed] == ["expected    low", "expected    high"]
    assert printed[0].endswith("holds") and printed[1].endswith("does not hold") and "4 Hz" in printed[1]
    assert run_report.print_modes_verdicts(parse_case(HUB)) == [] and lines(capsys) == []


# stability and linear models


def test_the_json_of_a_locus_and_a_chart_has_every_number():
    from test_printed_numbers import blank

    from femflex.studies.stability import KINDS, Chart, Locus

    values, kinds = np.array([1.0, 2.5]), np.array([0, 1])
    locus = blank(
        Locus, name="gain", unit="N", values=values, growth=np.array([-0.5, 0.25]), kinds=kinds, names=("a", "b"),
        branches=np.array([[1 + 2j, -3j], [4.0, 5 - 6j]]), trivial=("q",), split=2e-5, critical=(1.75,), of="motion",
    )  # fmt: skip
    chart = blank(
        Chart, names=("a", "b"), units=("m", ""), first=np.array([1.5, 2.5]), second=np.array([3.0]),
        kinds=np.array([[0], [1]]), growth=np.array([[0.5], [-1.5]]), error=(0.01, 0.5),
        boundaries=[(0, 1, np.array([[1.0, 2.0], [3.0, 4.0]]))],
    )  # fmt: skip
    meaning = {str(k): text for k, text in KINDS.items()}
    found: Any = SimpleNamespace(found=locus, second=chart, left_out=("flexibility",))
    assert stability.stability_data(found) == {
        "found": {
            "of": "motion", "name": "gain", "unit": "N", "values": [1.0, 2.5], "names": ["a", "b"], "trivial": ["q"],
            "branches": [[[1.0, 2.0], [0.0, -3.0]], [[4.0, 0.0], [5.0, -6.0]]], "split": 2e-5, "critical": [1.75],
            "lost": None,
            "kinds": [0, 1], "growth": [-0.5, 0.25], "meaning": meaning,
        },
        "without": ["flexibility"],
        "second": {
            "names": ["a", "b"], "units": ["m", ""], "first": [1.5, 2.5], "second": [3.0], "error": [0.01, 0.5],
            "boundaries": [{"between": [KINDS[0], KINDS[1]], "points": [[1.0, 2.0], [3.0, 4.0]]}],
            "kinds": [[0], [1]], "growth": [[0.5], [-1.5]], "meaning": meaning,
        },
    }  # fmt: skip
    assert stability.stability_data(SimpleNamespace(found=locus, second=None, left_out=()))["second"] is None  # type: ignore[arg-type]


def test_the_second_chart_is_printed_under_what_it_leaves_out(capsys: pytest.CaptureFixture[str]):
    from test_printed_numbers import blank

    from femflex.studies.stability import KINDS, Chart, Locus

    locus = blank(
        Locus, name="gain", unit="", values=np.array([1.0, 2.5]), growth=np.array([-0.5, 0.25]), kinds=np.array([0, 1]),
        names=(), branches=np.zeros((2, 1), complex), trivial=(), split=0.0, critical=(), of="equilibrium",
    )  # fmt: skip
    chart = blank(
        Chart, names=("a", "b"), units=("m", ""), first=np.array([1.5, 2.5]), second=np.array([3.0, 4.0]),
        kinds=np.zeros((2, 2), int), growth=np.zeros((2, 2)), error=(0.01, 0.5), boundaries=[],
    )  # fmt: skip
    stability.print_stability_of(SimpleNamespace(found=locus, second=chart, left_out=("flexibility", "K3")))  # type: ignore[arg-type]
    text = lines(capsys)
    assert [line.split() for line in text[:4]] == [
        ["gain", "growth,", "1/s", "stability"],
        [text[1]],
        ["1", "-0.5", *KINDS[0].split()],
        ["2.5", "0.25", *KINDS[1].split()],
    ]
    assert text[4:8] == ["", "changes     nowhere", "", "without flexibility, K3"]
    shares = {KINDS[0]: "100 %"} | {word: "0 %" for kind, word in KINDS.items() if kind}
    rows = [" ".join(line.split()) for line in text[10 : 10 + len(KINDS)]]
    assert rows == [f"{word} {shares[word]}" for word in KINDS.values()]
    assert text[10 + len(KINDS) :] == ["", "boundary    none", "traced      to within 0.01 m and 0.5"]
    stability.print_stability_of(SimpleNamespace(found=chart, second=None, left_out=()))  # type: ignore[arg-type]
    assert "without" not in "".join(lines(capsys))


def test_a_table_of_branches_without_names_numbers_them(tmp_path: Path):
    from test_printed_numbers import blank

    from femflex.studies.stability import Locus

    locus = blank(
        Locus, name="gain", values=np.array([1.5]), growth=np.array([0.5]), kinds=np.array([1]), names=(),
        branches=np.array([[1 + 2j, 3 - 4j]]),
    )  # fmt: skip
    path = tmp_path / "a.csv"
    stability.write_table(locus, path, force=False)
    assert path.read_text() == "gain,kind,growth,real_1,imag_1,real_2,imag_2\n1.5,1,0.5,1,2,3,-4\n"
    with pytest.raises(FileExistsError):
        stability.write_table(locus, path, force=False)
    stability.write_table(locus, path, force=True)


def test_a_linear_model_tells_what_it_is_about(capsys: pytest.CaptureFixture[str]):
    data = {"poles": [], "inputs": [{"name": "u"}], "outputs": [{"name": "y"}, {"name": "z"}]}
    model: Any = SimpleNamespace(states=[0] * 9, about=rest([]), left_out=("load 'a'", "motion b"))
    linearize.print_model(model, SimpleNamespace(states=[0] * 9), data)  # type: ignore[arg-type]
    assert lines(capsys)[3:] == [
        "states      9, of 9",
        "inputs      u",
        "outputs     y, z",
        "about       at rest in the frame that spins at [0, -1.25, 2] rad/s",
        "left out    load 'a', motion b. Use --at TIME to evaluate them at a time",
        "stability   unstable: it grows",
        f"growth      0.123 1/s at most; {RULE}",
        "rigid       turn: neither grow nor decay",
    ]


# diagrams of frequencies


def test_a_diagram_is_printed_whole(capsys: pytest.CaptureFixture[str]):
    from femflex.cli.campbell_report import print_campbell

    print_campbell(campbell(), 0.5, "rpm")
    assert lines(capsys) == [
        "blade",
        "frequency in the spinning frame, Hz (* unstable)",
        "rpm   flap  lag",
        "─" * 15,
        "0      1.5    4",
        "4    2.25*",
        "8       3*  5.5",
        "",
        "damping ratio of oscillating modes (* unstable)",
        "rpm     flap    lag",
        "─" * 19,
        "0      0.015   0.04",
        "4    0.0225*",
        "8      0.03*  0.055",
        "",
        "followed    through 1 additional speeds, where mode shapes change fast",
        "branch      flap ends as lag",
        "speed at which it meets",
        "rpm   1/rev  3/rev",
        "─" * 18,
        "flap      5",
        "lag           2, 7",
        "",
        "unstable    flap grows from 4 rpm on, fastest at 6 rpm, by a factor e in 0.75 s",
        f"growth      {RULE}",
        "rigid       turn: neither grow nor decay, and are no branches",
    ]


def test_a_run_is_summed_up_with_every_line_in_its_order(capsys: pytest.CaptureFixture[str]):
    """Latches, tanks, wheels, cables, the angles near their singularity, and monitors."""
    turn = np.linspace(0.0, np.pi / 2 - 0.02, 4)
    run = type("Named", (Rows,), {"names": lambda self, path: ("x", "y", "z")})(
        {
            "attitude/angles": np.column_stack([0 * turn, turn, 0 * turn]),
            "latches/a/time": np.full(4, -1.0),
            "effectors/t/emptied": np.full(4, -1.0),
            "effectors/t/mass": np.full(4, 2.25),
            "effectors/w/saturated": np.array([0.0, 1.0, 1.0, 0.0]),
            "effectors/c/tension": np.array([1.0, 0.0, 1.0, 1.0]),
            "effectors/c/distance": np.ones(4),
            "monitors/quaternion_norm": np.zeros(4),
        }
    )
    from femflex.system import Environment

    varying = {"a": SimpleNamespace(write=None)}
    system: Any = SimpleNamespace(
        varying=varying, libration_sequence="xyz", bodies={}, orbit=None, environment=Environment()
    )
    run_report.print_run_summary(run, system, Path("a.h5"))
    assert [line[:12].strip() for line in lines(capsys)] == [
        "done", "latch", "tank", "wheel", "cable", "attitude", "monitor",
    ]  # fmt: skip
