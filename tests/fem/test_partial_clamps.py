"""A clamp of single components holds whole straight edges of plates, between their nodes too."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import METAL
from support.plate_models import EDGES, frequencies, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.fem.support import Support
from femflex.mesh import line, rectangle
from femflex.reduction import cantilever_modes, lumped, nodal_translations


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad")])
def test_an_edge_held_across_stays_straight_and_slides_along_itself(family, cell):
    """Pressed by a thermal strain, a plate held in x between two edges and free in y: sigma_x = -E eps, sigma_y = 0."""
    strain, h = 1e-4, 0.01
    mesh = rectangle(1.0, 1.0, 3, 3, cell)
    structure = build_structure(mesh, [Member("surface", family, h, METAL, {"thermal_strain": strain})])
    held = [structure.clamped_dofs(edge, ("x",)) for edge in ("left", "right")]
    held += [structure.clamped_dofs("bottom", ("y",)), structure.clamped_dofs("surface", ("z", "rx", "ry", "rz"))]
    held = np.unique(np.concatenate(held))
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    K = structure.K[free][:, free].toarray()
    x = np.zeros(structure.n_dof)
    x[free] = np.linalg.lstsq(K, -structure.f0[free], rcond=None)[0]
    u = (structure.translation @ x).reshape(-1, 3)
    np.testing.assert_allclose(u[:, 0], 0.0, atol=1e-10)
    np.testing.assert_allclose(u[:, 1], (1 + METAL.nu) * strain * mesh.points[:, 1], rtol=1e-3, atol=1e-10)


HINGES = {"left": ("x", "y", "z", "ry"), "right": ("x", "z"), "bottom": ("y",)}


def turned(supports, C):
    """The supports of a structure that is turned by C."""
    return {group: Support(tuple(held), tuple(map(tuple, C.T))) for group, held in supports.items()}


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad")])
def test_hinges_and_slides_hold_the_same_dofs_in_any_axes(family, cell):
    mesh, C = rectangle(1.0, 0.7, 4, 3, cell), random_rotation(11)
    found = []
    for placed, supports in ((mesh, turned(HINGES, np.eye(3))), (mesh.rotated(C), turned(HINGES, C))):
        structure = build_structure(placed, [Member("surface", family, 0.02, METAL)], supports=supports)
        found.append(frequencies(structure, structure.held_dofs(supports), 6))
    np.testing.assert_allclose(found[1], found[0], rtol=3e-8)


def test_bubbles_of_a_beam_that_slides_along_itself_are_held_across():
    """A beam held in one direction all along bends in the other alone: every mode leaves the direction still."""
    C = random_rotation(12)
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 2).rotated(C)
    section = Rectangle(0.02, 0.03)
    supports = {"start": ("x", "y", "z", "rx", "ry", "rz"), "line": Support(("y", "rz", "rx"), tuple(map(tuple, C.T)))}
    structure = build_structure(mesh, [Member("line", "beam", section, METAL, {"order": 8})], supports=supports)
    modes = cantilever_modes(structure, supports, 6)
    skin = (structure.skin.operator @ modes.phi).reshape(-1, 3, 6)
    across = np.abs(np.einsum("pim,i->pm", skin, C[:, 1])).max()
    assert across < 1e-9 * np.abs(skin).max()


def test_lumped_masses_stand_on_skew_supports():
    """The lumped model turned with its supports is the same model."""
    mesh, C, found = rectangle(1.0, 0.7, 4, 3), random_rotation(13), []
    for placed, supports in ((mesh, turned(HINGES, np.eye(3))), (mesh.rotated(C), turned(HINGES, C))):
        structure = lumped(build_structure(placed, [Member("surface", "plate", 0.02, METAL)], supports=supports))
        phi = nodal_translations(structure, supports).phi
        K, M = phi.T @ structure.K @ phi, phi.T @ structure.M @ phi
        found.append(np.linalg.eigvals(np.linalg.solve(M, K)).real.min())
    assert found[1] == pytest.approx(found[0], rel=1e-7)


@pytest.mark.parametrize(
    ("family", "cell", "n", "error"), [("plate", "triangle", 16, 2e-2), ("plate_bfs", "quad", 8, 3e-3)]
)
def test_an_edge_held_in_its_place_alone_is_free_to_turn(family, cell, n, error):
    """A square plate held in x, y, z along its edges, slopes and twists left to themselves: Navier's frequencies."""
    h = 0.01
    structure = build_structure(rectangle(1.0, 1.0, n, n, cell), [Member("surface", family, h, METAL)])
    held = np.unique(np.concatenate([structure.clamped_dofs(edge, ("x", "y", "z")) for edge in EDGES]))
    rigidity = METAL.E * h**3 / 12 / (1 - METAL.nu**2)
    exact = np.pi**2 * np.sqrt(rigidity / (METAL.density * h)) * np.array([2.0, 5.0, 5.0, 8.0])
    found = frequencies(structure, held, 4, shift=float(exact[0] ** 2) / 2)
    assert found == pytest.approx(exact, rel=error)
