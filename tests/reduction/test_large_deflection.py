"""Reduced bodies under large static loads: closed forms, Levy's plate, snap-through."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.special import ellipk
from support.full_solution import FullModel, Reduced, arc_length, free_motion, load_factors_at, static_path
from support.nonlinear_models import METAL

from femflex.body.symmetric import unpacked
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line, rectangle
from femflex.reduction import cantilever_modes, strain_tensors, with_attachment, with_derivatives, with_responses
from femflex.reduction.boundary.rigid import held_dofs, rigid_shapes

H = 0.01  # thickness of everything here [m]
EDGES = ("left", "right", "bottom", "top")
PINS = ("x", "y", "z", "rx", "rz")


def duffing(structure, clamp):
    """c of x'' + x + c x^3 for the lowest shape, x its largest displacement over H, all else relaxed statically."""
    modes = cantilever_modes(structure, clamp, 1).picked([0])
    full = with_derivatives(structure, modes, "all")
    tensors, n = strain_tensors(structure, full.phi), full.n_modes
    amplitude = np.abs(structure.translation @ full.phi[:, 0]).max()
    pull = 3 * unpacked(tensors.V2, n, 3)[0, 0, 1:]  # elastic force on the others, per q^2
    relaxed = pull @ np.linalg.solve(tensors.V1[1:, 1:], pull)
    quartic = (unpacked(tensors.V3, n, 4)[0, 0, 0, 0] - relaxed) / 2
    return 4 * quartic / tensors.V1[0, 0] * (H / amplitude) ** 2


def pinned_beam(n, order):
    mesh = line([[0, 0, 0], [1.0, 0, 0]], n)
    options = {"order": order, "orientation": (0, 1, 0)}
    return build_structure(mesh, [Member("line", "beam", Rectangle(0.05, H), METAL, options)])


def test_hardening_of_pinned_beam_matches_woinowsky_krieger():
    """q'' + w0^2 (q + q^3 / 4 r^2) = 0, r the radius of gyration (1950).

    Their curvature is v''; v'' (1 - u') with u' = (mean of v'^2 - v'^2) / 2 takes 2 (pi r / L)^2 of the quartic.
    """
    exact = 3.0 * (1 - 2 * np.pi**2 * H**2 / 12)  # (H / r)^2 / 4 with r^2 = H^2 / 12
    pins = dict.fromkeys(("start", "end"), ("x", "y", "z", "rx"))
    assert duffing(pinned_beam(4, 6), pins) == pytest.approx(exact, rel=1e-7)
    errors = [duffing(pinned_beam(n, 3), pins) / exact - 1 for n in (4, 8, 16)]
    assert errors[2] < 2e-5
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([4, 4], abs=0.3)


@pytest.mark.parametrize(
    ("family", "counts", "order", "bound"), [("plate_bfs", (4, 8), 3.9, 1e-4), ("plate", (6, 12), 1.5, 5e-3)]
)
def test_hardening_of_plate_with_immovable_edges_matches_chu_herrmann(family, counts, order, bound):
    """Simply supported, edges held against normal motion in the plane, free along themselves (1956).

    Their curvature is w,ab; less w,ab (u,x + v,y), with u = pi a^2 / 16 (cos 2 pi y - 1 + nu) sin 2 pi x and v alike,
    takes (pi h)^2 (1/2 + nu - nu^2) / 2: 3e-4 of it at a hundredth.
    """
    nu = METAL.nu
    exact = 3 * (2 * (3 - nu**2) + 4 * nu) / 16 - (np.pi * H) ** 2 * (0.5 + nu - nu**2) / 2
    along_y, along_x = ("x", "z", "rx"), ("y", "z", "ry")
    edges = {"left": along_y, "right": along_y, "bottom": along_x, "top": along_x}
    errors = []
    for n in counts:
        mesh = rectangle(1.0, 1.0, n, n, "quad" if family == "plate_bfs" else "triangle")
        structure = build_structure(mesh, [Member("surface", family, H, METAL)])
        errors.append(duffing(structure, edges) / exact - 1)
    assert abs(errors[1]) < bound
    assert np.log2(errors[0] / errors[1]) > order


LEVY_LOADS = np.array([17.79, 38.3, 63.4, 95.0, 134.9, 184.0, 245.0, 318.0, 402.0])  # p a^4 / E h^4
GLASS = Material(1e7, 0.316, 1.0)


def clamped_plate(n, family="plate_bfs"):
    """Structure, held dofs, unit load p a^4 = E h^4 and the row of the centre's deflection over h."""
    mesh = rectangle(1.0, 1.0, n, n, "quad" if family == "plate_bfs" else "triangle")
    structure = build_structure(mesh, [Member("surface", family, H, GLASS)])
    load = structure.M @ rigid_shapes(structure)[:, 2] * GLASS.E * H**3 / GLASS.density
    centre = structure.translation[[3 * mesh.nearest_point([0.5, 0.5, 0]) + 2]].toarray()[0] / H
    return structure, held_dofs(structure, EDGES), load, centre


def loaded_shapes(modes, load, n):
    """The n shapes with the largest static amplitudes under the load, in their order."""
    amplitude = np.abs(modes.phi.T @ load) / modes.omega**2
    return modes.picked(np.sort(np.argsort(-amplitude)[:n]))


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("family", "n"), [("plate_bfs", 6), ("plate", 8)])
def test_deflection_of_clamped_plate_under_pressure_matches_full_elements(family, n):
    """Two modes, the load's own shape and six derivatives follow the full solution over all of Levy's loads."""
    structure, held, load, centre = clamped_plate(n, family)
    full = FullModel(structure, held)
    loads = LEVY_LOADS[[0, 2, 5, 8]]
    exact = static_path(full, load[full.free], loads) @ centre[full.free]
    modes = loaded_shapes(cantilever_modes(structure, EDGES, 6), load, 2)
    shapes = with_derivatives(structure, with_attachment(structure, modes, ["z"]))
    assert shapes.kinds.count("derivative") == 6
    d = static_path(Reduced(strain_tensors(structure, shapes.phi)), shapes.phi.T @ load, loads)
    np.testing.assert_allclose(d @ (shapes.phi.T @ centre), exact, rtol=2e-3)
    alone = strain_tensors(structure, modes.phi)
    stiff = static_path(Reduced(alone), modes.phi.T @ load, loads) @ (modes.phi.T @ centre)
    assert stiff[-1] < 0.9 * exact[-1]  # without derivatives the plate is far too stiff


