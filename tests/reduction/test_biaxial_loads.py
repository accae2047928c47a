"""Cantilevers bent about both axes of their sections at once, against Kirchhoff's rod in space."""

import numpy as np
import pytest
from support.kirchhoff import tip_of_rod
from test_bent_strips import bent_tip

from femflex import fem, reduction
from femflex.mesh import line
from femflex.reduction import BeamFunctions, UniformBeam, beam_body

LENGTH, EI, EA = 10.0, 1.4e4, 2.8e8


def meshed(EIy, GJ, strain="condensed"):
    """A condensed body whose section lies along y and z; EIz = EI."""
    section = fem.sections.StiffnessSection(EA, EIy, EI, GJ, 1.2, ry=0.01, rz=0.01)
    member = fem.Member("line", "beam", section, None, {"orientation": (0, 1, 0)})
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 8), [member])
    shapes = reduction.cantilever_modes(structure, "start", 8)
    shapes = reduction.with_attachment(structure, shapes, [], {"end": ["y", "z"]})
    shapes = reduction.with_derivatives(structure, shapes, "all")
    return reduction.reduce_structure(structure, shapes, {"tip": "end"}, strain=strain)


def on_functions(EIy, GJ, strain="condensed"):
    beam = UniformBeam(LENGTH, EA, EIy, EI, GJ, 1.2, ry=0.01, rz=0.01, orientation=(0, 1, 0))
    axial = 12 if strain == "nonlinear" else 0
    return beam_body(beam, BeamFunctions(y=4, z=4, axial=axial, torsion=4, family="polynomial"), strain=strain)


def skew(size, EIy):
    """A force (3,) that would bend the beam by so much of its length at 45 degrees, by linear theory."""
    return np.array([0.0, EI, EIy]) * 3 * size / LENGTH**2 / np.sqrt(2)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("build", "strain"),
    [
        (meshed, "condensed"),
        pytest.param(meshed, "nonlinear", marks=pytest.mark.slow),
        (on_functions, "condensed"),
        (on_functions, "nonlinear"),
    ],
)
def test_a_round_beam_bends_as_far_askew_as_in_a_plane_of_its_axes(build, strain):
    body, size = build(EI, 0.8 * EI, strain), 0.2
    straight, askew = (bent_tip(body, force) for force in (np.array([0, 0, 3 * EI * size / LENGTH**2]), skew(size, EI)))
    assert straight[2] > 0.19 * LENGTH
    assert askew == pytest.approx([straight[0], *np.full(2, straight[2] / np.sqrt(2))], rel=1e-7)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("build", [meshed, on_functions])
@pytest.mark.parametrize(
    ("ratio", "GJ"), [(1, 0.8), (4, 0.8), pytest.param(4, 1.5, marks=pytest.mark.slow), (0.3, 0.5)]
)
def test_a_beam_bent_askew_lies_where_kirchhoffs_rod_does(build, ratio, GJ):
    """Uneven ones leave the plane of the load's linear answer; what is left falls at least as the square of the size.

    Curvature of second order alone was 7e-3 off at a fifth of the length.
    """
    body, apart = build(ratio * EI, GJ * EI), []
    for size in (0.1, 0.2):
        exact = tip_of_rod(LENGTH, GJ * EI, ratio * EI, EI, skew(size, ratio * EI))[0]
        apart.append(np.linalg.norm(bent_tip(body, skew(size, ratio * EI)) - exact) / np.linalg.norm(exact))
    assert apart[0] < 5e-4 and apart[1] < 4e-3
