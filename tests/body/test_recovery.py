"""Section forces and stresses from strain fields: statics of bars, sheets and blocks under known loads."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from femflex.body.recovery import at_points, named, peaks, quantities
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Circle, Rectangle
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
        np.testing.assert_allclose(named(part, name, one)[0], q * (2.0 - part.places[:, 0]), atol=rel * q)


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
    V = named(part, "shear_force_y", y)[0]
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
        found = named(parts[0], name, np.array([[1.0]]))
        np.testing.assert_allclose(found, value, atol=70.0)
