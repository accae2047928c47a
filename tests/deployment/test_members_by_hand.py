"""Deploying members without equations of motion: drawings, forces in sections, points of mass, functions, sentences."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from support.material_points import H, frame_of, gauss_of
from test_tables_of_members import LENGTH, NEAR, ROOT, WAY, line_of, material_of_line

from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    ElementFunctions,
    MaterialTaper,
    Reel,
    StringFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
    deploying_tapered_line,
)
from femflex.deployment.drawn import skin_of
from femflex.deployment.intervals import Pieces, gauss_between, integral_of
from femflex.deployment.reel import reel_law
from femflex.deployment.shapes import clean
from femflex.reduction import BeamFunctions
from femflex.system import Profile
from femflex.warning import PhysicsWarning

FRAME = frame_of(WAY, NEAR)
STATIONS = np.linspace(0.0, 1.0, 11)


# --- drawings ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("drum", "radius", "drum_radius", "full"),
    [("tip", None, 0.4, 0.4), ("root", 0.06, None, 0.18), ("tip", None, None, 0.052), ("root", 0.01, None, 0.052)],
)
def test_a_member_is_drawn_as_a_tube_and_a_coil_that_shrinks_as_it_unwinds(drum, radius, drum_radius, full):
    """Of stock 2.6 m: COIL = 2 % of it, three radii of the tube, or what is given; 0.3 of that where all is out."""
    line = line_of(EIy=3.0, EIz=5.0, radius=radius)
    made = deploying_line(line, BeamFunctions(y=1, z=1), LENGTH, stock=2.6, until=3.0, drum=drum,
                          drum_radius=drum_radius)  # fmt: skip
    local = (made.body.skin.points - ROOT) @ FRAME.T
    tube, coil = local[:-32], local[-32:]
    assert np.ptp(tube[:, 0]) == pytest.approx(1.2) and tube[:, 0].min() == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(np.linalg.norm(tube[:, 1:], axis=1), radius or 0.0, atol=1e-12)
    centre = full if drum == "tip" else -full
    away = coil - [centre + (1.2 if drum == "tip" else 0.0), 0, 0]
    np.testing.assert_allclose(np.hypot(away[:, 0], away[:, 2]), full * (1 - 0.7 * 1.2 / 2.6), rtol=1e-9)
    np.testing.assert_allclose(away[:, 1], np.repeat([-full, full], 16), atol=1e-12)
    cells = made.body.skin.cells
    assert set(cells) == ({"line", "quad"} if radius is None else {"quad"})
    assert max(rows.max() for rows in cells.values()) == len(local) - 1
    assert (cells["quad"][-16:] >= len(tube)).all() and len(np.unique(cells["quad"][-16:])) == 32
    for kind, rows in cells.items():  # neighbours alone: no cell spans more than a step along or the coil's width
        ends = local[rows]
        assert np.abs(np.ptp(ends, axis=1))[: -16 if kind == "quad" else None].max(initial=0.0) < 0.07
    near = [skin_of(made.shapes, 1.2 * (1 + s * H), 2.6, drum == "tip", drum_radius) for s in (1, -1)]
    growth = (near[0].points - near[1].points) / (2 * H)
    np.testing.assert_allclose(made.body.skin.growth, growth, atol=1e-9)
    tip = made.body.marker("tip").phi
    at_end = np.flatnonzero(np.isclose(local[: len(tube), 0], 1.2))
    moved = made.body.skin.shapes[:, at_end].mean(axis=1)
    np.testing.assert_allclose(moved.T, tip, atol=1e-9)
    stowed = made.body.skin.shapes[:, -32:]
    still = np.zeros_like(stowed) if drum == "root" else np.broadcast_to(tip.T[:, None], stowed.shape)
    np.testing.assert_allclose(stowed, still, atol=1e-9)


def test_the_drum_of_a_strip_is_as_wide_as_the_strip_and_that_of_a_long_tether_at_most_a_metre():
    strip = DeployingStrip(mass_per_area=2.0, width=0.5, tension=4.0, root=ROOT, direction=WAY, across=NEAR)
    made = deploying_strip(strip, StripFunctions(StringFunctions(z=1)), LENGTH, stock=2.6, until=3.0)
    local = (made.body.skin.points - ROOT) @ FRAME.T
    np.testing.assert_allclose(local[-32:, 1], np.repeat([-0.25, 0.25], 16), atol=1e-12)
    assert np.abs(local[:-32, 1]).max() == pytest.approx(0.25) and not np.abs(local[:-32, 2]).max() > 1e-12
    tether = deploying_line(DeployingLine(mass_per_length=1.0), None, Profile.constant(5.0), stock=4000.0)
    coil = tether.body.skin.points[-32:]
    np.testing.assert_allclose(np.hypot(coil[:, 0] + 1.0, coil[:, 2]), 1 - 0.7 * 5 / 4000)


def test_what_is_drawn_has_four_lines_for_each_function_and_at_least_twenty():
    """Lines of a member without radius, tubes of twelve sides, sheets of five points across; then the drum's 32."""
    for most in (2, 6):
        n = 4 * max(5, most)
        plain = deploying_line(line_of(EIz=1.0), BeamFunctions(y=most), LENGTH, until=3.0).body.skin
        assert np.array_equal(plain.cells["line"], np.stack([np.arange(n), np.arange(1, n + 1)], axis=1))
        assert len(plain.points) == n + 1 + 32 and plain.cells["quad"].min() == n + 1
        tube = deploying_line(line_of(EIz=1.0, radius=0.05), BeamFunctions(y=most), LENGTH, until=3.0).body.skin
        assert len(tube.points) == 12 * (n + 1) + 32 and len(tube.cells["quad"]) == 12 * n + 16
        sheet = DeployingStrip(2.0, 0.5, bending=1.0, root=ROOT, direction=WAY, across=NEAR)
        sheet = deploying_strip(sheet, StripFunctions(BeamFunctions(z=most), 2), LENGTH, until=3.0).body.skin
        assert len(sheet.points) == 5 * (n + 1) + 32 and len(sheet.cells["quad"]) == 4 * n + 16
        for skin in (plain, tube, sheet):
            along = (skin.points[:-32] - ROOT) @ FRAME[0]
            assert (along.min(), along.max()) == pytest.approx((0.0, 1.2), abs=1e-12)


