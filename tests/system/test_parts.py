"""Parts of a system against geometry made independently: masses as points, joints as turned frames, tables as sums."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.effector_builders import (
    control_moment_gyro,
    reaction_wheel,
    tank_variation,
    with_wheel,
    without_axial_inertia,
)

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.body.flexible import Skin
from femflex.body.moments import MassPoints
from femflex.effectors import unbalanced_rotor
from femflex.rotations import dcm_from_coordinates, dcm_from_quaternion, singularity_distance
from femflex.system import (
    Block,
    Joint,
    LengthTable,
    Orbit,
    Sight,
    Stop,
    System,
    TabulatedDamper,
    TabulatedSpring,
    attached_moments,
    ball_coordinates,
    closure,
    cylindrical,
    prismatic,
    revolute,
    spherical,
    turns,
    universal,
    weld,
    with_attached,
)
from femflex.system.attraction import extent, system_size
from femflex.system.gimbal_lock import can_lock, free_turns, lock_angle

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


def test_attached_mass_equals_points_moving_with_the_marker():
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


def test_wheel_inertia_along_and_across_its_axis():
    at = Marker.at_position([0.3, 0.1, -0.2], Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix())
    body = rigid_body(20.0, [5.0, 6.0, 7.0], [0.1, 0.2, -0.1], {"bay": at})
    wheel = reaction_wheel("w", "hub", 0.4, marker="bay", axis=(1.0, -2.0, 2.0), initial_speed=-30.0, max_speed=50.0)
    a = at.orientation @ np.array([1.0, -2.0, 2.0]) / 3.0
    less = body.moments.inertia() - without_axial_inertia(body, wheel).moments.inertia()
    np.testing.assert_allclose(less, 0.4 * np.outer(a, a), atol=1e-12)
    more, r = with_wheel(body, wheel, 3.0, 0.25).moments, at.position
    added = 0.25 * (np.eye(3) - np.outer(a, a)) + 3.0 * (r @ r * np.eye(3) - np.outer(r, r))
    np.testing.assert_allclose(more.inertia() - body.moments.inertia(), added, atol=1e-12)
    np.testing.assert_allclose(more.first[0] - body.moments.first[0], 3.0 * r, atol=1e-12)
    rotor = wheel.coasting("rotor", np.array([-7.0]))
    np.testing.assert_allclose(rotor.parameters, [1 / 3, -2 / 3, 2 / 3, -7.0])


def test_unbalanced_rotor_has_the_products_of_small_masses():
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
def test_coasting_gyro_keeps_its_turned_axis(double):
    g, s, inner = np.array([0.0, 0.6, 0.8]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.8, -0.6])
    more = {"inner_axis": 3.0 * inner, "rates": [0.1, "law.u"]} if double else {"rates": ["law.u"]}
    gyro = control_moment_gyro("g", "hub", -4.0, gimbal_axis=2.0 * g, spin_axis=5.0 * s, **more)
    angles = np.array([0.7, -1.1])[: 1 + double]
    frame = Rotation.from_rotvec(0.7 * g)  # the outer gimbal, which carries the inner one
    turned = frame.apply(Rotation.from_rotvec(-1.1 * inner).apply(s)) if double else frame.apply(s)
    rotor = gyro.coasting("rotor", angles)
    np.testing.assert_allclose(rotor.parameters, [*turned, -4.0], atol=1e-12)


def test_dry_body_plus_propellant_is_the_full_body():
    body = flexible(3, fore=Marker.at_position([0.5, 0.1, 0.0], n_modes=2))
    tanks = {"a": ("tip", 1.5, 0.1), "b": ("fore", 0.8, 0.2)}
    variation = tank_variation(body, tanks)
    block = Block(body, ("mass",))
    dry, *units = variation.numbers[2:].reshape(3, block.size)
    np.testing.assert_allclose(dry + 1.5 * units[0] + 0.8 * units[1], block.constant_block(body), atol=1e-12)
    at = body.marker("tip").position  # of a unit of the first tank: a ball of that gyration radius at its marker
    np.testing.assert_allclose(units[0][:4], [1.0, *at])
    np.testing.assert_allclose(units[0][4:13].reshape(3, 3), np.outer(at, at) + 0.01 / 2 * np.eye(3), atol=1e-12)
    rigid_body(2.0, [0.1, 0.1, 0.1], markers={"m": Marker.at_position(np.zeros(3))})


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
def test_loop_closure_locks_exactly_what_the_joint_locks(joint):
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


def test_angle_to_gimbal_lock():
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

    def axis_angle(u, v):
        return math.asin(np.linalg.norm(np.cross(u, v)))

    held = replace(joint, motion=(None, None, 0.9, None))
    third = Rotation.from_rotvec(0.9 * a[1]).apply(a[2])
    assert lock_angle(held, q[0]) == pytest.approx(axis_angle(a[0], third)) and free_turns(held) == [0, 2]
    last = replace(joint, motion=(None, 0.2, None, None))
    assert not can_lock(last) and lock_angle(last, q[0]) == pytest.approx(axis_angle(a[1], a[2]))
    alone = replace(joint, motion=(None, 0.2, 0.9, None))
    assert lock_angle(alone, q[0]) == pytest.approx(np.pi / 2) and lock_angle(spherical("b"), np.zeros(4)) > 1.5


def test_reach_of_a_craft_is_its_longest_chain():
    far = Marker.at_position([0.0, 3.0, 4.0])
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
    found = system_size(System(bodies, joints, orbit=orbit))
    assert (found.size, found.radius) == pytest.approx((18.0, 7e6))
    assert (found.ratio, found.error) == pytest.approx((18.0 / 7e6, 27.0 / 7e6))


def test_length_table_is_a_sum_of_powers():
    rng = RNG(9)
    first = {(-2, 0, 0): rng.normal(size=16), (1, 1, 0): rng.normal(size=16), (0, 2, 1): rng.normal(size=16)}
    first[1, 1, 0][4:12] = 0.0
    first[0, 2, 1][:4] = 0.0
    second = {(0, 0, 0): rng.normal(size=16), (3, 0, 2): rng.normal(size=16)}
    table = LengthTable("r.length", [first, second], [1.0, 2.5], [0.5, 2.0], drum_mass=0.75)
    for L, piece, s in ((0.7, first, -0.6), (2.4, first, 2.8), (2.5, second, 0.0), (4.0, second, 0.75)):
        U, A = -1.3, 0.6
        wanted = sum(s**p * U**a * A**b * values for (p, a, b), values in piece.items())
        np.testing.assert_allclose(table.block_at(L, U, A), wanted, rtol=1e-12)


def test_ground_station_turns_eastwards():
    sight = Sight("s", "hub", axis=(0.0, 3.0, 4.0), latitude=0.5, longitude=-0.3, radius=6e6, rate=2e-4)
    np.testing.assert_allclose(sight.axis, [0.0, 0.6, 0.8])
    times = np.array([0.0, 700.0, 5000.0])
    start = 6e6 * np.array([math.cos(0.5) * math.cos(0.3), -math.cos(0.5) * math.sin(0.3), math.sin(0.5)])
    turned = [Rotation.from_rotvec([0.0, 0.0, 2e-4 * t]).apply(start) for t in times]
    np.testing.assert_allclose(sight.station(times), turned, rtol=1e-12)


def test_tabulated_springs_and_dampers_store_and_dissipate_their_work():
    x, f = np.array([-1.0, 0.5, 1.0, 3.0]), np.array([-4.0, 1.0, 3.0, 8.0])
    spring = TabulatedSpring(at=x, force=f)
    np.testing.assert_allclose(spring.potential(x)[1], f, atol=1e-12)
    assert spring.potential(0.0)[0] == pytest.approx(0.0, abs=1e-14)
    for lower, upper in ((-3.0, -0.5), (-0.5, 0.7), (2.0, 6.0)):
        q, w = np.polynomial.legendre.leggauss(5)
        cuts = np.unique(np.clip([lower, *x, upper], lower, upper))
        work = sum((b - a) / 2 * w @ spring.potential((a + b) / 2 + (b - a) / 2 * q)[1] for a, b in pairwise(cuts))
        energies = spring.potential(np.array([lower, upper]))[0]
        assert energies[1] - energies[0] == pytest.approx(work, rel=1e-10)
    for far in (np.array([-3.0, -2.0, -1.0]), np.array([3.0, 4.0, 5.0])):
        forces = spring.potential(far)[1]
        assert forces[2] - forces[1] == pytest.approx(forces[1] - forces[0]) and forces[2] > forces[1] + 0.5
    q = np.linspace(-3.0, 5.0, 4001)
    steepest = np.max(np.gradient(spring.potential(q)[1], q))
    assert spring.stiffest == pytest.approx(steepest, rel=0.02)
    step = TabulatedSpring(at=[0.0, 1.0, 2.0, 3.0], force=[0.0, 0.0, 1.0, 1.0])  # flat at its points
    assert step.stiffest == pytest.approx(1.5)
    damper = TabulatedDamper(rate=[-2.0, -0.5, 0.0, 1.0], force=[-6.0, -0.5, 0.0, 2.0])
    u = np.array([-2.0, -0.5, 1.0])
    np.testing.assert_allclose(damper.dissipation(u)[1], [-6.0, -0.5, 2.0], atol=1e-12)


@pytest.mark.parametrize("rotation", ["zxz", "xyz", "rodrigues", "extrinsic yzy"])
def test_rebased_ball_keeps_its_attitude(rotation):
    for angles in ([0.4, -0.7, 1.9], [0.1, 0.02, -0.1], [0.3, 3.1, 0.2]):
        q = ball_coordinates(rotation, "zyx", np.array(angles), rebase=True)
        C = dcm_from_quaternion(q[3:]) @ dcm_from_coordinates(q[:3], rotation)
        wanted = Rotation.from_euler("ZYX", angles).as_matrix()
        np.testing.assert_allclose(C, wanted, atol=1e-12)
        assert singularity_distance(q[:3], rotation) >= np.pi / 4 - 1e-9


K, D, W = 500.0, 3.0, 0.02  # stiffness, damping and width of the stop
LIMITS = [(-0.3, 0.5), (None, 0.5), (-0.3, None)]


@pytest.mark.sampled(1)
@pytest.mark.parametrize("stop", [Stop(lower=low, upper=high, stiffness=K, damping=D, width=W) for low, high in LIMITS])
def test_stop_energy_is_the_integral_of_a_smooth_stiffness(stop):
    """Stiffness K S(d / w) at a depth d, S rising from 0 to 1; force and energy are its integrals from the limit on."""
    for limit, sign in ((stop.upper, 1.0), (stop.lower, -1.0)):
        if limit is None:
            continue
        depth = np.linspace(0.0, 4 * W, 1601)
        found = np.array([stop.potential(limit + sign * d)[:3] for d in depth], float)
        step = depth[1]
        assert not found[0].any() and np.all(np.diff(found[:, 2]) > -1e-6 * K)
        np.testing.assert_allclose(found[depth >= W * (1 + 1e-9), 2], K, rtol=1e-9)
        force = np.concatenate([[0.0], np.cumsum((found[1:, 2] + found[:-1, 2]) / 2 * step)])
        energy = np.concatenate([[0.0], np.cumsum((force[1:] + force[:-1]) / 2 * step)])
        np.testing.assert_allclose(sign * found[:, 1], force, atol=1e-5 * force[-1])
        np.testing.assert_allclose(found[:, 0], energy, atol=1e-5 * energy[-1])
        damping = np.array([float(stop.contact(limit + sign * d)[0]) for d in depth])
        np.testing.assert_allclose(damping, D * found[:, 2] / K, atol=1e-9)
    assert float(stop.potential(0.1)[0]) == 0.0 == float(stop.contact(0.1)[0])
