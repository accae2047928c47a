"""Campbell diagrams of motions made by hand: what is followed, named, matched and met, each against its definition."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.dynamics.equilibria.small_motions import SmallMotions
from femflex.studies.campbell.crossings import crossings
from femflex.studies.campbell.diagram import Branch, assembled_diagram, followed
from femflex.studies.campbell.matching import Match, likeness, match
from femflex.studies.campbell.sweep import Spin, frame_of, walked


def motions(eigenvalues, shapes=None, M=None, growing=None) -> SmallMotions:
    values = np.asarray(eigenvalues, complex)
    n = len(values)
    M = np.eye(n) if M is None else M
    shapes = np.eye(n, dtype=complex) if shapes is None else shapes
    limit = np.full(n, 1e9) if growing is None else np.where(growing, -1e9, 1e9)
    return SmallMotions(values, shapes, values, (), M, 0.0, {}, False, ("",) * n, limit, limit)


def spin(speed, eigenvalues, words, asked=True, growing=None) -> Spin:
    return Spin(speed, asked, np.zeros(1), motions(eigenvalues, growing=growing), tuple(words))


def test_a_line_of_squares_meets_every_order_where_its_equation_says():
    """(2 pi f)^2 = a + b s^2 meets n s at s^2 = a / (n^2 - b); more samples than three are a cubic spline's."""
    speeds = np.array([0.0, 1.0, 2.5, 4.0, 6.0, 7.0])
    for count in (2, 3, 6):
        s = speeds[[0, 5]] if count == 2 else speeds[[0, 2, 5]] if count == 3 else speeds
        found = crossings("flap 1", s, np.sqrt(9.0 + 1.2 * s**2) / (2 * np.pi), [4, 3, 2, 1])
        assert [one.order for one in found] == [4, 3, 2]
        for one in found:
            assert one.speed == pytest.approx(np.sqrt(9.0 / (one.order**2 - 1.2)), rel=1e-9)
            assert one.frequency == pytest.approx(one.order * one.speed / (2 * np.pi)) and one.branch == "flap 1"


def test_a_curve_of_squares_is_met_on_its_parabola():
    s = np.linspace(0.5, 4.0, 9)
    found = crossings("x", s, np.sqrt(5.0 + 0.5 * s**2 + 0.11 * s**4) / (2 * np.pi), [2])
    z = np.roots([0.11, 0.5 - 4.0, 5.0])
    assert [one.speed for one in found] == pytest.approx(np.sqrt(z[(z > 0.25) & (z < 16)]).tolist()[::-1])


def test_a_branch_that_stops_to_swing_is_met_in_each_of_its_parts_and_at_a_sample_once():
    s = np.arange(9.0)
    squares = 12.0 + 0.0 * s  # meets once per turn at sqrt(12), twice at sqrt(3)
    f = np.sqrt(squares) / (2 * np.pi)
    f[2] = 0.0  # no swing from 1 to 3
    assert [(one.order, one.speed) for one in crossings("x", s, f, [1, 2])] == [(1, pytest.approx(np.sqrt(12.0)))]
    f = np.full(9, 4.0) / (2 * np.pi)
    f[5:] = np.nan
    assert [(one.order, one.speed) for one in crossings("x", s, f, [1, 2, 4])] == [(4, 1.0), (2, 2.0), (1, 4.0)]
    f[:] = 0.0
    f[4] = 4.0 / (2 * np.pi)  # alone
    assert crossings("x", s, f, [1]) == []


def test_branches_end_begin_and_are_taken_up_as_the_matches_say():
    found = [
        (spin(0.0, [2j, 3j, 9j], ["flap", "lag", "torsion"]), None),
        (spin(1.0, [2.1j, 3.2j, 5j, 9j], ["lag", "flap", "wobble", "torsion"]), Match(np.array([1, 0, -1]), 1.0)),
        (spin(2.0, [2.2j, 3.4j, 9j], ["lag", "flap", "torsion"]), Match(np.array([0, 1, -1, 2]), 1.0)),
    ]
    assert followed(found).tolist() == [[0, 1, 1], [1, 0, 0], [2, -1, -1], [-1, 2, -1], [-1, 3, 2]]


def diagram(**more):
    found = [
        (spin(0.0, [2j, 2j, 4j, 9j], ["lag", "flap", "flap", "torsion"]), None),
        (
            spin(0.5, [1.5j, -0.1 + 2.2j, 4.4j, 9j], ["flap", "lag", "flap", "torsion"], False),
            Match(np.array([1, 0, 2, 3]), 0.9),
        ),
        (
            spin(
                2.0,
                [0.5, -0.2 + 2.4j, 5j, 9j, 3j],
                ["tilt", "lag", "flap", "torsion", "wobble"],
                True,
                [True, False, False, False, False],
            ),
            Match(np.array([0, 1, 2, 3]), 0.9),
        ),
    ]
    return assembled_diagram(found, **{"modes": 3, "orders": (2, 1), "title": "made", **more})


