"""Campbell diagrams of free and driven craft, and of blades of case files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.advised_bodies import noted_system
from support.rotating_beams import Rotating
from support.spinning_craft import random_craft

from femflex.body import Marker, rigid_body
from femflex.case import read_case
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import equilibrium
from femflex.mesh import line, write_mesh
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.studies.campbell import campbell, spin_steps
from femflex.system import Frame, System, free, revolute, weld

SPEEDS = np.array([0.0, 0.2, 0.5, 1.0])


def turned_pair(C: np.ndarray) -> System:
    """A free hub with two booms along its y axis, everything but the mounting of the hub turned by C (3, 3)."""
    seats = {
        name: Marker.at_position(C @ [0, 0.5 * side, 0], C @ np.array([[0, -side, 0], [side, 0, 0], [0, 0, 1.0]]))
        for name, side in (("north", 1.0), ("south", -1.0))
    }
    hub = rigid_body(50.0, C @ np.diag([20.0, 12.0, 25.0]) @ C.T, markers=seats)
    beam = UniformBeam(3.0, 1e5, 60.0, 130.0, 4.0, 0.8, 0.3, 0.05)
    boom = beam_body(beam, BeamFunctions(y=3, z=3, torsion=2, family="polynomial"), strain="condensed")
    joints = [weld(name, "hub", parent_marker=name, child_marker="root") for name in seats]
    return System({"hub": hub, "north": boom, "south": boom}, (free("hub"), *joints))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("k", [0, 1, 2])
def test_diagram_is_independent_of_body_axes(k):
    """About x, y, z of the craft, and about the same axis of a craft turned in its hub's axes: one diagram."""
    plain = campbell(turned_pair(np.eye(3)), SPEEDS, np.eye(3)[k])
    C = Rotation.random(random_state=7).as_matrix()
    turned = campbell(turned_pair(C), SPEEDS, C[:, k])
    assert [branch.name for branch in plain.branches] == [branch.name for branch in turned.branches]
    assert plain.requested.sum() == turned.requested.sum() == len(SPEEDS) and len(turned.speeds) <= len(SPEEDS) + 4
    for plain_branch, turned_branch in zip(plain.branches, turned.branches, strict=True):
        expected = turned_branch.frequencies[turned.requested]
        assert plain_branch.frequencies[plain.requested] == pytest.approx(expected, rel=1e-6, abs=1e-7)
    assert len(turned.branches) == 7 and turned.branches[0].name == "wobble"  # beside the six of rest
    for branch in turned.branches[1:]:
        assert np.ptp(branch.frequencies) < 0.2 * branch.frequencies[0]


def assert_diagram_matches_equilibria(system: System, axis: np.ndarray) -> None:
    """Compare stability, growth and frequencies of the Campbell diagram with the equilibrium at every speed."""
    diagram = campbell(system, SPEEDS, axis, modes=6)
    assert diagram.speeds[diagram.requested] == pytest.approx(SPEEDS)
    for k in np.flatnonzero(diagram.requested):
        steady_state = equilibrium(replace(system, frame=Frame("spinning", diagram.speeds[k] * axis)))
        assert steady_state.stable is not any(branch.growing[k] for branch in diagram.branches)
        growth = max(
            float(branch.eigenvalues[k].real) for branch in diagram.branches if not np.isnan(branch.frequencies[k])
        )
        assert max(growth, 0.0) == pytest.approx(steady_state.growth, rel=1e-5, abs=1e-9)
        eigenvalues = linearised(steady_state.model, 0.0, steady_state.x).eigenvalues()
        for branch in diagram.branches:
            value = branch.eigenvalues[k]
            if diagram.speeds[k] > 0 and not np.isnan(value):
                assert np.abs(eigenvalues - value).min() < 1e-6 * max(1.0, abs(value))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", [pytest.param(k, marks=() if k in (0, 3) else pytest.mark.slow) for k in range(5)])
def test_diagram_and_equilibria_of_free_craft_agree(seed):
    assert_diagram_matches_equilibria(*random_craft(seed))


@pytest.mark.parametrize("seed", [pytest.param(k, marks=() if k == 10 else pytest.mark.slow) for k in range(10, 15)])
def test_diagram_and_equilibria_of_driven_craft_agree(seed):
    assert_diagram_matches_equilibria(*random_craft(seed, driven=True))


