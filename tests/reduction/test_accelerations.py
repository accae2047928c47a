"""Test: derivatives for acceleration fields give a set the stiffening of the full elements under a spin."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import splu
from support.full_spin import mass_points
from support.nonlinear_models import METAL, bent_beam

from femflex.fem import Member, build_structure
from femflex.mesh import box, rectangle
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.reduction.boundary.rigid import free_dofs
from femflex.reduction.inertia.accelerations import loads_of_linear_accelerations, work_of_accelerations


def plate():
    mesh = rectangle(1.0, 0.7, 5, 4, "quad")
    return build_structure(mesh, [Member("surface", "plate_bfs", 0.01, METAL)])


def solid():
    mesh = box(1.0, 0.2, 0.03, 8, 2, 1, "hexahedron27")
    return build_structure(mesh, [Member("volume", "solid", None, METAL)])


STRUCTURES = {
    "plate": (plate, "left", 9),
    "solid": (solid, "left", 6),
    "bent beam": (lambda: bent_beam(order=4), "start", 6),
}


def field_load(structure, B, b):
    """Load (n_dof,) of accelerations b + B rho."""
    dm, rho, N = mass_points(structure)
    return N.T @ (dm[:, None] * (rho @ B.T + b)).ravel()


@pytest.mark.parametrize("name", ["triangles", *STRUCTURES])
def test_loads_of_linear_accelerations_are_those_of_the_points_of_mass(name):
    """In its plane, and as it moves rigidly; a sheet's own field across it, which bends it, is that of its nodes."""
    mesh = rectangle(1.0, 0.7, 5, 4)
    made = {"triangles": lambda: build_structure(mesh, [Member("surface", "plate", 0.01, METAL)])}
    structure = (made | {key: make for key, (make, *_) in STRUCTURES.items()})[name]()
    found = loads_of_linear_accelerations(structure)
    fields = [(np.zeros((3, 3)), e) for e in np.eye(3)]
    fields += [(np.outer(e, f), np.zeros(3)) for f in np.eye(3) for e in np.eye(3)]
    wanted = np.column_stack([field_load(structure, B, b) for B, b in fields])
    size = np.abs(wanted).max()
    for i, j in ((0, 1), (1, 2), (2, 0)):  # turns
        ours, theirs = (loads[:, 3 + 3 * j + i] - loads[:, 3 + 3 * i + j] for loads in (found, wanted))
        assert ours == pytest.approx(theirs, abs=1e-9 * size)
    assert found[:, :3] == pytest.approx(wanted[:, :3], abs=1e-9 * size)
    some = range(12) if name == "solid" else [3, 4, 6, 7] if "beam" not in name else []
    assert found[:, some] == pytest.approx(wanted[:, some], abs=1e-9 * size)


def stiffening_of_elements(structure, modes, load):
    """Stiffness (n, n) over the modes that a small load adds, from tangents of the full elements."""
    free = free_dofs(structure, modes.held)
    x = np.zeros(structure.n_dof)
    x[free] = splu(structure.K[free][:, free].tocsc()).solve(load[free])
    x *= 1e-3 / np.abs(x).max()
    elastic = structure.internal_force
    change = (elastic.tangent(x) - elastic.tangent(-x)) / 2
    scale = (structure.K @ x) @ x / (load @ x)
    return modes.phi.T @ (change @ modes.phi) / scale


def stiffening_of_body(body, B, b):
    """Stiffness (n, n) that a field adds to a condensed body, by its dependent shapes and its static response.

    Without sections of beams that turn, which the full elements have not.
    """
    n = body.n_modes
    work = np.einsum("aki,ia->k", body.moments.second[0][:, 1:], B) + body.moments.first[1:] @ b
    bent = np.linalg.solve(body.strain.V1, work[:n])
    change = (body.strain.tangent(bent) - body.strain.tangent(-bent)) / 2
    stretch = np.array([kind != "section" for kind in body.kinds[n:]])
    found = change - np.einsum("s,sij->ij", work[n:][stretch], body.slaves[stretch])
    turned = body.strain.V1 @ change_of_modes(body, bent)
    return found - turned - turned.T


def change_of_modes(body, bent):
    """Change (n, n) of the modes of a deflected body by a small change of its coordinates."""
    n, carried = body.n_modes, np.array([kind == "carried" for kind in body.kinds[body.n_modes :]])
    parts = body.moments.elastic_mass()[n:, :n][carried]  # of carried shapes in the modes
    return np.einsum("sk,sij,j->ki", parts, body.slaves[carried], bent)


@pytest.mark.parametrize(
    ("name", "keep", "error"),
    [("plate", "auto", 3e-9), ("solid", "auto", 1e-8), ("bent beam", "auto", 1.3e-3), ("bent beam", "all", 1e-8)],
)
def test_stiffening_by_acceleration_fields_matches_full_elements(name, keep, error):
    """To rounding; "auto" leaves out those derivatives of the bent beam that are too slow to follow (4.4e-4)."""
    make, clamp, n = STRUCTURES[name]
    structure = make()
    modes = cantilever_modes(structure, clamp, n)
    body = reduce_structure(structure, with_derivatives(structure, modes, keep), strain="condensed")
    rng = np.random.default_rng(1)
    for k in range(4):
        B, b = (rng.normal(size=(3, 3)), np.zeros(3)) if k < 2 else (np.zeros((3, 3)), rng.normal(size=3))
        exact = stiffening_of_elements(structure, modes, field_load(structure, B, b))
        np.testing.assert_allclose(stiffening_of_body(body, B, b), exact, atol=error * np.abs(exact).max())


def test_the_most_energetic_derivatives_alone_would_not_do():
    structure = plate()
    modes = cantilever_modes(structure, "left", 9)
    auto = with_derivatives(structure, modes)
    energetic, more = (int(part.split()[k]) for part, k in zip(auto.note.split(", ")[::2], (0, 1), strict=True))
    assert auto.kinds.count("derivative") == energetic + more and 0 < more <= 12
    few = with_derivatives(structure, modes, energetic)
    spin = np.diag([-1.0, -1.0, 0.0]), np.zeros(3)
    exact = stiffening_of_elements(structure, modes, field_load(structure, *spin))
    found = [stiffening_of_body(reduce_structure(structure, s, strain="condensed"), *spin) for s in (few, auto)]
    off = [np.abs(K - exact).max() / np.abs(exact).max() for K in found]
    assert off[0] > 0.02 and off[1] < 1e-4


def test_work_on_uniform_and_linear_fields_is_that_of_the_points():
    structure = solid()
    shapes = np.random.default_rng(0).normal(size=(structure.n_dof, 2))
    found = work_of_accelerations(structure, shapes)
    for a in range(4):
        for b in range(3):
            B, uniform = np.zeros((3, 3)), np.zeros(3)
            if a:
                B[b, a - 1] = 1.0
            else:
                uniform[b] = 1.0
            exact = field_load(structure, B, uniform) @ shapes
            np.testing.assert_allclose(found[a, b], exact, rtol=1e-10, atol=1e-12 * np.abs(found).max())
