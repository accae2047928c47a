"""Beams that shear, with offset centres, full stiffness and released ends, against closed forms and rigid arms."""

from __future__ import annotations

import numpy as np
import pytest
from support.closed_forms import static_solution, timoshenko_cantilever
from support.plate_models import METAL, frequencies

from femflex.fem import Member, build_structure
from femflex.fem.sections import Box, FullSection, GivenSection, Rectangle, StiffnessSection, Tube
from femflex.mesh import Mesh, line
from femflex.reduction import cantilever_modes, relaxed

L = 1.0


def bar(n: int = 4, end=(L, 0, 0)) -> Mesh:
    return line(np.array([[0, 0, 0], end], float), n)


def beam(section, material=METAL, n=4, **options):
    return build_structure(bar(n), [Member("line", "beam", section, material, options)])


def tip(structure, force=(0, 0, 0), moment=(0, 0, 0), group="end", held="start"):
    """Displacement and rotation (3,) of the end under a force and a moment there."""
    node = structure.mesh.group_points(group)[0]
    F, M = np.zeros((2, len(structure.mesh.points), 3))
    F[node], M[node] = force, moment
    f = structure.translation.T @ F.ravel() + structure.rotation.T @ M.ravel()
    x = static_solution(structure, f, structure.clamped_dofs(held))
    return ((A @ x).reshape(-1, 3)[node] for A in (structure.translation, structure.rotation))


@pytest.mark.parametrize(("order", "n"), [(3, 1), (3, 4), (5, 1)])
def test_short_beam_under_end_force_matches_timoshenko(order, n):
    """w = F L^3 / 3 EI + F L / k G A, rotation F L^2 / 2 EI: exact with one element."""
    section = Rectangle(0.3, 0.4)
    s = beam(section, n=n, shear=True, order=order)
    u, turn = tip(s, force=(0, 0, 1.0))
    EI, kGA = 70e9 * 0.3 * 0.4**3 / 12, 10 * 1.3 / (12 + 3.3) * METAL.G * 0.12
    assert u[2] == pytest.approx(L**3 / 3 / EI + L / kGA, rel=1e-10)
    assert turn[1] == pytest.approx(-(L**2) / 2 / EI, rel=1e-10)


def test_thick_beam_frequencies_match_timoshenko():
    section = StiffnessSection(
        EA=1e6, EIy=1e6 / 12, EIz=1e6 / 12, GJ=1e5, mass_per_length=1.0, GAy=5 / 6 * 0.5e6, GAz=5 / 6 * 0.5e6
    )
    s = build_structure(bar(6, (5.0, 0, 0)), [Member("line", "beam", section, None, {"shear": True, "order": 4})])
    exact = timoshenko_cantilever(5.0, 1e6 / 12, 5 / 6 * 0.5e6, 1.0, 1 / 12)
    computed = frequencies(s, s.clamped_dofs("start"), 2)
    assert computed[0] == pytest.approx(exact, rel=1e-6)


def test_offset_centroid_under_axial_force():
    """N at the node line is N and M = N e at the centroid: w = N e L^2 / 2 EI, u = N L / EA + N e^2 L / EI."""
    e = 0.05
    s = beam(Rectangle(0.02, 0.03), offset=(0.0, e), order=3)
    u, turn = tip(s, force=(1.0, 0, 0))
    EA, EI = 70e9 * 6e-4, 70e9 * 0.02 * 0.03**3 / 12
    assert u[0] == pytest.approx(L / EA + e * e * L / EI, rel=1e-9)
    assert abs(u[2]) == pytest.approx(e * L**2 / 2 / EI, rel=1e-9)
    # stretched along a line above which the centroid lies, the bar bends away from the centroid
    assert turn[1] < 0 and u[2] > 0


def test_offset_shear_centre_under_transverse_force():
    """F at the node line twists about the shear centre by F e L / GJ; a force through it would not."""
    e = 0.01
    s = beam(GivenSection(A=6e-4, Iy=4.5e-8, Iz=2e-8, J=3e-8), shear_centre=(e, 0.0))
    _, turn = tip(s, force=(0, 0, 1.0))
    GJ = METAL.G * 3e-8
    assert turn[0] == pytest.approx(-e * L / GJ, rel=1e-9)
    _, turn = tip(s, force=(0, 0, 1.0), moment=(e, 0, 0))
    assert abs(turn[0]) < 1e-9 * e * L / GJ


