"""Terms of second and higher order against finite motions: turned sections, held shapes, sections and their stress."""

from __future__ import annotations

import numpy as np
import pytest
from support.reduction_examples import ALUMINIUM, bent_boom, frame
from test_walked_trusses import energy, of_free, slopes, truss  # noqa: F401

from femflex.fem import Material, Member, PointMass, build_structure
from femflex.fem.sections import Rectangle
from femflex.fem.sections.laminates import orthotropic
from femflex.mesh import Mesh, line, rectangle
from femflex.reduction import (
    BeamFunctions,
    Preload,
    UniformBeam,
    beam_body,
    cantilever_modes,
    hardening,
    least_stiffness_ratio,
    mesh_rise,
    static_equilibrium,
)
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.inertia.orders import membrane_energies
from femflex.reduction.large_deflection.curvature import held_energy
from femflex.reduction.reduce import section_axis
from femflex.reduction.strain.folded_beams import beam_slenderness
from femflex.reduction.strain.initial_stress import largest_strain, stress_energy
from femflex.reduction.strain.turned_sections import Sections, second_order
from femflex.rotations import dcm_from_vector


def test_points_of_sections_turn_along_circles_to_second_order():
    """The even part of int o (exp(psi) o)^T dm over random sections, psi = s - (e.s) e x s / 2."""
    rng = np.random.default_rng(5)
    A = rng.normal(size=(3, 3, 3))
    Q, e = A @ A.swapaxes(1, 2), rng.normal(size=(3, 3))
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    turn = rng.normal(size=(3, 3, 4))
    S = second_order(Sections(Q, e, turn))
    np.testing.assert_allclose(S, S.swapaxes(2, 3))

    def moved(d):
        total = np.zeros((3, 3))
        for p in range(3):
            s = turn[p] @ d
            psi = s - (e[p] @ s) * np.cross(e[p], s) / 2
            total += Q[p] @ (dcm_from_vector(psi) - np.eye(3)).T
        return total

    for d in rng.normal(size=(4, 4)):
        d *= 1e-3
        even = (moved(d) + moved(-d)) / 2
        np.testing.assert_allclose(
            np.einsum("ijkl,k,l->ij", S, d, d) / 2, even, rtol=1e-4, atol=1e-4 * np.abs(even).max()
        )


@pytest.mark.parametrize("rotary", [True, False])
def test_a_twisted_bar_has_the_second_moments_of_its_turned_sections(rotary):
    """int rho r^T dm with arms that shorten by cos theta, of a flat section in skew axes."""
    way, near = np.array([2.0, 1.0, -2.0]) / 3, np.array([0.0, 1.0, 0.3])
    beam = UniformBeam(2.0, EA=1e5, EIy=30.0, EIz=50.0, GJ=2.0, mass_per_length=0.8, ry=0.02, rz=0.11, direction=way,
                       orientation=near, rotary_inertia=rotary)  # fmt: skip
    functions = BeamFunctions(torsion=2, axial=2)
    body = beam_body(beam, functions, orthonormal=False, strain="nonlinear")
    x, w = np.polynomial.legendre.leggauss(30)
    x, w = (x + 1) / 2, w * 0.8 * 2.0 / 2
    F = beam.frame
    Qz, Qy = (0.11**2, 0.02**2) if rotary else [(0.11**2 + 0.02**2) / 2] * 2
    along = 0.0 if rotary else -(0.11**2 + 0.02**2) / 2
    Q = F.T @ np.diag([along, Qz, Qy]) @ F
    d = np.zeros(body.n_modes)
    d[2:4] = [0.02, -0.03]
    changes = []
    for sign in (1.0, -1.0):
        y = np.concatenate([[1.0], body.amplitudes(sign * d)])
        changes.append(np.einsum("aBb,B->ab", body.moments.second[0], y) - body.moments.second[0, :, 0])
    theta = functions.fields(x, 2.0)[:, 3] @ d[: functions.own] / np.sqrt(0.8 * 2.0)
    exact = sum(wk * Q @ (dcm_from_vector(t * F[0]) - np.eye(3)).T for wk, t in zip(w, theta, strict=True))
    back = sum(wk * Q @ (dcm_from_vector(-t * F[0]) - np.eye(3)).T for wk, t in zip(w, theta, strict=True))
    even, own = (exact + back) / 2, (changes[0] + changes[1]) / 2
    across = F[1:]  # what stretch does along the bar is another matter
    np.testing.assert_allclose(across @ own @ across.T, across @ even @ across.T, rtol=2e-3, atol=1e-9)
    odd, own_odd = (exact - back) / 2, (changes[0] - changes[1]) / 2
    np.testing.assert_allclose(across @ own_odd @ across.T, across @ odd @ across.T, rtol=2e-3, atol=1e-9)