def arch(rise, n=12):
    """A circular arch of unit span from straight elements, group "CROWN" at its middle."""
    radius = (0.25 + rise**2) / (2 * rise)
    half = np.arcsin(0.5 / radius)

    def point(t):
        angle = (2 * t - 1) * half
        return [0.5 + radius * np.sin(angle), 0.0, radius * (np.cos(angle) - np.cos(half))]

    mesh = line(point, n)
    return build_structure(mesh, [Member("line", "beam", Rectangle(0.03, H), METAL, {"extent": 1.0})])


def panel(rise, n=8, length=0.5, supports=None):
    """A cylindrical panel of unit span from flat triangles, straight edges "left" and "right"."""
    mesh = rectangle(1.0, length, n, round(n * length), "triangle")
    radius = (0.25 + rise**2) / (2 * rise)
    half = np.arcsin(0.5 / radius)
    angle = (2 * mesh.points[:, 0] - 1) * half
    points = np.stack(
        [0.5 + radius * np.sin(angle), mesh.points[:, 1], radius * (np.cos(angle) - np.cos(half))], axis=1
    )
    return build_structure(replace(mesh, points=points), [Member("surface", "plate", H, METAL)], supports=supports)


def snapped(structure, clamp, where, step):
    """Full model, load, row of the deflection of the crown over H, path of load factors and of deflections."""
    full = FullModel(structure, held_dofs(structure, clamp))
    load = -(structure.M @ rigid_shapes(structure)[:, 2])
    node = structure.mesh.nearest_point(where)
    row = -structure.translation[[3 * node + 2]].toarray()[0] / H
    inside = structure.translation.tocsc()[:, full.free]
    weight = np.asarray(inside.multiply(inside).sum(axis=0)).ravel()
    factors, x = arc_length(full, load[full.free], step, 80, weight, lambda _, x: row[full.free] @ x > 4.0)
    return load, row, factors, x @ row[full.free]


def load_off(structure, shapes, case):
    """Largest difference of the loads at equal deflections, over the largest load."""
    load, row, factors, deflections = case
    model = Reduced(strain_tensors(structure, shapes.phi))
    found = load_factors_at(model, shapes.phi.T @ load, shapes.phi.T @ row, deflections)
    return np.abs(found - factors).max() / factors.max()


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(("rise", "support"), [(3 * H, "pinned"), (3 * H, "clamped")])
def test_arch_snaps_through_with_two_shapes_and_derivatives_at_deflection(rise, support):
    structure = arch(rise)
    held = ("x", "y", "z", "rx", "rz") + (("ry",) if support == "clamped" else ())
    clamp = {"start": held, "end": held}
    case = snapped(structure, clamp, [0.5, 0, 1], 0.5 * H)
    modes = loaded_shapes(cantilever_modes(structure, clamp, 12), case[0], 1)
    modes = with_attachment(structure, modes, ["z"])
    assert load_off(structure, with_derivatives(structure, modes, 7, deflection=4 * H), case) < 2e-3


