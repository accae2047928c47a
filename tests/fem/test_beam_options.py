"""Options of beams, each against another way to say the same or a closed form: offsets, orders, corners, notes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from support.plate_models import METAL, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.beam.corners import corner_nodes
from femflex.fem.sections import Box, CableSection, Circle, FullSection, Rectangle, Tube
from femflex.mesh import Mesh, line, rectangle
from femflex.warning import PhysicsWarning

BENT = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 3)


def beam(section, mesh=BENT, **options):
    given = {"orientation": (0.1, 0.3, 1.0), "extent": 10.0, **options}
    return build_structure(mesh, [Member("line", "beam", section, METAL, given)])


def moved_strains(y: float, z: float) -> np.ndarray:
    """(6, 6): strains at (0, y, z) of a section from those at its origin, gamma + kappa x r."""
    X = np.eye(6)
    for k, kappa in enumerate(np.eye(3)):
        X[:3, 3 + k] = np.cross(kappa, [0, y, z])
    return X


def mass_about(M: np.ndarray, y: float, z: float) -> np.ndarray:
    """The mass matrix (6, 6) of a section moved by (0, y, z), from its velocities there."""
    X = np.eye(6)
    for k, omega in enumerate(np.eye(3)):
        X[:3, 3 + k] = np.cross(omega, [0, y, z])
    return X.T @ M @ X


def same(a, b):
    """Matrices, and the energy of a large motion."""
    assert a.n_dof == b.n_dof
    np.testing.assert_allclose(a.K.toarray(), b.K.toarray(), atol=1e-11 * abs(b.K).max())
    np.testing.assert_allclose(a.M.toarray(), b.M.toarray(), atol=1e-11 * abs(b.M).max())


MASSES = np.array([[0.3, 0.02, 0.01], [0.8, -0.03, 0.02], [0.5, 0.01, -0.04]])  # kg/m at y, z


def section_mass() -> np.ndarray:
    return sum(m * mass_about(np.diag([1.0, 1, 1, 0, 0, 0]), y, z) for m, y, z in MASSES)


def section_stiffness() -> np.ndarray:
    rows = np.random.default_rng(9).normal(size=(9, 6)) * [1e3, 800.0, 700.0, 30.0, 20.0, 40.0]
    return rows.T @ rows


def test_a_full_section_off_the_nodes_is_one_with_stiffness_and_mass_about_them():
    K, M = section_stiffness(), section_mass()
    offset, centre = (0.05, -0.08), (-0.02, 0.03)
    X = moved_strains(*offset)
    known = FullSection(X.T @ K @ X, mass_about(M, offset[0] + centre[0], offset[1] + centre[1]))
    same(beam(FullSection(K, M), offset=offset, mass_centre=centre), beam(known))
    same(beam(FullSection(K, M), shear_centre=(0.3, 0.2)), beam(FullSection(K, M)))  # its matrix has it already


def test_centroid_shear_centre_and_mass_centre_of_a_shape_lie_apart():
    """EA, EI at the centroid, GJ and k G A at the shear centre, the mass at its own centre: as one 6 x 6 matrix."""
    section, offset, shear, mass = Box(0.04, 0.06, 0.005), (0.05, -0.08), (0.013, 0.021), (-0.02, 0.03)
    r = section.resultants(METAL, np.zeros(1), np.ones(1))
    axial, across = np.diag([r.EA[0], 0, 0, 0, r.EIy[0], r.EIz[0]]), np.diag([0, r.GAy[0], r.GAz[0], r.GJ[0], 0, 0])
    at, where = moved_strains(*offset), moved_strains(offset[0] + shear[0], offset[1] + shear[1])
    Iy, Iz = (0.04 * 0.06**3 - 0.03 * 0.05**3) / 12, (0.06 * 0.04**3 - 0.05 * 0.03**3) / 12
    own = METAL.density * np.diag([9e-4, 9e-4, 9e-4, Iy + Iz, Iy, Iz])
    known = FullSection(at.T @ axial @ at + where.T @ across @ where, mass_about(own, *np.add(offset, mass)))
    found = beam(section, offset=offset, shear_centre=shear, mass_centre=mass)
    same(found, beam(known))


def test_heat_and_tension_of_an_offset_beam_act_at_its_centroid():
    """Virtual work of N (eps + z kappa_y - y kappa_z): the end feels N along the beam and e x N about the node."""
    C, e = random_rotation(5), np.array([0.0, 0.04, -0.07])
    mesh = line([[0, 0, 0], [1.5, 0, 0]], 2).rotated(C)
    section = Rectangle(0.03, 0.05)
    s = beam(section, mesh, orientation=C[:, 1], offset=e[1:], prestress=700.0, thermal_strain=2e-5)
    N = C @ [700.0 - METAL.E * 0.0015 * 2e-5, 0, 0]
    end = 3 * mesh.group_points("end")[0]
    assert (s.translation @ s.f0)[end : end + 3] == pytest.approx(N, abs=1e-9)
    assert (s.rotation @ s.f0)[end : end + 3] == pytest.approx(np.cross(C @ e, N), abs=1e-9)


@pytest.mark.parametrize(
    ("orders", "component", "speed"),
    [
        ({"torsion_order": 9, "axial_order": 2}, "rx", np.sqrt(METAL.G / METAL.density)),
        ({"torsion_order": 2, "axial_order": 9}, "x", np.sqrt(METAL.E / METAL.density)),
    ],
)
def test_one_element_of_high_order_twists_and_stretches_as_waves_do(orders, component, speed):
    """A round bar between fixed ends, L = 2: k pi c / L, four of them on an element whose bends are cubic."""
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 1)
    s = beam(Tube(0.02, 0.005), mesh, orientation=(0, 1, 0), order=3, **orders)
    others = [c for c in ("x", "y", "z", "rx", "ry", "rz") if c != component]
    held = np.union1d(s.held_dofs({"start": (component,), "end": (component,)}), s.held_dofs({"line": others}))
    free = np.setdiff1d(np.arange(s.n_dof), held)
    assert len(free) == 8  # the bubbles of one field
    value = linalg.eigh(s.K[free][:, free].toarray(), s.M[free][:, free].toarray(), eigvals_only=True)
    assert np.sqrt(value[:3]) == pytest.approx(np.arange(1, 4) * np.pi / 2 * speed, rel=1e-4)


@pytest.mark.parametrize("shear", [False, True])
def test_supports_of_a_whole_beam_hold_the_bubbles_of_their_own_field(shear):
    """Three elements along x, order 5: axial order 7 has 6, torsion 4 has 3, bending 2, shear 3 in each plane."""
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 3)
    s = beam(Rectangle(0.02, 0.03), mesh, orientation=(0, 1, 0), order=5, axial_order=7, torsion_order=4, shear=shear)
    for component, count in (("x", 6), ("rx", 3), ("y", 2 + 3 * shear), ("z", 2 + 3 * shear), ("ry", 0), ("rz", 0)):
        assert len(s.held_dofs({"line": (component,)})) == 4 + 3 * count, component
    rng = np.random.default_rng(0)
    for component, k in (("x", 0), ("y", 1), ("z", 2)):
        x = rng.normal(size=s.n_dof)
        others = [c for c in ("x", "y", "z", "rx", "ry", "rz") if c != component]
        x[s.held_dofs({"line": others})] = 0.0
        axis = s.inertia[0].shapes((s.T @ x)[:, None], slice(None))[..., 0]
        axis = axis.reshape(*axis.shape[:1], -1, 4, 3).mean(axis=2)  # of the four points of each section
        assert np.abs(np.delete(axis, k, axis=2)).max() < 1e-12 * np.abs(axis[..., k]).max()


def test_places_of_strain_know_the_fibres_of_shapes_in_the_line_of_the_nodes():
    tapered = Rectangle("0.06 - 0.02 * s / L", 0.03)
    s = beam(tapered, line([[0, 0, 0], [1.0, 2.0, 2.0]], 2))
    (place,) = s.places[:1]
    arc = np.linalg.norm(place.x, axis=2)  # the line begins at the origin
    b = 0.06 - 0.02 * arc / 3.0
    expected = np.stack([1 / (0.03 * b), 6 / (0.03 * b**2), 6 / (b * 0.03**2)], axis=-1)
    assert place.fibres[..., :3] == pytest.approx(expected, rel=1e-9)
    assert place.lever == pytest.approx(np.sqrt((b**2 + 0.03**2) / 12), rel=1e-9)
    plain = beam(Circle(0.02)).places[0]
    assert plain.fibres.ravel()[3] == pytest.approx(2 / (np.pi * 0.02**3))
    for name in ("offset", "shear_centre"):
        assert beam(Circle(0.02), **{name: (0.0, 0.01)}).places[0].fibres is None
    assert beam(FullSection(section_stiffness(), section_mass())).places[0].fibres is None


def test_an_offset_section_is_drawn_around_its_centroid():
    mesh = line([[1.0, 2.0, 3.0], [3.0, 2.0, 3.0]], 2)
    skin = beam(Rectangle(0.1, 0.2), mesh, orientation=(0, 1, 0), offset=(0.3, -0.4)).skin
    assert skin.points.min(axis=0) == pytest.approx([1.0, 2.25, 2.5])
    assert skin.points.max(axis=0) == pytest.approx([3.0, 2.35, 2.7])


@pytest.mark.parametrize("offset", [None, (0.03, -0.05)])
def test_sections_know_their_second_moments_of_mass_and_their_rotation(offset):
    """rho (I_z y y + I_y z z) and m e e of an offset, in mesh axes; theta of a rigid turn and of a parabola."""
    C = random_rotation(61)
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 2).rotated(C)
    s = beam(Rectangle(0.04, 0.06), mesh, orientation=C[:, 1], offset=offset, order=4)
    (block,) = s.inertia
    m, e = METAL.density * 0.04 * 0.06, np.zeros(2) if offset is None else np.array(offset)
    local = np.zeros((3, 3))
    local[1:, 1:] = m * (np.diag([0.04**2, 0.06**2]) / 12 + np.outer(e, e))
    assert block.second.sum(axis=(0, 1)) == pytest.approx(2.0 * C @ local @ C.T, abs=1e-12)
    assert block.axis == pytest.approx(np.tile(C[:, 0], (2, 1)))
    omega = C @ [0.3, -0.7, 0.5]
    x = mesh.points @ C[:, 0]
    bent = 0.2 * x[:, None] ** 2 * C[:, 1] - 0.3 * x[:, None] ** 2 * C[:, 2]
    turned = np.outer(x, 0.4 * C[:, 2] + 0.6 * C[:, 1] + 0.9 * C[:, 0])
    for u, theta in ((np.cross(omega, mesh.points), np.tile(omega, (3, 1))), (bent, turned)):
        v = s.T @ (s.translation.T @ u.ravel() + s.rotation.T @ theta.ravel())
        found = np.einsum("eqil,el->eqi", block.turn, v[block.dofs])
        at = (block.rho.reshape(2, -1, 4, 3).mean(axis=2) @ C)[..., 0]
        expected = omega if u is not bent else at[..., None] * (0.4 * C[:, 2] + 0.6 * C[:, 1] + 0.9 * C[:, 0])
        assert found == pytest.approx(np.broadcast_to(expected, found.shape), abs=1e-9)


def two_members(second="beam"):
    points = np.array([[0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [2.0, 1.0, 0], [3.0, 1.0, 0], [1.0, -1.0, 1.0]])
    cells = np.array([[0, 1], [2, 1], [3, 2], [3, 4], [1, 5]])
    mesh = Mesh(points, {"line": cells}, {"one": {"line": [0, 1]}, "two": {"line": [3, 2]}, "prop": {"line": [4]}})
    section = Circle(0.01) if second == "beam" else CableSection(1e5, 0.1)
    return mesh, [Member("one", "beam", Circle(0.01), METAL), Member("two", "beam", Circle(0.01), METAL),
                  Member("prop", second, section, METAL)]  # fmt: skip


def test_corners_are_where_beams_meet_at_an_angle_across_members_and_nothing_else_counts():
    mesh, members = two_members("rod")
    assert corner_nodes(mesh, members).tolist() == [2, 3]
    assert corner_nodes(mesh, members[:1]).tolist() == []
    assert corner_nodes(mesh, members[1:]).tolist() == [3]
    mesh, members = two_members()
    assert corner_nodes(mesh, members).tolist() == [1, 2, 3]
    assert corner_nodes(mesh, members, least=0.999).tolist() == [1, 2, 3]
    assert corner_nodes(mesh, members, least=1.1).tolist() == []


def notes(section, mesh, **options) -> list[str]:
    given = {"extent": 10.0, **options}
    return list(build_structure(mesh, [Member("line", "beam", section, METAL, given)]).notes)


def test_axes_that_are_selected_are_reported_with_their_reason_and_direction():
    begin = "beam on group 'line' has no orientation, "
    straight = line([[0, 0, 0], [3.0, 4.0, 0]], 2)
    oblong = "EIz is 0.25 times EIy: the section's y axis is selected along (-0.8, 0.6, 0)"
    assert notes(Rectangle(0.1, 0.2), straight) == [begin + oblong]
    across = "EIz is 4 times EIy: the section's y axis is selected across the mesh's z axis, element by element"
    assert notes(Rectangle(0.2, 0.1), BENT) == [begin + across]
    assert notes(Circle(0.1), straight) == [] and notes(Rectangle(0.1, 0.2), straight, orientation=(0, 0, 1)) == []
    for name in ("offset", "shear_centre", "mass_centre"):
        (found,) = notes(Circle(0.1), straight, **{name: (0.0, 0.01)})
        assert found.startswith(begin + "its section has centres off the nodes: the section's y axis")
        assert notes(Circle(0.1), straight, **{name: (0.0, 0.0)}) == []
    (found,) = notes(FullSection(section_stiffness(), section_mass()), straight)
    assert found.startswith(begin + "its section couples stretch, shear, twist and bending: the section's y axis")


def test_an_oblong_section_on_other_cells_is_refused_as_of_other_cells():
    sheet = rectangle(1.0, 1.0, 1, 1, "quad")
    with pytest.raises(ValueError, match="group 'surface' holds quad cells; the beam family is made of line, line3"):
        build_structure(sheet, [Member("surface", "beam", Rectangle(0.1, 0.2), METAL)])


def test_upright_elements_are_counted_and_their_own_axis_is_named():
    """The mesh's y axis is taken there, not that of the level elements before."""
    mesh = line([[0, 0, 0], [0, 1.0, 0], [0, 1.0, 2.0]], 3)
    with pytest.warns(PhysicsWarning) as given:
        assert notes(Rectangle(0.1, 0.2), mesh) == []
    n = int((np.ptp(mesh.points[mesh.cells["line"]], axis=1)[:, 2] > 0).sum())
    text = f"{n} of its 3 elements run along the mesh's z axis: the section's y axis is selected along (0, 1, 0) there"
    assert text in str(given[0].message)


