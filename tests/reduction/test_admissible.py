"""Beams on admissible functions: textbook roots, finite elements, integrals over the beam."""

from __future__ import annotations

import numpy as np
import pytest
from support.reduction_examples import EI_Y, EI_Z, LENGTH, MASS, slender_beam

from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh.generators import line
from femflex.reduction import (
    BeamFunctions,
    Damping,
    Taper,
    TaperedBeam,
    UniformBeam,
    beam_body,
    cantilever_modes,
    effective_mass,
    mac_of_bodies,
    reduce_structure,
)
from femflex.reduction.beams.beam_functions import (
    STATIC_BENDING,
    bending_characteristic,
    bending_roots,
    gauss,
    with_static,
)
from femflex.reduction.inertia.moments import point_moments

DIRECTION = (3.0, 4.0, 1.0)
XI, WEIGHT = gauss(500)


def beam(**changes):
    data = dict(EA=1e6, EIy=EI_Y, EIz=EI_Z, GJ=100.0, mass_per_length=MASS, ry=1e-3, rz=1e-3, direction=DIRECTION)
    return UniformBeam(LENGTH, **{**data, "rotary_inertia": False, **changes})


@pytest.mark.parametrize(
    ("ends", "roots"),
    [
        ("clamped-free", [1.87510406871196, 4.69409113297417, 7.85475743823761]),
        ("free-free", [4.73004074486270, 7.85320462409584, 10.9956078380017]),
        ("clamped-clamped", [4.73004074486270, 7.85320462409584, 10.9956078380017]),
        ("clamped-pinned", [3.92660231204792, 7.06858274562873, 10.2101761228130]),
        ("pinned-free", [3.92660231204792, 7.06858274562873, 10.2101761228130]),
        ("pinned-pinned", [np.pi, 2 * np.pi, 3 * np.pi]),
    ],
)
def test_roots_are_the_textbook_ones(ends, roots):
    assert bending_roots(ends, 3) == pytest.approx(roots, rel=1e-13)


def test_static_shapes_complete_response_to_root_acceleration():
    f = with_static(bending_characteristic("clamped-free", 4), STATIC_BENDING, 6)
    gram = (f(XI, 0) * WEIGHT[:, None]).T @ f(XI, 0)
    assert np.abs(gram - np.eye(6)).max() < 1e-9  # the static rest is a difference of 1e6 times its size
    K = (f(XI, 2) * WEIGHT[:, None]).T @ f(XI, 2)
    for load in (np.ones_like(XI), XI):
        answer = f(np.array([1.0]), 0) @ np.linalg.solve(K, (WEIGHT * load) @ f(XI, 0))
        tip = 1 / 8 if load[0] == load[-1] else 11 / 120  # of a unit cantilever under w'''' = 1 and = x
        assert answer[0] == pytest.approx(tip, rel=1e-10)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("functions", "tolerance"),
    [
        (BeamFunctions(5, 5, 2, 2), 2e-9),
        (BeamFunctions(7, 7, 3, 3, static=True), 2e-9),
        (BeamFunctions(12, 12, 6, 6, family="polynomial"), 2e-9),
    ],
    ids=["characteristic", "static", "polynomial"],
)
def test_analytic_body_equals_finite_element_body(functions, tolerance):
    structure = slender_beam(direction=DIRECTION)
    fe = reduce_structure(structure, cantilever_modes(structure, "start", 6), {"tip": "end"})
    body = beam_body(beam(), functions)
    assert body.omega[:6] == pytest.approx(fe.omega, rel=tolerance)
    assert body.moments.mass == pytest.approx(fe.moments.mass)
    assert body.moments.inertia() == pytest.approx(fe.moments.inertia(), rel=1e-9, abs=1e-9)
    assert body.moments.first[:7] == pytest.approx(fe.moments.first, abs=1e-6)
    assert effective_mass(body).effective[:6] == pytest.approx(effective_mass(fe).effective, abs=1e-6)
    assert body.marker("tip").position == pytest.approx(fe.marker("tip").position)
    assert body.marker("tip").phi[:, :6] == pytest.approx(fe.marker("tip").phi, abs=2e-6)
    assert body.marker("tip").psi[:, :6] == pytest.approx(fe.marker("tip").psi, abs=2e-5)
    assert not body.marker("root").phi.any() and not body.marker("root").psi.any()
    assert np.diag(mac_of_bodies(body, fe))[:2].min() > 0.99