def test_the_energy_of_a_held_shape_is_that_of_the_relaxed_truss(truss):  # noqa: F811
    """V = k q^2 / 2 + c q^3 + e q^4 with the rest relaxed, K-orthogonal to the shape: written energy, minimised."""
    structure, modes, _ = truss
    dofs = np.array([structure.translation[[row]].toarray()[0].argmax() for row in (3, 5, 11)])
    K = slopes(np.zeros(3))[1]
    static = np.zeros(structure.n_dof)
    static[dofs] = np.linalg.solve(K, [0.2, -1.0, 0.3])
    shapes = np.column_stack([modes.phi[:, 0] / np.abs(modes.phi).max(), static / np.abs(static).max()])
    k, c, e = held_energy(structure, modes, shapes)
    for column in range(2):
        phi = shapes[dofs, column]
        rest = np.linalg.svd((K @ phi)[None])[2][1:].T
        amounts, values = np.array([-3, -2, -1, 1, 2, 3]) * 2e-3, []
        for q in amounts:
            at = np.zeros(2)
            for _ in range(5):
                g, H = slopes(q * phi + rest @ at)
                at -= np.linalg.solve(rest.T @ H @ rest, rest.T @ g)
            values.append(energy(of_free(q * phi + rest @ at)))
        fit = np.linalg.lstsq(np.stack([amounts**p for p in range(2, 7)], axis=1), values, rcond=1e-30)[0]
        assert k[column] == pytest.approx(2 * fit[0], rel=1e-6)
        assert c[column] == pytest.approx(fit[1], rel=1e-4, abs=1e-6 * k[column])
        assert e[column] == pytest.approx(fit[2], rel=2e-2)
    # tangent stiffness k + 6 c q + 12 e q^2 over a reach of a tenth of the size
    size = np.linalg.norm(np.ptp(structure.mesh.points, axis=0))
    k, c, e = held_energy(structure, modes, modes.phi[:, :1])
    q = np.linspace(-1, 1, 401) * 0.1 * size / np.abs(structure.translation @ modes.phi[:, 0]).max()
    own = ((k + 6 * c * q + 12 * e * q**2) / k).min()
    found = least_stiffness_ratio(structure, modes)
    assert found <= own + 1e-9 and found < 1.0
    moved = np.linalg.norm((structure.translation @ modes.phi[:, 0]).reshape(-1, 3), axis=1).max()
    assert hardening(structure, modes) == pytest.approx(max(4 * e[0] / k[0] / moved**2, 0.0), rel=1e-9)


def test_a_mesh_rises_by_its_least_extent_that_is_any():
    for points, rise in (
        ([[0, 0, 0], [1.0, 0.5, 0.2]], 0.0),
        ([[0, 0, 0], [3.0, 0, 0], [3.0, 0.4, 0]], None),
    ):
        found = mesh_rise(build_structure(line(points, 4), [Member("line", "beam", Rectangle(0.02, 0.03), ALUMINIUM)]))
        if rise is not None:
            assert found == rise
        else:
            assert 0.2 < found < 0.45
    points = frame(n=2).mesh.points
    spans = np.ptp((points - points.mean(axis=0)) @ np.linalg.svd(points - points.mean(axis=0))[2].T, axis=0)
    assert mesh_rise(frame(n=2)) == pytest.approx(spans[spans > 1e-9].min())


def test_slenderness_is_the_length_of_all_beams_over_the_least_radius_of_gyration():
    mesh = line([[0, 0, 0], [3.0, 0, 0], [3.0, 2.0, 0]], 5)
    structure = build_structure(mesh, [Member("line", "beam", Rectangle(0.02, 0.03), ALUMINIUM)])
    assert beam_slenderness(structure) == pytest.approx(5.0 / (0.02 / np.sqrt(12)), rel=1e-6)
    legs = mesh.cells["line"]
    braced = Mesh(
        mesh.points,
        {"line": np.concatenate([legs, [[0, len(mesh.points) - 1]]])},
        {"legs": {"line": np.arange(len(legs))}, "brace": {"line": np.array([len(legs)])}},
    )
    members = [
        Member(name, family, Rectangle(0.02, 0.03), ALUMINIUM) for name, family in (("legs", "beam"), ("brace", "rod"))
    ]
    assert beam_slenderness(build_structure(braced, members)) == pytest.approx(5.0 / (0.02 / np.sqrt(12)), rel=1e-6)
    assert beam_slenderness(build_structure(mesh, [Member("line", "rod", Rectangle(0.02, 0.03), ALUMINIUM)])) == 0.0