@pytest.mark.slow
def test_large_oscillation_of_pinned_beam_matches_full_elements():
    """Started at w = 1.5 H in its first shape: w / w0 of Woinowsky-Krieger's oscillator, by Duffing's period."""
    structure = pinned_beam(8, 3)
    pins = dict.fromkeys(("start", "end"), ("x", "y", "z", "rx"))
    full = FullModel(structure, held_dofs(structure, pins))
    modes = loaded_shapes(cantilever_modes(structure, pins, 12), structure.M @ rigid_shapes(structure)[:, 2], 2)
    row = structure.translation[[3 * structure.mesh.nearest_point([0.5, 0, 0]) + 2]].toarray()[0]
    shapes = with_derivatives(structure, modes)
    M = structure.M[full.free][:, full.free]
    q = np.zeros(shapes.n_modes)
    q[0] = 1.5 * H / (row @ shapes.phi[:, 0])
    q = settled(Reduced(strain_tensors(structure, shapes.phi)), q)
    dt, count = 2 * np.pi / modes.omega[0] / 200, 150
    x = free_motion(full, M, (shapes.phi @ q)[full.free], np.zeros(len(full.free)), dt, count)
    reduced = Reduced(strain_tensors(structure, shapes.phi))
    d = free_motion(reduced, np.eye(len(q)), q, np.zeros(len(q)), dt, count)
    w, w_reduced = x @ row[full.free], d @ (row @ shapes.phi)
    np.testing.assert_allclose(w_reduced, w, atol=5e-3 * H)
    stiffer = 3 * 1.5**2  # c of x'' + x + c x^3, x from -1 to 1
    quarter = ellipk(stiffer / (2 * (1 + stiffer))) / np.sqrt(1 + stiffer)  # omega_0 times a quarter period
    crossing = np.flatnonzero(np.diff(np.sign(w)))[0]
    time = dt * (crossing + w[crossing] / (w[crossing] - w[crossing + 1]))
    assert time * modes.omega[0] == pytest.approx(quarter, rel=0.02)


def settled(model, q):
    """The state with the same first coordinate and all others in equilibrium."""
    q = q.copy()
    for _ in range(20):
        q[1:] -= np.linalg.solve(model.tangent(q)[1:, 1:], model.force(q)[1:])
    return q


CLAMPED = ("x", "y", "z", "rx", "ry", "rz")
ENDS, EDGES_RESPONSES = ("left", "right"), ("left", "right", "bottom", "top")
HINGES = dict.fromkeys(ENDS, PINS)


def limit_loads(at, loads):
    """Loads at which a path of loads over displacements turns."""
    curve = CubicSpline(at, loads)
    return curve(curve.derivative().roots(extrapolate=False))


def responding(structure, clamp, modes, count, deflection):
    shapes = with_attachment(structure, cantilever_modes(structure, clamp, modes), ["z"])
    return with_responses(structure, shapes, count, deflection, ["z"])


CASES = {
    "arch, hinged": (lambda: arch(3 * H), dict.fromkeys(("start", "end"), PINS), 1),
    "arch, clamped": (lambda: arch(3 * H), dict.fromkeys(("start", "end"), CLAMPED), 1),
    "panel, barely curved": (lambda: panel(1.5 * H, 6), ENDS, 0),
    "panel, clamped": (lambda: panel(3 * H, 6), ENDS, 2),
    "square panel, clamped": (lambda: panel(3 * H, 6, 1.0), ENDS, 2),
    "square panel, clamped all round": (lambda: panel(2 * H, 6, 1.0), EDGES_RESPONSES, 0),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.slow
def test_snap_through_in_ten_coordinates_matches_full_elements(name):
    """To four thicknesses: the load at equal deflections within 1 % of the largest, both limit points too."""
    make, clamp, turns = CASES[name]
    structure = make()
    middle = [0.5, structure.mesh.points[:, 1].mean(), 1]
    case = snapped(structure, clamp, middle, 0.4 * H)
    load, row, factors, deflections = case
    assert deflections[-1] > 4.0
    shapes = responding(structure, clamp, 1, 8, 6 * H)
    assert shapes.n_modes == 10 and shapes.kinds.count("response") == 8
    assert load_off(structure, shapes, case) < 0.01
    at = np.linspace(0, deflections[-1], 200)[1:]
    found = load_factors_at(Reduced(strain_tensors(structure, shapes.phi)), shapes.phi.T @ load, shapes.phi.T @ row, at)
    path = CubicSpline([0.0, *deflections], [0.0, *factors])(at)
    assert np.abs(found - path).max() < 0.01 * factors.max()  # on the symmetric path, not off it to where it buckles
    exact, own = limit_loads(deflections, factors), limit_loads(at, found)
    if turns:
        assert np.abs(own[:turns] - exact[:turns]).max() < 0.01 * np.ptp([*exact[:turns], 0.0])


@pytest.mark.slow
def test_so_does_a_hinged_panel_whose_corners_curl():
    structure = panel(2 * H, 6, supports=HINGES)
    case = snapped(structure, HINGES, [0.5, 0.25, 1], 0.3 * H)
    assert load_off(structure, responding(structure, HINGES, 1, 8, 4.5 * H), case) < 0.01
