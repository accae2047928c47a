"""What is compared, written, watched and resumed between a case and its files, on values made up for it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from femflex.assembly.open_choices import bound_to_linear, open_choices, remedy_of
from femflex.case import parse_case, read_case
from femflex.case.body import FlexibleTable
from femflex.integrate import Block
from femflex.pipeline import resumed
from femflex.pipeline.advised_case import toml, with_key
from femflex.pipeline.decisions import _fastest
from femflex.pipeline.file_digests import content_digest, file_digests
from femflex.pipeline.guard import first_overflow
from femflex.pipeline.inputs import changed_inputs, differences, inputs_text
from femflex.pipeline.linear_motion import NODES, Steps, parabola, response, tabulated
from femflex.pipeline.periods import check_periods
from femflex.pipeline.prepared import sampling
from femflex.pipeline.references import channel_problems, motion_problems, size_problems
from femflex.reading import error_text, reading, refuse_pointer
from femflex.summary import Summarised, listed
from femflex.system import Channel

HUB = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"

# advice written into a case

TEXT = """# craft
[bodies.hub]
kind = "rigid"

[ bodies . "boom" ]   # the boom
kind = "flexible"
reduction = { method = "cantilever", clamp = "a } b", loads = { tip = ["x"] }, modes = 2 }