def test_a_diagram_keeps_the_lowest_at_any_speed_and_what_grows_and_names_them_by_the_second_speed():
    found = diagram()
    assert (
        found.title == "made"
        and found.speeds.tolist() == [0.0, 0.5, 2.0]
        and found.asked.tolist() == [True, False, True]
    )
    assert [one.name for one in found.branches] == ["flap 1", "lag 1", "flap 2"]
    assert found.branch("flap 1").eigenvalues.tolist() == [2j, 1.5j, 0.5] and found.branch("flap 1").becomes == "tilt"
    assert (
        found.branch("lag 1").eigenvalues.tolist() == [2j, -0.1 + 2.2j, -0.2 + 2.4j]
        and found.branch("lag 1").becomes == ""
    )
    assert found.branch("flap 1").growing.tolist() == [False, False, True] and found.orders == (2, 1)
    assert [one.name for one in diagram(modes=4).branches] == ["flap 1", "lag 1", "flap 2", "torsion 1"]
    assert [one.name for one in diagram(modes=5).branches][-1].startswith("wobble")
    met = [(one.branch, one.order) for one in found.crossings]
    assert met == sorted(
        met, key=lambda pair: [one.speed for one in found.crossings if (one.branch, one.order) == pair]
    )
    assert ("lag 1", 2) in met and not diagram(orders=()).crossings
    speeds = [one.speed for one in found.crossings]
    assert speeds == sorted(speeds) and not diagram(complete=False).complete
    assert [one.name for one in diagram(modes=1).branches] == ["flap 1", "lag 1"]  # both were the lowest once


def test_a_diagram_gives_frequencies_at_its_speeds_alone():
    found = diagram()
    assert found.frequency("lag 1", 0.5) == pytest.approx(2.2 / (2 * np.pi))
    assert found.frequency("flap 2", 2.0 + 1e-10) == pytest.approx(5 / (2 * np.pi))
    with pytest.raises(
        KeyError, match=r"0\.6 rad/s is none of the diagram's speeds, from 0 to 2 rad/s; the nearest is 0\.5"
    ):
        found.frequency("lag 1", 0.6)
    with pytest.raises(KeyError, match="branch 'lag 2' is not in the diagram; it has flap 1, lag 1, flap 2"):
        found.branch("lag 2")


def test_a_diagram_in_plain_numbers_has_each_of_its_own():
    told = diagram().to_dict()
    lag = told["branches"][1]
    assert lag["name"] == "lag 1" and lag["growth"] == [0.0, -0.1, -0.2] and lag["stable"] == [True] * 3
    assert lag["frequency"] == pytest.approx([2 / (2 * np.pi), 2.2 / (2 * np.pi), 2.4 / (2 * np.pi)])
    assert lag["damping_ratio"] == pytest.approx([0.0, 0.1 / np.hypot(0.1, 2.2), 0.2 / np.hypot(0.2, 2.4)])
    assert told["branches"][0]["stable"] == [True, True, False] and told["branches"][0]["character"] == [
        "flap",
        "flap",
        "tilt",
    ]
    assert (told["over"], told["unit"], told["asked"]) == ("speed", "rad/s", [True, False, True])
    assert told["crossings"][0] == vars(diagram().crossings[0]) and told["complete"]


def test_a_branch_tells_its_damping_and_where_it_grows_fastest():
    values = np.array([-0.3 + 4j, 0.2 + 2j, 0.5 + 1e-12, -1e-10 + 3j, -0.7])
    one = Branch("x", values, ("x",) * 5, np.array([False, True, False, False, False]))
    assert one.damping_ratios[:4] == pytest.approx(
        [0.3 / abs(values[0]), -0.2 / abs(values[1]), np.nan, 0.0], nan_ok=True
    )
    assert np.isnan(one.damping_ratios[4]) and one.frequencies[4] == 0.0
    assert one.fastest == (1, pytest.approx(5.0))  # what does not count as growth is left out


def random_shapes(rng, n, M):
    """Complex shapes (n, n) of mass 1, orthogonal over M."""
    L = np.linalg.cholesky(M)
    Q = np.linalg.qr(rng.normal(size=(n, n)) + 1j * rng.normal(size=(n, n)))[0]
    return np.linalg.solve(L.T, Q)


