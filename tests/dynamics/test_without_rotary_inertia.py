"""Beams without rotary inertia are Euler and Bernoulli's in frames that turn too, whatever clamp their shapes have."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex import fem
from femflex.body import Marker
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import linearised
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_attachment,
)
from femflex.reduction.strain.turned_sections import sections_of
from femflex.system import System, free, revolute

RY, RZ = 0.03, 0.02  # of a length of 1: 4, 12.5 and 23 % in the first three frequencies if counted in rigid turns
EIY, EIZ, GJ = 1.0, 1.3, 0.7
FREE_FREE = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671]) ** 2
HINGED_FREE = np.array([3.926602312047919, 7.068582745628732, 10.210176122813031]) ** 2
TORSION = np.sqrt(GJ / (RY**2 + RZ**2))


def straight():
    section = fem.sections.StiffnessSection(1e6, EIY, EIZ, GJ, 1.0, ry=RY, rz=RZ)
    member = fem.Member("line", "beam", section, None, {"order": 6, "orientation": (0, 1, 0), "rotary_inertia": False})
    return fem.build_structure(line([[0, 0, 0], [1, 0, 0]], 6), [member])


def meshed():
    structure = straight()
    shapes = with_attachment(structure, cantilever_modes(structure, "start", 20), ("x", "y", "z", "rx", "ry", "rz"))
    return reduce_structure(structure, shapes, {"root": "start"})


def analytic(rotary=False):
    beam = UniformBeam(1.0, 1e6, EIY, EIZ, GJ, 1.0, RY, RZ, rotary_inertia=rotary, orientation=(0, 1, 0))
    return beam_body(beam, BeamFunctions(y=12, z=12, torsion=8, family="polynomial"))


def frequencies(body, joint):
    model = compile_system(System({"beam": body}, (joint,)))
    found = linearised(model, 0.0, model.x0).eigenvalues().imag
    return np.sort(found[found > 1.0])


@pytest.mark.parametrize("body", [meshed, analytic], ids=["meshed", "analytic"])
def test_a_free_beam_on_cantilever_shapes_has_the_closed_form_frequencies(body):
    """(beta L)^2 sqrt(EI / m L^4) of a free beam in both planes, and n pi sqrt(GJ / m p) of its twist."""
    found = frequencies(body(), free("beam"))
    exact = np.concatenate([np.sqrt(EI) * FREE_FREE for EI in (EIY, EIZ)] + [np.pi * np.arange(1, 3) * TORSION])
    assert found[: len(exact) - 1] == pytest.approx(np.sort(exact)[:-1], rel=1e-5)


@pytest.mark.parametrize("body", [meshed, analytic], ids=["meshed", "analytic"])
def test_a_hinged_beam_on_cantilever_shapes_has_the_closed_form_frequencies(body):
    """About y: that of a hinged beam in x-z; in x-y it stays clamped."""
    found = frequencies(body(), revolute("beam", axis=(0, 1, 0), child_marker="root"))
    for exact in HINGED_FREE * np.sqrt(EIY):
        assert np.abs(found / exact - 1).min() < 1e-5


@pytest.mark.slow
def test_with_rotary_inertia_they_are_lower():
    """By 1/2 r^2 int w'^2 / int w^2 and more, of Rayleigh's beam: here 1 % and more."""
    assert frequencies(analytic(True), free("beam"))[0] < 0.99 * frequencies(analytic(), free("beam"))[0]


def test_the_inertia_of_the_body_is_that_of_a_line_with_sections_about_its_axis():
    """m L^2 / 3 about the root, and m (ry^2 + rz^2) along the beam."""
    for body in (meshed(), analytic()):
        Q = body.moments.second[0, :, 0, :]
        expected = np.diag([RY**2 + RZ**2, 1 / 3, 1 / 3])
        assert np.trace(Q) * np.eye(3) - Q == pytest.approx(expected, abs=1e-12)


def test_sections_that_twist_and_bend_keep_their_inertia_along_the_line_to_second_order():
    """int o (y o)^T dm of what follows, against sections of p / 2 diag(-1, 1, 1) turned by finite rotations."""
    structure = straight()
    shapes = cantilever_modes(structure, "start", 8)
    body = reduce_structure(structure, shapes, {"root": "start"}, strain="nonlinear")
    assert body.kinds.count("section") > 1
    sections = sections_of(structure, shapes.phi)
    delta, apart = np.array([1.0, -0.7, 0.5, 0.8, -0.4, 0.6, 0.3, 0.2]), []
    for size in (0.004, 0.002):
        s = sections.turn @ (size * delta)
        curved = [
            Marker(np.zeros(3), np.zeros((3, 3)), np.eye(3), axis=e).rotation_vector(one)
            for e, one in zip(sections.axis, s, strict=True)
        ]
        beyond = Rotation.from_rotvec(curved).as_matrix() - np.eye(3) - np.cross(s[:, None], np.eye(3)).swapaxes(1, 2)
        exact = np.einsum("pij,pkj->ik", sections.second, beyond)
        found = np.einsum("isj,s->ij", body.moments.second[0][:, 9:], body.amplitudes(size * delta)[8:])
        apart.append(np.abs(found - exact).max() / np.abs(exact).max())
    assert apart[1] < 2e-2
    assert np.log2(apart[0] / apart[1]) > 0.8