[bodies.mast.reduction]
modes = 3
[bodies.mast]
kind = "flexible"
"""


def test_a_key_is_written_where_its_table_is():
    found = with_key(TEXT, "boom", "", "strain", "condensed", "it spins")
    assert '# the boom\nstrain = "condensed" # it spins\nkind' in found
    read = tomllib.loads(with_key(TEXT, "boom", "reduction", "spin", True))
    assert read["bodies"]["boom"]["reduction"] == {
        "method": "cantilever", "clamp": "a } b", "loads": {"tip": ["x"]}, "modes": 2, "spin": True,
    }  # fmt: skip
    read = tomllib.loads(with_key(TEXT, "mast", "reduction", "joints", {"a b": ["x", "ry"]}))
    assert read["bodies"]["mast"]["reduction"] == {"joints": {"a b": ["x", "ry"]}, "modes": 3}
    read = tomllib.loads(with_key(TEXT, "hub", "functions", "axial", 4))
    assert read["bodies"]["hub"] == {"functions": {"axial": 4}, "kind": "rigid"} and "mast" in read["bodies"]
    assert with_key(TEXT, "none", "", "strain", "linear") == TEXT


@pytest.mark.parametrize(
    "value", [True, 3, 2.0, 1e-9, 'é "q" \\', [1, [2.5, "x"]], {}, {"a-b": {"c d": [0.1]}, "é": "x"}, ("y", 1e300)]
)
def test_values_written_as_toml_are_read_back(value: Any):
    read = tomllib.loads(f"a = {toml(value)}")["a"]
    assert read == (list(value) if isinstance(value, tuple) else value) and type(read) is not tuple
    assert isinstance(read, float) == isinstance(value, float)


# inputs of a run


def test_differences_are_told_with_their_paths_and_both_values():
    begun = {"a": {"b": [1, 2.5, {"c": "x"}]}, "gone": 1, "same": [1], "long": "l" * 50, "list": [1, 2]}
    now = {"a": {"b": [1, 2.75, {"c": "y"}]}, "same": [1], "long": "l" * 49 + "m", "new": 3, "list": [1]}
    assert list(differences(begun, now)) == [
        "a.b[1] was 2.5, now 2.75",
        "a.b[2].c was 'x', now 'y'",
        "gone is no longer there",
        f"long was {'l' * 50!r}, now {'l' * 49 + 'm'!r}",
        "list was [1, 2], now [1]",
        "new is new",
    ]
    assert list(differences({"a": 1.0}, {"a": 1.0 + 2e-16 * 2})) == ["a was 1.0, now 1.0000000000000004"]


def loads(*, mass: float = 2.0, more: str = "") -> str:
    return HUB.replace("mass = 2", f"mass = {mass}") + f"[[loads]]\nname = 'l'\nbody = 'hub'\ntable = 'l.csv'\n{more}"


def test_changed_files_come_before_changed_values_and_no_more_than_four_are_told(tmp_path: Path):
    (tmp_path / "l.csv").write_text("time,fx\n0,1\n2,3\n")
    path = tmp_path / "a.toml"
    path.write_text(loads())
    begun = json.loads(inputs_text(read_case(path)))
    assert begun["length"] == {"duration": 4.0} and list(begun["files"]) == ["loads[0].table"]
    path.write_text("title = 'other'\n" + loads().replace("duration = 4", "duration = 5\nsamples = 7"))
    assert changed_inputs(begun, read_case(path)) == ""
    (tmp_path / "l.csv").write_text("# same numbers\ntime [s],fx [mN]\n0,1000\n2,3000\n")
    assert changed_inputs(begun, read_case(path)) == ""
    (tmp_path / "l.csv").write_text("time,fx\n0,1\n2,3.5\n")
    path.write_text(loads(mass=2.5))
    assert changed_inputs(begun, read_case(path)) == (
        "the contents of l.csv (loads[0].table) have changed; bodies.hub.mass was 2, now 2.5"
    )
    path.write_text(
        loads(mass=2.5, more="frame = 'inertial'\nmarker = 'm'\n") + "[attitude]\nrates = [1, 2, 3]\nheld = false\n"
    )
    path.write_text(
        path.read_text().replace("inertia = [3, 4, 5]", "inertia = [3, 4, 6]\nmarkers.m = { position = [1, 0, 0] }")
    )
    told = changed_inputs(begun, read_case(path))
    assert told.count("; ") == 3 and told.endswith(" more") and told.startswith("the contents of l.csv")


def test_every_file_of_a_case_has_its_digest(craft: str, write_case: Any):
    path = write_case(
        craft.replace("torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "table = 'l.csv'").replace(
            "markers.left",
            "shapes = [{ kind = 'box', size = [1, 1, 1] }, { kind = 'mesh', file = 'hull.inp' }]\nmarkers.left",
        )
        + "[[loads]]\nname = 'second'\nbody = 'hub'\nforce = [1, 0, 0]\n"
        "[[loads]]\nname = 'third'\nbody = 'hub'\ntable = 'm.csv'\n"
    )
    folder = path.parent
    (folder / "hull.inp").write_text((folder / "boom.inp").read_text())
    (folder / "l.csv").write_text("time,fx\n0,1\n2,3\n")
    (folder / "m.csv").write_text("time,fy\n0,1\n2,3\n")
    case = read_case(path)
    first = file_digests(case)
    assert {where: one["file"] for where, one in first.items()} == {
        "bodies.boom.mesh": "boom.inp",
        "bodies.hub.shapes[1].file": "hull.inp",
        "loads[0].table": "l.csv",
        "loads[2].table": "m.csv",
    }
    assert first["bodies.boom.mesh"]["digest"] == first["bodies.hub.shapes[1].file"]["digest"]
    for name, where, old, new in (
        ("boom.inp", "bodies.boom.mesh", "3.0, 0.0, 0.0", "3.0, 0.0, 0.125"),
        ("hull.inp", "bodies.hub.shapes[1].file", "NSET=TIP", "NSET=TOP"),
        ("l.csv", "loads[0].table", "2,3", "2.5,3"),
        ("m.csv", "loads[2].table", "fy", "fz"),
    ):
        text = (folder / name).read_text()
        (folder / name).write_text(text.replace(old, new))
        now = file_digests(case)
        assert [key for key in first if now[key] != first[key]] == [where]
        (folder / name).write_text(text)
    assert file_digests(case) == first


def test_a_digest_changes_with_every_part_and_not_with_the_order_of_keys():
    values: list[Any] = [
        {"a": 1, "b": 2.0}, {"a": 1, "b": 2}, {"a": 1}, [1, 2], [2, 1], [[1], 2], (1,), "1", 1, 1.0, True, None, b"1",
        np.array([1.0, 2.0]), np.array([[1.0, 2.0]]), np.array([1, 2]), np.array([1.0, 2.0], np.float32),
        np.array([2.0, 1.0]),
        np.array(["a", "b"]), SimpleNamespace,
    ]  # fmt: skip
    digests = [content_digest(value) for value in values[:-1]]
    assert len(set(digests)) == len(digests)
    assert content_digest({"b": 2.0, "a": 1}) == digests[0] and content_digest((1, 2)) == digests[3]
    with pytest.raises(TypeError, match="no digest of a SimpleNamespace"):
        content_digest([SimpleNamespace()])


# watching a run


def test_the_first_number_that_is_not_finite_is_told_with_its_instant():
    times, states = np.array([0.0, 1.0, 2.0, 3.0]), np.array([[1.0, 2], [3, -9], [5, 6], [7, 8]])
    block = Block(times, states, np.zeros(40))
    a, b = np.ones((4, 2)), np.ones(4)
    assert first_overflow({"a": a, "b": b}, block) is None
    a[3, 1], b[1] = np.inf, np.nan
    error = first_overflow({"a": a, "b": b}, block)
    assert error is not None and error.reason.startswith("b is not finite")
    assert error.t == 1.0 and error.coordinate == 1 and error.states.tolist() == [[3, -9]]


def test_controllers_that_are_called_together_are_told_together():
    def controller(name: str, period: float) -> Any:
        return SimpleNamespace(name=name, period=period)

    system: Any = SimpleNamespace(controllers=[controller("a", 0.1), controller("b", 0.25), controller("c", 0.1)])
    assert sampling(system) == [
        "Controllers a, c are called every 0.1 s, their commands constant between.",
        "Controller b is called every 0.25 s, its command constant between.",
    ]
    check_periods(system, 1e6)
    with pytest.raises(
        ValueError, match=r"controller 'a' has a period of 0.1 s, so a run of 2e\+06 s would call it 2e\+07 times"
    ):
        check_periods(system, 2e6)


# names of channels


CHANNELS = {
    "time": Channel("s", ""),
    "bodies/hub/rate": Channel("rad/s", "", (3,), ("x", "y", "z")),
    "bodies/hub/dyad": Channel("1", "", (2, 3)),
    "markers/hub.tip/position": Channel("m", "", (3,), ("x", "y", "z")),
    "sights/st/place": Channel("m", "", (3,)),
}


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("plots = ['energy drift', 'time', 'bodies/hub/rate:3 over bodies/hub/rate:x', 'bodies/hub/dyad:6']", None),
        (
            "plots = ['time', 'bodies/hub/rate:0']",
            "pictures.plots[1]: found entry 0 of bodies/hub/rate, which has 3, counted from 1",
        ),
        (
            "spectra = ['bodies/hub/rate:4']",
            "pictures.spectra[0]: found entry 4 of bodies/hub/rate, which has 3, counted from 1",
        ),
        ("spectrograms = ['bodies/hub/dyad:7']", "which has 6, counted from 1"),
        (
            "plots = ['time over bodies/hub/rate:w']",
            "pictures.plots[0]: found 'w', which is no entry of bodies/hub/rate",
        ),
        ("plots = ['bodies/hub/rat']", "did you mean 'bodies/hub/rate'"),
        ("plots = ['sights/stations/position']", "which the run will not report; known are 'sights/st/place'"),
        ("plots = ['zzz/y/x']", "known are 'bodies/hub', 'markers/hub.tip', 'sights/st', 'time'"),
        ("traces = ['hub.tip', 'sights/st']", None),
        (
            "traces = ['hub.tip', 'hub.tap']",
            "pictures.traces[1]: found 'hub.tap', which is no marker of the craft; did you mean 'hub.tip'",
        ),
    ],
)
def test_names_in_pictures_are_those_of_channels(more: str, told: str | None):
    case = parse_case(f"{HUB}[pictures]\n{more}\n")
    found = [str(problem) for problem in channel_problems(case, CHANNELS)]
    assert (found == []) if told is None else (len(found) == 1 and told in found[0]), found


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("channel = 'bodies/hub/rate', component = 2", None),
        ("channel = 'bodies/hub/rate', component = 'z'", None),
        (
            "channel = 'bodies/hub/rate', component = 3",
            "expect.a.component: found 3; bodies/hub/rate has 3 entries, counted from 0",
        ),
        (
            "channel = 'bodies/hub/rate', component = 'w'",
            "expect.a.component: found 'w', which is no entry of bodies/hub/rate",
        ),
        ("channel = 'time', component = 0", "found 0; time has no entries"),
        (
            "channel = 'bodies/hub/rte'",
            "expect.a.channel: found 'bodies/hub/rte', which the run will not report; did you mean",
        ),
    ],
)
def test_components_of_answers_are_entries_of_their_channels(more: str, told: str | None):
    case = parse_case(f"{HUB}[expect]\na = {{ {more}, above = 1 }}\n")
    found = [str(problem) for problem in channel_problems(case, CHANNELS)]
    assert (found == []) if told is None else (len(found) == 1 and told in found[0]), found


def test_motions_and_output_must_fit_the_run(tmp_path: Path):
    joint = SimpleNamespace(
        name="", child="arm", held={1: SimpleNamespace(last=3.5), 0: SimpleNamespace(last=np.inf)},
        freedom_names=lambda: ["slide", "angle"],
    )  # fmt: skip
    system: Any = SimpleNamespace(joints=[joint], orbit=None)
    (problem,) = motion_problems(parse_case(HUB), system)
    assert str(problem).startswith("joints[arm].motion: 'angle' is prescribed up to 3.5 s, the run lasts 4 s")
    assert not list(size_problems(parse_case(HUB), system, CHANNELS, tmp_path))
    many = parse_case(HUB.replace("duration = 4", "duration = 4\noutput_step = 1e-9"))
    (problem,) = size_problems(many, system, CHANNELS, tmp_path)
    assert str(problem).startswith("run.output_step: found 4e+09 rows of output, 512 GB, where ")  # 16 numbers a row


def test_of_two_joints_the_motion_that_ends_before_the_run_is_named():
    def joint(name: str, child: str, **last: float) -> Any:
        held = {k: SimpleNamespace(last=t) for k, t in enumerate(last.values())}
        return SimpleNamespace(name=name, child=child, held=held, freedom_names=lambda: list(last))

    joints = [joint("axle", "arm", turn=4.0, slide=9.0), joint("axles", "arms", slide=5.0, turn=3.0, roll=1.5)]
    found = [str(problem) for problem in motion_problems(parse_case(HUB), SimpleNamespace(joints=joints, orbit=None))]  # type: ignore[arg-type]
    rest = "the run lasts 4 s; give the motion to the end, or run for less"
    assert found == [
        f"joints[axles].motion: {name!r} is prescribed up to {t} s, {rest}" for name, t in (("turn", 3), ("roll", 1.5))
    ]


def test_all_of_two_answers_a_study_and_two_pictures_that_a_run_has_not_are_told_with_their_places():
    case = parse_case(
        f"""{HUB}