def on_arms(section, e, **options):
    """A beam aside of the nodes of `bar` by e (3,), each of its nodes joined to one of them by a rigid arm."""
    from femflex.fem import Rigid

    base = bar()
    n = len(base.points)
    mesh = Mesh(np.concatenate([base.points + e, base.points]), base.cells, base.cell_groups)
    groups = {f"a{k}": [k] for k in range(n)} | {f"b{k}": [n + k] for k in range(n)}
    ends = {name: base.group_points(name) for name in ("start", "end")}
    mesh = mesh.with_groups(points={**groups, **ends})
    member = Member("line", "beam", section, METAL, {"shear": True, **options})
    return build_structure(mesh, [member], connections=[Rigid(f"b{k}", f"a{k}") for k in range(n)])


def test_offset_section_equals_beam_on_rigid_arms():
    """All of a section moved aside: the same frequencies as a beam there, joined to the node line by rigid arms."""
    e, tube = np.array([0.0, 0.1, 0.05]), Tube(0.03, 0.002)
    moved = beam(tube, n=4, offset=(e[1], e[2]), order=7)
    arms = on_arms(tube, e, order=7)
    computed = [frequencies(s, s.clamped_dofs("start"), 5) for s in (moved, arms)]
    np.testing.assert_allclose(computed[0], computed[1], rtol=1e-8)
    total = moved.translation.T @ np.tile([0, 0, 1.0], len(moved.mesh.points))
    assert total @ moved.M @ total == pytest.approx(np.pi * (0.03**2 - 0.028**2) * 2700.0, rel=1e-9)


def test_prestress_of_an_offset_section_acts_at_its_centroid():
    """Left alone it relaxes without a trace; what it leaves unbalanced is that of the beam on arms."""
    e, tube = np.array([0.0, 0.1, 0.05]), Tube(0.03, 0.002)
    moved, arms = (
        beam(tube, offset=(e[1], e[2]), prestress=500.0, order=5),
        on_arms(tube, e, prestress=500.0, order=5),
    )
    end = moved.mesh.group_points("end")[0]
    force = moved.translation @ moved.f0
    turn = moved.rotation @ moved.f0
    np.testing.assert_allclose(force.reshape(-1, 3)[end], [500.0, 0, 0], atol=1e-6)
    np.testing.assert_allclose(turn.reshape(-1, 3)[end], np.cross(e, [500.0, 0, 0]), atol=1e-6)
    free = relaxed(moved, ["start"])
    assert not free.stressed or abs(free.f0).max() < 1e-6
    computed = [cantilever_modes(relaxed(s, ["start"]), ["start"], 3).omega for s in (moved, arms)]
    np.testing.assert_allclose(computed[0], computed[1], rtol=1e-6)


def coupled() -> np.ndarray:
    K = np.diag([3.7e6, 2.6e5, 2.4e5, 1.7e4, 5.0e4, 2.6e5])
    K[3, 4] = K[4, 3] = -1.76e4 * 0.5
    K[0, 3] = K[3, 0] = 2e4
    return K


def mass_of(m=2.0, y=0.01, z=-0.02, yy=3e-4, zz=9e-4, yz=1e-4) -> np.ndarray:
    M = np.diag([m, m, m, m * (yy + zz), m * zz, m * yy])
    M[0, 4] = M[4, 0] = m * z
    M[0, 5] = M[5, 0] = -m * y
    M[1, 3] = M[3, 1] = -m * z
    M[2, 3] = M[3, 2] = m * y
    M[4, 5] = M[5, 4] = -m * yz
    return M


