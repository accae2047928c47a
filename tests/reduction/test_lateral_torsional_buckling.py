"""Lateral-torsional buckling of reduced beams and strips at Prandtl's loads."""

import numpy as np
import pytest
from support.lateral_buckling import (
    EI,
    END_LOAD,
    GJ,
    LENGTH,
    MOMENT,
    WEIGHT,
    critical,
    critical_of_structure,
    of_narrow_beams,
)
from support.strips import STRIPS, derived, strip, under_end_load

from femflex.fem import Material, Member, build_structure
from femflex.mesh import rectangle
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, cantilever_modes, reduce_structure
from femflex.reduction.boundary.markers import marker_rows

HELD = {"start": ("x", "y", "z", "rx"), "end": ("y", "z", "rx")}


def follows(name):
    """EI / 2 EI_y: how much later a strip tips over whose twist follows, for it is then small of second order and the
    stiff plane does not turn under a bend already there."""
    return 0.5 / STRIPS[name][0]


@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
@pytest.mark.parametrize("name", STRIPS)
def test_prandtls_load_with_any_number_of_modes_and_end_load_shape(name, strain):
    """4.0126 sqrt(EI GJ) / L^2; from above, and closer with more modes."""
    late = follows(name) if strain == "condensed" else 0.0
    counts = (4, 6, 8) if strain == "nonlinear" else (4, 6, 8, 12)
    found = [under_end_load(name, n, strain=strain, loads={"end": ["z"]}) for n in counts]
    assert found[0] == pytest.approx(1, abs=5e-3 + late)
    assert found[1:] == pytest.approx([1] * len(found[1:]), abs=1.2e-3 + late)
    assert np.all(np.diff(found) < 3e-4)


@pytest.mark.parametrize("name", STRIPS)
def test_a_strip_tips_over_under_its_weight(name):
    """12.85 sqrt(EI GJ) / L^2 in all."""
    ratio = STRIPS[name][0]
    structure = strip(*STRIPS[name])
    found = []
    for n in (4, 6, 8):
        shapes = derived(structure, cantilever_modes(structure, "start", 12), n, "auto", attachment=["z"])
        body = reduce_structure(structure, shapes, strain="condensed")
        weight = body.moments.first[1:, 2] / body.moments.mass
        found.append(critical(body, weight, of_narrow_beams(WEIGHT, 2, ratio)))
    assert found == pytest.approx([1, 1, 1], abs=1.5e-2 + follows(name))
    assert found[-1] == pytest.approx(1, abs=2e-3 + follows(name))


@pytest.mark.parametrize("name", STRIPS)
def test_a_strip_between_forks_tips_over_under_end_moments(name):
    """pi sqrt(EI GJ) / L, ends held against twist, one free to draw in."""
    ratio = STRIPS[name][0]
    structure = strip(*STRIPS[name])
    modes = cantilever_modes(structure, HELD, 10)
    found = []
    for n in (4, 6, 8):
        shapes = derived(structure, modes, n, "auto", loads={"start": ["ry"], "end": ["ry"]})
        body = reduce_structure(structure, shapes, {"root": "start", "tip": "end"}, strain="condensed")
        moment = body.markers["root"].psi[1] - body.markers["tip"].psi[1]
        found.append(critical(body, moment, of_narrow_beams(MOMENT, 1, ratio)))
    assert found == pytest.approx([1, 1, 1], abs=5e-3 + follows(name))


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("family", "counts"), [("plate_bfs", (12, 2)), ("plate", (16, 2))])
def test_lateral_buckling_of_plate_strips_matches_full_elements(family, counts):
    metal = Material(7e10, 0.3, 2700.0)
    mesh = rectangle(1.0, 0.05, *counts, "quad" if family == "plate_bfs" else "triangle")
    structure = build_structure(mesh, [Member("surface", family, 0.002, metal)])
    modes = cantilever_modes(structure, "left", 12)
    weak, twist = 7e10 * 0.05 * 0.002**3 / 12, 7e10 / 2.6 * 0.05 * 0.002**3 / 3 * (1 - 0.63 * 0.04)
    unit = END_LOAD * np.sqrt(weak * twist)
    load = marker_rows(structure, "right").translation.toarray()[1]
    exact = critical_of_structure(structure, modes.held, load, unit, step=0.2)
    assert exact == pytest.approx(1, abs=0.06)  # a plate held against contraction at its root is stiffer than a beam
    for n in (4, 6, 8, 12):
        shapes = derived(structure, modes, n, "auto", loads={"right": ["y"]})
        body = reduce_structure(structure, shapes, {"tip": "right"}, strain="condensed")
        found = critical(body, body.markers["tip"].phi[1], unit)
        assert found == pytest.approx(exact, rel=7e-3 if n == 4 else 2e-3)


RATIOS = [50, 400]


def thin_beam(ratio, **changes):
    data = dict(EA=2.8e9, EIy=ratio * EI, EIz=EI, GJ=GJ, mass_per_length=1.2, ry=0.005, rz=0.005)
    return UniformBeam(LENGTH, orientation=(0, 1, 0), **{**data, **changes})


def polynomial(n, **changes):
    return BeamFunctions(**{**dict(y=n, z=n, torsion=n, family="polynomial"), **changes})


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("strain", ["condensed", pytest.param("nonlinear", marks=pytest.mark.slow)])
def test_lateral_buckling_of_cantilever_under_end_load_and_weight(ratio, strain):
    """4.0126 and 12.854 sqrt(EI GJ) / L^2, from above with more functions."""
    found = []
    for n in (3, 4, 6):
        body = beam_body(
            thin_beam(ratio), polynomial(n, axial=2 * n + 4 if strain == "nonlinear" else 0), strain=strain
        )
        weight = body.moments.first[1:, 2] / body.moments.mass
        loads = (body.markers["tip"].phi[2], END_LOAD), (weight, WEIGHT)
        found.append([critical(body, load, of_narrow_beams(k, 2, ratio)) for load, k in loads])
    assert found[0] == pytest.approx([1, 1], abs=5e-2)
    assert found[1] == pytest.approx([1, 1], abs=1e-2)
    assert found[2] == pytest.approx([1, 1], abs=6e-4)  # what six functions leave
    assert np.all(np.diff(found, axis=0) < 0)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", RATIOS)
def test_a_beam_between_forks_tips_over_under_end_moments(ratio):
    """pi sqrt(EI GJ) / L, of a beam so soft along its axis that its ends may as well draw in."""
    for n, bound in ((3, 5e-4), (6, 2e-4)):
        body = beam_body(thin_beam(ratio, EA=1.0), polynomial(n, ends="pinned-pinned"), strain="condensed")
        moment = body.markers["root"].psi[1] - body.markers["tip"].psi[1]
        assert critical(body, moment, of_narrow_beams(MOMENT, 1, ratio)) == pytest.approx(1, abs=bound)
