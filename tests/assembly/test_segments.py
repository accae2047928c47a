"""`segments` in a case: where joints, loads and markers go, what the run reports, and what cannot be cut."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.assembly import build_bodies
from femflex.assembly.bodies import build_part
from femflex.case import CaseError, read_case
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import linearised
from femflex.integrate import Dop853
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.decisions import build_system
from femflex.pipeline.recovered import recovered

MEMBER = 'material = "aluminium" }'
MARKERS = """markers.tip = { group = "TIP" }
markers.root = { group = 'ROOT' }
markers.middle = { position = [2, 0, 0] }"""
INITIAL = 'initial = { marker = "tip", displacement = [0, "10 mm", 0] }\n'
RATIO = 'damping = { ratio = "0.5 %" }\n'
REDUCTION = 'reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }\n'


@pytest.fixture
def cut(craft: str) -> str:
    """The boom of the craft cut into three, reduced as a segment is when nothing is said."""
    text = craft.replace(MEMBER, 'material = "aluminium", segments = 3 }').replace(INITIAL, "").replace(RATIO, "")
    text = text.replace('markers.tip = { group = "TIP" }', MARKERS)
    return text.replace(REDUCTION, "refine = 1\n").replace('"ROOT"', '"root"')


def test_a_cut_body_is_welded_from_the_joint_outward(cut: str, write_case: Callable[..., Path]):
    system = build_system(read_case(write_case(cut)))
    assert system.order == ["hub", "boom.1", "boom.2", "boom.3"]
    assert system.segments == {"boom": ("boom.1", "boom.2", "boom.3")}
    assert [system.joint_of(name).parent for name in system.order] == [None, "hub", "boom.1", "boom.2"]
    assert system.joint_of("boom.1").label == "hub-boom"
    channels = compile_system(system).channels
    markers = {path.split("/")[1] for path in channels if path.startswith("markers/")}
    assert markers == {"hub.left", "boom.root", "boom.tip", "boom.middle"}
    assert {"bodies/boom/position", "bodies/boom/attitude", "bodies/boom.2/delta"} <= set(channels)


def test_a_body_may_hang_from_its_far_end_or_its_middle(cut: str, write_case: Callable[..., Path]):
    for marker, parents in (("tip", ["boom.2", "boom.3", "hub"]), ("middle", ["boom.2", "hub", "boom.2"])):
        text = cut.replace('child_marker = "root"', f'child_marker = "{marker}"')
        system = build_system(read_case(write_case(text)))
        assert [system.joint_of(f"boom.{j}").parent for j in (1, 2, 3)] == parents


@pytest.mark.slow
def test_a_cut_boom_weighs_and_rings_like_the_whole_one(craft: str, cut: str, write_case: Callable[..., Path]):
    whole = craft.replace(INITIAL, "").replace(RATIO, "").replace("modes = 4 }", "modes = 8 }\nrefine = 1")
    found = []
    for text in (whole, cut.replace("segments = 3", "segments = 6")):
        system = build_system(read_case(write_case(text)))
        assert sum(body.moments.mass for body in system.bodies.values()) == pytest.approx(
            200 + 2700 * np.pi * (0.03**2 - 0.028**2) * 3
        )
        model = compile_system(system)
        rest = model.x0.copy()
        rest[model.n_q :] = 0.0
        found.append(np.sort(np.abs(linearised(model, 0.0, rest).eigenvalues().imag))[::2][6:10])
    assert found[1] == pytest.approx(found[0], rel=2e-3)


@pytest.mark.slow
def test_small_motions_are_those_of_the_whole_boom(craft: str, cut: str, write_case: Callable[..., Path]):
    tips = []
    for text in (craft.replace(INITIAL, "").replace(RATIO, ""), cut.replace("segments = 3", "segments = 4")):
        model = compile_system(build_system(read_case(write_case(text))))
        times = np.linspace(0, 2, 41)
        run = Dop853(rtol=1e-8).solve(model, times, model.x0)
        tips.append(model.observe(run.times, run.states)["markers/boom.tip/deflection"])
    assert np.abs(tips[0][:, 1]).max() > 1e-5
    assert np.abs(tips[1] - tips[0])[:, 1:].max() < 0.02 * np.abs(tips[0]).max()


def test_a_cut_body_has_no_one_set_of_modes(cut: str, write_case: Callable[..., Path]):
    case = read_case(write_case(cut))
    assert len(build_bodies(case)["boom"].bodies) == 3  # type: ignore[union-attr]
    with pytest.raises(CaseError, match="found a body cut into 3 segments, which has no one set of modes"):
        build_body(case, "boom")


@pytest.mark.parametrize(
    "reduction",
    [
        'method = "cantilever", clamp = "ROOT"',
        'method = "free_free"',
        'method = "craig_bampton", interfaces = ["ROOT", "TIP"]',
    ],
)
def test_segments_have_the_modes_of_the_case_or_those_asked_for(
    cut: str, write_case: Callable[..., Path], reduction: str
):
    case = read_case(write_case(cut.replace("refine = 1\n", f"reduction = {{ {reduction}, modes = 2 }}\n")))
    stated, asked = (build_part(case, "boom", modes=n) for n in (None, 4))
    added = [more.n_modes - one.n_modes for one, more in zip(stated.bodies, asked.bodies, strict=True)]
    assert added == [2, 2, 2]


def refusal(path: Path) -> str:
    with pytest.raises(CaseError) as told:
        build_system(read_case(path))
    return str(told.value)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("segments = 3", "segments = 0", "segments: found 0; it must be at least 1"),
        ("segments = 3", "segments = 501", "found 501 segments; a line member can be cut into 1 to 500"),
        ("segments = 3", "segments = 'many'", "found 'many'"),
        (", segments = 3", "", "bodies.boom: found no reduction"),
        (", segments = 3", "", "method = 'cantilever'"),
        (
            "refine = 1",
            "reduction = { method = 'lumped', clamp = 'ROOT' }",
            "found reduction method 'lumped' and segments",
        ),
        ("refine = 1", "damping = { ratio = 0.01 }", "damping by ratio or mass on a body cut into segments"),
        (
            "refine = 1",
            "reduction = { method = 'cantilever', clamp = 'ROOT', modes = 4, loads = { TIP = ['y'] } }",
            "found loads in the reduction of a body cut into segments",
        ),
        (
            "refine = 1",
            "reduction = { method = 'cantilever', clamp = 'ROOT', modes = 4, third_derivatives = 1 }",
            "found third_derivatives in the reduction of a body cut into segments",
        ),
        ("refine = 1", "initial = { amplitudes = [1] }", "found initial on a body cut into segments"),
        (
            "markers.root = { group",
            "markers.all = { group = 'BOOM' }\nmarkers.root = { group",
            "needs group 'BOOM', whose points are on several of the 3",
        ),
        (
            '[[loads]]\nname = "push"',
            '[sensors.gauge]\nkind = "strain"\nbody = "boom"\npoint = [1, 0, 0]\ncomponent = "axial"\nperiod = 0.1\n'
            '[[loads]]\nname = "push"',
            "sensors.gauge: found a strain sensor on a body cut into segments, whose strain is not known at one point",
        ),
        ('parent_marker = "left"', 'parent_marker = "left"\nname = "w"', None),
    ],
)
def test_what_a_cut_body_cannot_be_is_reported(
    old: str, new: str, told: str | None, cut: str, write_case: Callable[..., Path]
):
    assert old in cut
    path = write_case(cut.replace(old, new))
    if told is None:
        assert build_system(read_case(path)).joint_of("boom.1").label == "w"
    else:
        assert told in refusal(path)


def test_one_line_of_a_body_can_be_cut(cut: str, write_case: Callable[..., Path]):
    member = cut[cut.index("members = [") : cut.index("]", cut.index("members = ["))]
    twice = cut.replace(member, f"{member}, {member.removeprefix('members = [')}")
    assert "found segments in the members on BOOM, BOOM" in refusal(write_case(twice))


def test_flexibility_of_a_cut_body_is_switched_off_as_one(cut: str, write_case: Callable[..., Path]):
    model = compile_system(build_system(read_case(write_case(cut))))
    rigid = model.without("flexibility/boom")
    assert model.n_u - rigid.n_u == 18 and all(body.n_modes == 0 for body in rigid.system.bodies.values())
    with pytest.raises(ValueError, match=r"did you mean 'flexibility/boom'"):
        model.without("flexibility/boom.2")


CARRIED = """
[wheels.spinner]
body = "boom"
marker = "tip"
axis = [1, 0, 0]
inertia = 0.02
inertia_in_body = "added"
mass = 2.0
transverse_inertia = 0.01
torque = 0.1
[tanks.gas]
body = "boom"
marker = "middle"
propellant = 3.0
mass_in_body = "added"
[thrusters.jet]
body = "boom"
marker = "tip"
axis = [0, 1, 0]
thrust = 0.5
tank = "gas"
specific_impulse = 60.0
pulses = [[0.1, 0.2]]
"""


def test_the_segment_at_the_marker_carries_wheels_and_tanks(cut: str, write_case: Callable[..., Path]):
    bare = build_system(read_case(write_case(cut)))
    system = build_system(read_case(write_case(cut + CARRIED)))
    more = {name: system.bodies[name].moments.mass - bare.bodies[name].moments.mass for name in bare.order}
    middle = next(name for name in bare.order if "middle" in bare.bodies[name].markers)
    assert more == pytest.approx({"hub": 0.0, "boom.1": 0.0, "boom.2": 0.0, "boom.3": 2.0, middle: 3.0})
    assert list(system.varying) == [middle]
    wheel = next(one for one in system.effectors if one.name == "spinner")
    assert wheel.markers == (("boom.3", "tip"),)


SPUN = """
[gyros.cmg]
body = "boom"
marker = "tip"
momentum = 5.0
gimbal_axis = [1, 0, 0]
spin_axis = [0, 1, 0]
rates = [0.3]
[bodies.rotor]
kind = "rigid"
mass = 1.5
inertia = [0.012, 0.012, 0.02]
imbalance = { static = 1e-3, dynamic = 1e-4 }
[[joints]]
kind = "revolute"
name = "bearing"
child = "rotor"
parent = "boom"
parent_marker = "middle"
axis = [0, 0, 1]
rate = 20
"""


@pytest.mark.slow
def test_gyros_and_unbalanced_rotors_on_a_cut_body_keep_the_momentum(cut: str, write_case: Callable[..., Path]):
    """What turns the craft is internal; the gyro's torque on its segment is h times the gimbal rate at the start."""
    model = compile_system(replace(build_system(read_case(write_case(cut + SPUN))), loads=()))
    (gyro,) = model.system.effectors
    assert gyro.markers == (("boom.3", "tip"),)
    rotor = model.system.joint_of("rotor")
    assert (rotor.parent, rotor.parent_marker) in {("boom.2", "middle"), ("boom.1", "middle")}
    times = np.linspace(0.0, 0.5, 6)
    states = Dop853(rtol=1e-10, atol=1e-12).solve(model, times, model.x0).states
    seen = model.observe(times, states)
    H, p = seen["monitors/angular_momentum"], seen["monitors/momentum"]
    assert np.abs(H - H[0]).max() < 1e-8 * np.linalg.norm(H[0]) and np.linalg.norm(H[0]) > 1.0
    assert np.abs(p - p[0]).max() < 1e-8
    assert np.linalg.norm(seen["bodies/hub/rate"][-1] - seen["bodies/hub/rate"][0]) > 1e-4


def test_forces_at_a_place_of_a_cut_body_are_those_of_the_segment_there(cut: str, write_case: Callable[..., Path]):
    places = {f"at{k}": x for k, x in enumerate((0.4, 1.6, 2.9))}
    tables = "".join(
        f'recovery.{name} = {{ position = [{x}, 0, 0], quantities = ["moment_y"] }}\n' for name, x in places.items()
    )
    case = read_case(write_case(cut.replace("refine = 1\n", "refine = 1\n" + tables)))
    system = build_system(case)
    twins = {f"boom{k}": system.bodies[f"boom.{k}"] for k in (1, 2, 3)}  # other bodies, at the same places
    found = recovered(case, SimpleNamespace(bodies={**twins, **system.bodies}))
    for k, (name, x) in enumerate(places.items()):
        point, source = found.points[f"recovery/boom.{name}/moment_y"]
        assert source == f"bodies/boom.{k + 1}/delta" and point.place == pytest.approx([x, 0, 0], abs=0.2)
