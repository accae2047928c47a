"""Modes of whole craft: frequencies of exact equations, names, damping, energies and shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.hub_beam import exact_frequencies

import femflex
from femflex import fem
from femflex.body import Marker, rigid_body
from femflex.dynamics.equilibria.linearised import advanced
from femflex.dynamics.equilibria.system_modes import craft_skin
from femflex.mesh import line
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, cantilever_modes, reduce_structure
from femflex.system import (
    Controller,
    Environment,
    Frame,
    Load,
    Orbit,
    Profile,
    System,
    free,
    revolute,
    spherical,
    weld,
)
from femflex.system.wheel import reaction_wheel

BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=1.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)


def hub_and_beam(r: float, J: float, m: float, pinned: bool) -> System:
    hub = rigid_body(m, J * np.eye(3), markers={"rim": Marker.rigid([r, 0.0, 0.0])})
    beam = beam_body(BEAM, BeamFunctions(y=10, z=0, axial=0, torsion=0))
    root = revolute("hub") if pinned else free("hub")
    return System({"hub": hub, "beam": beam}, (root, weld("beam", "hub", parent_marker="rim", child_marker="root")))


@pytest.mark.sampled(2)
@pytest.mark.parametrize("pinned", [True, False], ids=["pinned", "free"])
@pytest.mark.parametrize(("r", "J", "m"), [(0.1, 0.1, 0.5), (0.5, 5.0, 10.0)])
def test_a_hub_with_a_beam_has_the_exact_frequencies(r, J, m, pinned):
    """The transcendental equation of hub and beam (VALIDATION E)."""
    found = femflex.system_modes(hub_and_beam(r, J, m, pinned))
    rigid = int(found.known.sum())
    assert rigid == (1 if pinned else 6) and not found.frequencies[:rigid].any() and found.stable
    assert found.names[rigid : rigid + 3] == ("bending 1", "bending 2", "bending 3")
    assert 2 * np.pi * found.frequencies[rigid : rigid + 3] == pytest.approx(
        exact_frequencies(r, J, m, pinned), rel=2e-3
    )
    assert found.frequency("bending 2") == found.frequencies[rigid + 1] == found.frequency(rigid + 2)
    assert np.sum(list(found.energy.values()), axis=0) == pytest.approx(1.0, rel=1e-9)


def test_energies_of_rigid_modes_are_those_of_mass_and_inertia():
    found = femflex.system_modes(hub_and_beam(0.5, 5.0, 10.0, False))
    energy = {name: found.energy["beam"][k] for k, name in enumerate(found.names)}
    assert energy["translation x"] == pytest.approx(1.0 / 11.0, rel=1e-9)
    beam = 1.0 / 12.0 + 1.0  # about the hub's centre, its own at 0.5 + 0.5
    assert energy["rotation z"] == pytest.approx(beam / (5.0 + beam), rel=1e-6)


def test_damping_ratios_are_those_of_the_joint():
    wheel = rigid_body(3.0, np.diag([1.0, 2.0, 2.5]))
    sprung = revolute("wheel", stiffness=np.array([40.0]), damping=np.array([2.0]))
    found = femflex.system_modes(System({"wheel": wheel}, (sprung,)))
    omega = np.sqrt(40.0 / 2.5)
    assert found.names == ("joint 1",)
    assert np.abs(found.eigenvalues) == pytest.approx(omega, rel=1e-9)
    assert found.damping_ratios == pytest.approx(2.0 / (2 * 2.5 * omega), rel=1e-9)


def test_librations_are_named_by_their_axes():
    """VALIDATION row D: pitch 1.5801 n, roll and yaw 1.9266 and 0.5687 n."""
    axes = Marker.rigid(np.zeros(3), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    body = rigid_body(79710.0, np.diag([8286760.0, 8646050.0, 1091430.0]), markers={"nominal": axes})
    joint = spherical("craft", child_marker="nominal")
    orbit = Orbit.from_perigee(331e3, true_anomaly=1.0, inclination=0.7)
    found = femflex.system_modes(System({"craft": body}, (joint,), orbit=orbit, frame=Frame("orbital")))
    ratios = {name: 2 * np.pi * f / orbit.mean_motion for name, f in zip(found.names, found.frequencies, strict=True)}
    assert ratios == pytest.approx(
        {"libration yaw": 0.5687, "libration pitch": 1.5801, "libration roll": 1.9266}, abs=5e-5
    )


def test_a_pendulum_swings_by_its_joint_about_the_state_that_hangs():
    rod = rigid_body(2.0, np.diag([0.02, 0.5, 0.5]), [1.2, 0, 0])
    down = Environment(np.array([9.81, 0.0, 0.0]))
    found = femflex.system_modes(System({"rod": rod}, (revolute("rod", axis=[0, 1, 0], q0=[0.3]),), environment=down))
    assert found.names == ("joint 1",) and found.about.q == pytest.approx([0.0], abs=1e-9)
    omega = np.sqrt(2.0 * 9.81 * 1.2 / (0.5 + 2.0 * 1.2**2))
    assert 2 * np.pi * found.frequencies == pytest.approx([omega], rel=1e-8)


def test_loads_and_motions_that_vary_are_left_out_unless_a_time_is_given():
    system = hub_and_beam(0.5, 5.0, 10.0, True)
    pulse = Load("pulse", "hub", torque=np.array([[0, 0, 3.0], [0, 0, -3.0]]), times=np.array([0.0, 1.0]))
    turn = Profile.polynomial(0.2, 0.1)
    driven = System(system.bodies, (revolute("hub", motion=(turn,)), system.joints[1]), (pulse,))
    found = femflex.system_modes(driven)
    assert found.left_out == ("load 'pulse'", "motion of 'base-hub'") and found.about.q[0] == pytest.approx(0.2)
    cantilever = np.array([1.8751040687119611, 4.694091132974175]) ** 2
    assert 2 * np.pi * found.frequencies[:2] == pytest.approx(cantilever, rel=1e-6)
    late = femflex.system_modes(driven, at=2.0)
    assert not late.left_out and late.about.q[0] == pytest.approx(0.4)


def test_a_push_that_a_free_craft_cannot_balance_is_left_out():
    system = hub_and_beam(0.5, 5.0, 10.0, False)
    found = femflex.system_modes(replace(system, loads=(Load("push", "hub", force=np.array([0.0, 3.0, 0.0])),)))
    assert found.left_out == ("load 'push' (no equilibrium under it)",)
    assert found.frequencies == pytest.approx(femflex.system_modes(system).frequencies, rel=1e-12)


@pytest.mark.parametrize("part", [np.real, np.imag])
def test_the_drawn_craft_moves_as_its_states_do(part):
    """The end of the drawn beam along the real and the imaginary part of a shape, against the craft moved that way."""
    system = hub_and_beam(0.3, 1.0, 1.0, False)
    found = femflex.system_modes(replace(system, frame=Frame("spinning", np.array([0.0, 0.0, 0.5]))))
    model, mode = found.about.model, int(np.flatnonzero(~found.known)[1])
    shape, h = part(np.exp(0.7j) * found.shapes[:, mode]), 1e-6
    skin = craft_skin(model.system, found.about.motions.bodies, shape[:, None].astype(complex))
    rows = [np.concatenate([advanced(model, found.about.q, s * h * shape), np.zeros(model.n_u)]) for s in (1, -1, 0)]
    seen = model.observe(np.zeros(3), np.array(rows))
    tip = seen["markers/beam.tip/position"]
    beam = model.system.bodies["beam"].skin
    last = len(skin.points) - len(beam.points) + np.flatnonzero(beam.points[:, 0] > 1 - 1e-9)
    assert skin.points[last].mean(axis=0) == pytest.approx(tip[2], abs=1e-9)
    velocity = (tip[0] - tip[1]) / (2 * h)
    assert skin.shapes[0][last].mean(axis=0) == pytest.approx(velocity, abs=1e-6 * np.abs(skin.shapes).max())


def test_a_craft_with_sampled_controllers_has_the_modes_of_its_open_loops():
    """The rotors of two wheels whose commands are held stay as they are: the sprung hub of 8 kg m^2 moves alone."""
    hub = rigid_body(4.0, np.diag([3.0, 5.0, 8.0]))
    wheels = [reaction_wheel(name, "hub", 0.5, axis=[0, 0, 1], torque=f"{name}_law.u") for name in ("left", "right")]
    laws = [
        Controller(f"{name}_law", lambda t, seen, memory: ([1.0], memory), period, commands={"u": "N m"}, held=[u])
        for name, period, u in (("left", 0.1, 0.0), ("right", 0.2, 0.0))
    ]
    system = System({"hub": hub}, (revolute("hub", axis=[0, 0, 1], stiffness=[20.0]),), effectors=(*wheels, *laws))
    found = femflex.system_modes(system)
    assert found.held == ["left_law", "right_law"] and found.to_dict()["held"] == found.held
    assert 2 * np.pi * found.frequencies[-1] == pytest.approx(np.sqrt(20.0 / 8.0), rel=1e-6)
    assert found.left_out == () and femflex.system_modes(system, at=3.0).held == found.held
    assert femflex.system_modes(replace(system, effectors=tuple(wheels[:0]))).held == []


def test_modes_that_are_not_there_are_refused():
    found = femflex.system_modes(hub_and_beam(0.5, 5.0, 10.0, True))
    with pytest.raises(KeyError, match="the craft has no mode 'torsion 1'; it has rotation z, bending 1"):
        found.frequency("torsion 1")
    with pytest.raises(KeyError, match="the craft has no mode 40; its modes are 1 to 11"):
        found.frequency(40)


@pytest.mark.parametrize(
    ("path", "stretched"), [([[0, 0, 0], [1.0, 0, 0], [1.0, 0.8, 0]], 0), ([[0, 0, 0], [1.0, 0, 0]], 1)]
)
def test_a_leg_that_goes_along_the_line_of_a_folded_boom_is_not_called_stretched(path, stretched):
    """A straight one of the same beam stretches at c / 4 L = 1273 Hz, the folded one bends up to there."""
    section, material = fem.sections.Rectangle(0.02, 0.03), fem.Material(70e9, 0.3, 2700.0)
    structure = fem.build_structure(line(path, 8), [fem.Member("line", "beam", section, material)])
    body = reduce_structure(structure, cantilever_modes(structure, "start", 13), {"root": "start"})
    system = System({"boom": body}, (weld("boom", child_marker="root"),))
    assert sum(name.startswith("stretch") for name in femflex.system_modes(system).names) == stretched
