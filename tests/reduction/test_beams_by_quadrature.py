"""Beams on admissible functions against integrals over their own points: taper, skew axes, offsets, unlike planes."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.reduction import BeamFunctions, ModalDamping, Taper, UniformBeam, beam_body
from femflex.reduction.beams.beam_functions import STATIC_AXIAL, STATIC_BENDING, TIP_AXIAL, TIP_BENDING
from femflex.reduction.inertia.moments import point_moments

ROOT, WAY, NEAR, L = np.array([0.3, -0.2, 0.5]), np.array([2.0, 1.0, -0.7]), np.array([0.1, 0.9, 0.4]), 1.7
TAPER = Taper(mass=lambda xi: 1 + xi, bending=lambda xi: 2 - xi**2, axial=lambda xi: np.exp(-xi))
_x = WAY / np.linalg.norm(WAY)
_y = NEAR - _x * (_x @ NEAR)
_y /= np.linalg.norm(_y)
FRAME = np.array([_x, _y, np.cross(_x, _y)])
XI, W = (lambda x, w: ((x + 1) / 2, w / 2))(*np.polynomial.legendre.leggauss(48))


def beam_of(**changes):
    data = dict(EA=900.0, EIy=30.0, EIz=50.0, GJ=20.0, mass_per_length=0.8, ry=0.05, rz=0.09, root=ROOT,
                direction=WAY, orientation=NEAR, taper=TAPER)  # fmt: skip
    return UniformBeam(L, **{**data, **changes})


def points_of(beam):
    """Points of a section, and their shares of its mass."""
    if beam.rotary_inertia:
        a, b = np.sqrt(2) * beam.rz, np.sqrt(2) * beam.ry
        return np.array([[0, a, 0], [0, -a, 0], [0, 0, b], [0, 0, -b]]), np.full(4, 0.25)
    a = np.sqrt((beam.ry**2 + beam.rz**2) / 2)
    return np.concatenate([a * np.eye(3), -a * np.eye(3)]), np.array([-0.5, 0.5, 0.5] * 2)


def displaced(functions, offsets, X, xi=XI):
    """Displacements (k, m, 3, n), body axes, of points of sections that turn by (theta, -w', v')."""
    value, slope = (functions.fields(xi, L, d) @ X for d in (0, 1))
    turn = np.stack([value[:, 3], -slope[:, 2], slope[:, 1]], axis=1)
    local = value[:, None, :3] + np.cross(turn[:, None], offsets[None, :, :, None], axis=2)
    return np.einsum("ba,kmbn->kman", FRAME, local)


@pytest.mark.parametrize(("rotary", "family"), [(True, "characteristic"), (False, "polynomial")])
def test_moments_stiffness_markers_and_skin_are_integrals_over_the_beam(rotary, family):
    beam = beam_of(rotary_inertia=rotary, radius=0.11)
    functions = BeamFunctions(y=2, z=1, axial=1, torsion=2, family=family)
    body = beam_body(beam, functions, ModalDamping(0.02))
    bare = beam_body(beam, functions, orthonormal=False)
    offsets, share = points_of(beam)
    dm = (W * 0.8 * L * TAPER.mass(XI))[:, None] * share
    rho = ROOT + (L * XI)[:, None, None] * FRAME[0] + offsets @ FRAME
    scale = 1 / np.sqrt(0.8 * L)
    own = point_moments(
        dm.ravel(), rho.reshape(-1, 3), displaced(functions, offsets, scale * np.eye(6)).reshape(-1, 3, 6)
    )
    np.testing.assert_allclose(bare.moments.first, own.first, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(bare.moments.second, own.second, rtol=1e-9, atol=1e-9)
    slope, bend = (functions.fields(XI, L, d) * scale for d in (1, 2))
    EI = W * L * TAPER.bending(XI)
    terms = ((900 * W * L * TAPER.axial(XI), slope[:, 0]), (50 * EI, bend[:, 1]), (30 * EI, bend[:, 2]),
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


def test_twist_of_a_section_stretches_its_fibres_by_half_its_square():
    """EA u' (p theta')^2 / 2 along a tapered beam is what twist and stretch have in common, p^2 = ry^2 + rz^2."""
    functions = BeamFunctions(y=1, axial=2, torsion=1, family="polynomial")
    body = beam_body(beam_of(), functions, orthonormal=False, strain="nonlinear")
    axial, twist = np.array([0.0, 0.4, -0.7, 0.0]), np.array([0.0, 0.0, 0.0, 0.6])
    slope = functions.fields(XI, L, 1) / np.sqrt(0.8 * L)
    u, t = slope[:, 0] @ axial, slope[:, 3] @ twist
    own = (900 * W * L * TAPER.axial(XI)) @ (u * (0.05**2 + 0.09**2) * t**2) / 2

    def energy(a, b):
        return body.strain.energy(np.pad(a * axial + b * twist, (0, body.n_modes - 4)))

    odd = (energy(1, 1) - energy(-1, 1) - energy(1, 0) + energy(-1, 0)) / 2
    assert odd == pytest.approx(own, rel=1e-7)


@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
def test_a_bent_beam_draws_its_tip_in_by_half_the_squares_of_its_slopes(strain):
    """Amplitudes of bending alone; what the axial functions do not hold of it follows."""
    beam = beam_of(rotary_inertia=False, ry=0.0, rz=0.0, taper=Taper())
    functions = BeamFunctions(y=2, z=1, axial=0 if strain == "condensed" else 2)
    body = beam_body(beam, functions, orthonormal=False, strain=strain)
    d = np.zeros(body.n_modes)
    d[:3] = [0.05, -0.02, 0.04]
    settled = body.strain.settled(d, np.arange(3, body.n_modes)) if strain == "nonlinear" else d
    slope = functions.fields(XI, L, 1)[:, :, :3] @ d[:3] / np.sqrt(0.8 * L)
    drawn = L * W @ (slope[:, 1] ** 2 + slope[:, 2] ** 2) / 2
    found = FRAME[0] @ (body.marker("tip").phi @ body.amplitudes(settled))
    assert found == pytest.approx(-drawn, rel=1e-3)
    np.testing.assert_allclose(body.marker("tip").axis, FRAME[0], atol=1e-12)


def test_static_shapes_of_root_and_tip_are_among_the_functions_and_marked():
    x = np.linspace(0.0, 1.0, 50)
    functions = BeamFunctions(y=4, z=5, axial=2, torsion=3, static=True, tip=True)
    assert functions.own == functions.count == 14
    added = [True] * 4 + [False] + [True] * 4 + [True] * 2 + [False] + [True] * 2
    np.testing.assert_array_equal(functions.added, added)
    np.testing.assert_array_equal(functions.alone, [True] * 4 + [False] * 10)
    only = BeamFunctions(y=3, z=2, torsion=1, tip=True)
    np.testing.assert_array_equal(only.added, [False, True, True, True, True, True])
    np.testing.assert_array_equal(only.alone, [False] * 3 + [True] * 3)
    fields = functions.fields(x, 1.0)
    for shapes, row in (((*STATIC_BENDING, *TIP_BENDING), 1), ((*STATIC_BENDING, *TIP_BENDING), 2),
                        ((*STATIC_AXIAL, *TIP_AXIAL), 0), ((*STATIC_AXIAL, *TIP_AXIAL), 3)):  # fmt: skip
        for shape in shapes:
            basis = fields[:, row]
            assert np.abs(basis @ np.linalg.lstsq(basis, shape(x), rcond=None)[0] - shape(x)).max() < 1e-10
    # what they are: deflections under root acceleration, root turning, tip moment, tip force
    for shape, load, moment, force in (
        (STATIC_BENDING[0], lambda s: 1 + 0 * s, 0, 0),
        (STATIC_BENDING[1], lambda s: s, 0, 0),
        (TIP_BENDING[0], lambda s: 0 * s, 1, 0),
        (TIP_BENDING[1], lambda s: 0 * s, 0, -1),
    ):
        np.testing.assert_allclose(shape.deriv(4)(x), load(x), atol=1e-12)
        np.testing.assert_allclose([shape(0.0), shape.deriv()(0.0)], 0, atol=1e-15)
        np.testing.assert_allclose([shape.deriv(2)(1.0), shape.deriv(3)(1.0)], [moment, force], atol=1e-12)
    kinds = beam_body(beam_of(taper=Taper()), BeamFunctions(y=3, z=2, tip=True)).kinds
    assert kinds[0] == "admissible" and sorted(kinds[1:]) == ["attachment"] * 2 + ["unanswered attachment"] * 2


@pytest.mark.parametrize(
    ("y", "z", "ends", "needed"),
    [
        (2, 1, "clamped-free", 5),
        (1, 3, "clamped-clamped", 10),
        (3, 2, "pinned-free", 7),
        (1, 2, "free-free", 5),
        (2, 1, "pinned-pinned", 4),
    ],
)
def test_axial_polynomials_hold_the_squares_of_slopes_from_their_degree_on(y, z, ends, needed):
    """The integral of the square of the steepest slope lies in them, but for what the ends do not allow."""
    x = np.linspace(0.0, 1.0, 60)
    for axial in (needed - 1, needed):
        functions = BeamFunctions(y=y, z=z, axial=axial, family="polynomial", ends=ends)
        assert functions.holds_squares == (axial >= needed)
    assert not BeamFunctions(y=y, z=z, axial=40, ends=ends).holds_squares
    fields = BeamFunctions(y=y, z=z, axial=needed, family="polynomial", ends=ends).fields(x, 1.0)
    row, first, n = (1, 0, y) if y > z else (2, y, z)
    xi, w = (lambda a, b: ((a + 1) / 2, b / 2))(*np.polynomial.legendre.leggauss(20))
    slope = BeamFunctions(y=y, z=z, family="polynomial", ends=ends).fields(np.outer(x, xi).ravel(), 1.0, 1)
    highest = slope[:, row, first + n - 1].reshape(60, 20) ** 2
    square = x * (highest @ w)
    rigid = {"free-free": np.ones((60, 1)), "clamped-clamped": x[:, None], "pinned-pinned": x[:, None]}
    basis = np.hstack([fields[:, 0, y + z :], rigid.get(ends, np.zeros((60, 0)))])
    if not ends.startswith("free"):
        assert square[0] == 0.0
    assert np.abs(basis @ np.linalg.lstsq(basis, square, rcond=None)[0] - square).max() < 1e-9 * np.abs(square).max()


def test_stiffnesses_too_far_apart_are_said_with_their_numbers():
    with pytest.raises(ValueError, match=r"EA = 1e\+40 N, EIy = 30, EIz = 1e-30 and GJ = 20 N m\^2, are so far apart"):
        beam_body(beam_of(EA=1e40, EIz=1e-30), BeamFunctions(y=2, axial=2))


@pytest.mark.parametrize("far", [False, True])
@pytest.mark.parametrize(("y", "z"), [(2, 1), (2, 0), (0, 2)])
def test_an_inextensible_beam_has_the_curvature_of_an_arc_at_fourth_order(y, z, far):
    """int (EIz a^2 + EIy b^2 + 2 s a b) / 2 of a = v'v'', b = w'w''; s their mean, or the lesser where it bends far."""
    taper = Taper(bending=lambda xi: 2 - xi**2)
    beam = beam_of(taper=taper, ry=0.0, rz=0.0, far_bends=far)
    functions = BeamFunctions(y=y, z=z)
    body = beam_body(beam, functions, orthonormal=False, strain="condensed")
    d = np.array([0.04, -0.03, 0.05])[: y + z]
    slope, bend = (functions.fields(XI, L, k) @ d / np.sqrt(0.8 * L) for k in (1, 2))
    a, b = slope[:, 1] * bend[:, 1], slope[:, 2] * bend[:, 2]
    shared = 30.0 if far else 40.0
    quartic = (W * L * taper.bending(XI)) @ (50 * a**2 + 30 * b**2 + 2 * shared * a * b) / 2
    found = [body.strain.energy(k * d) for k in (1.0, -1.0, 2.0)]
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    assert (found[2] - 4 * found[0]) / 12 == pytest.approx(quartic, rel=1e-5)
