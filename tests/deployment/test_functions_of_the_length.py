"""Series in the length, polynomials between knots, the drawn coil of a drum, and the points of mass of a member."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body.mass_points import points_of_moments
from femflex.deployment import DeployingLine, deploying_line
from femflex.deployment.drawn import SIDES
from femflex.deployment.intervals import Pieces, gauss_between, integral_of
from femflex.deployment.series import added, at, derivative, mapped, product, scaled
from femflex.reduction import BeamFunctions
from femflex.system import Profile

A = {-1: np.array([1.0, 2.0]), 0: np.array([3.0, -1.0]), 2: np.array([0.5, 4.0])}
B = {-2: np.array([2.0, 1.0]), 0: np.array([-1.0, 5.0])}


def plain(series):
    """A series with its coefficients as lists, in ascending powers."""
    return {power: series[power].tolist() for power in sorted(series)}


def test_series_are_added_scaled_multiplied_and_differentiated_power_by_power():
    assert plain(added(A, B, {5: np.array([1.0, 1.0])})) == {-2: [2, 1], -1: [1, 2], 0: [2, 4], 2: [0.5, 4], 5: [1, 1]}
    assert plain(scaled(A, 3.0, -1)) == {-2: [3, 6], -1: [9, -3], 1: [1.5, 12]}
    assert plain(mapped(A, lambda rows: rows[::-1])) == {-1: [2, 1], 0: [-1, 3], 2: [4, 0.5]}
    assert plain(product(A, B, np.multiply)) == {-3: [2, 2], -2: [6, -1], -1: [-1, 10], 0: [-2, -1], 2: [-0.5, 20]}
    assert plain(derivative(A)) == {-2: [-1, -2], 1: [1, 8]}
    assert at(A, 2.0) == pytest.approx([0.5 + 3 + 2, 1 - 1 + 16])
    slope = (at(A, 1.3 + 1e-6) - at(A, 1.3 - 1e-6)) / 2e-6
    assert at(derivative(A), 1.3) == pytest.approx(slope, rel=1e-8)


@pytest.mark.parametrize(
    ("knots", "n", "count"), [([], 5, [5]), ([0.3], 40, [20, 20]), ([0.3], 41, [21, 21]), ([0.2, 0.7], 9, [12] * 3)]
)
def test_gauss_points_are_shared_out_between_knots_twelve_at_least(knots, n, count):
    x, w = gauss_between(np.array(knots), n)
    edges = np.array([0.0, *knots, 1.0])
    assert np.histogram(x, edges)[0].tolist() == count
    assert np.all(np.diff(x) > 0)
    for first, a, b in zip(np.cumsum([0, *count]), edges[:-1], edges[1:], strict=False):
        own = slice(first, first + count[0])
        assert w[own] @ x[own] ** 3 == pytest.approx((b**4 - a**4) / 4)


def test_polynomials_between_knots_take_the_right_side_at_a_knot_and_go_on_beyond_the_ends():
    """2 + s on the first interval, 5 s - P2(s) on the second, s from -1 to 1 over each."""
    coefficients = np.array([[[2.0], [1.0], [0.0]], [[0.0], [5.0], [-1.0]]])
    made = Pieces(np.array([0.0, 0.25, 1.0]), coefficients)
    xi = np.array([0.0, 0.125, 0.25, 0.625, 1.0])
    assert made(xi)[:, 0] == pytest.approx([1.0, 2.0, -6.0, 0.5, 4.0])
    assert made(xi, 1)[:, 0] == pytest.approx(np.array([8.0, 8.0, 8.0 * 8 / 3, 5.0 * 8 / 3, 2.0 * 8 / 3]))
    assert made(xi, 2)[:, 0] == pytest.approx(np.array([0.0, 0.0, -3.0, -3.0, -3.0]) * (8 / 3) ** 2)


def test_integrals_of_functions_that_jump_at_a_knot_are_continuous():
    edges = np.array([0.0, 0.4, 1.0])
    x = (np.polynomial.legendre.leggauss(6)[0] + 1) / 2
    first, second = 0.4 * x, 0.4 + 0.6 * x
    values = np.stack([np.stack([first**2, 3 + 0 * x], axis=1), np.stack([2 - second, second**3], axis=1)])
    found = integral_of(edges, values, 5)
    xi = np.array([0.1, 0.4, 0.9])
    wanted = [
        [0.1**3 / 3, 0.3],
        [0.4**3 / 3, 1.2],
        [0.4**3 / 3 + 2 * 0.5 - (0.81 - 0.16) / 2, 1.2 + (0.9**4 - 0.4**4) / 4],
    ]
    assert found(xi) == pytest.approx(np.array(wanted), rel=1e-13)
    assert found.edges is edges


@pytest.mark.parametrize(("drum", "radius"), [("root", None), ("root", 0.4), ("tip", 0.25)])
def test_the_coil_of_a_drum_shrinks_with_the_stowed_length_and_lies_beyond_its_end(drum, radius):
    """A full drum has its radius, or 2 % of the stock; an empty one 30 % of it."""
    line = DeployingLine(mass_per_length=1.0, direction=(0, 0, 2.0), orientation=(0, 1, 0))
    options = {"stock": 10.0, "until": 10.0, "drum": drum, "drum_radius": radius}
    full = radius or 0.2
    body = deploying_line(line, None, Profile.polynomial(4.0, 0.1), **options).body
    coil = body.skin.points[-2 * SIDES :]
    axis, across = coil @ [0, 0, 1.0], coil @ [0, 1.0, 0]
    centre = 4.0 + full if drum == "tip" else -full
    assert sorted({*np.round(across, 12)}) == [-full, full]
    size = full * (1 - 0.7 * 4.0 / 10.0)
    assert np.hypot(axis - centre, coil @ [1.0, 0, 0]) == pytest.approx(np.full(2 * SIDES, size))
    assert len(body.skin.cells["quad"]) >= SIDES


@pytest.mark.parametrize("drum", ["root", "tip"])
@pytest.mark.parametrize("functions", [None, BeamFunctions(y=2, z=1)])
def test_points_of_mass_have_the_moments_of_the_member_at_any_length(drum, functions):
    line = DeployingLine(mass_per_length=0.7, EIy=3.0, EIz=2.0, root=(0.3, -0.2, 0.1), direction=(1, 2, 2))
    made = deploying_line(line, functions, Profile.polynomial(4.0, 0.1), stock=6.0, until=10.0, drum=drum)
    points = made.variation.write.points
    assert points.direction == pytest.approx([1 / 3, 2 / 3, 2 / 3])
    assert points.numbers.shape == (len(points.mass), 8)
    tables = (points.phi, points.phi_inverse, points.drift, points.drift_inverse)
    assert all((points.tables[:, k] == one).all() for k, one in enumerate(tables))
    for L in (4.0, 4.7):
        mass = points.mass + points.density * L
        r = points.base + (points.along * L)[:, None] * points.direction
        shapes = points.phi + points.phi_inverse / L
        assert mass.sum() == pytest.approx(4.2)
        x = L / 2 * 0.7 * L + (L if drum == "tip" else 0.0) * 0.7 * (6.0 - L)
        first = 4.2 * np.array([0.3, -0.2, 0.1]) + x * np.array([1, 2, 2]) / 3
        assert mass @ r == pytest.approx(first, rel=1e-10)
        if L == 4.0:
            moments = made.body.moments
            assert np.einsum("p,pck->kc", mass, shapes) == pytest.approx(moments.first[1:], abs=1e-9)
            assert np.einsum("p,pa,pck->ack", mass, r, shapes) == pytest.approx(
                moments.second[0, :, 1:, :].swapaxes(1, 2), abs=1e-8
            )
            assert len(points_of_moments(moments).rho) == 6