@pytest.mark.slow
def test_second_moments_agree_too_torsion_and_axial_motion_included():
    section = StiffnessSection(EA=1e4, EIy=EI_Y, EIz=EI_Z, GJ=2.0, mass_per_length=MASS, ry=0.04, rz=0.07)
    end = LENGTH * np.array(DIRECTION) / np.linalg.norm(DIRECTION)
    member = Member("line", "beam", section, options={"order": 7})
    structure = build_structure(line([[0, 0, 0], end.tolist()], 8), [member])
    fe = reduce_structure(structure, cantilever_modes(structure, "start", 12))
    functions = BeamFunctions(16, 16, 20, 20, "polynomial")
    body = beam_body(beam(EA=1e4, GJ=2.0, ry=0.04, rz=0.07, rotary_inertia=True), functions)
    assert body.omega[:12] == pytest.approx(fe.omega, rel=1e-8)
    assert body.moments.second[:13, :, :13, :] == pytest.approx(fe.moments.second, abs=2e-5)


def test_free_free_functions_move_with_the_mean():
    body = beam_body(beam(), BeamFunctions(4, 4, 1, 1, ends="free-free"))
    assert effective_mass(body).carried_fraction.max() < 1e-12
    exact = np.array([4.73004074486270, 7.85320462409584]) ** 2 * np.sqrt(EI_Z / (MASS * LENGTH**4))
    assert np.isin(np.round(exact, 6), np.round(body.omega, 6)).all()


ROOT, WAY, NEAR, L = np.array([0.3, -0.2, 0.5]), np.array([2.0, 1.0, -0.7]), np.array([0.1, 0.9, 0.4]), 1.7
TAPER = Taper(mass=lambda xi: 1 + xi, bending=lambda xi: 2 - xi**2, axial=lambda xi: np.exp(-xi))
_x = WAY / np.linalg.norm(WAY)
_y = NEAR - _x * (_x @ NEAR)
_y /= np.linalg.norm(_y)
FRAME = np.array([_x, _y, np.cross(_x, _y)])
XI_QUADRATURE, W = (lambda x, w: ((x + 1) / 2, w / 2))(*np.polynomial.legendre.leggauss(48))


def beam_of(**changes):
    data = dict(EA=900.0, EIy=30.0, EIz=50.0, GJ=20.0, mass_per_length=0.8, ry=0.05, rz=0.09, root=ROOT,
                direction=WAY, orientation=NEAR, factors=TAPER)  # fmt: skip
    return TaperedBeam(L, **{**data, **changes})


def points_of(beam):
    """Points of a section, and their shares of its mass."""
    if beam.rotary_inertia:
        a, b = np.sqrt(2) * beam.rz, np.sqrt(2) * beam.ry
        return np.array([[0, a, 0], [0, -a, 0], [0, 0, b], [0, 0, -b]]), np.full(4, 0.25)
    a = np.sqrt((beam.ry**2 + beam.rz**2) / 2)
    return np.concatenate([a * np.eye(3), -a * np.eye(3)]), np.array([-0.5, 0.5, 0.5] * 2)


def displaced(functions, offsets, X, xi=XI_QUADRATURE):
    """Displacements (k, m, 3, n), body axes, of points of sections that turn by (theta, -w', v')."""
    value, slope = (functions.fields(xi, L, d) @ X for d in (0, 1))
    turn = np.stack([value[:, 3], -slope[:, 2], slope[:, 1]], axis=1)
    local = value[:, None, :3] + np.cross(turn[:, None], offsets[None, :, :, None], axis=2)
    return np.einsum("ba,kmbn->kman", FRAME, local)