def test_full_stiffness_matches_its_flexibility():
    """End loads F, M: strains e = S (forces along the beam), tip motion by integration; exact."""
    s = build_structure(bar(2), [Member("line", "beam", FullSection(coupled(), mass_of()))])
    S = np.linalg.inv(coupled())
    force, moment = np.array([3.0, -2.0, 5.0]), np.array([0.3, 0.4, -0.2])
    u, turn = tip(s, force, moment)
    x, w = np.polynomial.legendre.leggauss(6)
    x, w = (x + 1) / 2, w / 2
    u0, t0 = np.zeros(3), np.zeros(3)
    for at, weight in zip(x, w, strict=True):
        local = moment + np.cross([L - at, 0, 0], force)
        e = S @ np.concatenate([force, local])
        t0 += weight * e[3:]
        u0 += weight * (e[:3] + np.cross(e[3:], [L - at, 0, 0]))
    np.testing.assert_allclose(turn, t0, rtol=1e-8, atol=1e-8 * np.abs(t0).max())
    np.testing.assert_allclose(u, u0, rtol=1e-8, atol=1e-8 * np.abs(u0).max())


def test_hinge_carries_no_moment():
    """Two bars clamped at both ends with a hinge in the middle: a force there bends two cantilevers, F L^3 / 24 EI."""
    mesh = bar(2)
    middle = mesh.nearest_point([0.5, 0, 0])
    groups = {"middle": [middle], "ends": np.concatenate([mesh.group_points("start"), mesh.group_points("end")])}
    first = mesh.cells["line"][:, 0].argmin()
    mesh = mesh.with_groups({"one": {"line": [first]}, "two": {"line": [1 - first]}}, groups)
    section = Rectangle(0.02, 0.02)
    members = [
        Member("one", "beam", section, METAL, {"release": ["rx", "ry", "rz"], "release_at": "middle", "extent": L}),
        Member("two", "beam", section, METAL, {"extent": L}),
    ]
    s = build_structure(mesh, members)
    u, _ = tip(s, (0, 0, 1.0), group="middle", held="ends")
    EI = 70e9 * 0.02**4 / 12
    assert u[2] == pytest.approx(0.5**3 / 3 / EI / 2, rel=1e-9)
    structure = build_structure(mesh, [Member("line", "beam", section, METAL)])
    u, _ = tip(structure, (0, 0, 1.0), group="middle", held="ends")
    assert u[2] == pytest.approx(1.0 / 192 / EI, rel=1e-9)


BENT = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 3)


def beam_beam_options(section, mesh=BENT, **options):
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


def assert_equal_structures(a, b):
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


def test_offset_full_section_equals_shifted_matrices():
    K, M = section_stiffness(), section_mass()
    offset, centre = (0.05, -0.08), (-0.02, 0.03)
    X = moved_strains(*offset)
    reference = FullSection(X.T @ K @ X, mass_about(M, offset[0] + centre[0], offset[1] + centre[1]))
    assert_equal_structures(
        beam_beam_options(FullSection(K, M), offset=offset, mass_centre=centre), beam_beam_options(reference)
    )
    assert_equal_structures(
        beam_beam_options(FullSection(K, M), shear_centre=(0.3, 0.2)), beam_beam_options(FullSection(K, M))
    )  # its matrix has it already


def test_shape_with_separate_centres():
    """EA, EI at the centroid, GJ and k G A at the shear centre, the mass at its own centre: as one 6 x 6 matrix."""
    section, offset, shear, mass = Box(0.04, 0.06, 0.005), (0.05, -0.08), (0.013, 0.021), (-0.02, 0.03)
    r = section.resultants(METAL, np.zeros(1), np.ones(1))
    axial, across = np.diag([r.EA[0], 0, 0, 0, r.EIy[0], r.EIz[0]]), np.diag([0, r.GAy[0], r.GAz[0], r.GJ[0], 0, 0])
    at, where = moved_strains(*offset), moved_strains(offset[0] + shear[0], offset[1] + shear[1])
    Iy, Iz = (0.04 * 0.06**3 - 0.03 * 0.05**3) / 12, (0.06 * 0.04**3 - 0.05 * 0.03**3) / 12
    own = METAL.density * np.diag([9e-4, 9e-4, 9e-4, Iy + Iz, Iy, Iz])
    reference = FullSection(at.T @ axial @ at + where.T @ across @ where, mass_about(own, *np.add(offset, mass)))
    computed = beam_beam_options(section, offset=offset, shear_centre=shear, mass_centre=mass)
    assert_equal_structures(computed, beam_beam_options(reference))
