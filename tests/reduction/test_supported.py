"""One set of factors for modes, static answers and buckling, with supports and without."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.mesh import rectangle
from femflex.reduction import critical_factor, free_free_modes
from femflex.reduction.boundary.clamps import held_dofs
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.boundary.supported import lowest_modes_on, supported

METAL, SIDE, H = Material(7e10, 0.3, 2700.0), 1.0, 5e-3
D = METAL.E * H**3 / 12 / (1 - METAL.nu**2)
EDGES = dict.fromkeys(("left", "right", "bottom", "top"), ("z",)) | {"bottom_left": ("x", "y", "z"), "top_left": ("x",)}
NOTHING = np.zeros(0, np.int64)


def sheet(prestress=(0.0, 0.0, 0.0), n=10):
    mesh = rectangle(SIDE, SIDE, n, n, "quad")
    return build_structure(mesh, [Member("surface", "plate_bfs", H, METAL, {"prestress": prestress})])


@pytest.mark.parametrize("factor", [0.6, 1.1, 2.5, 40.0])
def test_a_compressed_sheet_buckles_at_the_load_of_navier(factor):
    """Simply supported, square, pressed along x: N = 4 pi^2 D / b^2; borne, nearly borne, and past buckling."""
    structure = sheet((-4 * np.pi**2 * D / SIDE**2 / factor, 0.0, 0.0))
    assert critical_factor(structure, held_dofs(structure, EDGES)) == pytest.approx(factor, rel=1e-3)


def test_tension_that_stiffens_manifold_never_buckles():
    structure = sheet((1e4 * D / SIDE**2, 1e4 * D / SIDE**2, 0.0))
    assert critical_factor(structure, held_dofs(structure, EDGES)) == np.inf


def test_far_off_buckling_is_not_sought_exactly():
    structure = sheet((-4 * np.pi**2 * D / SIDE**2 / 40.0, 0.0, 0.0))
    assert critical_factor(structure, held_dofs(structure, EDGES), enough=1.25) == np.inf


def test_a_free_structure_answers_the_balanced_part_of_a_load():
    """K x is the load less the inertia of the rigid acceleration it gives; no rigid motion is in the answer."""
    structure = sheet()
    R, M = rigid_shapes(structure), structure.M
    load = structure.translation.T @ np.random.default_rng(0).standard_normal((structure.translation.shape[0], 2))
    x = supported(structure, NOTHING).answers(load)
    balanced = load - M @ R @ np.linalg.solve(R.T @ (M @ R), R.T @ load)
    assert np.abs(structure.K @ x - balanced).max() < 1e-8 * np.abs(load).max()
    assert np.abs(R.T @ (M @ x)).max() < 1e-9 * np.abs(R.T @ (M @ np.abs(x))).max()


def test_modes_without_supports_are_those_of_a_shifted_search():
    """Beside the rigid motions on determinate supports, and with a spring to the ground on every dof."""
    from femflex.fem.eigen.modes import lowest_modes

    structure = sheet()
    ours = free_free_modes(structure, 8)
    theirs = lowest_modes(structure.K, structure.M, 8, free=True)
    np.testing.assert_allclose(ours.omega, theirs.omega[: len(ours.omega)], rtol=1e-8)


def test_what_is_known_of_a_structure_is_computed_once_and_dropped_on_request():
    structure = sheet()
    held = held_dofs(structure, "left")
    assert supported(structure, held) is supported(structure, held.copy())
    assert lowest_modes_on(structure, held, 4) is lowest_modes_on(structure, held, 4)
    before = supported(structure, held)
    structure.forget()
    assert not structure.known
    assert supported(structure, held) is not before


def test_a_warning_is_given_every_time_its_result_is_wanted():
    import warnings

    structure = sheet()

    def make():
        warnings.warn("thin", UserWarning, stacklevel=1)
        return 1

    for _ in range(2):
        with pytest.warns(UserWarning, match="thin"):
            assert structure.recalled(("a figure",), make) == 1