def test_stoutness_is_judged_by_the_larger_radius_and_the_extent_that_is_given():
    """Radius b / sqrt(12) in either direction, 20 of them against the length."""
    mesh = line([[0, 0, 0], [3.0, 0, 0]], 2)
    for section in (Rectangle(0.6, 0.1), Rectangle(0.1, 0.6)):
        with pytest.warns(PhysicsWarning, match=r"with a radius of gyration of 0\.1732 m; below 20 radii \(3\.464 m\)"):
            beam(section, mesh, extent=None, orientation=(0, 1, 0))
        with pytest.warns(PhysicsWarning, match=r"'line' extends over 2\.5 m with"):
            beam(section, mesh, extent=2.5, orientation=(0, 1, 0))
        beam(section, mesh, extent=3.5, orientation=(0, 1, 0))


def test_curved_cells_of_three_nodes_are_warned_of_by_the_length_that_their_chords_lack():
    """An arc over the angle a in n cells: two chords a / 2 n each, longer by (a / 4 n) / sin(a / 4 n)."""
    arcs = {n: line(lambda s: [np.cos(np.pi * s / 2), np.sin(np.pi * s / 2), 0], n, "line3") for n in (1, 2, 3)}
    section = Rectangle(0.01, 0.02)
    for n in (1, 2):
        angle = np.pi / 8 / n
        with pytest.warns(PhysicsWarning, match=f"they are {angle / np.sin(angle) - 1:.1%} shorter than the arcs"):
            beam(section, arcs[n], orientation=(0, 0, 1))
    beam(section, arcs[3], orientation=(0, 0, 1))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"far_bends": 2}, "has far_bends 2; give true or false, or leave it out"),
        ({"shear": "yes"}, "has shear 'yes'; give true or false, or leave it out"),
        ({"shear_centre": (1.0, np.nan)}, "has shear_centre (1.0, nan); give y and z, two lengths"),
        ({"mass_centre": (1.0, 2.0, 3.0)}, "has mass_centre (1.0, 2.0, 3.0); give y and z, two lengths"),
        ({"thermal_strain": np.inf}, "has thermal_strain inf; give one finite number"),
        ({"orientation": (0.0, np.nan, 1.0)}, "has orientation [0.0, nan, 1.0]; give three components, not all zero"),
    ],
)
def test_values_that_a_beam_cannot_use_are_named(options, said):
    with pytest.raises(ValueError) as refusal:
        beam(Circle(0.01), **options)
    assert str(refusal.value) == f"beam on group 'line' {said}"


@pytest.mark.parametrize("option", ["offset", "shear_centre"])
def test_beams_with_centres_apart_shear_and_others_do_not(option: str):
    section = Rectangle(0.3, 0.2)
    stiffness = {
        (apart, shear): beam(section, shear=shear, **({option: (0.05, 0.02)} if apart else {})).K.toarray()
        for apart, shear in ((True, None), (True, True), (False, None), (False, True), (False, False))
    }
    assert np.array_equal(stiffness[True, None], stiffness[True, True])
    assert np.array_equal(stiffness[False, None], stiffness[False, False])
    assert stiffness[False, None].shape != stiffness[False, True].shape  # shear has dofs of its own
