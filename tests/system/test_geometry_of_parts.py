"""Parts of a system against geometry made apart: masses as points, joints as turned frames, tables as sums."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.body.mass_points import MassPoints
from femflex.body.skin import Skin
from femflex.system import (
    Block,
    Effector,
    Environment,
    Friction,
    Joint,
    Latch,
    LengthTable,
    Load,
    MovingPoints,
    Orbit,
    Profile,
    Sight,
    Supply,
    System,
    TabulatedDamper,
    TabulatedSpring,
    Threshold,
    Variation,
    attached_moments,
    ball_coordinates,
    closure,
    coasting,
    coasting_gyro,
    control_moment_gyro,
    cylindrical,
    free,
    prismatic,
    pulse_train,
    reaction_wheel,
    revolute,
    spherical,
    tank,
    tank_variation,
    thruster,
    turns,
    unbalanced_rotor,
    universal,
    weld,
    with_attached,
    with_wheel,
    without_axial_inertia,
)
from femflex.system.attraction import extent, is_integrated, reach
from femflex.system.ball import ball_names
from femflex.system.fixed_length import fixed_lengths, moving_lengths
from femflex.system.kept import kept
from femflex.system.turning import can_lock, free_turns, lock_angle, locked

RNG = np.random.default_rng


def cloud_moments(mass, rho, phi):
    z = np.concatenate([rho[:, None], phi.swapaxes(1, 2)], axis=1)
    return MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))


def flexible(seed=0, n=2, skin=None, **markers):
    rng = RNG(seed)
    mass, rho, phi = rng.uniform(0.5, 2.0, 7), rng.normal(size=(7, 3)), 0.3 * rng.normal(size=(7, 3, n))
    K = rng.normal(size=(n, n))
    axes = Rotation.random(random_state=seed + 5).as_matrix()
    at = Marker(np.array([0.4, -0.7, 0.2]), rng.normal(size=(3, n)), rng.normal(size=(3, n)), axes)
    return FlexibleBody(
        cloud_moments(mass, rho, phi), StrainTensors.linear(K @ K.T), K.T @ K, {"tip": at} | markers, skin
    )


def same_moments(a, b, **close):
    for x, y in ((a.mass, b.mass), (a.first, b.first), (a.second, b.second)):
        np.testing.assert_allclose(x, y, **({"rtol": 1e-10, "atol": 1e-12} | close))


def test_an_attached_mass_is_a_cloud_of_points_that_turn_with_the_marker():
    body, rng = flexible(), RNG(1)
    at = body.marker("tip")
    dm, e = rng.uniform(0.1, 0.4, 9), rng.normal(size=(9, 3))
    e -= dm @ e / dm.sum()  # from their centre, axes of the marker
    J = np.einsum("p,pab->ab", dm, (e**2).sum(1)[:, None, None] * np.eye(3) - e[:, :, None] * e[:, None, :])
    arms = e @ at.orientation.T
    moved = at.phi + np.cross(at.psi.T[None], arms[:, None]).swapaxes(1, 2)
    same_moments(attached_moments(body, "tip", dm.sum(), J), cloud_moments(dm, at.position + arms, moved))
    there = with_attached(body, "tip", dm.sum(), J)
    same_moments(with_attached(there, "tip", -dm.sum(), -J).moments, body.moments)
    with pytest.raises(ValueError, match=r"without the mass removed at marker 'tip' the body has -0\.5 kg; it needs"):
        with_attached(body, "tip", -body.moments.mass - 0.5, np.zeros((3, 3)))
    light = rigid_body(2.0, [1.0, 2.0, 2.5], markers={"m": Marker.rigid(np.zeros(3))})
    with pytest.raises(ValueError, match=r"at marker 'm' the body has a principal inertia of -0\.5 kg m\^2: "):
        with_attached(light, "m", 0.0, np.diag([-1.5, 0.0, 0.0]))
    assert with_attached(light, "m", 0.0, np.diag([-1.0, 0.0, 0.0])).moments.inertia()[0, 0] == pytest.approx(0.0)


def test_a_wheel_is_taken_out_along_its_axis_and_added_across_it():
    at = Marker.rigid([0.3, 0.1, -0.2], Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix())
    body = rigid_body(20.0, [5.0, 6.0, 7.0], [0.1, 0.2, -0.1], {"bay": at})
    wheel = reaction_wheel("w", "hub", 0.4, marker="bay", axis=(1.0, -2.0, 2.0), initial_speed=-30.0, max_speed=50.0)
    a = at.orientation @ np.array([1.0, -2.0, 2.0]) / 3.0
    less = body.moments.inertia() - without_axial_inertia(body, wheel).moments.inertia()
    np.testing.assert_allclose(less, 0.4 * np.outer(a, a), atol=1e-12)
    more, r = with_wheel(body, wheel, 3.0, 0.25).moments, at.position
    added = 0.25 * (np.eye(3) - np.outer(a, a)) + 3.0 * (r @ r * np.eye(3) - np.outer(r, r))
    np.testing.assert_allclose(more.inertia() - body.moments.inertia(), added, atol=1e-12)
    np.testing.assert_allclose(more.first[0] - body.moments.first[0], 3.0 * r, atol=1e-12)
    assert wheel.sizes == pytest.approx([12.0]) and wheel.starts == {"speed": ("momentum", -30.0)}
    assert reaction_wheel("w", "hub", 0.4, initial_speed=0.5).sizes == pytest.approx([0.4])
    rotor = coasting(wheel, -7.0)
    np.testing.assert_allclose(rotor.parameters, [1 / 3, -2 / 3, 2 / 3, -7.0])
    assert rotor.markers == (("hub", "bay"),) and rotor.act == "rotor" and not rotor.states


def test_an_unbalanced_rotor_has_the_products_of_two_small_masses():
    plain = unbalanced_rotor(5.0, 0.3, 0.2)
    # two masses at opposite heights and sides: int x z dm = 2 m x h; a third in the plane moves the centre
    m, x, h = 0.01, 0.2, 0.15
    rotor = unbalanced_rotor(5.0, 0.3, 0.2, 0.02, 2 * m * x * h)
    Q = rotor.moments.second[0, :, 0, :]
    assert Q[0, 2] == Q[2, 0] == pytest.approx(2 * m * x * h)
    np.testing.assert_allclose(rotor.moments.first[0], [0.02, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(np.diag(rotor.moments.inertia()), [0.2, 0.2, 0.3])
    np.testing.assert_allclose(plain.moments.inertia(), np.diag([0.2, 0.2, 0.3]), atol=1e-15)


@pytest.mark.parametrize("double", [False, True])
def test_a_coasting_gyro_keeps_the_axis_to_which_its_gimbals_have_turned_the_rotor(double):
    g, s, inner = np.array([0.0, 0.6, 0.8]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.8, -0.6])
    more = {"inner_axis": 3.0 * inner, "rates": [0.1, "law.u"]} if double else {"rates": ["law.u"]}
    gyro = control_moment_gyro("g", "hub", -4.0, gimbal_axis=2.0 * g, spin_axis=5.0 * s, **more)
    angles = np.array([0.7, -1.1])[: 1 + double]
    frame = Rotation.from_rotvec(0.7 * g)  # the outer gimbal, which carries the inner one
    turned = frame.apply(Rotation.from_rotvec(-1.1 * inner).apply(s)) if double else frame.apply(s)
    rotor = coasting_gyro(gyro, angles)
    np.testing.assert_allclose(rotor.parameters, [*turned, -4.0], atol=1e-12)
    assert list(gyro.states) == (["angle1", "angle2"] if double else ["angle"]) and gyro.inputs == ("law.u",)


def test_a_thruster_pushes_along_its_misaligned_axis_and_empties_its_tank_by_specific_impulse():
    turn = np.array([0.1, -0.2, 0.3])
    pulses = pulse_train(1.0, 4.0, 0.5, 3)
    assert pulses == [(1.0, 0.5), (5.0, 0.5), (9.0, 0.5)]
    jet = thruster(
        "jet", "hub", 2.5, marker="n", axis=(1.0, 2.0, -2.0), misalignment=turn, pulses=pulses, lag=0.2,
        specific_impulse=220.0, supply=Supply("main", "bus", "t", 0.3),
    )  # fmt: skip
    d = Rotation.from_rotvec(turn).apply(np.array([1.0, 2.0, -2.0]) / 3.0)
    times = [1.0, 1.5, 5.0, 5.5, 9.0, 9.5]
    wanted = [*d, 2.5, 9.80665 * 220.0, 0.2, 0.0, 1.0, 1.0, 0.09, 6.0, *times, *[1.0, 0.0] * 3]
    np.testing.assert_allclose(jet.parameters, wanted, rtol=1e-12)
    np.testing.assert_allclose(jet.breaks, times)
    assert jet.markers == (("hub", "n"), ("bus", "t")) and jet.inputs == ("main.feed",)
    assert jet.states == {"lagged": "N"} and jet.sizes == pytest.approx([2.5])
    event = tank("main", 7.0, ("jet", "jet2")).events[0]
    assert event.value(3.0, np.array([2.0, 1.0, -1.0])) == 2.0 and event.value(3.0, np.array([-2.0, 0.0, 1.0])) == 1.0
    np.testing.assert_array_equal(event.happen(3.0, np.array([1e-9, 1.0, -1.0])), [0.0, 0.0, 3.0])


def test_a_body_less_its_propellant_plus_units_of_it_is_the_body_with_full_tanks():
    body = flexible(3, fore=Marker.rigid([0.5, 0.1, 0.0], n_modes=2))
    tanks = {"a": ("tip", 1.5, 0.1), "b": ("fore", 0.8, 0.2)}
    variation = tank_variation(body, tanks)
    assert variation.states == ("a.mass", "b.mass") and variation.varies == ("mass",)
    block = Block(body, ("mass",))
    dry, *units = variation.numbers[2:].reshape(3, block.size)
    assert variation.numbers[0] == -1.0 and variation.numbers[1] == block.size
    np.testing.assert_allclose(dry + 1.5 * units[0] + 0.8 * units[1], block.laid(body), atol=1e-12)
    at = body.marker("tip").position  # of a unit of the first tank: a ball of that gyration radius at its marker
    np.testing.assert_allclose(units[0][:4], [1.0, *at])
    np.testing.assert_allclose(units[0][4:13].reshape(3, 3), np.outer(at, at) + 0.01 / 2 * np.eye(3), atol=1e-12)
    with pytest.raises(ValueError, match=r"the tanks a, b hold 1002\.3 kg of propellant, and their body"):
        tank_variation(body, {"a": ("tip", 1.5, 0.1), "b": ("fore", 1000.8, 0.2)})
    small = rigid_body(2.0, [0.1, 0.1, 0.1], markers={"m": Marker.rigid(np.zeros(3))})
    with pytest.raises(ValueError, match=r"the tanks c leave a principal inertia of -0\.9 kg m\^2 when they are empty"):
        tank_variation(small, {"c": ("m", 1.0, 1.0)})


JOINTS = [
    weld("b"),
    revolute("b", axis=(1.0, 2.0, -0.5)),
    prismatic("b", axis=(0.3, -1.0, 2.0)),
    cylindrical("b", axis=(0.3, -1.0, 2.0)),
    universal("b", axes=((1.0, 0.2, 0.0), (0.3, -0.4, 1.0))),
    spherical("b"),
    Joint("b", translations=[[1.0, 0.0, 1.0], [0.0, 1.0, 0.5]], rotations=[[0.2, 0.1, 1.0]]),
    Joint("b", translations=[[1.0, 0.0, 1.0]], ball="euler_parameters"),
    turns("b", sequence="zxy", slides=[[1.0, 0.4, 0.0]]),
]


@pytest.mark.parametrize("joint", JOINTS, ids=[f"{k}-{joint.kind}" for k, joint in enumerate(JOINTS)])
def test_a_cut_joint_locks_all_that_it_does_not_leave_free_and_nothing_else(joint):
    rng, c = RNG(4), closure(joint)
    assert c.n_rows == 6 - joint.n_u

    def residual(slides, C):
        r = np.asarray(slides) @ joint.translations if len(joint.translations) else np.zeros(3)
        return gaps(r, C)

    def gaps(r, C):
        return np.array([e[:3] @ r - e[3] for e in c.slides] + [p[:3] @ C @ p[3:6] - p[6] for p in c.pairs])

    for _ in range(3):  # anywhere that the joint goes nothing is misfit
        C = np.eye(3)
        for axis in joint.rotations:
            C = C @ Rotation.from_rotvec(rng.normal() * axis).as_matrix()
        C = Rotation.random(random_state=3).as_matrix() if joint.ball else C
        slides = rng.normal(size=len(joint.translations))
        np.testing.assert_allclose(residual(slides, C), 0.0, atol=1e-12)
    # and every small motion that it does not allow is seen: as many independent rows as it locks
    start = Rotation.from_rotvec(0.3 * joint.rotations[0]).as_matrix() if len(joint.rotations) else np.eye(3)
    columns = [gaps(1e-6 * v, start) for v in np.eye(3)]
    columns += [gaps(np.zeros(3), start @ Rotation.from_rotvec(1e-6 * v).as_matrix()) for v in np.eye(3)]
    if c.n_rows:
        assert np.linalg.svd(np.array(columns))[1][c.n_rows - 1] > 1e-7


def test_the_angle_to_gimbal_lock_is_that_of_the_axes_as_they_stand():
    a = np.array([[1.0, 0.2, 0.0], [0.1, 1.0, -0.3], [0.3, -0.2, 1.0]])
    joint = Joint("b", name="gimbal", translations=[[1.0, 0.0, 0.0]], rotations=a, q0=[0.5, 0.2, 0.9, -0.4])
    a = joint.rotations
    q = np.array([[0.5, 0.2, 0.9, -0.4], [0.1, -2.0, 0.3, 1.0]])
    for row, found in zip(q, lock_angle(joint, q), strict=True):
        third = Rotation.from_rotvec(row[2] * a[1]).apply(a[2])
        # the third axis has its foot in the plane of the first two
        coefficients = np.linalg.lstsq(a[:2].T, third, rcond=None)[0]
        foot = coefficients @ a[:2]
        wanted = math.atan2(np.linalg.norm(third - foot), np.linalg.norm(foot))
        assert found == pytest.approx(wanted, rel=1e-9)
    assert can_lock(joint) and free_turns(joint) == [0, 1, 2]

    def between(u, v):
        return math.asin(np.linalg.norm(np.cross(u, v)))

    held = replace(joint, motion=(None, None, 0.9, None))
    third = Rotation.from_rotvec(0.9 * a[1]).apply(a[2])
    assert lock_angle(held, q[0]) == pytest.approx(between(a[0], third)) and free_turns(held) == [0, 2]
    last = replace(joint, motion=(None, 0.2, None, None))
    assert not can_lock(last) and lock_angle(last, q[0]) == pytest.approx(between(a[1], a[2]))
    alone = replace(joint, motion=(None, 0.2, 0.9, None))
    assert lock_angle(alone, q[0]) == pytest.approx(np.pi / 2) and lock_angle(spherical("b"), np.zeros(4)) > 1.5
    flat = turns("b", name="t", sequence="xyx", q0=[0.1, 0.0, 0.3])
    text = flat.singular_start()
    assert (
        "joint 't' starts in gimbal lock: the axes of its free turns 't.angle1', 't.angle2', 't.angle3' are in one"
        in text
    )
    assert "in one plane to 0 rad (turns of 5.72958, 0, 17.1887 deg)" in text
    assert "'gimbal.angle1', 'gimbal.angle3' are parallel to" in locked(held, q[0])


def test_a_reach_is_the_longest_chain_over_the_perigee():
    far = Marker.rigid([0.0, 3.0, 4.0])
    skin = Skin(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -6.0]]), {}, np.zeros((0, 2, 3)))
    hub = rigid_body(1.0, [1.0, 1.0, 1.0], markers={"m": far})
    arm = rigid_body(1.0, [1.0, 1.0, 1.0], skin=skin)
    tip = replace(arm, skin=None, mass_points=MassPoints(np.ones(2), np.array([[7.0, 0, 0], [0, 2.0, 0]]), None))
    assert extent(hub) == pytest.approx(5.0) and extent(arm) == pytest.approx(6.0) and extent(tip) == pytest.approx(7.0)
    bare = rigid_body(3.0, [2.0, 3.0, 4.0], [0.0, 0.0, 2.0])
    # six points m/6 at sqrt(3 q / m) along each axis about the centre, q_z = (2 + 3 - 4) / 2
    assert extent(bare) == pytest.approx(2.0 + math.sqrt(0.5))
    joints = (spherical("hub"), weld("arm", "hub"), weld("tip", "arm"), weld("side", "hub"))
    bodies = {"hub": hub, "arm": arm, "tip": tip, "side": bare}
    orbit = Orbit(8e6, 0.125)
    found = reach(System(bodies, joints, orbit=orbit))
    assert (found.size, found.radius) == pytest.approx((18.0, 7e6))
    assert (found.ratio, found.error) == pytest.approx((18.0 / 7e6, 27.0 / 7e6))
    longer = reach(System(bodies, joints, orbit=orbit), {"side": 40.0})
    assert longer.size == pytest.approx(45.0)
    assert reach(System({"hub": hub}, (free("hub"),))) is None


def deploying(length, stock=None, points=None, bounds=(1.0, 900.0)):
    table = LengthTable(length, [{(0, 0, 0): np.ones(16)}], stock=stock, bounds=bounds, points=points)
    return Variation(table, ("mass",))


def test_attraction_is_integrated_where_the_craft_is_long_and_its_points_are_known():
    p = MovingPoints(np.eye(3)[0], *np.ones((2, 1)), np.zeros((1, 3)), *np.ones((2, 1)), *np.zeros((4, 1, 3, 0)))
    hub, long = (
        rigid_body(1.0, [1.0, 1.0, 1.0]),
        rigid_body(1.0, [1.0, 1.0, 1.0], markers={"m": Marker.rigid([0.0, 600.0, 500.0])}),
    )
    orbit, joints = Orbit(7e6), (spherical("hub"), weld("arm", "hub"))

    reel = Effector("reel", lambda *_: None, states={"length": "m", "rate": "m/s"})

    def craft(body=hub, attraction="auto", **varying):
        return System(
            {"hub": hub, "arm": body}, joints, orbit=orbit, environment=Environment(attraction=attraction),
            varying={"arm": varying["arm"]} if varying else {}, effectors=(reel,),
        )  # fmt: skip

    assert not is_integrated(craft()) and is_integrated(craft(long)) and is_integrated(craft(attraction="exact"))
    assert not is_integrated(craft(long, "gradient"))
    constant = Profile.constant(2.0)
    assert is_integrated(craft(hub, arm=deploying(constant, points=p)))  # by its largest length
    assert not is_integrated(craft(hub, arm=deploying(constant, points=p, bounds=(1.0, 600.0))))
    assert not is_integrated(craft(hub, arm=deploying(constant)))
    for stock, bounds, long_enough in (
        (900.0, 5.0, True),
        (500.0, 900.0, True),
        (None, 900.0, True),
        (500.0, 5.0, False),
    ):
        free_length = deploying("reel.length", stock, p, (1.0, bounds))
        assert is_integrated(craft(hub, arm=free_length)) is long_enough
    soft = replace(flexible(), markers=flexible().markers | {"far": Marker.rigid([900.0, 0, 0], n_modes=2)})
    assert not is_integrated(craft(soft)) and is_integrated(craft(soft, "exact"))
    known = replace(soft, mass_points=MassPoints(np.ones(1), np.zeros((1, 3)), np.zeros((1, 3, 2))))
    assert is_integrated(craft(known))


def test_lengths_that_stay_are_told_from_those_that_move():
    from types import SimpleNamespace

    system = SimpleNamespace(
        varying={
            "a": deploying(Profile.polynomial(3.0, 0.5)),
            "b": deploying(Profile.constant(4.0)),
            "c": deploying("reel.length"),
            "d": Variation(lambda *_: None, ("mass",)),
            "e": deploying(Profile.sine(0.5, 2.0, mean=5.0)),
        }
    )
    assert moving_lengths(system) == ["a", "e"] and fixed_lengths(system) == {"b": 4.0}
    assert not Profile.sine(0.5, 0.0, 1.0).moves and Profile.sine(0.5, 2.0).moves and not Profile.sine(0.0, 2.0).moves


def test_a_table_over_the_length_is_the_sum_of_its_powers_piece_by_piece_and_so_are_its_numbers():
    rng = RNG(9)
    first = {(-2, 0, 0): rng.normal(size=16), (1, 1, 0): rng.normal(size=16), (0, 2, 1): rng.normal(size=16)}
    first[1, 1, 0][4:12] = 0.0
    first[0, 2, 1][:4] = 0.0
    second = {(0, 0, 0): rng.normal(size=16), (3, 0, 2): rng.normal(size=16)}
    table = LengthTable("r.length", [first, second], [1.0, 2.5], [0.5, 2.0], drum_mass=0.75)
    for L, piece, s in ((0.7, first, -0.6), (2.4, first, 2.8), (2.5, second, 0.0), (4.0, second, 0.75)):
        U, A = -1.3, 0.6
        wanted = sum(s**p * U**a * A**b * values for (p, a, b), values in piece.items())
        np.testing.assert_allclose(table.at(L, U, A), wanted, rtol=1e-12)
    numbers = table.numbers()
    n_pieces, n_terms, n_runs, n_values, least, most = numbers[:6].astype(int)
    assert (n_pieces, n_terms, least, most, numbers[6]) == (2, 5, -2, 3, 0) and numbers[11] == 0.75
    rest = numbers[12:]
    np.testing.assert_array_equal(rest[:4], [1.0, 2.5, 0.5, 2.0])
    terms = rest[4 : 4 + 3 * n_terms].reshape(n_terms, 3)
    runs = rest[4 + 3 * n_terms : 4 + 3 * n_terms + 4 * n_runs].reshape(n_runs, 4).astype(int)
    values = rest[4 + 3 * n_terms + 4 * n_runs :].reshape(n_pieces, n_values)
    for k, (L, s) in enumerate(((2.4, 2.8), (4.0, 0.75))):
        out, at = np.full(16, np.nan), 0
        for place, groups, term, added in runs:
            p, a, b = terms[term]
            own = values[k, at : at + 4 * groups] * s**p * (-1.3) ** a * 0.6**b
            here = slice(place, place + 4 * groups)
            out[here] = out[here] + own if added else own
            at += 4 * groups
        np.testing.assert_allclose(out, table.at(L, -1.3, 0.6), rtol=1e-12)


def test_the_blocks_of_a_body_hold_each_number_once_in_its_place():
    body = flexible(6, 5)
    parts = ("mass", "stiffness", "damping", "marker/tip")
    block = Block(body, parts)
    out, P = block.laid(body), body.moments.second

    def rows(place, *shape, n=5, wide=8):
        return out[place : place + int(np.prod(shape)) * wide].reshape(*shape, wide)[..., :n]

    np.testing.assert_allclose(out[block.mass : block.mass + 4], [body.moments.mass, *body.moments.first[0]])
    np.testing.assert_allclose(rows(block.first, 3), body.moments.first[1:].T)
    np.testing.assert_allclose(rows(block.second, 6, 3, 3), np.einsum("Aakc->Aack", P[:, :, 1:]))
    np.testing.assert_allclose(rows(block.stiffness, 5), body.strain.V1)
    np.testing.assert_allclose(rows(block.damping, 5), body.damping.T)
    at, place = body.marker("tip"), block.markers["tip"]
    np.testing.assert_allclose(out[place : place + 12], [*at.position, *at.orientation.ravel()])
    np.testing.assert_allclose(rows(place + 24, 3), at.phi)
    np.testing.assert_allclose(rows(place + 24 + 9 * 8, 3), at.psi)
    assert block.rates == block.growth == block.strain == block.pickup == -1
    filled = 13 + 15 + 6 * 9 * 5 + 25 + 25 + 12 + 30
    assert np.count_nonzero(out) == filled


def test_a_station_turns_eastwards_from_its_longitude():
    sight = Sight("s", "hub", axis=(0.0, 3.0, 4.0), latitude=0.5, longitude=-0.3, radius=6e6, rate=2e-4)
    np.testing.assert_allclose(sight.axis, [0.0, 0.6, 0.8])
    times = np.array([0.0, 700.0, 5000.0])
    start = 6e6 * np.array([math.cos(0.5) * math.cos(0.3), -math.cos(0.5) * math.sin(0.3), math.sin(0.5)])
    turned = [Rotation.from_rotvec([0.0, 0.0, 2e-4 * t]).apply(start) for t in times]
    np.testing.assert_allclose(sight.station(times), turned, rtol=1e-12)


def test_an_orbit_has_the_period_of_kepler_and_its_axes_from_three_turns():
    orbit = Orbit(9e6, 0.1, 0.4, 1.1, -0.7, mu=3e14)
    assert orbit.period == pytest.approx(2 * math.pi * math.sqrt(9e6**3 / 3e14))
    turned = [Rotation.from_rotvec(v).as_matrix() for v in ([0, 0, 1.1], [0.4, 0, 0], [0, 0, -0.7])]
    np.testing.assert_allclose(orbit.C_NP(), turned[0] @ turned[1] @ turned[2], atol=1e-12)
    other = Orbit.from_perigee(4e5, 0.2, 5e6, inclination=0.3)
    assert other.semi_major_axis * 0.8 == pytest.approx(5.4e6) and other.inclination == 0.3


def test_tables_of_springs_and_dampers_go_on_straight_and_store_what_they_resist():
    x, f = np.array([-1.0, 0.5, 1.0, 3.0]), np.array([-4.0, 1.0, 3.0, 8.0])
    spring = TabulatedSpring(stretch=x, resisting=f)
    np.testing.assert_allclose(spring.force(x, 0.0 * x), f, atol=1e-12)
    assert spring.energy(np.zeros(1)) == pytest.approx(0.0, abs=1e-14)
    for lower, upper in ((-3.0, -0.5), (-0.5, 0.7), (2.0, 6.0)):
        q, w = np.polynomial.legendre.leggauss(5)
        cuts = np.unique(np.clip([lower, *x, upper], lower, upper))
        work = sum((b - a) / 2 * w @ spring.force((a + b) / 2 + (b - a) / 2 * q, 0 * q) for a, b in pairwise(cuts))
        energies = spring.energy(np.array([lower, upper]))
        assert energies[1] - energies[0] == pytest.approx(work, rel=1e-10)
    for far in (np.array([-3.0, -2.0, -1.0]), np.array([3.0, 4.0, 5.0])):
        forces = spring.force(far, 0 * far)
        assert forces[2] - forces[1] == pytest.approx(forces[1] - forces[0]) and forces[2] > forces[1] + 0.5
    q = np.linspace(-3.0, 5.0, 4001)
    steepest = np.max(np.gradient(spring.force(q, 0 * q), q))
    assert spring.stiffest == pytest.approx(steepest, rel=0.02)
    step = TabulatedSpring(stretch=[0.0, 1.0, 2.0, 3.0], resisting=[0.0, 0.0, 1.0, 1.0])  # flat at its points
    assert step.stiffest == pytest.approx(1.5)
    damper = TabulatedDamper(rate=[-2.0, -0.5, 0.0, 1.0], resisting=[-6.0, -0.5, 0.0, 2.0])
    u = np.array([-2.0, -0.5, 1.0])
    np.testing.assert_allclose(damper.force(0 * u, u), [-6.0, -0.5, 2.0], atol=1e-12)
    np.testing.assert_allclose(damper.power(0 * u, u), [12.0, 0.25, 2.0], atol=1e-12)
    assert Friction(limit=3.0, velocity=0.5).power(0.0, np.array(0.25)) == pytest.approx(0.75 * math.tanh(0.5))


def test_names_count_what_there_is_more_than_one_of():
    laws = (Friction(0, limit=1.0), Friction(1, name="brake", limit=1.0), Friction(1, limit=1.0))
    joint = universal("arm", "hub", name="u", laws=laws, latches=(Latch(0, at=1.0), Latch(1, at=0.0, opens=3.0)))
    assert joint.law_names() == ["u.friction1", "brake", "u.friction2"]
    assert [n for n, _ in joint.state_names()] == ["u.latch1_time", "u.latch1_loss", "u.latch2_time", "u.latch2_loss"]
    assert [unit for _, unit in joint.state_names()] == ["s", "J", "s", "J"]
    np.testing.assert_array_equal(joint.initial_states(), [-1.0, 0.0, 0.0, 0.0])
    assert revolute("arm", "hub", latches=(Latch(0, at=1.0),)).state_names()[0] == ("hub-arm.latch_time", "s")
    ball = Joint("arm", name="b", translations=[[1, 0, 0], [0, 1, 0]], ball="extrinsic xzy", rebase=True)
    assert ball.coordinate_names() == [
        ("b.slide1", "m"), ("b.slide2", "m"), ("b.fixed_x1", "rad"), ("b.fixed_z2", "rad"), ("b.fixed_y3", "rad"),
        *((f"b.reference_e{j}", "1") for j in range(4)),
    ]  # fmt: skip
    assert ball.velocity_names() == [
        ("b.slide1_rate", "m/s"), ("b.slide2_rate", "m/s"), *((f"b.omega_{a}", "rad/s") for a in "xyz")
    ]  # fmt: skip
    assert ball.ball_places() == slice(2, 5)
    assert ball_names("rodrigues") == [("g1", "1"), ("g2", "1"), ("g3", "1")]
    assert ball_names("modified_rodrigues")[2] == ("p3", "1") and ball_names("zxz")[0] == ("z1", "rad")
    slide = cylindrical("arm", name="c")
    assert slide.coordinate_names() == [("c.slide", "m"), ("c.angle", "rad")]
    assert kept(["c.angle", "c"], slide) == [0, 1] and kept(["c.angle"], slide) == [1] and kept(["u"], slide) == []
    assert kept(["b"], ball) == [0, 1, 2, 3, 4] and kept(["b.slide2", "b.omega_x"], ball) == [1]


@pytest.mark.parametrize("rotation", ["zxz", "xyz", "rodrigues", "extrinsic yzy"])
def test_a_rebased_ball_starts_at_the_attitude_that_its_angles_say(rotation):
    from femflex.rotations import dcm_from_coordinates, dcm_from_quaternion, singularity_distance

    for angles in ([0.4, -0.7, 1.9], [0.1, 0.02, -0.1], [0.3, 3.1, 0.2]):
        q = ball_coordinates(rotation, "zyx", np.array(angles), rebase=True)
        C = dcm_from_quaternion(q[3:]) @ dcm_from_coordinates(q[:3], rotation)
        wanted = Rotation.from_euler("ZYX", angles).as_matrix()
        np.testing.assert_allclose(C, wanted, atol=1e-12)
        assert singularity_distance(q[:3], rotation) >= np.pi / 4 - 1e-9


def test_thresholds_count_down_to_their_value_from_their_side():
    up, down = Threshold("a/b", above=2.0), Threshold("a/b", below=-1.0)
    assert (up.to_go(0.5), up.to_go(3.0)) == (1.5, -1.0) and (down.to_go(0.5), down.to_go(-3.0)) == (1.5, -2.0)
    assert (str(up), str(down)) == ("a/b above 2", "a/b below -1") and Threshold("c", below=0.0).to_go(0.25) == 0.25


def test_only_a_constant_inertial_force_without_torque_has_a_potential():
    force, times = np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0])
    assert Load("a", "hub", frame="inertial", force=force).conservative
    assert not Load("a", "hub", frame="inertial", force=force, torque=force).conservative
    assert not Load("a", "hub", frame="body", force=force).conservative
    assert not Load("a", "hub", frame="inertial", force=np.stack([force, force]), times=times).conservative