def test_wobble_of_a_free_rigid_body():
    C = Rotation.random(random_state=3).as_matrix()
    system = System({"top": rigid_body(5.0, C @ np.diag([2.0, 3.0, 4.5]) @ C.T)}, (free("top"),))
    diagram = campbell(system, SPEEDS, C[:, 2])
    (wobble,) = diagram.branches
    assert wobble.name == "wobble" and diagram.rigid[-1] == "tilt of the spin axis"
    assert 2 * np.pi * wobble.frequencies == pytest.approx(SPEEDS * np.sqrt(1.5 * 2.5 / 6.0), rel=1e-8)
    diagram_across = campbell(system, SPEEDS, C[:, 1])
    assert diagram_across.branches[0].growing.tolist() == [False, True, True, True]
    assert diagram_across.branches[0].eigenvalues.real == pytest.approx(SPEEDS * np.sqrt(1.5 / 9.0), rel=1e-8)


def test_free_hinge_swings_with_the_spin():
    """A rod on a free flap hinge at the rim of a driven hub: no branch at rest, sqrt(1 + ...) times the spin beyond."""
    hub = rigid_body(10.0, np.eye(3), markers={"rim": Marker.at_position(np.array([0.7, 0.0, 0.0]))})
    rod = rigid_body(2.0, np.diag([0.02, 0.5, 0.5]), np.array([1.2, 0.0, 0.0]))
    system = System({"hub": hub, "rod": rod}, (weld("hub"), revolute("rod", "hub", (0, 1, 0), parent_marker="rim")))
    (branch,) = campbell(system, SPEEDS).branches
    about = 0.5 + 2.0 * 1.2**2
    pull = 2.0 * 1.2 * (0.7 + 1.2) + 0.5 - 0.02 - 0.0
    assert branch.name == "flap 1" and np.isnan(branch.frequencies[0])
    assert 2 * np.pi * branch.frequencies[1:] == pytest.approx(SPEEDS[1:] * np.sqrt(pull / about), rel=1e-8)


BLADE_SPEEDS = np.array([0.0, 4.0, 12.0])
BLADE = """
[run]
duration = 1
samples = 11

[attitude]
frame = "spinning"
spin = [0, 0, 12]

[campbell]
speeds = "0:12:4"
modes = 6

[sections.spar]
kind = "stiffness"
EA = 1e6
EIy = 1
EIz = {lag}
GJ = 1
mass_per_length = 1
ry = 1e-3
rz = 1e-3

[bodies.hub]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
markers.seat = {{ position = [{hub}, 0, 0] }}

[bodies.blade]
kind = "flexible"
mesh = "blade.msh"
members = [{{ group = "line", family = "beam", section = "spar", options = {{ order = 4, orientation = {up} }} }}]
reduction = {{ method = "cantilever", clamp = "start", modes = {modes}{more} }}

[[joints]]
kind = "weld"
child = "hub"

[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "seat"
child = "blade"
child_marker = "start"
"""


def blade(folder, hub=0.0, lag=1.9, setting=0.0, modes=4, more=""):
    """The system of the case."""
    write_mesh(folder / "blade.msh", line([[0, 0, 0], [1, 0, 0]], 6))
    up = [0, float(np.cos(setting)), float(np.sin(setting))]
    (folder / "blade.toml").write_text(BLADE.format(hub=hub, lag=lag, up=up, modes=modes, more=more))
    return noted_system(read_case(folder / "blade.toml"))


def frequencies(system, count):
    """(n_speeds, count) the lowest, about the steady state at each speed."""
    frequencies_by_speed = {
        spin.value: np.sort(spin.vibration.eigenvalues.imag[spin.vibration.eigenvalues.imag > 0])[:count]
        for spin in spin_steps(system, np.array([0, 0, 1.0]), BLADE_SPEEDS, 6)
        if spin.requested
    }
    return np.array([frequencies_by_speed[speed] for speed in BLADE_SPEEDS])


@pytest.mark.slow
@pytest.mark.parametrize(("hub", "lag", "setting"), [(0.0, 1.9, 0.0), (1.0, 1.9, 0.0), (0.0, 3.0, 0.5)])
def test_blade_of_four_modes_has_exact_frequencies(tmp_path, hub, lag, setting):
    """Flap and lag, two of each, over spins up to 12 sqrt(EI / m L^4): eight coordinates."""
    system = blade(tmp_path, hub, lag, setting)
    body = system.bodies["blade"]
    assert body.n_modes == 8 and "(spin)" in body.note and body.strain_form == "condensed"
    for speed, omega in zip(BLADE_SPEEDS, frequencies(system, 4), strict=True):
        beam = Rotating(float(speed), hub=hub, lag=lag, setting=setting)
        exact = beam.exact(omega, within=2e-3)
        assert omega[:2] == pytest.approx(exact[:2], rel=5e-4)
        assert omega == pytest.approx(exact, rel=1.5e-3)
