"""What softens strips that are bent in their stiff plane: the load at which they tip over, whatever the set."""

import numpy as np
import pytest
from support.lateral_buckling import END_LOAD, MOMENT, WEIGHT, critical, critical_of_structure, of_narrow_beams
from support.strips import STRIPS, derived, strip, under_end_load

from femflex.fem import Material, Member, build_structure
from femflex.mesh import rectangle
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.large_deflection.derivatives import scaled_derivatives
from femflex.reduction.large_deflection.softening import softening

HELD = {"start": ("x", "y", "z", "rx"), "end": ("y", "z", "rx")}


def follows(name):
    """EI / 2 EI_y: how much later a strip tips over whose twist follows, for it is then small of second order and the
    stiff plane does not turn under a bend already there."""
    return 0.5 / STRIPS[name][0]


@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
@pytest.mark.parametrize("name", STRIPS)
def test_any_number_of_modes_beside_the_shape_of_an_end_load_tips_over_at_prandtls_load(name, strain):
    """4.0126 sqrt(EI GJ) / L^2; from above, and closer with more modes."""
    late = follows(name) if strain == "condensed" else 0.0
    counts = (4, 6, 8) if strain == "nonlinear" else (4, 6, 8, 12)
    found = [under_end_load(name, n, strain=strain, loads={"end": ["z"]}) for n in counts]
    assert found[0] == pytest.approx(1, abs=5e-3 + late)
    assert found[1:] == pytest.approx([1] * len(found[1:]), abs=1.2e-3 + late)
    assert np.all(np.diff(found) < 3e-4)


@pytest.mark.parametrize("n", [4, 6, 8])
def test_automatic_derivatives_hold_the_coupling_that_all_have(n):
    """The twist of a slim strip stores a millionth of the stretch, and without it 8 modes tip over 6 % late."""
    auto, everything = (under_end_load("slim", n, keep) for keep in ("auto", "all"))
    assert auto == pytest.approx(everything, rel=1e-3)


def test_the_twist_wants_few_more_derivatives():
    structure = strip(*STRIPS["slim"])
    for n in (4, 8, 12):
        shapes = derived(structure, cantilever_modes(structure, "start", 12), n, "auto")
        more = [int(part.split()[0]) for part in shapes.note.split(", and ") if "deflections that soften other" in part]
        assert bool(more) == (n > 4)  # of four modes those for slender bends hold these too
        assert sum(more) <= n


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
def test_plate_strips_tip_over_where_their_own_finite_elements_do(family, counts):
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


def test_softening_is_that_of_the_tangent_of_the_bent_structure():
    """Second differences of the tangent along a bend, all that is outside the set at rest."""
    structure = strip(*STRIPS["thick"])
    modes = cantilever_modes(structure, "start", 5)
    theta = scaled_derivatives(structure, modes)
    found = softening(structure, modes, theta)
    k = int(np.argmin(found.load))
    j, x = found.bend[k], found.shapes[k]
    phi = modes.phi / modes.omega
    row = [list(zip(*np.triu_indices(5), strict=True)).index((min(i, j), max(i, j))) for i in range(5)]
    a = 1e-4 / np.sqrt(found.factor[k])
    K = structure.K
    bent = [structure.internal_force.tangent(s * a * phi[:, j] + a**2 / 2 * theta[:, row[j]]) for s in (1, -1)]
    first, second = (bent[0] - bent[1]) / (2 * a), ((bent[0] + bent[1]) / 2 - K) / a**2
    shape, follower = phi @ x, theta[:, row] @ x
    lost = shape @ (second @ shape) + 2 * shape @ (first @ follower) + follower @ (K @ follower)
    assert lost == pytest.approx(-found.factor[k], rel=1e-4)


def test_a_flat_panel_wants_no_shapes_for_softening():
    metal = Material(7e10, 0.3, 2700.0)
    structure = build_structure(rectangle(1.0, 0.7, 5, 4, "quad"), [Member("surface", "plate_bfs", 0.01, metal)])
    assert "soften" not in with_derivatives(structure, cantilever_modes(structure, "left", 9)).note