def test_shapes_are_matched_through_any_order_phase_and_mixture():
    rng = np.random.default_rng(6)
    A = rng.normal(size=(5, 5))
    M = A @ A.T + 5 * np.eye(5)
    phi = random_shapes(rng, 5, M)
    order = np.array([3, 0, 4, 1, 2])
    turned = phi[:, order] * np.exp(1j * rng.uniform(0, 6, 5))
    first = motions(1j * np.array([1.0, 2.0, 3.0, 4.0, 5.0]), phi, M)
    found = match(first, motions(1j * np.array([4.1, 1.1, 5.1, 2.1, 3.1]), turned, M), 5)
    assert found.to[order].tolist() == [0, 1, 2, 3, 4] and found.worst == pytest.approx(1.0)
    single, alike = likeness(first, motions(1j * np.arange(5) + 7j, turned, M))
    assert single == pytest.approx(np.abs(phi.conj().T @ M @ turned) ** 2, abs=1e-12) and alike == pytest.approx(single)
    # two of one frequency may be any mixture
    mixed = phi.copy()
    mixed[:, :2] = phi[:, :2] @ (np.array([[1, 1], [-1, 1]]) / np.sqrt(2))
    last = motions(1j * np.array([2.5, 2.5, 3.0, 4.0, 5.0]), mixed, M)
    single, alike = likeness(first, last)
    assert single[:2, :2] == pytest.approx(0.5) and alike[:2, :2] == pytest.approx(1.0)
    assert alike[2:, :2] == pytest.approx(0.0, abs=1e-12) and likeness(last, first)[1] == pytest.approx(alike.T)
    assert match(first, last, 5).worst == pytest.approx(1.0)


def test_only_the_lowest_count_for_the_worst_likeness_and_shapes_may_be_lost():
    phi = np.eye(4, dtype=complex)
    spoiled = phi.copy()
    c, s = np.cos(0.5), np.sin(0.5)
    spoiled[:, 2:] = phi[:, 2:] @ np.array([[c, -s], [s, c]])
    first, last = motions(1j * np.arange(1.0, 5.0), phi), motions(1j * np.arange(1.0, 5.0), spoiled)
    assert match(first, last, 2).worst == pytest.approx(1.0) and match(first, last, 3).worst == pytest.approx(c**2)
    fewer = motions(1j * np.array([1.0, 3.0]), phi[:, [0, 2]], np.eye(4))
    assert match(first, fewer, 4).to.tolist() == [0, -1, 1, -1]
    assert match(fewer, first, 1).to.tolist() == [0, 2]
    raised = motions(1j * np.array([4.0, 1.0, 2.0, 3.0]), spoiled[:, [3, 0, 1, 2]])  # low at the second alone
    assert match(first, raised, 1).worst == pytest.approx(c**2)


def test_near_speeds_go_by_frequency_where_shapes_change_places():
    phi = np.eye(2, dtype=complex)
    first, last = motions([1j, 2j], phi), motions([1j, 2j], phi[:, ::-1])
    assert match(first, last, 2).to.tolist() == [1, 0] and match(first, last, 2, close=True).to.tolist() == [0, 1]


def test_between_speeds_at_which_shapes_turn_more_are_looked_at_in_order():
    """A shape that turns by 1 rad from 0 to 1 and on to 2: likeness cos^2 is 0.8 for steps of 0.46 rad."""
    asked = []

    def at(value: float, near, requested: bool) -> Spin:
        asked.append((value, near if near is None else float(near[0]), requested))
        c, s = np.cos(value), np.sin(value)
        return Spin(
            value, requested, np.array([value]), motions([1j, 2j], np.array([[c, -s], [s, c]], complex)), ("a", "b")
        )

    told = []
    found = list(walked(at, [0.0, 1.0, 2.0], 1, told.append))
    speeds = [one.speed for one, _ in found]
    assert speeds == [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0] and told == [0.0, 1.0, 2.0]
    assert [one.asked for one, _ in found] == [value in (0.0, 1.0, 2.0) for value in speeds]
    assert found[0][1] is None and all(link.to.tolist() == [0, 1] for _, link in found[1:])
    assert all(link.worst == pytest.approx(np.cos(0.25) ** 2) for _, link in found[1:])
    assert asked[:4] == [(0.0, None, True), (1.0, 0.0, True), (0.5, 0.0, False), (0.25, 0.0, False)]


def test_a_jump_is_passed_after_as_many_halvings_as_are_said():
    def at(value: float, near, requested: bool) -> Spin:
        shapes = np.eye(2, dtype=complex)
        return Spin(
            value,
            requested,
            np.zeros(1),
            motions(
                [1j, 2j], shapes if value < 0.3 else shapes[:, ::-1] @ np.array([[1, 0.9], [-0.9, 1]]) / np.sqrt(1.81)
            ),
            ("a", "b"),
        )

    speeds = [one.speed for one, _ in walked(at, [0.0, 1.0], 2)]
    assert min(np.diff(speeds)) == 1 / 64 and speeds == sorted(speeds) and len(speeds) == 8


def test_a_frame_spins_about_its_axis_whatever_its_length():
    assert frame_of(np.array([0.0, 3.0, 4.0]), 2.0).rate == pytest.approx([0.0, 1.2, 1.6])
    assert frame_of(np.array([0.0, 3.0, 4.0]), 2.0).kind == "spinning"