def test_markers_are_sections_where_all_that_meets_at_one_node_lies_along_one_axis():
    boom = bent_boom(n=4)
    leg = np.array([0, 3.0, 1.5]) / np.hypot(3.0, 1.5)
    found = section_axis(boom, "end")
    assert abs(found @ leg) == pytest.approx(1.0)
    corner = int(np.argmin(np.linalg.norm(boom.mesh.points - [3, 1, 0.5], axis=1)))
    inner = int(np.argmin(np.linalg.norm(boom.mesh.points - [3, 2.5, 1.25], axis=1)))
    assert inner != corner

    def at(nodes):
        mesh = boom.mesh.with_groups(points={"here": nodes})
        return section_axis(build_structure(mesh, [Member("line", "beam", Rectangle(0.05, 0.03), ALUMINIUM)]), "here")

    assert not at([corner]).any() and not at([corner, inner]).any()
    assert abs(at([inner]) @ leg) == pytest.approx(1.0)
    assert not section_axis(frame(n=2), "top").any()


def test_a_beam_that_ends_on_a_plate_is_no_section_there():
    points = np.array([[-1.0, 0, 0], [0, 0, 0], [1.0, 0, 0], [1.0, 1.0, 0], [0, 1.0, 0]])
    cells = {"line": np.array([[0, 1]]), "triangle": np.array([[1, 2, 3], [1, 3, 4]])}
    groups = {"boom": {"line": np.arange(1)}, "sheet": {"triangle": np.arange(2)}}
    mesh = Mesh(points, cells, groups, {"free": np.array([0]), "joint": np.array([1])})
    beam = Member("boom", "beam", Rectangle(0.05, 0.03), ALUMINIUM)
    structure = build_structure(mesh, [beam, Member("sheet", "plate", 0.01, ALUMINIUM)])
    assert abs(section_axis(structure, "free")[0]) == pytest.approx(1.0)
    assert not section_axis(structure, "joint").any()


def test_energy_and_strain_of_a_stress_are_those_of_its_forces():
    """A bar of two legs under tension N: N^2 L / 2 EA, and N / EA, where it was given."""
    member = Member("line", "beam", Rectangle(0.02, 0.03), ALUMINIUM, {"prestress": 4200.0})
    bar = build_structure(line([[0, 0, 0], [3.0, 0, 0], [3.0, 2.0, 0]], 5), [member])
    EA = 7e10 * 6e-4
    assert stress_energy(bar) == pytest.approx(4200.0**2 * 5.0 / (2 * EA), rel=1e-9)
    assert largest_strain(bar, bar) == pytest.approx(4200.0 / EA, rel=1e-9)


def test_a_pulled_beam_carries_its_load_and_a_hanging_mass():
    metal = Material(7e10, 0.3, 2700.0)
    beam = build_structure(
        line([[0, 0, 0], [2.0, 0, 0]], 2),
        [Member("line", "beam", Rectangle(0.01, 0.02), metal)],
        [PointMass("end", 1.5)],
    )
    held = {"start": ("x", "y", "z", "rx", "ry", "rz")}
    pulled = static_equilibrium(beam, held, Preload.weight([9.8, 0, 0], forces={"end": [50.0, 0, 0]}))
    block = pulled.strain[0]
    force = np.broadcast_to(block.stress[..., 0], block.weight.shape)
    top = 50.0 + 9.8 * (1.5 + 2700.0 * 2e-4 * 2.0)
    mean = (block.weight * force).sum() / block.weight.sum()
    assert mean == pytest.approx(top - 9.8 * 2700.0 * 2e-4, rel=1e-4)
    assert cantilever_modes(pulled, held, 1).omega[0] > cantilever_modes(beam, held, 1).omega[0]


@pytest.mark.parametrize("family", ["plate", "shell", "plate_bfs"])
def test_what_turns_far_and_stretches_little_is_told_by_its_membrane(family):
    """Rigid turns of a sheet: no membrane energy; A_yy, A_xx and both of them times the squares of its slopes."""
    sheet = build_structure(
        rectangle(1.3, 0.7, 2, 2, "quad" if family == "plate_bfs" else "quad9" if family == "shell" else "triangle"),
        [Member("surface", family, orthotropic(0.002, 90e9, 7e9, 5e9, 0.3, 1600.0), None, {"axis": (1, 0, 0)})],
    )
    raw = sheet.T @ rigid_shapes(sheet)[:, 3:]
    stretched, turned = membrane_energies(sheet, raw)
    Q11, Q22 = (E / (1 - 0.3**2 * 7 / 90) for E in (90e9, 7e9))
    A = 0.002 * 1.3 * 0.7 * np.array([Q22, Q11, Q11 + Q22])
    assert np.abs(stretched).max() < 1e-9 * A.max()
    np.testing.assert_allclose(turned, np.diag(A), rtol=1e-6, atol=1e-6 * A.max())
