"""Elastic energy, force and stiffness summed in small pieces, and of stress that some elements have alone."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import METAL, STRUCTURES, random_state

from femflex.fem import Member, build_structure
from femflex.fem.assembly import assembler
from femflex.fem.internal_force import InternalForce
from femflex.fem.relaxed import settled
from femflex.fem.sections import CableSection, Rectangle
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh, line, rectangle


def shell(cell):
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    x, y, _ = flat.points.T
    bowl = Mesh(np.stack([x, y, 0.1 * x * x + 0.2 * x * y], axis=1), flat.cells, flat.cell_groups)
    member = Member("surface", "shell", isotropic(0.05, METAL).shifted(0.01), None, {"prestress": (3e4, -1e4, 2e4)})
    return build_structure(bowl, [member])


def rope():
    mesh = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 5)
    return build_structure(mesh, [Member("line", "tether", CableSection(1e5, 0.3), None, {"prestress": 40.0})])


def shearing():
    mesh = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 5)
    options = {"shear": True, "prestress": 400.0, "orientation": (0, 0, 1), "far_bends": True}
    return build_structure(mesh, [Member("line", "beam", Rectangle(0.05, 0.08), METAL, options)])


MADE = {**STRUCTURES, "rope": rope, "shell of 4 nodes": lambda: shell("quad"), "shell of 9": lambda: shell("quad9"),
        "beam that shears": shearing}  # fmt: skip
NAMES = ("tapered beam", "folded plate", "prestressed plate", "hot bfs", "prestressed solid", "rope",
         "shell of 4 nodes", "shell of 9", "beam that shears")  # fmt: skip


def everything(s) -> list[np.ndarray]:
    x, y = random_state(s, 1e-2), random_state(s, 1e-2, seed=1)
    phi = np.stack([x, y], axis=1)
    V = InternalForce(s.strain, s.T)
    dense = [V.tangent(x).toarray(), V.geometric_stiffness(x).toarray(), V.initial_stiffness().toarray()]
    more = [
        V.force(x),
        V.initial_force(),
        V.work_of_stress(phi, phi),
        V.quartic_energy(phi),
        V.second_derivative(phi, np.arange(phi.shape[1]), np.arange(phi.shape[1])[::-1]),
    ]
    return [np.array(V.energy(x)), *dense, *more]


@pytest.mark.parametrize("name", NAMES)
def test_sums_over_few_elements_at_a_time_are_those_over_all(name, monkeypatch):
    whole = everything(MADE[name]())

    def few(n, values, most=0):
        return (slice(k, min(k + 2, n)) for k in range(0, n, 2))

    for module in ("femflex.fem.internal_force", "femflex.fem.shell.blocks", "femflex.fem.shell.fields"):
        monkeypatch.setattr(f"{module}.element_chunks", few)
    monkeypatch.setattr(assembler, "CHUNK_ENTRIES", 2000)
    s = MADE[name]()
    for found, expected in zip(everything(s), whole, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("name", NAMES)
def test_the_first_of_the_gradients_are_those_of_all(name):
    """However few are wanted, for shapes that bend and for shapes in the plane, of blocks and of settled ones."""
    s = MADE[name]()
    phi = s.T @ np.stack(
        [random_state(s, 1.0), s.translation.T @ (s.mesh.points @ np.diag([1.0, 2, 3])).ravel()], axis=1
    )
    for block in (*s.strain, *settled(s, random_state(s, 1e-4)).strain):
        every, rows = block.gradients(phi, slice(None)), block.rows(slice(None))
        for most in range(1, block.linear_map.shape[1] + 1):
            np.testing.assert_array_equal(block.rows(slice(None), most), rows[:, :, :most])
            few = block.gradients(phi, slice(None), most)
            np.testing.assert_allclose(few, every[:, :, :most], atol=1e-13 * np.abs(every).max())


@pytest.mark.parametrize("name", NAMES)
def test_the_change_of_the_tangent_is_its_central_difference(name):
    """(dK/da) b at rest, of two motions of unlike size, where the energy is of degree four."""
    s = MADE[name]()
    a, b = random_state(s, 1.0, seed=2), random_state(s, 0.3, seed=3)
    V, h = s.internal_force, 1e-3
    slope = (V.tangent(h * a) @ b - V.tangent(-h * a) @ b) / (2 * h)
    found = V.second_derivative(np.column_stack([a, b]), np.array([0]), np.array([1]))[:, 0]
    np.testing.assert_allclose(found, slope, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize("name", NAMES)
def test_stress_of_a_few_elements_counts_and_that_of_others_is_none(name):
    """Displaced at the last nodes alone: the first elements have no stress of it, the last of every block have."""
    s = MADE[name]()
    x = random_state(s, 1e-3)
    order = np.argsort(s.mesh.points @ [1.0, 0.2, 0.1])[: len(s.mesh.points) // 2]
    still = abs(s.translation[(3 * order[:, None] + np.arange(3)).ravel()]).sum(axis=0) > 0
    still |= abs(s.rotation[(3 * order[:, None] + np.arange(3)).ravel()]).sum(axis=0) > 0
    inner = (abs(s.translation).sum(axis=0) + abs(s.rotation).sum(axis=0)) == 0
    x[still | inner] = 0.0
    found = settled(s, x)
    V, rest = found.internal_force, np.zeros(s.n_dof)
    force, tangent = V.force(rest), V.tangent(rest).toarray()
    np.testing.assert_allclose(V.initial_force(), force, atol=1e-10 * np.abs(force).max())
    sum_of = found.K0.toarray() + V.initial_stiffness().toarray()
    np.testing.assert_allclose(sum_of, tangent, atol=1e-10 * np.abs(tangent).max())
    np.testing.assert_allclose(found.f0 - s.f0, s.K0 @ x, atol=2e-7 * np.abs(s.K0 @ x).max())
