"""Colours of strain, energy and stress on skins of several members, from fields made by hand; bars and their titles."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from femflex.body import Skin
from femflex.body.strain_field import NAMES, StrainPart
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view.paint import BodyPaint, PeakPaint, Quantity, chosen, owners, painted
from femflex.view.shape_paint import shape_paint
from femflex.view.skin_strain import along_lines, carried, in_elements, on_skin
from femflex.view.units import Bar, clock, colour_bar, strain_bar, time_unit

RNG = np.random.default_rng(11)


def part_of(kind, places, per=1, n=2, stress=0.0, seed=0, **more):
    """A part whose gradients are linear in place: rows[p, g, k] = a[g, k] + b[g, k] . x."""
    rng = np.random.default_rng(seed)
    places = np.asarray(places, float)
    g = len(NAMES[kind])
    a, b = rng.normal(size=(g, n)), rng.normal(size=(g, n, 3))
    rows = a + np.einsum("gnx,px->pgn", b, places)
    C = rng.normal(size=(g, g))
    return StrainPart(
        kind, places, rng.uniform(0.5, 1.5, len(places)), rows.astype(np.float32), np.eye(g), np.zeros((g, g, g)),
        (C @ C.T)[None], np.full((1, g), stress), np.eye(n), False, per, **more,
    )  # fmt: skip


def exact(part, points, y, seed=0):
    """The strains of `part_of` at any places."""
    rng = np.random.default_rng(seed)
    g, n = len(NAMES[part.kind]), part.rows.shape[2]
    a, b = rng.normal(size=(g, n)), rng.normal(size=(g, n, 3))
    return (a + np.einsum("gnx,px->pgn", b, points)) @ y


GAUSS = (1 + np.array([-1, 1]) / np.sqrt(3)) / 2


def plate_places(nx=3, ny=2):
    """Four points in each of a row of rectangles, in the plane z = 0."""
    return np.array([[i + a, 1.5 * (j + b), 0] for i in range(nx) for j in range(ny) for a in GAUSS for b in GAUSS])


def solid_places(nx=3):
    return np.array([[i + a, b, c] for i in range(nx) for a in GAUSS for b in GAUSS for c in GAUSS])


def test_a_linear_field_is_carried_exactly_to_the_faces_of_solids_and_within_plates():
    solid = part_of("solid", solid_places(), 8)
    corners = np.array([[x, y, z] for x in (0.0, 0.3, 1.7, 3.0) for y in (0.0, 1.0) for z in (0.0, 0.6, 1.0)])
    y = np.array([0.7, -1.3])
    found = on_skin(solid, corners)
    assert found.strains(y[None])[0] == pytest.approx(exact(solid, corners, y), abs=1e-4)
    plate = part_of("plate", plate_places(), 4, seed=3)
    flat = np.array([[x, z, 0.0] for x in (0.0, 1.1, 3.0) for z in (0.0, 1.5, 2.9)])
    lifted = flat + np.array([0, 0, 0.4])  # the skin of a thick plate: as in its plane
    for points in (flat, lifted):
        assert on_skin(plate, points).strains(y[None])[0] == pytest.approx(exact(plate, flat, y, 3), abs=1e-4)
    for part, points in ((solid, corners), (plate, lifted)):
        weights = carried(part, points)
        assert weights.shape == (len(points), len(part.places))
        assert weights.sum(axis=1) == pytest.approx(np.ones(len(points)))
    single = part_of("plate", plate_places(1, 1))  # every point by itself: the nearest counts most
    nearest = in_elements(single, single.places).toarray()
    assert (np.diag(nearest) > 0.8).all() and nearest.min() >= 0 and nearest.sum(axis=1) == pytest.approx(np.ones(4))


def test_along_a_line_values_are_linear_between_the_two_nearest_points_and_a_little_beyond():
    s = np.array([0.0, 0.5, 1.5, 2.0])
    way = np.array([0.6, 0.0, 0.8])
    line = part_of("line", s[:, None] * way)
    across = np.array([0.0, 0.3, 0.0])
    at = np.array([-0.2, 0.1, 0.4, 0.9, 1.2, 1.9, 2.3])
    weights = along_lines(line, at[:, None] * way + across)
    assert weights @ s == pytest.approx(at) and weights.sum(axis=1) == pytest.approx(np.ones(7))
    far = along_lines(line, np.array([[-9.0, 0, -12.0]])).toarray()[0]
    assert far[:2] == pytest.approx([2.5, -1.5]) and far[2:] == pytest.approx([0, 0])  # no farther than 1.5 distances
    y = np.array([0.3, 0.9])
    on = on_skin(line, at[:, None] * way + across)
    assert on.strains(y[None])[0] == pytest.approx(exact(line, at[:, None] * way, y), abs=1e-5)
    assert on.per == 1 and not on.weight.any()


def two_members():
    """A plate, and a beam beside it that touches its skin by one corner; the skin of both, in two pieces."""
    plate = part_of("plate", plate_places(), 4)
    beam = part_of("line", [[0.3 * k, 3.2 + 0.25 * (k > 0) + 0.05 * k, 0] for k in range(9)], seed=5)
    x = np.array([[i, j, 0.0] for j in (0.0, 1.5, 3.0) for i in range(4)])
    rows = np.arange(12).reshape(3, 4)
    quads = np.stack([rows[:-1, :-1], rows[:-1, 1:], rows[1:, 1:], rows[1:, :-1]], axis=-1).reshape(-1, 4)
    s = np.linspace(0, 3, 12)
    edge = np.concatenate([np.stack([s, 3.3 + 0.0 * s, 0 * s], axis=1), np.stack([s, 3.6 + 0.1 * s, 0 * s], axis=1)])
    strip = np.array([[12 + k, 13 + k, 25 + k, 24 + k] for k in range(11)])
    points = np.concatenate([x, edge])
    return (plate, beam), Skin(points, {"quad": np.concatenate([quads, strip])}, np.zeros((2, len(points), 3)))


def test_every_point_of_a_skin_has_the_member_of_its_piece_and_what_lacks_the_quantity_is_bare():
    field, skin = two_members()
    owner = owners(field, skin)
    assert (owner[12:] == 1).all() and (owner[:12] == 0).all()
    corner = np.linalg.norm(field[1].places - skin.points[8], axis=1).min()
    assert corner < np.linalg.norm(field[0].places - skin.points[8], axis=1).min()  # it lies nearest to the beam
    small = np.array([[1.0, 3.9, 0], [1.2, 3.9, 0], [1.1, 4.1, 0]])  # a piece of few points has its member too
    cells = {**skin.cells, "triangle": np.array([[36, 37, 38]])}
    more = owners(field, Skin(np.concatenate([skin.points, small]), cells, np.zeros((2, 39, 3))))
    assert more.tolist() == [*owner.tolist(), 1, 1, 1]
    y = np.array([0.4, -0.8])
    bent = BodyPaint.of(chosen("strain:curvature_z", list(field), "b"), field, skin)
    values = bent.values(y)
    mine = owner == 1
    assert np.array_equal(bent.bare, ~mine) and np.isnan(values[~mine]).all()
    assert values[mine] == pytest.approx(
        (carried(field[1], skin.points[mine]) @ field[1].strains(y[None])[0, :, 1]), rel=1e-4
    )
    moment = BodyPaint.of(chosen("stress:moment_xy", list(field), "b"), field, skin)
    assert np.array_equal(moment.bare, mine)
    strains = exact(field[0], skin.points[~mine], y)
    resultants = strains @ field[0].elastic[0].T
    assert moment.values(y)[~mine] == pytest.approx(resultants[:, 5], rel=1e-3, abs=1e-3)


@pytest.mark.parametrize(
    ("colour", "unit", "title"),
    [
        ("energy", "%", "strain energy,\nof the largest\nof its kind"),
        ("energy:plate", "J/m²", "strain\nenergy"),
        ("energy:line", "J/m", "strain\nenergy"),
        ("strain:axial", "1", "axial\nstrain"),
        ("strain:membrane_xy", "1", "membrane\nxy\nstrain"),
        ("strain:curvature_xx", "1/m", "curvature\nxx"),
        ("strain:twist", "1", "twist"),
        ("stress:axial_force", "N", "axial\nforce"),
        ("stress:force_xy", "N/m", "force\nxy"),
        ("stress:moment_y", "N m", "moment\ny"),
    ],
)
def test_quantities_have_their_unit_and_title(colour, unit, title):
    field, _ = two_members()
    quantity = chosen(colour, list(field), "b")
    assert (quantity.unit, quantity.title) == (unit, title)
    assert Quantity("every", None, stress="von_mises").title == "von\nmises\nstress"
    assert chosen("energy", [field[0]], "b") == Quantity("plate", None)
    solid = chosen("strain:yz", [part_of("solid", solid_places(), 8)], "b")
    assert (solid.unit, solid.title, solid.number) == ("1", "yz\nstrain", 3)


def test_unknown_colours_name_the_known_ones_of_the_parts():
    field, _ = two_members()
    with pytest.raises(
        ValueError, match=r"colour 'x' is not known for b; known are displacement, energy, energy:line, ene"
    ):
        chosen("x", list(field), "b")
    with pytest.raises(
        ValueError, match=r"colour 'strain:yz' is not known for b; known are displacement, energy, strain:ax"
    ):
        chosen("strain:yz", [field[1]], "b")
    with pytest.raises(ValueError, match="colour 'strain:yz' needs the strain of flexible bodies, and b holds none"):
        chosen("strain:yz", [], "b")
    with pytest.raises(ValueError, match="colour 'x' is not known for b; known are displacement, energy, strain:axial"):
        chosen("x", [], "b")


@pytest.fixture
def painted_run(tmp_path):
    """A run of two bodies with fields, and one without; amplitudes by body."""
    field, skin = two_members()
    delta = {
        "one": np.array([[0.0, 0.0], [0.3, -0.2], [0.1, 0.6]]),
        "two": 3.0 * np.array([[0.2, 0.0], [-0.3, 0.4], [0.0, 0.1]]),
    }
    arrays = {f"bodies/{name}/delta": values for name, values in delta.items()}
    channels = {name: Channel("m", name, values.shape[1:]) for name, values in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, {}) as writer:
        writer.write_block(np.arange(3.0), arrays)
    bodies = {
        name: SimpleNamespace(n_modes=2, strain_field=field if name != "bare" else (), skin=skin)
        for name in ("bare", "two", "one")
    }
    with open_run(tmp_path / "run.h5") as run:
        yield run, bodies, field, skin, delta


def test_a_bar_holds_the_largest_value_of_all_bodies_over_the_run(painted_run):
    run, bodies, field, skin, delta = painted_run
    assert painted(run, bodies, "displacement") == ({}, None)
    for colour, number, kind in (("strain:axial", 0, 1), ("strain:shear_y", 7, 0), ("energy:plate", None, 0)):
        paints, bar = painted(run, bodies, colour)
        assert set(paints) == {"one", "two"}
        own = owners(field, skin) == kind
        part = on_skin(field[kind], skin.points[own])
        values = [part.energy(y) if number is None else part.strains(y)[:, :, number] for y in delta.values()]
        largest = max(np.abs(v).max() for v in values)
        assert largest * (1 - 1e-6) <= bar.top / bar.factor <= 1.7 * largest and bar.signed == (number is not None)
    paints, bar = painted(run, bodies, "energy")
    assert bar.unit == "%" and bar.top == 100.0 and not bar.signed
    found = np.array([paints[name].values(y) for name in delta for y in delta[name]])
    for kind in (0, 1):
        assert found[:, owners(field, skin) == kind].max() == pytest.approx(100.0, rel=1e-5)


def test_peaks_are_the_largest_magnitudes_over_the_run_of_every_body(painted_run):
    run, bodies, field, skin, delta = painted_run
    paints, bar = painted(run, bodies, "peak:moment_xy")
    own = owners(field, skin) == 0
    largest = 0.0
    for name, y in delta.items():
        moments = np.abs(field[0].strains(y) @ field[0].elastic[0].T)[..., 5].max(axis=0)
        expected = np.maximum(carried(field[0], skin.points[own]) @ moments, 0.0)
        found = paints[name].values(np.zeros(2))
        assert found[own] == pytest.approx(expected, rel=1e-4) and np.isnan(found[~own]).all()
        largest = max(largest, expected.max())
    assert (bar.unit.endswith("N"), bar.signed, bar.title) == (True, False, "peak\nmoment\nxy")
    assert largest <= bar.top / bar.factor * (1 + 1e-6) and bar.top / bar.factor <= 1.7 * largest
    assert isinstance(paints["one"], PeakPaint) and set(paints) == {"one", "two"}
    with pytest.raises(
        ValueError, match=r"colour 'peak:x' is not known for run.h5; peaks known are peak:force_xx, peak:fo"
    ):
        painted(run, bodies, "peak:x")
    with pytest.raises(ValueError, match=r"colour 'peak:x' is not known for run.h5; peaks known are none"):
        painted(run, {"bare": bodies["bare"]}, "peak:x")


def test_shapes_are_coloured_in_parts_of_their_own_largest_without_initial_stress():
    field, skin = two_members()
    stressed = tuple(part_of(p.kind, p.places, p.per, stress=50.0, seed=s) for p, s in zip(field, (0, 5), strict=True))
    body = SimpleNamespace(strain_field=stressed)
    owner = owners(field, skin)
    assert shape_paint(body, skin, "displacement") is None
    bent = shape_paint(body, skin, "strain:curvature_y")
    assert bent.signed
    for y in (np.array([0.0, 0.02]), np.array([5.0, 0.0])):
        bent.choose(y)
        values = bent.values(y)
        assert np.nanmax(np.abs(values)) == pytest.approx(1.0)
        plain = BodyPaint.of(chosen("strain:curvature_y", list(field), "b"), field, skin).values(y)
        assert values == pytest.approx(plain / np.nanmax(np.abs(plain)), rel=1e-5, nan_ok=True)
        assert bent.values(-y) == pytest.approx(-values, nan_ok=True)
    energy = shape_paint(body, skin, "energy")
    assert not energy.signed
    y = np.array([0.0, 0.02])
    energy.choose(y)
    values = energy.values(y)
    for kind in (0, 1):
        assert np.nanmax(values[owner == kind]) == pytest.approx(1.0, rel=1e-5)
    assert values == pytest.approx(energy.values(-y))  # linear strain: the same either way
    energy.choose(np.zeros(2))
    assert not np.nan_to_num(energy.values(np.zeros(2))).any()


@pytest.mark.parametrize(
    ("largest", "unit", "shown", "factor", "top"),
    [
        (3.1e-4, "1", "µε", 1e6, 400), (0.06, "1/m", "1/m", 1.0, 0.06), (0.04, "1/m", "1/km", 1e3, 40),
        (7.5e6, "Pa", "MPa", 1e-6, 8), (2.2e3, "N/m", "kN/m", 1e-3, 2.5), (0.9, "N", "mN", 1e3, 1000),
        (5e-5, "J/m³", "µJ/m³", 1e6, 50), (3e-9, "J/m", "nJ/m", 1e9, 3), (1.0, "N m", "N m", 1.0, 1),
        (1e-20, "N", "nN", 1e9, 1), (42.0, "%", "%", 1.0, 50),
    ],
)  # fmt: skip
def test_bars_are_in_the_unit_that_reads_well(largest, unit, shown, factor, top):
    bar = strain_bar(largest, unit, False, "t")
    assert (bar.unit, bar.title) == (shown, "t") and bar.factor == pytest.approx(factor)
    assert bar.top == pytest.approx(top) and bar.limits == (0.0, bar.top)


def test_labels_go_from_the_least_to_the_largest_with_the_decimals_they_need():
    assert Bar(1.0, "m", 1.5, 5).labels == ["0.0", "0.3", "0.6", "0.9", "1.2", "1.5"]
    assert Bar(1.0, "m", 0.25, 1, True).labels == ["-0.25", "0.00", "0.25"]
    assert Bar(1.0, "m", 40.0, 2, True).labels == ["-40", "-20", "0", "20", "40"]
    assert Bar(1.0, "m", 40.0, 2, True).limits == (-40.0, 40.0)
    assert (colour_bar(12e3).unit, colour_bar(12e3).top) == ("km", 12.0)


@pytest.mark.parametrize(
    ("t", "duration", "text"),
    [
        (0.5, 5.0, "0.500 s"), (12.0, 10.0, "12.00 s"), (599.96, 599.0, "600.0 s"), (61.26, 600.0, "1 min 01.3 s"),
        (3725.4, 7200.0, "1 h 02 min 05 s"), (1e-4, 2e-4, "0.0001000 s"), (3.5, 0.0, "3.5 s"), (0.1, 99.0, "0.10 s"),
    ],
)  # fmt: skip
def test_the_clock_has_one_width_over_a_run(t, duration, text):
    assert clock(t, duration) == text


@pytest.mark.parametrize(
    ("duration", "unit"),
    [
        (1199, (1, "s")),
        (1200, (60, "min")),
        (7199, (60, "min")),
        (7200, (3600, "h")),
        (345_599, (3600, "h")),
        (345_600, (86400, "days")),
    ],
)
def test_time_axes_change_their_unit_at_twenty_minutes_two_hours_and_four_days(duration, unit):
    assert time_unit(float(duration)) == unit
