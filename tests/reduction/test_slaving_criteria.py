"""Which derivatives follow: stretch does, bending that a stretching coordinate drives does not; and what V3 costs."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body.symmetric import packed_size
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line, rectangle
from femflex.reduction import cantilever_modes, condense, craig_bampton, reduce_structure, with_derivatives

SLIM = StiffnessSection(1e6, 40.0, 70.0, 30.0, 0.5, ry=6e-3, rz=8e-3)


def boom():
    return build_structure(line([[0, 0, 0], [4.0, 0, 0]], 8), [Member("line", "beam", SLIM)])


def derived(shapes):
    return np.flatnonzero([kind == "derivative" for kind in shapes.kinds])


def sideways(structure, column):
    """Part of a shape's motion that is across the boom."""
    moved = (structure.translation @ column).reshape(-1, 3)
    return float((moved[:, 1:] ** 2).sum() / (moved**2).sum())


def test_derivatives_that_bend_stay_coordinates_and_the_rest_follows():
    structure = boom()
    shapes = with_derivatives(structure, craig_bampton(structure, ("start", "end"), 2), "all")
    body = reduce_structure(structure, shapes, strain="condensed")
    across = [sideways(structure, shapes.phi[:, k]) > 0.5 for k in derived(shapes)]
    stay = [omega for omega, kind in zip(body.omega, body.kinds, strict=True) if kind == "derivative"][
        : body.kinds[: body.n_modes].count("derivative")
    ]
    assert 0 < len(stay) < len(across)
    assert set(stay) <= set(shapes.omega[derived(shapes)[across]])  # no stretch among them
    assert max(stay) < 2 * shapes.omega[:8].max()


def test_automatic_derivatives_of_a_slim_boom_follow_where_they_are_stiff():
    structure = boom()
    for modes in (craig_bampton(structure, ("start", "end"), 2), cantilever_modes(structure, "start", 6)):
        shapes = with_derivatives(structure, modes)
        body = reduce_structure(structure, shapes, strain="condensed")
        assert 0 < len(derived(shapes)) == body.kinds.count("derivative")
        # a derivative that bends stays a coordinate, and is no faster than those there are
        kept = body.omega[modes.n_modes : body.n_modes]
        assert len(kept) <= 1 and (kept < 0.5 * body.omega[: modes.n_modes].max()).all()


def test_a_set_none_of_whose_derivatives_can_follow_keeps_them_all_as_coordinates():
    structure = boom()
    shapes = with_derivatives(structure, craig_bampton(structure, ("start", "end"), 2), "all")
    slow = shapes.picked([*range(8), *derived(shapes)[:2]])
    body, whole = (reduce_structure(structure, slow, strain=strain) for strain in ("condensed", "nonlinear"))
    assert body.n_modes == 10 and not body.condensed
    np.testing.assert_array_equal(body.strain.V3, whole.strain.V3)


def test_members_between_interfaces_stay_as_stiff_as_they_are_with_linear_strain():
    structure = boom()
    modes = craig_bampton(structure, ("start", "end"), 2)
    linear = reduce_structure(structure, modes)
    for keep in (4, "auto"):
        body = reduce_structure(structure, with_derivatives(structure, modes, keep), strain="condensed")
        stiff = np.sqrt(np.outer(*[np.diag(linear.strain.V1)] * 2))
        np.testing.assert_allclose(body.strain.V1[:8, :8] / stiff, linear.strain.V1 / stiff, atol=1e-9)
        np.testing.assert_allclose(body.moments.elastic_mass()[:8, :8], linear.moments.elastic_mass(), atol=1e-9)


def plate(n, cells=4):
    metal = Material(7e10, 0.3, 2700.0)
    structure = build_structure(
        rectangle(1.0, 0.7, cells, cells - 1, "quad"), [Member("surface", "plate_bfs", 0.01, metal)]
    )
    return structure, with_derivatives(structure, cantilever_modes(structure, "left", n), "all")


def test_tensors_over_the_coordinates_alone_are_those_of_the_whole_body():
    structure, shapes = plate(5)
    body, whole = (reduce_structure(structure, shapes, strain=strain) for strain in ("condensed", "nonlinear"))
    again = condense(whole, derived(shapes))
    for name in ("V1", "f0", "V2", "V3"):
        found, exact = getattr(body.strain, name), getattr(again.strain, name)
        np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max() + 1e-300)
    np.testing.assert_allclose(body.slaves, again.slaves, atol=1e-9 * np.abs(again.slaves).max())


@pytest.mark.slow
def test_more_shapes_may_follow_than_could_be_coordinates():
    structure, shapes = plate(20, 8)
    assert shapes.n_modes > 200
    with pytest.raises(ValueError, match=r"strain tensors of \d+ shapes would take"):
        reduce_structure(structure, shapes, strain="nonlinear")
    body = reduce_structure(structure, shapes, strain="condensed")
    assert body.n_modes < 60 and body.strain.V3.shape == (packed_size(body.n_modes, 4),)