[expect]
a = {{ channel = "bodies/hub/rate", component = "u", above = 1 }}
b = {{ channel = "bodies/hub/rate", component = "y", above = 1 }}
c = {{ channel = "bodies/hub/dyad", component = 2, above = 1 }}
[study]
quantity = {{ channel = "bodies/hub/rates", component = "v" }}
[pictures]
plots = ["time", "bodies/hub/rate:v", "bodies/hub/rate:2"]
spectra = ["bodies/hub/rate:z over bodies/hub/dyad:7"]
spectrograms = ["times"]
traces = ["hub.tip", "hub.tips"]
"""
    )
    found = [str(problem).partition(";")[0] for problem in channel_problems(case, CHANNELS)]
    assert found == [
        "expect.a.component: found 'u', which is no entry of bodies/hub/rate",
        "expect.c.component: found 2",
        "study.quantity.channel: found 'bodies/hub/rates', which the run will not report",
        "pictures.plots[1]: found 'v', which is no entry of bodies/hub/rate",
        "pictures.spectra[0]: found entry 7 of bodies/hub/dyad, which has 6, counted from 1",
        "pictures.spectrograms[0]: found 'times', which the run will not report",
        "pictures.traces[1]: found 'hub.tips', which is no marker of the craft",
    ]


# resuming


@pytest.mark.parametrize(
    ("there", "times", "told"),
    [
        ([0, 1, 2], [0, 1, 2, 3], None),
        ([0, 1, 2, 2.5], [0, 1, 2, 3, 4], None),  # the end of a shorter run
        ([0, 1, 2], [0, 1, 1.5], "holds rows up to 2 s, and the case now ends at 1.5 s"),
        ([0, 1, 2, 3], [0, 1, 2.5, 3, 4], "holds a row at 2 s where the case now has one at 2.5 s"),
        ([0, 1, 2, 2.5], [0, 1, 2, 2.25, 3], "holds a row at 2.5 s where the case now has one at 2.25 s"),
        ([], [0, 1], None),
    ],
)
def test_rows_of_a_file_are_those_of_the_longer_run(
    monkeypatch: pytest.MonkeyPatch, there: list[float], times: list[float], told: str | None
):
    class Opened:
        time = np.array(there, float)

        def __enter__(self) -> Any:
            return self

        def __exit__(self, *_: Any) -> None: ...

    monkeypatch.setattr("femflex.results.open_run", lambda path: Opened())
    if told is None:
        resumed.check_same_times(np.array(times, float), Path("a.h5"))
    else:
        with pytest.raises(ValueError, match=f"a.h5 {told}"):
            resumed.check_same_times(np.array(times, float), Path("a.h5"))


def test_effectors_from_python_must_be_those_the_run_began_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    opened = SimpleNamespace(attributes={"effectors": "a, b"})
    manager = type("M", (), {"__enter__": lambda s: opened, "__exit__": lambda s, *_: None})
    monkeypatch.setattr("femflex.results.open_run", lambda path: manager())
    a, b = SimpleNamespace(name="a"), SimpleNamespace(name="b")
    resumed.check_same_effectors([a, b], Path("x.h5"))  # type: ignore[list-item]
    with pytest.raises(ValueError, match=r"x.h5 was begun with the effectors a, b from Python, and now there are b, a"):
        resumed.check_same_effectors([b, a], Path("x.h5"))  # type: ignore[list-item]
    with pytest.raises(ValueError, match="now there are none"):
        resumed.check_same_effectors([], Path("x.h5"))


# linear motion


A0 = np.array([[0.1, 1.0, 0.0], [-2.0, -0.3, 0.4], [0.5, 0.2, -0.6]])


def test_the_response_to_a_polynomial_force_is_exact():
    h = 0.7
    E, P = response(A0, h)
    c = [np.array([1.0, -2, 0.5]), np.array([0.3, 0.7, -1]), np.array([2.0, 0.1, 0.4])]
    y0 = np.array([0.2, -0.4, 0.9])
    exact = solve_ivp(lambda s, y: A0 @ y + c[0] + c[1] * s + c[2] * s**2 / 2, (0, h), y0, rtol=1e-12, atol=1e-13).y[
        :, -1
    ]
    np.testing.assert_allclose(E, expm(A0 * h), atol=1e-13)
    np.testing.assert_allclose(E @ y0 + P @ np.concatenate(c), exact, atol=1e-10)
    a, b, d = np.array([1.0, 2, 3]), np.array([-1.0, 0.5, 2]), np.array([4.0, -3, 0.2])
    middle = h / 2
    force = lambda s: a + b * s + d * s**2 / 2  # noqa: E731
    found = parabola([force(middle + middle * node) for node in NODES], h)
    for one, expected in zip(found, (a, b, d), strict=True):
        np.testing.assert_allclose(one, expected, atol=1e-12)


class Varying:
    """Linear equations whose matrix does not commute with itself at other times."""

    constant, sizes = False, np.ones(3)

    def matrix(self, t: float) -> np.ndarray:
        return A0 + np.array([[0, 0, np.sin(t)], [np.cos(2 * t), 0, 0], [0, t, 0.0]])

    def forcing(self, t: float) -> np.ndarray:
        return np.array([np.sin(3 * t), 1.0, np.cos(t)])


def test_a_step_of_varying_equations_has_the_fourth_order():
    about: Any = Varying()
    y0 = np.array([0.2, -0.4, 0.9])
    exact = solve_ivp(lambda t, y: about.matrix(t) @ y + about.forcing(t), (0.3, 1.3), y0, rtol=1e-12, atol=1e-13).y[
        :, -1
    ]
    errors = []
    for n in (4, 8, 16):
        steps = Steps(about, 1e-7, np.zeros(60), np.array([0.0, 2.0]))
        y, h = y0, 1.0 / n
        for k in range(n):
            y = steps._step(y, 0.3 + k * h, h)
        errors.append(np.linalg.norm(y - exact))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.5)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4, abs=0.5)
    steps = Steps(about, 1e-7, np.zeros(60), np.array([0.0, 2.0]))
    np.testing.assert_allclose(steps.moved(y0, 0.3, 1.3), exact, atol=1e-5)


def test_a_table_of_the_matrix_is_as_accurate_as_it_says():
    table = tabulated(Varying(), 0.5, 2.5)  # type: ignore[arg-type]
    for t in (0.51, 1.234, 2.4):
        np.testing.assert_allclose(table(t), Varying().matrix(t), atol=1e-4)


# choices


def test_the_fastest_spin_of_a_diagram_is_along_its_axis():
    diagram = "[campbell]\nspeeds = '0:30 rad/s:4'\n"
    case = parse_case(HUB + diagram + "axis = [0, 3, 4]\n")
    np.testing.assert_allclose(_fastest(case), [0, 18, 24])  # type: ignore[arg-type]
    spun = parse_case(HUB + diagram + "[attitude]\nframe = 'spinning'\nspin = [0.2, 0, 0]\n")
    np.testing.assert_allclose(_fastest(spun), [30, 0, 0])  # type: ignore[arg-type]
    assert _fastest(parse_case(HUB)) is None


def meshed(reduction: str, more: str = "") -> Any:
    text = "[run]\nduration = 4\n[bodies.b]\nkind = 'flexible'\nmesh = 'boom.inp'\n"
    member = "members = [{ group = 'BOOM', family = 'beam' }]\n"
    table = tomllib.loads(f"{text}{member}reduction = {{ {reduction} }}\n{more}")["bodies"]["b"]
    return FlexibleTable.model_validate(table)


CANTILEVER = "method = 'cantilever', clamp = 'ROOT', modes = 3"


@pytest.mark.parametrize(
    ("reduction", "more", "strain", "joints", "few"),
    [
        (CANTILEVER, "", True, True, 3),
        (CANTILEVER, "strain = 'linear'", False, True, 3),
        (CANTILEVER + ", joints = {}", "", True, False, 3),
        (CANTILEVER + ", attachment = ['x']", "", True, True, None),
        (CANTILEVER + ", spin = false", "", True, True, None),
        (CANTILEVER + ", derivatives = 2", "", True, False, 3),
        (CANTILEVER + ", derivatives = 'auto'", "", True, True, 3),
        (CANTILEVER + ", derivatives = 2, deflection = 0.1", "", True, False, 3),
        ("method = 'free_free', modes = 3", "", True, True, None),
        ("method = 'rigid'", "", True, False, None),
    ],
)
def test_what_a_body_leaves_to_be_chosen_follows_from_its_keys(
    reduction: str, more: str, strain: bool, joints: bool, few: int | None
):
    found = open_choices(meshed(reduction, more))
    assert (found.strain, found.joints, found.few) == (strain, joints, few)


@pytest.mark.parametrize(
    ("reduction", "at_roots", "elsewhere", "responses"),
    [
        (CANTILEVER, True, True, True),
        (CANTILEVER + ", attachment = ['x']", False, True, True),
        (CANTILEVER + ", loads = { TIP = ['x'] }", True, False, True),
        (CANTILEVER + ", attachment = [], loads = { TIP = ['x'] }", False, False, True),
        (CANTILEVER + ", joints = {}", False, False, True),
        (CANTILEVER + ", derivatives = 'auto'", True, True, False),
        ("method = 'free_free', modes = 3", True, True, False),
    ],
)
def test_shapes_that_a_table_names_itself_are_not_chosen_for_it(reduction, at_roots, elsewhere, responses):
    found = open_choices(meshed(reduction))
    assert (found.at_roots, found.elsewhere, found.responses) == (at_roots, elsewhere, responses)
    assert found.roots == (() if "free_free" in reduction else ("ROOT",))


def test_remedies_name_the_key_that_binds_a_body_to_linear_strain():
    assert bound_to_linear(meshed(CANTILEVER)) == "" and remedy_of(meshed(CANTILEVER)) == "give it strain = 'condensed'"
    none = meshed(CANTILEVER + ", derivatives = 'none'")
    assert bound_to_linear(none).startswith("with derivatives = 'none' its shapes cannot bend without stretching")
    assert remedy_of(none) == "drop derivatives = 'none' and give it strain = 'condensed'"
    zero = meshed(CANTILEVER + ", derivatives = 0")
    assert "derivatives = 0 " in bound_to_linear(zero) and remedy_of(zero).startswith("drop derivatives = 0 ")
    assert bound_to_linear(meshed("method = 'rigid'")).startswith("its reduction method 'rigid' has no other form")


# reading files


def test_a_pointer_of_git_lfs_is_told_from_its_first_bytes(tmp_path: Path):
    path = tmp_path / "a.msh"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 3\n")
    with pytest.raises(ValueError, match=r"a.msh is a pointer of Git LFS"):
        refuse_pointer(path)
    path.write_text("version 4.1\n")
    refuse_pointer(path)


def test_errors_of_readers_become_one_sentence_about_the_file(tmp_path: Path):
    path = tmp_path / "a.msh"
    path.write_text("12345")

    def error(raised: BaseException) -> BaseException:
        with pytest.raises(BaseException) as caught, reading(path, "a mesh", "Write it again."):
            raise raised
        return caught.value

    assert (
        str(error(KeyError("x")))
        == "a.msh could not be read as a mesh: its contents are not those of this format. Write it again."
    )
    assert "needs more memory than is free, or than a file of 5 bytes can need. Write it again." in str(
        error(MemoryError())
    )
    own = ValueError("a.msh has no nodes")
    assert error(own) is own
    gone = FileNotFoundError(2, "No such file", "b.msh")
    assert error(gone) is gone
    warned = UserWarning("careful")
    assert error(warned) is warned
    with pytest.raises(
        ValueError, match=r"a.msh could not be read as a mesh: it has 'x' where a number belongs\. Write"
    ):
        with reading(path, "a mesh", "Write it again."):
            float("x")
    try:
        parse = {}["a"]
    except KeyError as found:
        assert error_text(found) == "its contents are not those of this format"
    else:
        assert parse


def test_long_lists_are_cut_and_counted():
    assert listed([]) == "none" and listed(["a", "b"], most=2) == "a, b"
    assert listed([f"n{k}" for k in range(11)], most=3) == "n0, n1, n2 and 8 more"
    assert listed([f"n{k}" for k in range(9)]).endswith("n7 and 1 more")
    thing = type("Thing", (Summarised,), {"summary": lambda self: ("Thing", [("mass", "3 kg"), ("inertia", "<4>")])})()
    assert repr(thing) == "Thing\n  mass     3 kg\n  inertia  <4>"
    assert "<th style='text-align:left'>inertia</th><td style='text-align:left'>&lt;4&gt;</td>" in thing._repr_html_()


def test_a_body_file_has_the_digest_of_its_numbers_and_not_of_its_version(tmp_path: Path):
    def digest(version: str, value: float, name: str = "M") -> str:
        with h5py.File(tmp_path / "b.h5", "w") as file:
            file.attrs["femflex_version"] = version
            file.attrs["format"] = "femflex body"
            file[f"group/{name}"] = np.array([value, 2.0])
        (tmp_path / "a.toml").write_text("[run]\nduration = 4\n[bodies.b]\nkind = 'file'\nfile = 'b.h5'\n")
        return file_digests(read_case(tmp_path / "a.toml"))["bodies.b.file"]["digest"]

    assert digest("1", 3.0) == digest("2", 3.0) != digest("1", 4.0)
    assert digest("1", 3.0, "K") != digest("1", 3.0)
