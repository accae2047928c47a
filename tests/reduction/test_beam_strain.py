"""Beams on admissible functions bend and twist together: the energy of meshed ones, loads at which they tip over."""

import numpy as np
import pytest
from support.lateral_buckling import EI, END_LOAD, GJ, LENGTH, MOMENT, WEIGHT, critical, of_narrow_beams

from femflex.body.symmetric import packed_indices
from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, sampled_functions
from femflex.reduction.strain.tensors import strain_tensors

RATIOS = [50, 400]


def strip(ratio, **changes):
    data = dict(EA=2.8e9, EIy=ratio * EI, EIz=EI, GJ=GJ, mass_per_length=1.2, ry=0.005, rz=0.005)
    return UniformBeam(LENGTH, orientation=(0, 1, 0), **{**data, **changes})


def polynomial(n, **changes):
    return BeamFunctions(**{**dict(y=n, z=n, torsion=n, family="polynomial"), **changes})


@pytest.mark.parametrize("far", [False, True])
def test_the_energy_is_that_of_the_meshed_beam_in_the_same_functions(far):
    """Two codes for one strain: V2 and V3 of functions sampled on a mesh, and along the line."""
    functions = polynomial(2, axial=5)  # they hold all squares of slopes, so that nothing follows
    EA = 3e6
    radii = {"ry": np.sqrt(50 * EI / EA), "rz": np.sqrt(EI / EA)}  # of one material
    whole = beam_body(strip(50, EA=EA, far_bends=far, **radii), functions, orthonormal=False, strain="nonlinear")
    section = StiffnessSection(EA, 50 * EI, EI, GJ, 1.2, **radii)
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], 40)
    options = {"orientation": (0, 1, 0), "far_bends": far}
    structure = build_structure(mesh, [Member("line", "beam", section, None, options)])
    shapes = sampled_functions(structure, strip(50), functions, "start")
    scale = np.sqrt(np.diag(whole.without_slaves().moments.elastic_mass()))
    meshed = strain_tensors(structure, shapes.phi * scale)
    size = 1 / np.sqrt(np.diag(whole.strain.V1))
    for name, degree in (("V2", 3), ("V3", 4)):
        rows = packed_indices(len(size), degree)
        own, other = (getattr(strain, name) * size[rows].prod(axis=1) for strain in (whole.strain, meshed))
        twisted = ((rows < 2).any(axis=1)) & ((rows // 2 == 1).any(axis=1)) & ((rows >= 7).any(axis=1))  # v, w, theta
        for some in (twisted, ~twisted) if degree == 3 else (~twisted,):  # the fourth order of all three is odd in one
            assert np.abs(own[some]).max() > 0
            np.testing.assert_allclose(own[some], other[some], atol=1e-3 * np.abs(own[some]).max())


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("strain", ["condensed", pytest.param("nonlinear", marks=pytest.mark.slow)])
def test_a_cantilever_tips_over_under_an_end_load_and_under_its_weight(ratio, strain):
    """4.0126 and 12.854 sqrt(EI GJ) / L^2, from above with more functions."""
    found = []
    for n in (3, 4, 6):
        body = beam_body(strip(ratio), polynomial(n, axial=2 * n + 4 if strain == "nonlinear" else 0), strain=strain)
        weight = body.moments.first[1:, 2] / body.moments.mass
        loads = (body.markers["tip"].phi[2], END_LOAD), (weight, WEIGHT)
        found.append([critical(body, load, of_narrow_beams(k, 2, ratio)) for load, k in loads])
    assert found[0] == pytest.approx([1, 1], abs=5e-2)
    assert found[1] == pytest.approx([1, 1], abs=1e-2)
    assert found[2] == pytest.approx([1, 1], abs=6e-4)  # what six functions leave
    assert np.all(np.diff(found, axis=0) < 0)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", RATIOS)
def test_far_bends_tip_over_as_late_as_the_bend_before_would_have_it(ratio):
    """1 - EI / EIy in place of its root, with what six functions leave: 1.0 % late at 50, 0.1 % at 400."""
    body = beam_body(strip(ratio, far_bends=True), polynomial(6, axial=16), strain="nonlinear")
    found = critical(body, body.markers["tip"].phi[2], of_narrow_beams(END_LOAD, 2, ratio))
    assert found == pytest.approx(1 / np.sqrt(1 - 1 / ratio), abs=6e-4)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", RATIOS)
def test_a_beam_between_forks_tips_over_under_end_moments(ratio):
    """pi sqrt(EI GJ) / L, of a beam so soft along its axis that its ends may as well draw in."""
    for n, bound in ((3, 5e-4), (6, 2e-4)):
        body = beam_body(strip(ratio, EA=1.0), polynomial(n, ends="pinned-pinned"), strain="condensed")
        moment = body.markers["root"].psi[1] - body.markers["tip"].psi[1]
        assert critical(body, moment, of_narrow_beams(MOMENT, 1, ratio)) == pytest.approx(1, abs=bound)


@pytest.mark.slow
@pytest.mark.parametrize(("strain", "axial"), [("condensed", 0), ("nonlinear", 1), ("nonlinear", 6)])
def test_characteristic_functions_tip_over_at_the_same_load(strain, axial):
    """With few axial functions, which are sines, they would do so 11 to 50 % late, but for the dependent shapes."""
    found = []
    for n in (2, 4, 6):
        functions = BeamFunctions(y=n, z=n, axial=axial, torsion=n)
        body = beam_body(strip(50), functions, strain=strain)
        assert body.n_modes == 3 * n + axial
        found.append(critical(body, body.markers["tip"].phi[2], of_narrow_beams(END_LOAD, 2, 50)))
    assert found == pytest.approx([1, 1, 1], abs=1.2e-2) and found[-1] == pytest.approx(1, abs=1e-3)


def test_a_section_alike_in_all_directions_does_not_tip_over():
    body = beam_body(strip(1), polynomial(3), strain="condensed")
    assert critical(body, body.markers["tip"].phi[2], END_LOAD * np.sqrt(EI * GJ) / LENGTH**2) == np.inf
