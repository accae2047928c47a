"""Strain advised to beams that may hang, stand or be spun: what weight and spin add, by integrals of the first mode."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.advice.bodies import KnownBodies
from femflex.advice.buckling.margin import BucklingMargin
from femflex.advice.motion_estimate import MotionEstimate
from femflex.advice.strain import pendulum_stiffening, strain_advice
from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh.generators import line
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.reduction.admissible import beam_body
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.origin import LeftOpen, Meshed, Origin
from femflex.system import Environment, Profile, System, prismatic, revolute, spherical, weld

LENGTH, MASS, EI = 3.0, 0.8, 500.0
BEAM = UniformBeam(length=LENGTH, EA=1e6, EIy=4 * EI, EIz=EI, GJ=1e3, mass_per_length=MASS)
G = np.array([2.0, -3.0, 6.0])  # 7 m/s^2
TIP = 1.7  # kg


def first_mode() -> tuple[np.ndarray, np.ndarray, float]:
    """Places (k,), slope by place (k,), and beta^4, of the first mode of mean square 1 of a cantilever 1 long."""
    b = 1.87510406871196
    s = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
    x = np.linspace(0.0, 1.0, 20001)
    slope = b * (np.sinh(b * x) + np.sin(b * x) - s * (np.cosh(b * x) - np.cos(b * x)))
    return x, slope, b**4


def added(tension) -> float:
    """Part of the first mode's stiffness that a tension T(x) [N] over places x of the length adds."""
    x, slope, fourth = first_mode()
    return float(np.trapezoid(tension(x) * slope**2, x)) * LENGTH**2 / (EI * fourth)


def hanging(joint, tip: float = 0.0, gravity=G) -> System:
    bodies = {"post": rigid_body(1.0, np.eye(3)), "boom": beam_body(BEAM, BeamFunctions(1, 1))}
    joints = [weld("post"), joint]
    if tip:
        bodies["ball"] = rigid_body(tip, np.eye(3))
        joints.append(spherical("ball", "boom", parent_marker="tip"))
    return System(bodies, tuple(joints), environment=Environment(np.array(gravity)))


def hinge(**more):
    return revolute("boom", "post", child_marker="root", axis=[0, 0, 1], **more)


def test_a_boom_that_may_come_to_hang_is_stiffened_by_all_of_its_weight_and_what_it_carries():
    """T = m' g (L - x) + M g; nothing of a boom that no joint lets turn, and nothing without gravity."""
    own = added(lambda x: MASS * 7.0 * LENGTH * (1 - x))
    both = added(lambda x: MASS * 7.0 * LENGTH * (1 - x) + TIP * 7.0)
    assert pendulum_stiffening(hanging(hinge())) == {"boom": pytest.approx(own, rel=1e-4)}
    found = pendulum_stiffening(hanging(hinge(), TIP))
    assert found["boom"] == pytest.approx(both, rel=1e-4) and set(found) == {"boom"}
    held = hinge(motion=(Profile.constant(0.3),))
    slide = prismatic("boom", "post", child_marker="root", axis=[1, 0, 0])
    for joint in (weld("boom", "post", child_marker="root"), held, slide):
        assert pendulum_stiffening(hanging(joint)) == {}
    assert pendulum_stiffening(hanging(hinge(), gravity=[0, 0, 0])) == {}


def at_rest(system: System) -> MotionEstimate:
    model = compile_system(system)
    return MotionEstimate(model, np.zeros(1), model.x0[None], model.x0[None])


def test_the_strain_of_a_boom_that_may_hang_is_condensed_by_the_tension_of_its_weight():
    system = hanging(hinge(), TIP)
    chosen, snapping = strain_advice(system, ["boom"], {}, at_rest(system), KnownBodies({}))
    raised = np.sqrt(1 + added(lambda x: MASS * 7.0 * LENGTH * (1 - x) + TIP * 7.0)) - 1
    fallen = 1 - np.sqrt(1 - added(lambda x: MASS * 7.0 * LENGTH * (1 - x) + TIP * 7.0))
    assert fallen > raised > 0.01  # standing on end takes more of it than hanging adds
    one = chosen["boom"]
    assert (one.choice, one.limit, snapping) == ("condensed", 0.01, [])
    assert one.value == pytest.approx(fallen, rel=1e-3)
    assert one.reason == (
        f"axial compression (loads or inertia) may lower the first frequency by {fallen:.1%}, which linear strain "
        "leaves out"
    )
    assert strain_advice(system, [], {}, at_rest(system), KnownBodies({})) == ({}, [])


@pytest.mark.parametrize(("rate", "choice"), [(0.5, "condensed"), (0.15, "linear")])
def test_a_steady_spin_that_is_to_come_counts_beside_the_motion(rate: float, choice: str):
    """By T = m' Om^2 (L^2 - x^2) / 2: 1.19 of the square of rate over first frequency."""
    system = hanging(weld("boom", "post", child_marker="root"), gravity=[0, 0, 0])
    omega = np.sqrt(first_mode()[2] * EI / MASS) / LENGTH**2
    spin = rate * omega * np.array([0.0, 0.6, 0.8])
    chosen, _ = strain_advice(system, ["boom"], {}, at_rest(system), KnownBodies({}), spin)
    gain = added(lambda x: MASS * (rate * omega * LENGTH) ** 2 * (1 - x**2) / 2)
    assert gain == pytest.approx(1.193 * rate**2, rel=1e-3)
    raised = np.sqrt(1 + gain) - 1
    one = chosen["boom"]
    assert one.value == pytest.approx(raised, rel=1e-3)
    if choice == "condensed":
        assert one.choice == choice and one.reason == (
            f"turning at {rate * omega:.4g} rad/s may raise the first frequency by {raised:.1%}, which linear strain "
            "leaves out"
        )
    still = strain_advice(system, ["boom"], {}, at_rest(system), KnownBodies({}))[0]["boom"]
    assert (still.choice, still.reason) == ("linear", "it does not turn; no load bends it")


def test_a_curved_body_near_buckling_that_is_open_to_responses_snaps():
    at = [(0, 0), (0.25, 0.75), (0.5, 1), (0.75, 0.75), (1, 0)]
    mesh = line([[s, 0.2, 0.03 * h] for s, h in at], 4)
    member = Member("line", "beam", Rectangle(0.02, 0.005), Material(7e10, 0.3, 2700.0), {"orientation": (0, 0, 1)})
    structure = build_structure(mesh, [member])
    modes = cantilever_modes(structure, ["start", "end"], 2)
    body = reduce_structure(structure, modes)
    system = System(
        {"one": body, "two": body, "three": body},
        tuple(weld(name, child_marker="start") for name in ("one", "two", "three")),
    )
    opened, closed = LeftOpen(responses=True), LeftOpen()
    known = KnownBodies(
        {
            "one": Origin(Meshed(structure, modes), opened),
            "two": Origin(Meshed(structure, modes), closed),
            "three": Origin(Meshed(structure, modes), opened),
        }
    )
    near = {name: BucklingMargin("its weight (3 N)", 0.41) for name in ("one", "two")}
    chosen, snapping = strain_advice(system, ["one", "two", "three"], near, at_rest(system), known)
    assert snapping == ["one"]
    assert {name: found.choice for name, found in chosen.items()} == {
        "one": "nonlinear",
        "two": "condensed",
        "three": "linear",
    }
    assert chosen["one"].reason.startswith("it is curved (rise 0.03 m), its weight (3 N) is 0.41 of the linear buckl")
