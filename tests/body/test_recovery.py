"""Section forces and stresses from strain fields: statics of bars, sheets and blocks under known loads."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from femflex.body.recovery import at_points, peaks, quantities, quantity_by_name
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Circle, Rectangle
from femflex.fem.sections.laminates import Lamina, Ply, layup, sandwich
from femflex.mesh import box, line, rectangle
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.reduction.beams.strain_points import strain_field

METAL = Material(70e9, 0.3, 2700.0)


def field(structure, force, held, group, nonlinear=False):
    """Strain parts over the one shape that a force (3,), shared by the nodes of a group, makes; amplitude 1."""
    nodes = structure.mesh.group_points(group)
    F = np.zeros((len(structure.mesh.points), 3))
    F[nodes] = np.asarray(force) / len(nodes)
    free = np.setdiff1d(np.arange(structure.n_dof), structure.clamped_dofs(held))
    x = np.zeros((structure.n_dof, 1))
    x[free, 0] = spsolve(structure.K[free][:, free].tocsc(), (structure.translation.T @ F.ravel())[free])
    return strain_field(structure, x, nonlinear)


def test_section_forces_of_a_bar():
    """Force (2, 3, 5) at the end of a bar and an arm of 0.1: M = F (L - x), N, T = 0.1 times a force across."""
    mesh = line(np.array([[0, 0, 0], [1.0, 0, 0], [1.0, 0.1, 0]]), 2)
    s = build_structure(mesh, [Member("line", "beam", Rectangle(0.02, 0.03), METAL)])
    parts = field(s, (2.0, 3.0, 5.0), "start", "end")
    y = np.array([[0.0], [1.0], [-2.0]])
    found = {name: at_points(parts, name, [0.3, 0, 0], y) for name in quantities(parts)}
    x = found["axial_force"][1][0, 0]
    for name, value in {
        "axial_force": 2.0,
        "moment_z": 3.0 * (1 - x) - 2.0 * 0.1,
        "moment_y": -5.0 * (1 - x),
        "torque": 0.1 * 5.0,
        "shear_force_y": 3.0,
        "shear_force_z": 5.0,
    }.items():
        np.testing.assert_allclose(found[name][0][:, 0], [0.0, value, -2 * value], rtol=2e-3, err_msg=name)
    top = {peak.name: peak for peak in peaks(parts, y, np.array([0.0, 1.0, 2.0]))}
    assert top["moment_y"].time == 2.0 and top["moment_y"].place[0] < 0.05
    assert top["moment_y"].value == pytest.approx(2 * 5 * (1 - top["moment_y"].place[0]), rel=2e-3)


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize(
    ("section", "A", "Wz", "Wy", "Wt"),
    [
        (Rectangle(0.02, 0.03), 6e-4, 0.03 * 0.02**2 / 6, 0.02 * 0.03**2 / 6, None),
        (Circle(0.02), np.pi * 4e-4, np.pi * 8e-6 / 4, np.pi * 8e-6 / 4, np.pi * 8e-6 / 2),
        (Circle("0.02 + 0*s"), np.pi * 4e-4, np.pi * 8e-6 / 4, np.pi * 8e-6 / 4, np.pi * 8e-6 / 2),
    ],
    ids=["rectangle", "circle", "circle of stations"],
)
def test_fibre_stresses_of_a_bar(section, A, Wz, Wy, Wt, nonlinear):
    """Corner N/A + M_z/W_z + M_y/W_y; round N/A + |M|/W, with shear T/W_t in von Mises' stress."""
    mesh = line(np.array([[0, 0, 0], [1.0, 0, 0], [1.0, 0.1, 0]]), 2)
    s = build_structure(mesh, [Member("line", "beam", section, METAL)])
    parts = field(s, (2e-3, 3e-3, 5e-3), "start", "end", nonlinear)
    found = {name: at_points(parts, name, [0.3, 0, 0], [[-1.0]]) for name in quantities(parts)}
    x = found["axial_force"][1][0, 0]
    N, Mz, My, T = 2e-3, 3e-3 * (1 - x) - 2e-4, 5e-3 * (1 - x), 5e-4
    stress = N / A + (np.hypot(Mz, My) / Wz if Wt else Mz / Wz + My / Wy)
    assert found["fibre_stress"][0][0, 0] == pytest.approx(stress, rel=2e-3)
    assert ("von_mises" in found) == (Wt is not None)
    if Wt:
        assert found["von_mises"][0][0, 0] == pytest.approx(np.sqrt(stress**2 + 3 * (T / Wt) ** 2), rel=2e-3)