@pytest.mark.parametrize(("rotary", "family"), [(True, "characteristic"), (False, "polynomial")])
def test_moments_stiffness_markers_and_skin_are_integrals_over_the_beam(rotary, family):
    beam = beam_of(rotary_inertia=rotary, radius=0.11)
    functions = BeamFunctions(y=2, z=1, axial=1, torsion=2, family=family)
    body = beam_body(beam, functions, Damping(0.02))
    bare = beam_body(beam, functions, orthonormal=False)
    offsets, share = points_of(beam)
    dm = (W * 0.8 * L * TAPER.mass(XI_QUADRATURE))[:, None] * share
    rho = ROOT + (L * XI_QUADRATURE)[:, None, None] * FRAME[0] + offsets @ FRAME
    scale = 1 / np.sqrt(0.8 * L)
    own = point_moments(
        dm.ravel(), rho.reshape(-1, 3), displaced(functions, offsets, scale * np.eye(6)).reshape(-1, 3, 6)
    )
    np.testing.assert_allclose(bare.moments.first, own.first, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(bare.moments.second, own.second, rtol=1e-9, atol=1e-9)
    slope, bend = (functions.fields(XI_QUADRATURE, L, d) * scale for d in (1, 2))
    EI = W * L * TAPER.bending(XI_QUADRATURE)
    terms = ((900 * W * L * TAPER.axial(XI_QUADRATURE), slope[:, 0]), (50 * EI, bend[:, 1]), (30 * EI, bend[:, 2]),
             (20 * EI, slope[:, 3]))  # fmt: skip
    V1 = sum(np.einsum("k,ki,kj->ij", c, f, f) for c, f in terms)
    np.testing.assert_allclose(bare.strain.V1, V1, rtol=1e-9, atol=1e-9 * V1.max())
    assert np.isnan(bare.omega).all() and body.kinds == ("admissible",) * 6
    np.testing.assert_allclose(body.moments.elastic_mass(), np.eye(6), atol=1e-9)
    np.testing.assert_allclose(body.strain.V1, np.diag(body.omega**2), atol=1e-8 * V1.max())
    np.testing.assert_allclose(np.diag(body.damping), 0.04 * body.omega, rtol=1e-8)
    for made in (body, bare):
        tip = made.marker("tip")
        assert not made.marker("root").phi.any() and not made.marker("root").psi.any()
        np.testing.assert_allclose(made.marker("root").position, ROOT)
        np.testing.assert_allclose(tip.position, ROOT + L * FRAME[0])
        assert not tip.axis.any()
    end = np.ones(1)
    value, slope = functions.fields(end, L)[0] * scale, functions.fields(end, L, 1)[0] * scale
    np.testing.assert_allclose(bare.marker("tip").phi, FRAME.T @ value[:3], atol=1e-12)
    np.testing.assert_allclose(bare.marker("tip").psi, FRAME.T @ [value[3], -slope[2], slope[1]], atol=1e-12)
    skin = bare.skin
    local = (skin.points - ROOT) @ FRAME.T
    np.testing.assert_allclose(np.hypot(local[:, 1], local[:, 2]), 0.11)
    xi = np.unique(local[:, 0].round(12)) / L
    assert xi[0] == pytest.approx(0) and xi[-1] == pytest.approx(1) and len(local) == 16 * len(xi)
    ring = local[:16] * [0, 1, 1]
    moved = displaced(functions, ring, scale * np.eye(6), xi).reshape(-1, 3, 6)
    np.testing.assert_allclose(skin.shapes, moved.transpose(2, 0, 1), atol=1e-11)
    sides = np.sort(np.ptp(local[skin.cells["quad"]], axis=1), axis=1)
    assert len(np.unique(skin.cells["quad"])) == len(local) and sides.max() < 0.2
    plain = beam_body(beam_of(), functions).skin
    assert set(plain.cells) == {"line"} and len(plain.points) == len(plain.cells["line"]) + 1
    np.testing.assert_allclose(np.linalg.norm(np.diff(plain.points[plain.cells["line"]], axis=1)[:, 0], axis=1),
                               L / len(plain.cells["line"]), rtol=1e-9)  # fmt: skip


@pytest.mark.parametrize("far", [False, True])
@pytest.mark.parametrize(("y", "z"), [(2, 1), (2, 0), (0, 2)])
def test_an_inextensible_beam_has_the_curvature_of_an_arc_at_fourth_order(y, z, far):
    """int (EIz a^2 + EIy b^2 + 2 s a b) / 2 of a = v'v'', b = w'w''; s their mean, or the lesser where it bends far."""
    taper = Taper(bending=lambda xi: 2 - xi**2)
    beam = beam_of(factors=taper, ry=0.0, rz=0.0, bounded_energy=far)
    functions = BeamFunctions(y=y, z=z)
    body = beam_body(beam, functions, orthonormal=False, strain="condensed")
    d = np.array([0.04, -0.03, 0.05])[: y + z]
    slope, bend = (functions.fields(XI_QUADRATURE, L, k) @ d / np.sqrt(0.8 * L) for k in (1, 2))
    a, b = slope[:, 1] * bend[:, 1], slope[:, 2] * bend[:, 2]
    shared = 30.0 if far else 40.0
    quartic = (W * L * taper.bending(XI_QUADRATURE)) @ (50 * a**2 + 30 * b**2 + 2 * shared * a * b) / 2
    found = [body.strain.energy(k * d) for k in (1.0, -1.0, 2.0)]
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    assert (found[2] - 4 * found[0]) / 12 == pytest.approx(quartic, rel=1e-5)