# --- forces in sections -----------------------------------------------------------------------------------------------


SOME = MaterialTaper.table((0.2, 1.4, 2.4), mass=(1.0, 2.0, 0.7), bending=(1, 3, 2))


@pytest.mark.parametrize(("drum", "taper"), [("root", None), ("root", SOME), ("tip", SOME)])
def test_tension_and_moments_of_any_motion_are_those_of_what_lies_beyond(drum, taper):
    """S = int (a - f) dm by second differences along the material, with forces attached; N = -S.t."""
    line, functions = line_of(EIy=3.0, EIz=5.0, tension=0.6, ry=0.02, rz=0.03), BeamFunctions(y=1, z=1)
    more = {"stock": 2.6, "until": 3.0, "drum": drum, "markers": {"mid": 0.4}}
    if taper is None:
        made = deploying_line(line, functions, LENGTH, **more)
    else:
        made = deploying_tapered_line(line, taper, functions, LENGTH, **more)
    points, mass, bending = (0.2, 1.4, 2.4), (1.0, 2.0, 0.7), (1, 3, 2)
    factor = (lambda s: np.interp(s, points, bending)) if taper else (lambda s: np.ones_like(s))
    density = (lambda s: 0.8 * np.interp(s, points, mass)) if taper else (lambda s: 0.8 + 0 * s)
    at_tip = drum == "tip"
    material, fields = material_of_line(made, line, functions, at_tip, density, 2.6, points)
    rng = np.random.default_rng(6)
    L, U, A = 1.7, 0.4, -0.3
    Z = 1 + made.body.n_shapes
    y, dy, ddy = rng.normal(size=(3, Z)) * 0.2
    y[0], dy[0], ddy[0] = 1.0, 0.0, 0.0
    omega, alpha, a = rng.normal(size=(3, 3))
    gradient = rng.normal(size=(3, 3))
    motion = SimpleNamespace(y=y, dy=dy, ddy=ddy, omega=omega, alpha=alpha, a=a, gradient=gradient)
    attached = [("mid", np.array([0.3, -0.2, 0.4])), ("tip", np.array([-1.0, 0.5, 0.1])), ("root", np.ones(3))]
    found = made.variation.write.sections.report((L, U, A), motion, attached)

    h = 1e-3

    def acceleration(path):
        """path(L, y) (k, 3) of points; their acceleration less the field's."""
        r, before, after = (path(L + U * t + A * t * t / 2, y + dy * t + ddy * t * t / 2) for t in (0.0, -h, h))
        v, own = (after - before) / (2 * h), (after - 2 * r + before) / h**2
        turning = np.cross(alpha, r) + np.cross(omega, np.cross(omega, r)) + 2 * np.cross(omega, v)
        return a + turning + own + r @ gradient.T

    def mean(xi, length, amplitudes):
        return np.einsum("m,kmaA,A->ka", material.share, material.z(xi, length), amplitudes)

    force, some = np.zeros((11, 3)), [0, 2, 4, 5, 9, 10]
    for k, station in zip(some, STATIONS[some], strict=True):
        ends = sorted([material.sigma(station, L), L if at_tip else 0.0])
        sigma, w = gauss_of([ends[0], *(p for p in points if ends[0] < p < ends[1]), ends[1]])
        beyond = acceleration(lambda length, q, sigma=sigma: mean(material.xi(sigma, length), length, q))
        force[k] = (w * density(sigma)) @ beyond
    if at_tip:
        s, w = gauss_of([L, *(p for p in points if L < p < 2.6), 2.6])
        end = np.ones(1)
        force += (w @ density(s)) * acceleration(lambda length, q: mean(end, length, q))[0]
        fixed = (mean(np.array([L / (L + d)]), L + d, y)[0] for d in (h, -h))  # of the material that has just left
        leaves = np.subtract(*fixed) / (2 * h) - (mean(end, L + h, y) - mean(end, L - h, y))[0] / (2 * h)
        force += density(np.array([L]))[0] * U * U * leaves
    force[STATIONS <= 0.4] += attached[0][1]
    force += attached[1][1]
    force[0] += attached[2][1]
    tangent = (mean(STATIONS + 1e-6, L, y) - mean(STATIONS - 1e-6, L, y)) / 2e-6
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    pull = 0.6 - np.einsum("ka,ka->k", force, tangent)
    np.testing.assert_allclose(found["tension"][some], pull[some], rtol=2e-4, atol=2e-4)
    bend = fields(STATIONS, L, 2) @ y[1:3]
    stiff = factor(material.sigma(STATIONS, L))
    np.testing.assert_allclose(found["moment_z"], 5.0 * stiff * bend[:, 1], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(found["moment_y"], -3.0 * stiff * bend[:, 2], rtol=1e-8, atol=1e-9)
    sections = made.variation.write.sections
    assert set(sections.resultants) == set(found) and not sections.slackens


def test_tethers_slacken_and_rods_plates_and_beams_do_not():
    def of(line, functions=None):
        return deploying_line(line, functions, LENGTH, until=3.0).variation.write.sections

    tether = of(DeployingLine(mass_per_length=1.0))
    assert tether.slackens and set(tether.resultants) == {"tension"} and tether.bends is None
    assert not of(DeployingLine(mass_per_length=1.0, rod=True)).slackens
    assert not of(DeployingLine(mass_per_length=1.0, EIy=1.0), BeamFunctions(z=1)).slackens
    for bending, slack in ((0.0, True), (2.0, False)):
        strip = DeployingStrip(1.0, 0.5, bending=bending, tension=3.0)
        sections = deploying_strip(strip, None, LENGTH, until=3.0).variation.write.sections
        assert sections.slackens == slack and sections.support == 3.0


# --- points of mass ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("drum", ["root", "tip"])
def test_points_of_mass_follow_the_length_as_the_material_does(drum):
    line, functions = line_of(EIy=3.0, EIz=5.0, ry=0.05, rz=0.09, rotary_inertia=True), BeamFunctions(y=1, z=2)
    made = deploying_line(line, functions, LENGTH, stock=2.6, until=3.0, drum=drum)
    points, at_tip = made.variation.write.points, drum == "tip"
    material, _ = material_of_line(made, line, functions, at_tip, lambda s: 0.8 + 0 * s, 2.6)
    L, n_shapes = 1.7, made.body.n_shapes
    np.testing.assert_allclose(points.direction, FRAME[0], atol=1e-12)
    dm = points.mass + points.density * L
    r = points.base + (points.along * L)[:, None] * points.direction
    phi = points.phi + points.phi_inverse / L
    own = material.integrals(L)
    z = np.concatenate([r[:, :, None], phi], axis=2)
    assert dm.sum() == pytest.approx(own["mass"])
    np.testing.assert_allclose(np.einsum("p,paA->Aa", dm, z), own["first"], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(np.einsum("p,paA,pbB->AaBb", dm, z, z), own["second"], rtol=1e-8, atol=1e-9)
    moved = points.drawn[:, None] * points.direction
    chi = np.concatenate([moved[:, :, None], points.drift / L + points.drift_inverse / L**2], axis=2)
    if at_tip:  # the drum's own velocity is that of a place that keeps its xi
        stowed = points.mass > 0
        chi[stowed, :, 1:] = -(points.phi_inverse / L**2)[stowed]
    np.testing.assert_allclose(np.einsum("p,paA->Aa", dm, chi), own["X"], rtol=1e-7, atol=1e-8)
    assert chi.shape[2] == 1 + n_shapes


# --- rates of a deflection at rest ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rest", "way"), [("place", lambda xi: xi), ("material", lambda xi: xi - 1.0)])
def test_a_deflection_at_rest_has_the_rates_that_take_the_growth_back(rest, way):
    """Least squares over the mass of phi d delta/dt = way phi' delta U / L."""
    functions = BeamFunctions(y=2, z=1)
    made = deploying_line(line_of(EIy=3.0, EIz=5.0), functions, Profile.polynomial(1.3, 0.4), stock=2.6, until=2.0)
    assert made.start == (pytest.approx(1.3), pytest.approx(0.4))
    d, (x, w) = np.array([0.3, -0.2, 0.5]), gauss_of([0.0, 1.0])
    phi, slope = (functions.fields(x, 1.0, k)[:, 1:3] @ made.shapes.X for k in (0, 1))
    M = np.einsum("q,qai,qaj->ij", w, phi, phi)
    drive = np.einsum("q,qai,qaj,j->i", w * way(x), phi, slope, d)
    np.testing.assert_allclose(made.resting_rates(d, rest), 0.4 / 1.3 * np.linalg.solve(M, drive), rtol=1e-7)
    np.testing.assert_array_equal(made.resting_rates(d, "coordinates"), np.zeros(3))


# --- functions --------------------------------------------------------------------------------------------------------


def test_sines_of_strings_end_free_or_held_and_stretch_ends_free():
    xi = np.linspace(0.0, 1.0, 7)
    for tip, shift in (("free", 0.5), ("held", 0.0)):
        functions = StringFunctions(y=2, z=1, axial=2, tip=tip, family="characteristic")
        assert functions.count == 5 and functions.most == 3
        for derivative in range(3):
            found = functions.fields(xi, 2.0, derivative)

            def sine(k, d=derivative):
                return np.sqrt(2) * (k * np.pi / 2) ** d * np.sin(k * np.pi * xi + d * np.pi / 2)

            wanted = np.zeros((7, 4, 5))
            wanted[:, 1, 0], wanted[:, 1, 1] = sine(1 - shift), sine(2 - shift)
            wanted[:, 2, 2] = sine(1 - shift)
            wanted[:, 0, 3], wanted[:, 0, 4] = sine(0.5), sine(1.5)
            np.testing.assert_allclose(np.abs(found), np.abs(wanted), atol=1e-11)


@pytest.mark.parametrize("tip", ["free", "held"])
def test_polynomials_of_strings_leave_the_straight_turn_out_where_a_joint_turns_the_member(tip):
    x, w = gauss_of([0.0, 1.0])
    whole, bent = (
        StringFunctions(y=3, axial=1, tip=tip, straight=straight).fields(x, 1.0) for straight in (True, False)
    )
    for found in (whole, bent):
        np.testing.assert_allclose(np.einsum("q,qi,qj->ij", w, found[:, 1, :3], found[:, 1, :3]), np.eye(3), atol=1e-11)
    turn = np.sqrt(3) * x
    if tip == "held":
        np.testing.assert_allclose(bent, whole, atol=1e-13)
        ends = StringFunctions(y=3, axial=1, tip=tip).fields(np.array([0.0, 1.0]), 1.0)
        assert np.abs(ends[:, 1]).max() < 1e-12 and abs(ends[1, 0, 3]) > 1.0
    else:
        np.testing.assert_allclose(whole[:, 1, 0], turn, atol=1e-11)
        assert np.abs((w * turn) @ bent[:, 1, :3]).max() < 1e-11
        np.testing.assert_allclose(np.abs(bent[:, 1, :2]), np.abs(whole[:, 1, 1:3]), atol=1e-11)


@pytest.mark.parametrize("string", [False, True])
def test_functions_of_elements_meet_the_supports_and_their_derivatives_are_derivatives(string):
    ends = [0.15, 0.5, 0.7]
    functions = ElementFunctions(y=2, z=1, axial=3, torsion=1, elements=ends, string=string, held=string)
    across = 7 if string else 8
    assert functions.count == 2 * across + 8 + 8 and functions.most == 3
    np.testing.assert_allclose(functions.knots, ends)
    numbers, kept = zip(*functions.blocks, strict=True)
    assert kept == (2, 1, 3, 1) and np.array_equal(np.concatenate(numbers), np.arange(functions.count))
    rows = [1, 2, 0, 3]
    xi = np.array([0.05, 0.3, 0.6, 0.69, 0.93])
    for block, row in zip(numbers, rows, strict=True):
        others = np.setdiff1d(np.arange(4), row)
        assert not functions.fields(xi, 1.0)[:, others][:, :, block].any()
        at = functions.fields(np.array([0.0, 1.0]), 1.0)[:, row, block]
        assert not at[0].any()
        assert at[1].any() != (string and row in (1, 2))
    for derivative in range(2):
        h = 1e-6
        slope = (functions.fields(xi + h, 2.0, derivative) - functions.fields(xi - h, 2.0, derivative)) / (4 * h)
        np.testing.assert_allclose(functions.fields(xi, 2.0, derivative + 1), slope, atol=1e-6 * np.abs(slope).max())
    for knot in ends:  # values, and slopes of what bends, are continuous
        for derivative in range(2):
            jump = np.abs(np.diff(functions.fields(np.array([knot - 1e-9, knot + 1e-9]), 1.0, derivative), axis=0))[0]
            bends = [] if string else [1, 2]
            smooth = jump if derivative == 0 else jump[bends]
            assert smooth.max(initial=0.0) < 1e-6
    # any straight slope of bending and any parabola of stretch is among them
    x = np.linspace(0.0, 1.0, 40)
    for row, target in ((0, 2 * x - x**2), (3, x), (1, x * (1 - x) if string else x**2 - x**3 / 4)):
        basis = functions.fields(x, 1.0)[:, row]
        assert np.abs(basis @ np.linalg.lstsq(basis, target, rcond=None)[0] - target).max() < 1e-12


def test_a_strip_of_elements_keeps_its_modes_along_times_its_functions_across():
    strip = DeployingStrip(mass_per_area=2.0, width=0.5, bending=2.0, poisson=0.3)
    functions = StripFunctions(ElementFunctions(z=2, elements=3), 3)
    ((numbers, kept),) = functions.blocks
    assert len(numbers) == functions.count == 18 and kept == 6 and functions.most == 2
    np.testing.assert_allclose(functions.knots, [1 / 3, 2 / 3])
    assert deploying_strip(strip, functions, Profile.constant(1.0)).body.n_modes == 6


def test_polynomials_by_pieces_and_their_integrals():
    edges, rng = np.array([0.0, 0.3, 0.45, 1.0]), np.random.default_rng(1)
    pieces = Pieces(edges, rng.normal(size=(3, 5, 2)))
    for k, (a, b) in enumerate(pairwise(edges)):
        x = np.linspace(a, b, 5)[:-1]
        exact = [np.polynomial.Legendre(pieces.coefficients[k, :, j], domain=[a, b]) for j in range(2)]
        for d in range(4):
            wanted = np.stack([(p.deriv(d) if d else p)(x) for p in exact], axis=1)
            np.testing.assert_allclose(pieces(x, d), wanted, rtol=1e-9, atol=1e-9)
    xi, w = gauss_between(edges[1:-1], 60)
    assert len(xi) == 60 and w.sum() == pytest.approx(1.0) and len(gauss_between(edges[1:-1], 5)[0]) == 36
    assert len(gauss_between(np.zeros(0), 5)[0]) == 5
    np.testing.assert_allclose([w @ xi**k for k in range(6)], 1 / np.arange(1.0, 7.0))
    values = np.stack([xi**4 - 0.3 * xi, np.cos(xi)], axis=1).reshape(3, 20, 2)
    integral = integral_of(edges, values, 9)
    x = np.array([0.0, 0.2, 0.3, 0.4, 0.6, 1.0])
    np.testing.assert_allclose(integral(x), np.stack([x**5 / 5 - 0.15 * x**2, np.sin(x)], axis=1), atol=1e-12)


# --- reels, options and sentences -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("length", "speed"), [(3.0, 0.5), (6.0, -2.0), (5.0, 0.0)])
def test_a_reel_pulls_with_tension_brake_and_stiffness(length, speed):
    reel = Reel("winch", length=4.0, speed=-0.002, tension=3.0, damping=2.0, stiffness=5.0, rest=1.5, mass=9.0)
    effector = reel.effector(6.0)
    out = SimpleNamespace(zdot=np.zeros(2), channel=np.zeros(1))
    reel_law(SimpleNamespace(parameters=effector.parameters, z=np.array([length, speed])), out)
    pull = 3.0 + 2.0 * speed + 5.0 * (length - 1.5)
    np.testing.assert_allclose([*out.zdot, *out.channel], [speed, -pull, pull])
    for beyond in (6.0001, 0.0, -1.0):
        reel_law(SimpleNamespace(parameters=effector.parameters, z=np.array([beyond, speed])), out)
        assert np.isnan(out.zdot[1]) and out.zdot[0] == speed
    assert reel.state == "winch.length" and effector.name == "winch"
    assert dict(effector.states) == {"length": "m", "speed": "m/s"} and dict(effector.channels) == {"tension": "N"}
    np.testing.assert_array_equal(effector.z0, [4.0, -0.002])
    np.testing.assert_allclose(effector.sizes, [4.0, 0.004])
    np.testing.assert_allclose(Reel("winch", 4.0, -2.0).effector().sizes, [4.0, 2.0])
    assert np.isfinite(reel.effector().parameters).all() and reel.effector().parameters[4] > 1e300


def test_a_member_on_a_reel_starts_with_its_length_and_speed():
    made = deploying_line(line_of(), None, Reel("winch", 4.0, -0.3, mass=9.0), stock=6.0, drum_radius=0.2)
    write = made.variation.write
    assert made.start == (4.0, -0.3)
    assert (write.length, write.drum_mass, write.stock, write.drum_radius) == ("winch.length", 9.0, 6.0, 0.2)
    assert write.bounds == (4.0, 4.0) and made.body.moments.mass == pytest.approx(0.8 * 6.0)
    alone = deploying_line(line_of(), None, Reel("winch", 4.0))
    assert alone.variation.write.stock == 4.0


def test_the_stock_left_out_is_the_largest_length_up_to_the_end():
    """A peak between two breaks counts, breaks after the end do not, and the first length is that at t = 0."""
    there = Profile.smooth_step(0.0, 2.0, 1.0, 3.0)
    made = deploying_line(line_of(), None, there, until=1.0)
    L, U, _ = (float(v) for v in there(1.0))
    assert made.variation.write.stock == pytest.approx(L, rel=1e-9) and made.variation.write.bounds[0] == 1.0
    peak = Profile.polynomial(2.0, 1.0, -0.2)  # 2 + t - 0.2 t^2, highest at t = 2.5
    made = deploying_line(line_of(), None, peak, until=5.5)
    assert made.variation.write.stock == pytest.approx(3.25, rel=1e-6)
    assert made.variation.write.bounds == (pytest.approx(1.45), pytest.approx(3.25))
    assert made.start == (2.0, 1.0) and made.shapes.reference == 2.0 and U > 0


@pytest.mark.parametrize("drum", ["root", "tip"])
def test_a_tapered_member_that_is_drawn_in_starts_as_its_longest_piece_says(drum):
    points, mass = (0.2, 1.7, 2.4), (1.0, 2.0, 0.7)
    factors = {"bending": (0.5, 1.5, 2.5), "axial": (2.0, 1.0, 0.6), "torsion": (1.0, 0.4, 1.7)}
    taper, back = MaterialTaper.table(points, mass=mass, **factors), Profile.smooth_step(0.0, 3.0, 2.1, 1.2)
    line = line_of(EA=90.0, EIy=3.0, EIz=5.0, GJ=2.0, tension=0.4, ry=0.05, rz=0.09)
    functions = BeamFunctions(y=1, z=1, axial=1, torsion=1)
    made = deploying_tapered_line(line, taper, functions, back, stock=2.6, until=3.0, drum=drum, drum_radius=0.3)
    density = lambda s: 0.8 * np.interp(s, points, mass)  # noqa: E731
    material, fields = material_of_line(made, line, functions, drum == "tip", density, 2.6, points)
    own = material.integrals(2.1)
    np.testing.assert_allclose(made.body.moments.first, own["first"], rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(made.body.moments.second, own["second"], rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(np.einsum("kala->kl", own["second"][1:5, :, 1:5]), np.eye(4), atol=1e-7)
    np.testing.assert_allclose(made.body.marker("tip").position, ROOT + 2.1 * FRAME[0], rtol=1e-9)
    assert made.parts.origin <= 2.1 <= made.parts.origin + made.parts.reference * (1 + 1e-9)
    assert made.start == (pytest.approx(2.1), 0.0) and made.variation.write.drum_radius == 0.3
    sigma, w = gauss_of([0.0, *points[:2], 2.1])
    slope, bend = (fields(material.xi(sigma, 2.1), 2.1, k) for k in (1, 2))
    bending, axial, torsion = (w * np.interp(sigma, points, values) for values in factors.values())
    terms = (
        (5 * bending, bend[:, 1]),
        (3 * bending, bend[:, 2]),
        (90 * axial, slope[:, 0]),
        (2 * torsion, slope[:, 3]),
    )
    terms += ((0.4 * w, slope[:, 1]), (0.4 * w, slope[:, 2]))
    V1 = sum(np.einsum("k,ki,kj->ij", c, f, f) for c, f in terms)
    np.testing.assert_allclose(made.body.strain.V1, V1, rtol=1e-6, atol=1e-6 * V1.max())


def test_axes_given_to_a_marker_are_its_own_and_others_keep_the_member_s():
    turned = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    more = {"until": 3.0, "markers": {"mid": 0.4}, "orientations": {"mid": turned}}
    for made in (
        deploying_line(line_of(), None, LENGTH, **more),
        deploying_tapered_line(line_of(), MaterialTaper(), None, LENGTH, **more),
    ):
        np.testing.assert_array_equal(made.body.marker("mid").orientation, turned)
        for name in ("tip", "root"):
            np.testing.assert_allclose(made.body.marker(name).orientation, FRAME.T, atol=1e-12)


def test_linear_strain_is_warned_of_with_the_part_of_the_buckling_load():
    """m' |A| L^3 / (7.837 EI), EI the lesser stiffness that is there, at its largest over the run."""
    length = Profile.polynomial(2.0, 0.5, -0.2)  # 2 + 0.5 t - 0.2 t^2
    t = np.linspace(0.0, 1.0, 5001)
    L, _, acceleration = length(t)
    for EIy, EIz, EI in ((8.0, 5.0, 5.0), (0.0, 5.0, 5.0), (8.0, 0.0, 8.0)):
        part = (0.8 * np.abs(acceleration) * L**3).max() / (7.837 * EI)
        with pytest.warns(
            PhysicsWarning, match=rf"\(up to 0\.4 m/s\^2\) reaches {part:.2g} of its buckling .*limit 0\.02"
        ):
            deploying_line(line_of(EIy=EIy, EIz=EIz), BeamFunctions(y=1 if EIz else 0, z=1 if EIy else 0), length,
                           strain="linear", until=1.0)  # fmt: skip
    with pytest.warns(PhysicsWarning, match=r"\(up to 0\.4 m/s\^2\) reaches inf of its buckling load"):
        deploying_line(line_of(tension=2.0), StringFunctions(y=1), length, strain="linear", until=1.0)
    deploying_line(line_of(tension=2.0), StringFunctions(y=1), Profile.polynomial(2.0, 0.5), strain="linear", until=1.0)
    deploying_line(line_of(EA=9.0), StringFunctions(axial=1), length, strain="linear", until=1.0)  # does not bend
    stiff = line_of(EIy=500.0, EIz=500.0)
    deploying_line(stiff, BeamFunctions(y=1), length, strain="linear", until=1.0)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: DeployingLine(1.0, EIz=-2.0), r"EIz of a deploying member is -2\.0; it must be zero or positive"),
        (lambda: DeployingLine(1.0, tension=np.inf), r"tension of a deploying member is inf; it must be zero or pos"),
        (lambda: DeployingLine(np.nan), r"mass_per_length of a deploying member is nan kg/m"),
        (lambda: DeployingStrip(1.0, 0.0, tension=1.0), r"width of a deploying strip is 0\.0; it must be positive"),
        (lambda: DeployingStrip(np.inf, 1.0, tension=1.0), r"mass_per_area of a deploying strip is inf; it must"),
        (lambda: DeployingStrip(1.0, 1.0, tension=1.0, tension_across=-3.0), r"tension_across of .* is -3\.0; .* zero"),
        (lambda: StringFunctions(y=-1, z=3), r"\(y, z, axial\) are \(-1, 3, 0\); give at least one, and none negative"),
        (lambda: ElementFunctions(y=1, elements=[0.5, 0.4]), r"are \[0\.5, 0\.4\]; give a number from 1"),
        (lambda: ElementFunctions(y=2, torsion=-1), r"\(2, 0, 0, -1\); give at least one, and none negative"),
        (lambda: ElementFunctions(torsion=5, elements=2), "5 modes along torsion were requested; 2 elements have 4"),
        (lambda: ElementFunctions(z=4, elements=2, string=True, held=True), "4 modes along z .*; 2 elements have 3"),
        (lambda: MaterialTaper.table([-0.1, 1.0], mass=[1, 1]), r"points of a taper are \[-0\.1, 1\.0\]"),
        (lambda: MaterialTaper.table([0.1], mass=[1]), r"points of a taper are \[0\.1\]"),
        (lambda: deploying_tapered_line(line_of(), MaterialTaper.table([0.5, 1.0], torsion=[1, -0.5]), None, LENGTH,
                                        until=3.0), r"taper on its torsion falls to -0\.5; it must not be negative"),
        (lambda: deploying_tapered_line(line_of(), MaterialTaper.table([0.5, 1.0], axial=[1, np.nan]), None, LENGTH,
                                        until=3.0), r"taper on its axial falls to nan"),
        (lambda: deploying_line(line_of(), None, LENGTH, until=3.0, markers={"eye": -0.01}), r"'eye' stands at -0\.01"),
        (lambda: deploying_line(line_of(EIz=1.0), BeamFunctions(y=2), LENGTH, until=3.0, damping=(0.1,)),
         "1 damping ratios were given for 2 coordinates"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_said_with_its_name_and_number(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def test_a_length_may_reach_its_stock_and_a_strip_may_stay_flat():
    deploying_line(line_of(), None, LENGTH, until=3.0, stock=2.1)
    with pytest.raises(ValueError, match=r"grows to 2\.1 m, above the total length of the member, stock = 2\.0999 m"):
        deploying_line(line_of(), None, LENGTH, until=3.0, stock=2.0999)
    with pytest.raises(ValueError, match=r"falls to 0 m; it must stay above zero"):
        deploying_line(line_of(), None, Profile.polynomial(0.0, 1.0), until=1.0)
    flat = deploying_strip(DeployingStrip(2.0, 0.5, tension=1.0, root=ROOT, direction=WAY, across=NEAR), None, LENGTH,
                           until=3.0)  # fmt: skip
    assert flat.body.n_shapes == 0 and flat.body.moments.mass == pytest.approx(2.1)
    np.testing.assert_array_equal(flat.resting_rates(np.zeros(0)), np.zeros(0))
    centre = (0.6 * 1.2 + 0.0 * 0.9) / 2.1  # of 1.2 m that are out and 0.9 m at the exit
    np.testing.assert_allclose(flat.body.moments.center_of_mass(), ROOT + centre * FRAME[0], rtol=1e-9)


@pytest.mark.parametrize("numbers", [(4, 2, 1), (2, 4, 1), (1, 2, 4)])
def test_the_degree_of_strings_is_that_of_the_field_with_most_functions(numbers: tuple[int, int, int]):
    functions = StringFunctions(*numbers)
    assert functions.count == 7 and functions.most == 5


@pytest.mark.parametrize("size", [1e-14, 1.0, 1e14])
def test_rounding_is_taken_off_functions_of_any_size(size: float):
    """At xi = 0 the function is 3e-14 of its largest value, at 0.5 a quarter of it."""
    found = clean(lambda xi: size * (xi**2 + 3e-14), np.array([0.0, 1e-6, 0.5]))
    assert found[0] == 0.0 and found[1:] == pytest.approx(size * np.array([1e-12, 0.25]), rel=0.05)