@pytest.mark.parametrize("order", [3, 5])
def test_shear_force_of_a_bar_under_its_weight(order):
    """Its own weight q per length: V = q (L - x), linear in every element of order 5, constant in those of order 3."""
    s = build_structure(
        line([[0, 0, 0], [2.0, 0, 0]], 8), [Member("line", "beam", Rectangle(0.02, 0.03), METAL, {"order": order})]
    )
    q = 9.81 * METAL.density * 0.02 * 0.03
    free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("start"))
    f = s.M @ s.translation.T @ np.tile([0, 9.81, 9.81], len(s.mesh.points))
    x = np.zeros((s.n_dof, 1))
    x[free, 0] = spsolve(s.K[free][:, free].tocsc(), f[free])
    one = np.ones((1, 1))
    part = strain_field(s, x, False)[0]
    for name in ("shear_force_y", "shear_force_z"):
        rel = 1e-3 if order == 5 else 0.125  # of the root's, half an element
        np.testing.assert_allclose(quantity_by_name(part, name, one)[0], q * (2.0 - part.places[:, 0]), atol=rel * q)


def test_membrane_forces_of_a_stretched_square():
    """A square pulled along x by e: N = E h e / (1 - nu^2) (1, nu, 0), on top of the initial forces."""
    options = {"prestress": [50.0, 40.0, 5.0]}
    mesh = rectangle(1.0, 1.0, 1, 1, "triangle6")
    s = build_structure(mesh, [Member("surface", "membrane", 1e-4, METAL, options)])
    e = 2e-6
    parts = strain_field(s, s.translation.T @ (e * mesh.points * [1, 0, 0]).reshape(-1, 1), False)
    assert quantities(parts) == {"force_xx": "N/m", "force_yy": "N/m", "force_xy": "N/m"}
    stiffness = 70e9 * 1e-4 / (1 - 0.3**2)
    wanted = {"force_xx": 50.0 + stiffness * e, "force_yy": 40.0 + 0.3 * stiffness * e, "force_xy": 5.0}
    for peak in peaks(parts, np.array([[0.0], [1.0]]), np.array([3.0, 4.0])):
        assert (peak.kind, peak.unit) == ("plate", "N/m")
        assert peak.value == pytest.approx(wanted.pop(peak.name), rel=1e-4)
        assert peak.time == (3.0 if peak.name == "force_xy" else 4.0)
    assert not wanted


def test_root_shear_of_a_vibrating_beam():
    """Root shear of the first mode: mass times acceleration of all beyond, omega^2 int m w dx."""
    beam = UniformBeam(length=2.0, EA=1e7, EIy=2e3, EIz=3e3, GJ=1e3, mass_per_length=1.5)
    body = beam_body(beam, BeamFunctions(y=6))
    y = np.zeros((1, body.n_shapes))
    y[0, 0] = 1.0
    part = body.strain_field[0]
    V = quantity_by_name(part, "shear_force_y", y)[0]
    total = np.linalg.norm(body.moments.first[1]) * body.omega[0] ** 2
    assert abs(V[0]) == pytest.approx(total, rel=5e-3)


@pytest.mark.parametrize(("family", "cell", "rel"), [("shell", "quad9", 0.01), ("plate", "triangle", 0.03)])
def test_stress_of_a_sheet_bent_and_pulled(family, cell, rel):
    """A strip with nu = 0 under a pull N and a tip force: n = N / b, m = F (L - x) / b, stress n / h + 6 m / h^2."""
    h, b = 0.01, 0.2
    s = build_structure(
        rectangle(1.0, b, 10, 2, cell), [Member("surface", family, h, Material(70e9, 0.0, 1.0), {"axis": (1, 0, 0)})]
    )
    parts = field(s, (50.0, 0, 2.0), "left", "right")
    at = [0.5, 0.1, 0.0]
    n, where = at_points(parts, "force_xx", at, np.ones((1, 1)))
    m, _ = at_points(parts, "moment_xx", at, np.ones((1, 1)))
    stress, _ = at_points(parts, "von_mises", at, np.ones((1, 1)))
    x = where[0, 0]
    assert n[0, 0] == pytest.approx(50 / b, rel=0.03)
    assert abs(m[0, 0]) == pytest.approx(2.0 * (1 - x) / b, rel=rel)
    assert stress[0, 0] == pytest.approx(abs(n[0, 0]) / h + 6 * abs(m[0, 0]) / h**2, rel=0.02)


def test_stress_of_a_pulled_block():
    s = build_structure(box(1.0, 0.2, 0.1, 4, 2, 1, "tetra10"), [Member("volume", "solid", material=METAL)])
    # a stretch and its contraction, exactly
    u = s.mesh.points * [1.0, -0.3, -0.3] * 1e-3
    parts = strain_field(s, (s.translation.T @ u.ravel())[:, None], False)
    for name, value in {"xx": 70e6, "yy": 0.0, "xy": 0.0, "von_mises": 70e6}.items():
        found = quantity_by_name(parts[0], name, np.array([[1.0]]))
        np.testing.assert_allclose(found, value, atol=70.0)


