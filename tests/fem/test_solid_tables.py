"""Warnings, refusals and initial stress of solids, and what raising their cells leaves alone."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.element_meshes import brick
from support.plate_models import METAL, random_rotation

from femflex.fem import Anisotropic, Material, Member, Orthotropic, build_structure
from femflex.fem.solid.elastic import elasticity
from femflex.fem.solid.locking import warn_of_curved, warn_of_first_order
from femflex.mesh import Mesh, box
from femflex.mesh.cells import CELL_TYPES
from femflex.warning import PhysicsWarning

FIBRE = Orthotropic(140e9, 10e9, 9e9, 5e9, 4.5e9, 3.5e9, 0.3, 0.28, 0.4, 1600.0)


def general() -> Anisotropic:
    rows = np.random.default_rng(3).normal(size=(9, 6)) * 1e5
    return Anisotropic(rows.T @ rows, 1600.0)


@pytest.mark.parametrize("material", [general(), FIBRE, Material(70e9, 0.3, 1.0, 20e9)])
def test_a_turned_material_answers_as_its_tensor_does(material):
    """c_ijkl of its own axes by the definition of engineering strains, turned index by index."""
    A = random_rotation(14)
    pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    own = elasticity(material)
    if isinstance(material, Material):
        assert own == pytest.approx(elasticity(material, A))  # its own axes are those of the mesh
        mu, lam = 70e9 / 2.6, 70e9 * 0.3 / 1.3 / 0.4
        assert np.diag(own) == pytest.approx([lam + 2 * mu] * 3 + [20e9] * 3) and own[0, 1] == pytest.approx(lam)
        return
    c = np.zeros((3, 3, 3, 3))
    for I, (i, j) in enumerate(pairs):
        for J, (k, l) in enumerate(pairs):
            for a, b in {(i, j), (j, i)}:
                for d, e in {(k, l), (l, k)}:
                    c[a, b, d, e] = own[I, J]
    turned = np.einsum("ia,jb,kc,ld,ijkl->abcd", A, A, A, A, c)
    expected = np.array([[turned[i, j, k, l] for k, l in pairs] for i, j in pairs])
    np.testing.assert_allclose(elasticity(material, A), expected, atol=1e-10 * expected.max())


@pytest.mark.parametrize("cell", ["tetra10", "hexahedron20", "wedge15", "pyramid13"])
def test_stress_and_heat_of_a_skew_material_pull_as_their_tensor(cell):
    """Virtual work of f0 on a gradient H is sigma : H times the volume, sigma less what free strain would need."""
    A, sigma = random_rotation(15), np.array([3e5, -1e5, 2e5, 4e4, -6e4, 8e4])
    options = {"axes": [*A[0], *(A[1] + 0.3 * A[0])], "prestress": sigma, "thermal_strain": 2e-6}
    s = build_structure(brick(cell, (1, 1, 1)), [Member("volume", "solid", material=FIBRE, options=options)])
    own = np.diag([1.0, 1, 1]) * 2e-6  # the same in all axes
    heat = elasticity(FIBRE) @ np.array([*np.diag(own), 0, 0, 0])
    tensor = A.T @ np.array([[heat[0], heat[5], heat[4]], [heat[5], heat[1], heat[3]], [heat[4], heat[3], heat[2]]]) @ A
    xx, yy, zz, yz, xz, xy = sigma
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - tensor
    volume = sum(block.weight.sum() for block in s.strain)
    for k in range(9):
        H = np.zeros(9)
        H[k] = 1.0
        H = H.reshape(3, 3)
        x = s.translation.T @ (s.mesh.points @ H.T).ravel()
        assert s.f0 @ x == pytest.approx(volume * np.sum(tensor * H), abs=1e-8 * np.abs(tensor).max())


def said(function, *args) -> str:
    with pytest.warns(PhysicsWarning) as given:
        function(*args)
    assert len(given) == 1
    return str(given[0].message)


def silent(function, *args):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        function(*args)


@pytest.mark.parametrize(("material", "nu"), [(Material(1e9, 0.2, 1.0), 0.2), (FIBRE, 0.3)])
def test_first_order_cells_are_told_with_the_slenderest_of_them(material, nu):
    """Bricks of 2 x 1 x 0.5 and of 3 x 1 x 1: four times as long as thick, 1 + (1 - nu) / 2 * 16."""
    unit = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    x = np.stack([unit * [3.0, 1.0, 1.0], unit * [2.0, 1.0, 0.5], 10 * unit])
    text = said(warn_of_first_order, "hexahedron", x, material, "g")
    assert text.startswith(
        "solid on group 'g' uses 3 hexahedron cells of first order, up to 4 times as long as thick: one layer of them "
        f"bends up to {1 + (1 - nu) / 2 * 16:.3g} times too stiffly (1 is right)"
    )


def layer(rises, cell="hexahedron20", h=0.1, across=2):
    """Bricks 2 x 1 x h, thin along one axis, whose long edges rise by these parts of h over their chords."""
    mesh = box(2.0, 1.0, h, 1, 1, 1, cell)
    x = np.repeat(mesh.points[mesh.cells[cell]], len(rises), axis=0)
    x[..., 2] += np.array(rises)[:, None] * h * (1 - (x[..., 0] - 1) ** 2)
    return np.roll(x, across - 2, axis=2)


@pytest.mark.parametrize("across", [2, 0])
def test_thin_curved_layers_are_told_with_the_median_rise_over_the_thickness(across):
    text = said(warn_of_curved, "hexahedron20", layer([0.0, 0.02, 0.1, 0.3, 0.4], across=across), "g")
    assert text.startswith(
        "solid on group 'g' is a thin curved layer of hexahedron20 cells: their edges rise by 0.3 of the "
        "thickness over their chords, so deflections in bending are about 30% too small (limit 5%); give "
        "integration = 'reduced', take"
    )
    text = said(warn_of_curved, "hexahedron27", layer([1.5, 1.5], "hexahedron27"), "g")
    assert "rise by 1.5 of the thickness" in text and "about 90% too small" in text
    assert "(limit 5%); take family shell" in text
    silent(warn_of_curved, "hexahedron20", layer([0.04] * 3, across=across), "g")
    silent(warn_of_curved, "hexahedron20", layer([0.0] * 9 + [0.3], across=across), "g")  # a fillet
    silent(warn_of_curved, "hexahedron20", layer([0.3], h=0.6, across=across), "g")  # thick


def test_cells_of_other_members_are_not_raised_with_those_of_solids():
    """Two shells on two faces of a block keep their four-node cells; other boundaries are raised."""
    mesh = box(1.0, 0.5, 0.2, 2, 1, 1, "hexahedron")
    members = [Member("volume", "solid", material=METAL)]
    members += [Member(face, "shell", 0.001, METAL) for face in ("top", "left")]
    s = build_structure(mesh, members)
    kept = {group: sorted(s.mesh.group_cells(group)) for group in ("top", "left", "right", "bottom")}
    assert kept["top"] == kept["left"] == ["quad"]
    assert "quad" not in kept["right"] and "quad" not in kept["bottom"]
    new = len(s.mesh.points) - len(mesh.points)
    assert s.notes[0] == (
        f"solid cells of first order are raised to second order (2 hexahedron to hexahedron20; {new} nodes are new); "
        "order = 1 keeps them"
    )


def words(mesh, material=METAL, section=None, **options) -> str:
    with pytest.raises(ValueError) as refusal:
        build_structure(mesh, [Member("volume", "solid", section, material, options)])
    return str(refusal.value)


def test_refused_solids_name_what_is_wrong_and_where():
    mesh = box(3.0, 1.0, 1.0, 3, 1, 1, "hexahedron20")
    assert words(mesh, None) == "solid on group 'volume' has no material; give one for solids"
    assert words(mesh, 5.0) == "solid on group 'volume' has 5.0; give one for solids"
    assert words(mesh, METAL, 0.1) == "solid on group 'volume' has a section; a solid has none, its mesh is the shape"
    assert words(mesh, order=3).startswith("solid on group 'volume' has order 3; give 2 (cells of first order are")
    assert words(mesh, integration="half").startswith("solid on group 'volume' has integration 'half'; give 'reduced'")
    assert words(mesh, thermal_strain=np.nan).startswith("prestress of a solid is None and thermal_strain nan; give")
    assert words(mesh, axes=[1.0, 0, 0, 0, 0, 0]) == (
        "solid on group 'volume' has axes [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], whose directions are parallel or zero; give "
        "two that differ"
    )
    cells = mesh.cells["hexahedron20"].copy()
    swapped = cells.copy()
    swapped[1:, [8, 13]] = swapped[1:, [13, 8]]
    said = words(Mesh(mesh.points, {"hexahedron20": swapped}, {"volume": {"hexahedron20": np.arange(3)}}))
    assert said == (
        "solid on group 'volume': node 8 of 2 of 3 hexahedron20 elements (first element 1) lies far from the middle of "
        "its corners; the nodes must be in VTK's order"
    )
    points = mesh.points.copy()
    corner = cells[2, 6]
    points[corner] = points[cells[2]].mean(axis=0) - 0.2
    said = words(Mesh(points, {"hexahedron20": cells}, {"volume": {"hexahedron20": np.arange(3)}}))
    at = ", ".join(f"{c:.6g}" for c in points[cells[2]].mean(axis=0))
    inside_out = rf"solid on group 'volume': \d of 3 hexahedron20 elements are turned .* \(element 2 at \({at}\) m has"
    assert "lies far from the middle" in said or re.match(inside_out, said)


def test_one_stray_node_far_from_a_short_edge_is_judged_by_that_edge():
    """A node in the middle of a short edge that lies as far off as the edge is long."""
    mesh = box(2.0, 1.0, 0.1, 1, 1, 1, "hexahedron20")
    low, high = (mesh.nearest_point([0, 0, z]) for z in (0, 0.1))
    middle = mesh.nearest_point([0, 0, 0.05])
    points = mesh.points.copy()
    points[middle] += [0.04, 0.0, 0.0]
    cells = mesh.cells["hexahedron20"]
    assert {low, high} <= set(cells[0])
    said = words(Mesh(points, {"hexahedron20": cells}, {"volume": {"hexahedron20": [0]}}))
    assert "of 1 of 1 hexahedron20 elements (first element 0) lies far from the middle of its corners" in said


def test_places_of_solids_are_those_of_their_points_of_strain():
    """Volume-weighted: the centre of a skew block, and its second moments."""
    s = build_structure(brick("hexahedron20", (2, 1, 1), (2.0, 1.0, 0.5)), [Member("volume", "solid", material=METAL)])
    x, w = s.places[0].x, s.strain[0].weight
    assert s.places[0].kind == "solid" and w.sum() == pytest.approx(1.0)
    assert np.einsum("eq,eqi->i", w, x) == pytest.approx([1.0, 0.5, 0.25])
    assert np.einsum("eq,eqi,eqj->ij", w, x, x) == pytest.approx(
        np.array([[4 / 3, 0.5, 0.25], [0.5, 1 / 3, 0.125], [0.25, 0.125, 1 / 12]])
    )


def test_reduced_points_of_strain_are_those_of_cells_of_twenty_nodes_alone():
    for cell, points in (("hexahedron20", 8), ("hexahedron27", 27)):
        mesh = box(1.0, 1.0, 1.0, 2, 1, 1, cell)
        s = build_structure(mesh, [Member("volume", "solid", material=METAL, options={"integration": "reduced"})])
        assert s.strain[0].weight.shape == (2, points)
    s = build_structure(box(1.0, 1.0, 1.0, 1, 1, 1, "hexahedron20"), [Member("volume", "solid", material=METAL)])
    assert s.strain[0].weight.shape == (1, 27)


def unit_rule(shape: str) -> tuple[np.ndarray, np.ndarray]:
    """Seven Gauss points each way on the unit cell; of triangles and tetrahedra by collapsed sides."""
    g, w = np.polynomial.legendre.leggauss(7)
    g, w = (g + 1) / 2, w / 2
    r, s, t = (a.ravel() for a in np.meshgrid(g, g, g, indexing="ij"))
    weight = np.einsum("i,j,k->ijk", w, w, w).ravel()
    if shape == "hexahedron":
        return np.stack([r, s, t], axis=1), weight
    if shape == "wedge":
        return np.stack([r, s * (1 - r), t], axis=1), weight * (1 - r)
    return np.stack([r, s * (1 - r), t * (1 - r) * (1 - s)], axis=1), weight * (1 - r) ** 2 * (1 - s)


@pytest.mark.parametrize(
    "cell", ["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge", "wedge15", "wedge18"]
)
@pytest.mark.filterwarnings("ignore:solid on group .* cells of first order")
def test_mass_and_stiffness_of_skew_cells_are_their_integrals(cell):
    """Of random motions of an affine cell, against an integration of far higher degree."""
    kind = CELL_TYPES[cell]
    A = np.array([[1.0, 0.2, 0.1], [-0.3, 0.8, 0.2], [0.1, -0.2, 0.6]])
    mesh = Mesh(kind.nodes @ A, {cell: [np.arange(len(kind.nodes))]}, {"volume": {cell: [0]}})
    s = build_structure(mesh, [Member("volume", "solid", material=FIBRE, options={"order": 1})])
    u = np.random.default_rng(1).normal(size=(len(kind.nodes), 3))
    points, weight = unit_rule(kind.shape)
    weight = weight * np.linalg.det(A)
    value = kind.interpolation(points) @ u
    H = np.einsum("qka,ki->qia", kind.gradients(points), u) @ np.linalg.inv(A).T
    e = (H + H.swapaxes(1, 2)) / 2
    eps = np.stack([e[:, 0, 0], e[:, 1, 1], e[:, 2, 2], 2 * e[:, 1, 2], 2 * e[:, 0, 2], 2 * e[:, 0, 1]], axis=1)
    x = s.translation.T @ u.ravel()
    assert x @ s.M @ x == pytest.approx(1600 * weight @ np.sum(value**2, axis=1), rel=1e-10)
    assert x @ s.K @ x == pytest.approx(np.einsum("q,qi,ij,qj->", weight, eps, FIBRE.elasticity(), eps), rel=1e-10)
