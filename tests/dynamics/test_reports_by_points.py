"""What runs report, against clouds of points and frames that are moved here, apart from the compiled equations."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.body.skin import Skin
from femflex.body.symmetric import packed_size
from femflex.dynamics.equilibria.body_motions import BodyMotion as SmallBodyMotion
from femflex.dynamics.equilibria.character import moved_points, numbered_names, points_of
from femflex.dynamics.equilibria.system_modes import craft_skin
from femflex.dynamics.reports.contacts import observe_contacts
from femflex.dynamics.reports.drum import drum_row
from femflex.dynamics.reports.marker_motion import base_attitude, marker_motion
from femflex.dynamics.reports.material import (
    BodyMotion,
    flow_power,
    growth_power,
    half_rate,
    moving_power,
    speed_form,
    stiffness_power,
    strain_power,
)
from femflex.dynamics.reports.own_markers import acting_forces
from femflex.dynamics.reports.segmented import observe_segmented
from femflex.dynamics.reports.sights import observe_sights, sight_channels
from femflex.rotations import quaternion_from_dcm
from femflex.system import (
    Block,
    Effector,
    Frame,
    Load,
    Orbit,
    Sight,
    Spring,
    System,
    free,
    knife_edge,
    rolling_disc,
    spherical,
    weld,
)
from femflex.system.variation import COLUMNS, strain_table

N = 3  # shapes
RNG = np.random.default_rng(17)
MASS = RNG.uniform(0.5, 2.0, 9)
Z, DZ, DDZ = RNG.normal(size=(3, 9, 1 + N, 3))  # rho and shapes at every point, their rates and accelerations


def moments_of(z: np.ndarray, mass: np.ndarray = MASS) -> MassMoments:
    return MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))


def body_of(z: np.ndarray, markers: dict | None = None, skin: Skin | None = None) -> FlexibleBody:
    n = z.shape[1] - 1
    K = RNG.normal(size=(n, n))
    return FlexibleBody(moments_of(z), StrainTensors.linear(K @ K.T), 0.0 * K, markers or {}, skin)


def axes(seed: int) -> np.ndarray:
    return Rotation.random(random_state=seed).as_matrix()


def motion() -> BodyMotion:
    rng = np.random.default_rng(23)
    delta, ddelta, dddelta = 0.3 * rng.normal(size=(3, N))
    F = rng.normal(size=(3, 3))
    v, a, omega, alpha = rng.normal(size=(4, 3))
    y, dy, ddy = (np.concatenate([[first], row]) for first, row in ((1.0, delta), (0.0, ddelta), (0.0, dddelta)))
    return BodyMotion(v, a, omega, alpha, F + F.T, y, dy, ddy)


def flowing() -> tuple[Block, np.ndarray, dict]:
    """The block of the cloud whose points move by DZ and DDZ, and where its record finds the parts."""
    block = Block(body_of(Z), ("mass", "flow"))
    out = np.zeros(block.size)
    speed = np.einsum("p,pAa,pBa->AB", MASS, DZ, DZ)
    rate = np.einsum("p,pAa,pBa->AB", MASS, DZ, DDZ)
    block.put_flow(
        out,
        np.einsum("p,pAa->Aa", MASS, DZ), np.einsum("p,pAa->Aa", MASS, DDZ),
        np.einsum("p,pAa,pBb->AaBb", MASS, Z, DZ), np.einsum("p,pAa,pBb->AaBb", MASS, Z, DDZ),
        speed, rate + rate.T,
    )  # fmt: skip
    record = {"n_shapes": N, "wide": block.wide, "rates": block.rates, "drifts": block.drift, "flow": block.flow}
    return block, out, record | {"flow0": block.flow0, "speeds": block.speed}


def test_the_power_of_moving_material_is_that_of_every_point():
    _, pool, record = flowing()
    m = motion()
    y, dy, ddy = m.y, m.dy, m.ddy
    total = moving = 0.0
    for dm, z, dz, ddz in zip(MASS, Z, DZ, DDZ, strict=True):
        r, w = z.T @ y, dz.T @ y
        carried = m.a + np.cross(m.alpha, r) + np.cross(m.omega, np.cross(m.omega, r)) + m.gradient @ r
        carried = carried + 2.0 * np.cross(m.omega, z.T @ dy) + z.T @ ddy
        # Coriolis force of w does no work along w; its own acceleration is 2 dz dy + ddz y
        total += dm * w @ (carried + 2.0 * np.cross(m.omega, w) + 2.0 * dz.T @ dy + ddz.T @ y)
        moving += dm * w @ carried
    assert flow_power(record, pool, m) == pytest.approx(total, rel=1e-11)
    assert moving_power(record, pool, m) == pytest.approx(moving, rel=1e-11)
    left, right = np.arange(1.0, 5.0), np.array([0.3, -2.0, 0.7, 1.1])
    wanted = np.einsum("p,pa,pa->", MASS, np.einsum("pAa,A->pa", DZ, left), np.einsum("pAa,A->pa", DZ, right))
    assert speed_form(record, pool, left, right) == pytest.approx(wanted, rel=1e-11)
    own = np.einsum("p,pa,pa->", MASS, np.einsum("pAa,A->pa", DZ, right), np.einsum("pAa,A->pa", DDZ, right))
    assert half_rate(record, pool, right) == pytest.approx(own, rel=1e-11)


def test_arriving_mass_brings_half_of_its_speed_squared():
    block = Block(body_of(Z), ("mass", "growth"))
    pool, m = np.zeros(block.size), motion()
    block.put_moments(pool, moments_of(Z), growth=True)
    power, mass, first = growth_power(block.growth, N, pool, m)
    r = np.einsum("pAa,A->pa", Z, m.y)
    v = m.v + np.cross(m.omega, r) + np.einsum("pAa,A->pa", Z, m.dy)
    assert power == pytest.approx(0.5 * MASS @ np.sum(v**2, axis=1), rel=1e-11)
    assert mass == pytest.approx(MASS.sum())
    np.testing.assert_allclose(first, MASS @ r, rtol=1e-11)


@pytest.mark.parametrize("n", [3, 9])
def test_the_power_of_changing_strain_is_the_energy_of_its_rates(n):
    rng = np.random.default_rng(n)
    body = FlexibleBody(moments_of(RNG.normal(size=(9, 1 + n, 3))), StrainTensors.linear(np.eye(n)), np.eye(n), {})
    block = Block(body, ("mass", "stiffness", "strain"))
    K = rng.normal(size=(n, n))
    rates = StrainTensors(
        K + K.T, rng.normal(size=n), rng.normal(size=packed_size(n, 3)), rng.normal(size=packed_size(n, 4))
    )
    pool, delta = np.zeros(block.size), rng.normal(size=n)
    block.put_stiffness(pool, rates.V1, rates.f0, rates=True)
    block.put_strain(pool, rates.V2, rates.V3, rates=True)
    linear = StrainTensors(rates.V1, rates.f0)
    found = stiffness_power(block.stiffness_rate, block.f0_rate, n, pool, delta)
    assert found == pytest.approx(linear.energy(delta), rel=1e-11)
    n_blocks = len(strain_table(rates.V2, rates.V3, n))
    found = strain_power(block.strain_rate, n, n_blocks, COLUMNS, pool, delta)
    assert found == pytest.approx(rates.energy(delta) - linear.energy(delta), rel=1e-10)


def small(n_u: int = 5, n_shapes: int = N, seed: int = 3) -> SmallBodyMotion:
    rng = np.random.default_rng(seed)
    return SmallBodyMotion(
        rng.normal(size=3), axes(seed), 0.3 * rng.normal(size=n_shapes),
        *(rng.normal(size=(k, n_u)) for k in (3, 3, n_shapes)),
    )  # fmt: skip


def complex_motions(n_u: int = 5, k: int = 4) -> np.ndarray:
    rng = np.random.default_rng(8)
    return rng.normal(size=(n_u, k)) + 1j * rng.normal(size=(n_u, k))


def velocities(z: np.ndarray, at: SmallBodyMotion, motions: np.ndarray) -> np.ndarray:
    """Velocities (p, 3, k) of points in the base frame."""
    slide, turn, rates = at.slide @ motions, at.turn @ motions, at.shape @ motions
    y = np.concatenate([[1.0], at.delta])
    out = []
    for one in z:
        arm = at.attitude @ (one.T @ y)
        out.append(slide + np.cross(turn.T, arm).T + at.attitude @ one[1:].T @ rates)
    return np.array(out)


def test_kinetic_energy_and_drawn_points_are_those_of_the_moved_cloud():
    at, motions = small(), complex_motions()
    body = body_of(Z, skin=Skin(Z[:, 0], {"vertex": np.arange(9)[:, None]}, Z[:, 1:].swapaxes(0, 1)))
    v = velocities(Z, at, motions)
    np.testing.assert_allclose(at.kinetic(body, motions), np.einsum("p,pak->k", MASS, np.abs(v) ** 2), rtol=1e-11)
    places, moved = moved_points(body, at)
    y = np.concatenate([[1.0], at.delta])
    np.testing.assert_allclose(places, at.position + np.einsum("pAa,A->pa", Z, y) @ at.attitude.T, rtol=1e-11)
    np.testing.assert_allclose(np.einsum("pau,uk->pak", moved, motions), v, rtol=1e-11, atol=1e-12)


def test_a_rigid_body_is_looked_at_in_points_of_its_inertia_and_a_bare_one_at_its_markers():
    J = axes(2) @ np.diag([2.0, 3.0, 4.5]) @ axes(2).T
    body = rigid_body(6.0, J, [0.3, -0.2, 0.5])
    points, shapes = points_of(body)
    assert shapes.shape == (0, 6, 3)
    np.testing.assert_allclose(points.mean(axis=0), [0.3, -0.2, 0.5], atol=1e-12)
    r = points - points.mean(axis=0)
    np.testing.assert_allclose((r**2).sum() * np.eye(3) - r.T @ r, J, rtol=1e-10, atol=1e-12)
    marker = Marker(np.array([0.4, 0.5, 0.6]), RNG.normal(size=(3, N)), RNG.normal(size=(3, N)))
    points, shapes = points_of(body_of(Z, {"tip": marker}))
    here = next(k for k, point in enumerate(points) if point[0] == 0.4)
    np.testing.assert_array_equal(shapes[:, here].T, marker.phi)
    many = Skin(RNG.normal(size=(1300, 3)), {}, RNG.normal(size=(N, 1300, 3)))
    points, shapes = points_of(body_of(Z, skin=many))
    assert 400 <= len(points) <= 500 and shapes.shape == (N, len(points), 3)
    np.testing.assert_array_equal(points[7], many.points[21])


def test_the_drawn_craft_holds_every_body_in_its_place_and_phase():
    skin = Skin(Z[:, 0], {"line": np.array([[0, 1], [1, 2]]), "vertex": np.array([[8]])}, Z[:, 1:].swapaxes(0, 1))
    other = Skin(Z[:4, 0] + 1.0, {"line": np.array([[2, 3]])}, np.zeros((0, 4, 3)))
    drawn, bare = body_of(Z, skin=skin), rigid_body(2.0, [1.0, 1.0, 1.0], [0.5, 0.6, 0.7], skin=None)
    plain = rigid_body(2.0, [1.0, 1.0, 1.0], skin=other)
    system = System({"a": drawn, "b": bare, "c": plain}, (free("a"), weld("b", "a"), weld("c", "b")))
    bodies = {"a": small(seed=3), "b": small(n_shapes=0, seed=4), "c": small(n_shapes=0, seed=5)}
    motions = complex_motions()
    found = craft_skin(system, bodies, motions)
    clouds = {"a": Z, "b": np.array([[[0.5, 0.6, 0.7]]]), "c": (Z[:4, 0] + 1.0)[:, None]}
    at = 0
    v = np.concatenate([velocities(clouds[name], bodies[name], motions) for name in "abc"])
    for name, cloud in clouds.items():
        y = np.concatenate([[1.0], bodies[name].delta])
        wanted = bodies[name].position + np.einsum("pAa,A->pa", cloud, y) @ bodies[name].attitude.T
        np.testing.assert_allclose(found.points[at : at + len(cloud)], wanted, rtol=1e-11)
        at += len(cloud)
    np.testing.assert_array_equal(found.cells["line"], [[0, 1], [1, 2], [12, 13]])
    np.testing.assert_array_equal(found.cells["vertex"], [[8], [9]])
    shapes = found.shapes[:4] + 1j * found.shapes[4:]
    for k in range(4):
        mine = v[:, :, k]
        factor = np.vdot(mine, shapes[k]) / np.vdot(mine, mine)
        assert abs(factor) == pytest.approx(1.0)
        np.testing.assert_allclose(shapes[k], factor * mine, atol=1e-11)
        turned = [np.sum((mine * np.exp(1j * phase)).real ** 2) for phase in np.linspace(0.0, np.pi, 721)]
        assert np.sum(shapes[k].real ** 2) >= max(turned) * (1 - 1e-12)


def test_a_dot_moves_with_the_centre_of_mass_of_its_body():
    body, at = body_of(Z), small()
    system = System({"a": body}, (free("a"),))
    found = craft_skin(system, {"a": at}, complex_motions(k=1))
    v = np.einsum("p,pak->ak", MASS, velocities(Z, at, complex_motions(k=1)))[:, 0] / MASS.sum()
    shape = (found.shapes[0] + 1j * found.shapes[1])[0]
    assert abs(np.vdot(v, shape)) == pytest.approx(np.vdot(v, v).real) and np.linalg.norm(shape) == pytest.approx(
        np.linalg.norm(v)
    )


def test_names_are_counted_but_for_rigid_motions_that_are_alone_and_states():
    words = ["flap", "wobble", "lag", "flap", "translation x", "rotation y", "rotation y", "wheel.speed", "joint"]
    assert numbered_names(words) == (
        "flap 1", "wobble", "lag 1", "flap 2", "translation x", "rotation y 1", "rotation y 2", "wheel.speed", "joint 1"
    )  # fmt: skip


TIMES = np.array([0.0, 0.7, 2.0])


def seen_of(names: dict[str, int], seed: int = 5) -> tuple[dict, dict]:
    """Reported motion of bodies with so many shapes: channels, and C_NB (n_t, 3, 3) by name."""
    rng, seen, turns = np.random.default_rng(seed), {}, {}
    for name, n in names.items():
        turns[name] = Rotation.random(3, random_state=rng.integers(1000)).as_matrix()
        seen[f"bodies/{name}/position"] = rng.normal(size=(3, 3))
        seen[f"bodies/{name}/attitude"] = np.array([quaternion_from_dcm(C) for C in turns[name]])
        seen[f"bodies/{name}/delta"] = 0.2 * rng.normal(size=(3, n))
    return seen, turns


def test_a_marker_is_where_its_shapes_have_moved_it_and_without_a_body_in_the_base_frame():
    marker = Marker(np.array([0.4, 0.5, 0.6]), RNG.normal(size=(3, N)), RNG.normal(size=(3, N)), axes(9))
    rate = np.array([0.3, -0.5, 0.8])
    system = System({"a": body_of(Z, {"tip": marker})}, (free("a"),), frame=Frame("spinning", rate))
    seen, turns = seen_of({"a": N})
    place, C = marker_motion(system, TIMES, seen, "a", "tip")
    for k in range(3):
        delta = seen["bodies/a/delta"][k]
        wanted = seen["bodies/a/position"][k] + turns["a"][k] @ (marker.position + marker.phi @ delta)
        np.testing.assert_allclose(place[k], wanted, atol=1e-12)
        turned = turns["a"][k] @ Rotation.from_rotvec(marker.psi @ delta).as_matrix() @ axes(9)
        np.testing.assert_allclose(C[k], turned, atol=1e-12)
        base = Rotation.from_rotvec(rate * TIMES[k]).as_matrix()
        np.testing.assert_allclose(base_attitude(system, TIMES, seen)[k], base, atol=1e-12)
    place, C = marker_motion(system, TIMES, seen, None, "origin")
    assert not place.any() and C[2] == pytest.approx(Rotation.from_rotvec(2.0 * rate).as_matrix())
    still = System({"a": body_of(Z)}, (free("a"),))
    np.testing.assert_array_equal(base_attitude(still, TIMES, seen), np.stack([np.eye(3)] * 3))


def test_a_disc_touches_with_its_lowest_point_on_a_plane_that_moves():
    disc = rigid_body(1.0, [1.0, 1.0, 1.0], markers={"hub": Marker.rigid(np.array([0.1, 0.2, 0.3]), axes(11))})
    table = rigid_body(1.0, [1.0, 1.0, 1.0], markers={"top": Marker.rigid(np.array([0.0, 0.1, 0.0]), axes(12))})
    rolling = rolling_disc(
        "r", "disc", 0.4, marker="hub", parent="table", parent_marker="top", axis=[1, 2, 3], normal=[0.2, 0.1, 2]
    )
    edge = knife_edge("e", "table", [1, 0, 0], marker="top")
    system = System({"disc": disc, "table": table}, (free("disc"), free("table")), constraints=(rolling, edge))
    seen, turns = seen_of({"disc": 0, "table": 0})
    found = observe_contacts(system, TIMES, seen)
    for k in range(3):
        centre = seen["bodies/disc/position"][k] + turns["disc"][k] @ [0.1, 0.2, 0.3]
        a = turns["disc"][k] @ axes(11) @ rolling.axis
        n = turns["table"][k] @ axes(12) @ rolling.normal
        down = np.cross(a, np.cross(a, n))  # in the disc's plane, straight to or from the table
        rim = [centre + sign * 0.4 * down / np.linalg.norm(down) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(found["constraints/r/place"][k], min(rim, key=lambda p: p @ n), atol=1e-12)
        top = seen["bodies/table/position"][k] + turns["table"][k] @ [0.0, 0.1, 0.0]
        np.testing.assert_allclose(found["constraints/e/place"][k], top, atol=1e-12)


def test_a_sight_sees_its_station_in_the_triangle_of_the_centre_of_the_earth():
    dish = Marker(np.array([0.4, 0.5, 0.6]), RNG.normal(size=(3, N)), RNG.normal(size=(3, N)), axes(9))
    sight = Sight("dish", "a", "tip", axis=(1.0, -2.0, 0.5), latitude=0.4, longitude=1.0, radius=20.0, rate=0.1)
    system = System({"a": body_of(Z, {"tip": dish})}, (spherical("a"),), orbit=Orbit(30.0), sights=(sight,))
    seen, _ = seen_of({"a": N})
    C_NO = Rotation.random(3, random_state=4).as_matrix()
    seen["orbit/attitude"] = np.array([quaternion_from_dcm(C) for C in C_NO])
    seen["orbit/radius"] = np.array([30.0, 31.0, 33.0])
    found = observe_sights(system, TIMES, seen)
    assert set(found) == set(sight_channels(system))
    place, C = marker_motion(system, TIMES, seen, "a", "tip")
    for k, t in enumerate(TIMES):
        up = C_NO[k][:, 1]
        craft = seen["orbit/radius"][k] * up + place[k]  # from the Earth's centre
        angle = 1.0 + 0.1 * t
        station = 20.0 * np.array([np.cos(0.4) * np.cos(angle), np.cos(0.4) * np.sin(angle), np.sin(0.4)])
        away = station - craft
        distance = np.linalg.norm(away)
        assert found["sights/dish/range"][k] == pytest.approx(distance)
        np.testing.assert_allclose(found["sights/dish/direction"][k], away / distance, atol=1e-12)
        np.testing.assert_allclose(found["sights/dish/position"][k], place[k], atol=1e-12)
        pointed = C[k] @ np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)
        assert np.cos(found["sights/dish/error"][k]) == pytest.approx(pointed @ away / distance)
        # in the triangle the angle at the station is 90 degrees and the elevation
        cosine = (20.0**2 + distance**2 - craft @ craft) / (2 * 20.0 * distance)
        assert found["sights/dish/elevation"][k] == pytest.approx(np.arccos(cosine) - np.pi / 2)


def test_a_cut_body_sits_where_it_is_held_and_bends_from_there():
    rng = np.random.default_rng(2)

    def place(at=None):
        at = rng.normal(size=3) if at is None else np.array(at)
        return Marker(at, rng.normal(size=(3, 2)), rng.normal(size=(3, 2)))

    def segment(**more):
        return body_of(rng.normal(size=(9, 3, 3)), {".near": place(), ".far": place()} | more)

    bodies = {
        "hub": rigid_body(1.0, [1.0] * 3),
        "b.1": segment(root=place([0.1, 0.2, 0.3])),
        "b.2": segment(tip=place([2.0, 0.1, 0.0])),
    }
    joints = (
        free("hub"),
        weld("b.2", "hub", child_marker="tip"),
        weld("b.1", "b.2", child_marker=".far", parent_marker=".near"),
    )
    system = System(bodies, joints, segments={"b": ("b.1", "b.2")})
    seen, turns = seen_of({"hub": 0, "b.1": 2, "b.2": 2})
    for label in ("hub.origin", "b.root", "b.tip", "b.origin"):
        seen[f"markers/{label}/position"] = rng.normal(size=(3, 3))
        seen[f"markers/{label}/deflection"] = np.full((3, 3), 7.0)
    observe_segmented(system, seen)
    held = bodies["b.2"].marker("tip")
    for k in range(3):
        delta = seen["bodies/b.2/delta"][k]
        at = seen["bodies/b.2/position"][k] + turns["b.2"][k] @ (held.position + held.phi @ delta)
        C = turns["b.2"][k] @ Rotation.from_rotvec(held.psi @ delta).as_matrix()
        origin = at - C @ held.position
        np.testing.assert_allclose(seen["bodies/b/position"][k], origin, atol=1e-12)
        q = seen["bodies/b/attitude"][k]
        np.testing.assert_allclose(Rotation.from_quat([*q[1:], q[0]]).as_matrix(), C, atol=1e-12)
        root = C.T @ (seen["markers/b.root/position"][k] - origin) - [0.1, 0.2, 0.3]
        np.testing.assert_allclose(seen["markers/b.root/deflection"][k], root, atol=1e-12)
    assert (seen["markers/hub.origin/deflection"] == 7.0).all()


def test_forces_at_a_body_are_those_of_its_loads_springs_and_effectors_in_its_axes():
    springs = (
        Spring("s", "a", "b", "p", "q", stiffness=7.0, damping=0.6, length=0.4),
        Spring("g", "a", None, "p", stiffness=3.0, damping=0.2, length=0.1),
        Spring("o", "b", None, "q", stiffness=5.0),
        Spring("r", "b", "a", "q", "p", stiffness=2.0, length=9.0),
        Spring("none", "a", "b", "p", "same", stiffness=2.0),
    )
    jet = Effector("jet", lambda seen, out: None, (("b", "q"), ("a", "p"), ("a", "origin")))
    other = Effector("other", lambda seen, out: None, (("b", "q"),))
    system = SimpleNamespace(loads=(Load("w", "b", "q"), Load("v", "a", "p")), springs=springs, effectors=(other, jet))
    seen, turns = seen_of({"a": 0, "b": 0})
    rng = np.random.default_rng(6)
    for label in ("a.p", "b.q", "b.same"):
        seen[f"markers/{label}/position"], seen[f"markers/{label}/velocity"] = rng.normal(size=(2, 3, 3))
    seen["markers/b.same/position"] = seen["markers/a.p/position"]
    for name, n in (("jet", 3), ("other", 1)):
        seen[f"effectors/{name}/force"] = rng.normal(size=(3, n, 3))
    for name in "wv":
        seen[f"loads/{name}/force"] = rng.normal(size=(3, 3))
    j, C = 1, turns["a"][1]
    p, dp = seen["markers/a.p/position"][j], seen["markers/a.p/velocity"][j]
    q, dq = seen["markers/b.q/position"][j], seen["markers/b.q/velocity"][j]

    def pull(k, c, length, end, rate):
        """Force on p of a spring to `end`."""
        d = end - p
        L = np.linalg.norm(d)
        return (k * (L - length) + c * (d @ (rate - dp)) / L) * d / L

    wanted = [
        ("p", seen["loads/v/force"][j]),
        ("p", C.T @ pull(7.0, 0.6, 0.4, q, dq)),
        ("p", C.T @ pull(3.0, 0.2, 0.1, 0 * p, 0 * p)),
        ("p", C.T @ pull(2.0, 0.0, 9.0, q, dq)),
        ("p", C.T @ seen["effectors/jet/force"][j][1]),
        ("origin", C.T @ seen["effectors/jet/force"][j][2]),
    ]
    found = acting_forces(SimpleNamespace(system=system), "a", seen, j)
    assert [marker for marker, _ in found] == [marker for marker, _ in wanted]
    for (_, mine), (_, force) in zip(found, wanted, strict=True):
        np.testing.assert_allclose(mine, force, atol=1e-12)


@pytest.mark.parametrize("U", [0.7, -0.7])
def test_the_force_of_a_drum_is_the_work_along_the_length_of_all_that_it_moves(U):
    rng = np.random.default_rng(29)
    body = body_of(Z)
    parts = ("mass", "flow", "pickup", "stiffness", "strain")
    block, m = Block(body, parts), motion()
    pool, acceleration = np.zeros(block.size), -0.4
    # chi = dz/dL of every point stands for the rate at a unit rate of the length, its own rate for its acceleration
    speed, rate = np.einsum("p,pAa,pBa->AB", MASS, DZ, DZ), np.einsum("p,pAa,pBa->AB", MASS, DZ, DDZ)
    block.put_flow(
        pool,
        np.einsum("p,pAa->Aa", MASS, DZ), np.einsum("p,pAa->Aa", MASS, DDZ),
        np.einsum("p,pAa,pBb->AaBb", MASS, Z, DZ), np.einsum("p,pAa,pBb->AaBb", MASS, Z, DDZ),
        speed, rate + rate.T,
    )  # fmt: skip
    pickup = rng.normal(size=(1 + N, 1 + N))
    pickup = pickup @ pickup.T
    block.put_pickup(pool, pickup)
    K = rng.normal(size=(N, N))
    strain = StrainTensors(
        K + K.T, rng.normal(size=N), rng.normal(size=packed_size(N, 3)), rng.normal(size=packed_size(N, 4))
    )
    block.put_stiffness(pool, strain.V1, strain.f0, rates=True)
    block.put_strain(pool, strain.V2, strain.V3, rates=True)
    record = {"n": N, "n_shapes": N, "wide": block.wide, "block": 0, "rates": block.rates, "drifts": block.drift}
    record |= {"flow": block.flow, "flow0": block.flow0, "speeds": block.speed}
    record |= {"n_blocks": len(strain_table(strain.V2, strain.V3, N))}
    force = 0.0
    for dm, z, chi, bend in zip(MASS, Z, DZ, DDZ, strict=True):
        r = z.T @ m.y
        a = m.a + np.cross(m.alpha, r) + np.cross(m.omega, np.cross(m.omega, r)) + m.gradient @ r
        a = a + 2.0 * np.cross(m.omega, z.T @ m.dy) + z.T @ m.ddy
        a = a + 2.0 * U * chi.T @ m.dy + acceleration * chi.T @ m.y + U**2 * bend.T @ m.y
        force += dm * (chi.T @ m.y) @ a
    kappa = m.y @ pickup @ m.y
    force += strain.energy(m.y[1:]) + 0.5 * kappa * (U * abs(U)) + 1.25  # what is carried at moving markers
    table = SimpleNamespace(drum_radius=0.2)
    found = drum_row(record, block, table, pool, m, (3.0, U, acceleration), 1.25, parts, 7.0)
    assert found["drum_force"] == pytest.approx(force, rel=1e-10)
    assert found["drum_torque"] == pytest.approx(0.2 * force, rel=1e-10)
    assert found["pickup_loss"] == pytest.approx(0.5 * abs(U) ** 3 * kappa)
    assert found["drum_power"] == pytest.approx(7.0 + 0.5 * abs(U) ** 3 * kappa)
    assert found["exit_flux"] == pytest.approx(pickup[0, 0] * U**2)
    assert (found["length"], found["length_rate"], found["length_acceleration"]) == (3.0, U, acceleration)
    bare = drum_row(record, block, SimpleNamespace(drum_radius=None), pool, m, (3.0, U, 0.0), 1.25, ("pickup",), 7.0)
    assert bare["drum_force"] == 1.25 and bare["pickup_loss"] == 0.0 and "drum_torque" not in bare