CARBON, CORE = Lamina(140e9, 9e9, 5e9, 0.3, 1600.0), Lamina.core(50.0, 3e7)
STACK = [Ply(CARBON, 4e-4, 0.3), Ply(CORE, 0.01), Ply(CARBON, 3e-4, -0.7), Ply(Lamina.isotropic(METAL), 5e-4)]
EVEN = [
    Ply(CARBON, 2e-4, 0.3),
    Ply(CARBON, 3e-4, -0.7),
    Ply(CORE, 0.01),
    Ply(CARBON, 3e-4, -0.7),
    Ply(CARBON, 2e-4, 0.3),
]


def ply_stress(ply, angle, strain, z):
    """Stress along a ply's own axes of strains (8,) at height z: sigma = S^-1 C eps C^T, by tensors."""
    e = strain[:3] + z * strain[3:6]
    C = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    own = C @ np.array([[e[0], e[2] / 2], [e[2] / 2, e[1]]]) @ C.T
    lamina = ply.lamina
    S = np.array([[1, -lamina.nu12], [-lamina.nu12, lamina.E1 / lamina.E2]]) / lamina.E1
    return np.array([*np.linalg.solve(S, np.diag(own)), 2 * lamina.G12 * own[0, 1]])


@pytest.mark.parametrize(
    ("family", "cell", "plies", "options"),
    [
        ("plate", "triangle", EVEN, {"axis": (np.cos(0.2), np.sin(0.2), 0)}),
        ("plate_bfs", "quad", EVEN, {}),
        ("shell", "quad", STACK, {"offset": 0.004}),
        ("shell", "quad9", STACK, {"thickness": "0.0112 * (1 + x)", "offset": -0.001}),
    ],
)
def test_ply_stresses_by_lamination_theory(family, cell, plies, options):
    """Stresses of every ply at its faces from the strains of the section and a free strain, and their peak."""
    free = np.array([2e-5, -1e-5, 0.0])
    member = Member(
        "surface", family, layup(plies, coupled=family == "shell"), options={**options, "thermal_strain": free}
    )
    s = build_structure(rectangle(1.0, 0.4, 3, 2, cell), [member])
    (part,) = field(s, (4e3, 1e3, 30.0), "left", "right")
    strains = part.strains(np.ones((1, 1)))[0]
    turn = 0.2 if "axis" in options else 0.0  # plates have strains in axes of the elements, here the global ones
    C = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    own = C.T @ np.array([[free[0], free[2] / 2], [free[2] / 2, free[1]]]) @ C
    strains[:, :3] -= [own[0, 0], own[1, 1], 2 * own[0, 1]]
    tops = np.cumsum([ply.thickness for ply in plies])
    assert part.group == "surface"
    for k, ply in enumerate(plies):
        for c, name in enumerate(("11", "22", "12")):
            found = quantity_by_name(part, f"ply{k + 1}_{name}", np.ones((1, 1)))
            if ply.lamina is CORE:
                assert found is None
                continue
            for p in range(0, len(strains), 5):
                factor = (1 + part.places[p, 0]) if "thickness" in options else 1.0
                heights = factor * (tops[k] - [ply.thickness, 0.0] - tops[-1] / 2) + options.get("offset", 0.0)
                faces = [ply_stress(ply, ply.angle + turn, strains[p], z)[c] for z in heights]
                largest = max(faces, key=abs)
                assert found[0, p] == pytest.approx(largest, rel=1e-4, abs=1e-6 * 140e9 * np.abs(strains[p]).max())


@pytest.mark.parametrize(("family", "cell"), [("shell", "quad9"), ("plate", "triangle")])
def test_face_stress_of_a_sandwich(family, cell):
    """A strip with faces of nu = 0 under a tip force: F (L - x) / b over (h^3 - c^3) / 12, times h / 2 outside."""
    t, c, b = 5e-4, 0.02, 0.2
    faces = Ply(Lamina.isotropic(Material(70e9, 0.0, 1.0)), t)
    s = build_structure(rectangle(1.0, b, 20, 4, cell), [Member("surface", family, sandwich(faces, c, CORE))])
    parts = field(s, (0, 0, 2.0), "left", "right")
    h = c + 2 * t
    for name in ("von_mises", "ply1_11", "ply3_11"):
        found, where = at_points(parts, name, [0.5, 0.1, 0.0], np.ones((1, 1)))
        expected = 2.0 * (1 - where[0, 0]) / b * 6 * h / (h**3 - c**3)
        assert abs(found[0, 0]) == pytest.approx(expected, rel=0.03), name
    assert set(quantities(parts)) >= {"ply1_22", "ply3_12"} and "ply2_11" not in quantities(parts)
