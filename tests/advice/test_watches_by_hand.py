"""Watches and judgements of bodies made by hand: deflections, axial forces, slackness, loads, rows of estimates."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.advice.bodies import KnownBodies
from femflex.advice.curved import _held, _loads, _weight
from femflex.advice.deflections import DeflectionWatch, deflection_watches
from femflex.advice.deployed import SlackWatch
from femflex.advice.deployed_bending import axial_gain, mean_force
from femflex.advice.enriched_bodies import EnrichedBody, MeshedEnrichment
from femflex.advice.limits import SHARE
from femflex.advice.model_warnings import carried_mass, model_warnings, output_warnings
from femflex.advice.motion_estimate import estimate_times, rigid_motion_of, shape_periods, slowest_period, typical_sizes
from femflex.advice.spin_shapes import spin_advice
from femflex.advice.strain import _phase
from femflex.advice.truncation import _stands, joint_markers, selected_shapes
from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors, rigid_body
from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.reduction.origin import LeftOpen, Origin
from femflex.system import (
    Environment,
    Load,
    Orbit,
    Profile,
    System,
    free,
    prismatic,
    revolute,
    spherical,
    universal,
    weld,
)
from femflex.warning import PhysicsWarning


def cloud(n: int, seed: int = 0, stiff: float = 8.0, **more) -> FlexibleBody:
    rng = np.random.default_rng(seed)
    mass, rho, phi = rng.uniform(0.5, 2, 9), rng.normal(size=(9, 3)), 0.3 * rng.normal(size=(9, 3, n))
    z = np.concatenate([rho[:, None, :], phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    K, D = rng.normal(size=(2, n, n))
    markers = {
        name: Marker(rng.normal(size=3), rng.normal(size=(3, n)), rng.normal(size=(3, n))) for name in ("a", "b")
    }
    skin = Skin(rng.normal(size=(6, 3)), {"vertex": np.arange(6)[:, None]}, rng.normal(size=(n, 6, 3)))
    return FlexibleBody(moments, StrainTensors.linear(stiff * (K @ K.T + np.eye(n))), D @ D.T, markers, skin, **more)


def bent(body: FlexibleBody, delta: np.ndarray) -> float:
    """Largest displacement of a point of the skin over the diagonal of its box."""
    size = np.linalg.norm(body.skin.points.max(axis=0) - body.skin.points.min(axis=0))
    return np.linalg.norm(np.einsum("k,kpa->pa", delta, body.skin.shapes), axis=1).max() / size


def test_deflections_are_seen_of_each_body_in_every_row_and_the_worst_is_kept():
    bodies = {"one": cloud(2, 1), "hub": rigid_body(1.0, np.eye(3)), "two": cloud(3, 2)}
    system = System(
        bodies,
        (
            free("hub"),
            universal("one", "hub", axes=np.eye(3)[:2]),
            revolute("two", "one", parent_marker="a", axis=[0, 0, 1]),
        ),
    )
    model = compile_system(system)
    watches = {one.name: one for one in deflection_watches(model)}
    assert list(watches) == [name for name in system.order if name != "hub"]
    names = [name for name, _ in model.system.coordinate_names()]
    rng = np.random.default_rng(3)
    states = rng.normal(size=(5, model.n_x))
    for name, one in watches.items():
        body = bodies[name]
        own = [k for k, text in enumerate(names) if text.startswith(f"{name}.") and k >= one.at][: body.n_modes]
        assert own == list(range(one.at, one.at + body.n_modes))
        delta = states[:, own]
        assert one.over(states) == pytest.approx([bent(body, row) for row in delta])
        moved = one.moved(states)
        largest = [np.linalg.norm(shape, axis=1).max() for shape in body.skin.shapes]
        assert moved == pytest.approx(np.abs(delta) * largest)
        worst = int(moved.max(axis=1).argmax())
        assert one.reached == pytest.approx(bent(body, delta[worst]))
        one.moved(0.1 * states)  # smaller ones leave it
        assert one.reached == pytest.approx(bent(body, delta[worst]))
        one.moved(-3.0 * states[::-1])
        assert one.reached == pytest.approx(3 * bent(body, delta[worst]))
        size = np.linalg.norm(np.ptp(body.skin.points, axis=0))
        assert one.size == pytest.approx(size) and DeflectionWatch(name, 0, body, "x", 99.0).size == 99.0
        with pytest.warns(PhysicsWarning) as told:
            one.warn("was", "a note")
        reached = 3 * bent(body, delta[worst])
        assert str(told[0].message) == (
            f"body {name!r} was displaced by {reached * size:.3g} m, {reached:.0%} of its size of {size:.3g} m; "
            f"linear strain is valid up to "
            "about 10%. Check stiffness, loads and units, give it strain = 'condensed', or take the result as an "
            "indication only. Before "
            "the run: a note."
        )


def test_a_body_without_skin_is_seen_by_its_markers():
    body = replace(cloud(2, 4), skin=None)
    one = DeflectionWatch("x", 0, body, "y")
    delta = np.array([[0.3, -0.2]])
    wanted = max(np.linalg.norm(marker.phi @ delta[0]) for marker in body.markers.values())
    places = np.array([marker.position for marker in body.markers.values()])
    assert one.size == pytest.approx(max(np.linalg.norm(np.ptp(places, axis=0)), 1.0))
    assert one.over(delta) == pytest.approx([wanted / one.size])


def sections(tip: object = None) -> SimpleNamespace:
    """A member of bending stiffnesses 3 and 2 that taper as its length says, at uneven stations."""
    stations = np.concatenate([np.linspace(0, 0.4, 60), np.linspace(0.41, 1.0, 200)])
    return SimpleNamespace(
        stations=stations, stiffness=(3.0, 2.0), tip=tip, factor=lambda s: 1.0 + 0.25 * np.asarray(s)
    )


@pytest.mark.parametrize("tip", [None, "fixed"])
def test_the_gain_of_axial_force_is_the_ratio_of_its_integrals(tip):
    """int N w'^2 / int EI w''^2 with w = 1 - cos(pi s / 2 L); the taper counts from the tip, or from the root."""
    from scipy.integrate import quad

    one, lengths = sections(tip), np.array([2.0, 5.0])
    force = np.array([4.0 - 3.0 * one.stations, -1.0 + one.stations**2])
    found = axial_gain(one, force, lengths)
    for k, (L, N) in enumerate(zip(lengths, (lambda s: 4 - 3 * s / 2.0, lambda s: -1 + (s / 5.0) ** 2), strict=True)):
        a = np.pi / (2 * L)
        pull = quad(lambda s, N=N, a=a: N(s) * (a * np.sin(a * s)) ** 2, 0, L)[0]
        EI = (lambda s, L=L: 2.0 * (1 + 0.25 * (L - s))) if tip is None else (lambda s: 2.0 * (1 + 0.25 * s))
        bend = quad(lambda s, a=a, EI=EI: EI(s) * (a**2 * np.cos(a * s)) ** 2, 0, L)[0]
        assert found[k] == pytest.approx(pull / bend, rel=2e-3)
    mean = quad(lambda x: (4 - 3 * x) * np.sin(np.pi * x / 2) ** 2, 0, 1)[0] / 0.5
    assert mean_force(one, force[0]) == pytest.approx(mean, rel=1e-3) and mean_force(
        one, np.full(260, 7.0)
    ) == pytest.approx(7.0)


def test_the_lowest_tension_of_all_blocks_is_told_with_its_time_and_place():
    watch = SlackWatch.__new__(SlackWatch)
    from femflex.advice.deployed import Lowest

    watch._sections = {"tape": SimpleNamespace(stations=np.array([0.0, 0.25, 1.0]))}
    watch.lowest = {"tape": Lowest()}
    blocks = [
        ([1.0, 2.0], [[5.0, 4.0, 3.0], [2.0, -9.0, 1.0]], [10.0, 12.0]),
        ([3.0, 4.0], [[-1.0, 1.0, 1.0], [2.0, 2.0, -2.0]], [14.0, 16.0]),
    ]
    for times, tension, length in blocks:
        watch.watch(np.array(times), {"bodies/tape/tension": np.array(tension), "bodies/tape/length": np.array(length)})
    with pytest.warns(
        PhysicsWarning,
        match=r"body 'tape' went slack: at t = 2 s its tension is -9 N, 3 m from the exit "
        r"\(length 12 m, largest tension 9 N\)",
    ):
        watch.warn()


def test_loads_on_a_body_are_named_by_marker_in_its_axes_at_their_largest():
    """A body turned by 90 deg about z: a push along inertial x is along -y of it."""
    at = np.array([math.cos(math.pi / 4), 0, 0, math.sin(math.pi / 4)])
    body = rigid_body(1.0, np.eye(3), markers={"tip": Marker.rigid([1, 0, 0]), "mid": Marker.rigid([0.5, 0, 0])})
    rows = np.array([[0.0, 0, 0], [9.0, 0, 0.3], [0, 0, 5.0], [0, 0, 0]])
    loads = (
        Load("a", "arm", "tip", "inertial", np.array([3.0, 0.1, 0.2])),
        Load("b", "arm", "mid", "body", rows, times=np.arange(4.0)),
        Load("c", "arm", "tip", "body", torque=np.array([0.0, 2.0, 1.0])),
        Load("d", "hub", "origin", "body", np.array([0, 0, 1.0])),
    )
    system = System(
        {"arm": body, "hub": rigid_body(1.0, np.eye(3))},
        (spherical("arm", q0=at), free("hub")),
        loads=loads,
        environment=Environment(np.array([0.0, 0.2, -9.0])),
    )
    assert _loads(system, "arm") == {"tip": ["y", "z", "ry", "rz"], "mid": ["x"]}
    assert _loads(system, "hub") == {"origin": ["z"]}
    assert _weight(system, "arm") == ["z"] and _weight(
        replace(system, environment=Environment(np.array([0.0, 3.0, 1.0]))), "arm"
    ) == ["x", "z"]
    assert _weight(replace(system, environment=Environment()), "arm") == []
    held = _held(loads[1])
    assert held.times is None and held.force.tolist() == [9.0, 0.0, 0.3] and _held(loads[0]) is loads[0]


def test_an_enriched_body_at_rest_has_the_moments_of_the_same_shapes_reduced():
    member = Member("line", "beam", Rectangle(0.05, 0.02), Material(70e9, 0.3, 2700.0), {"orientation": (0.1, 1, 0.2)})
    structure = build_structure(line([[0.1, 0.2, 0.3], [1.0, 0.5, 0.1]], 4), [member])
    modes = cantilever_modes(structure, "start", 3)
    body = reduce_structure(structure, modes, markers={"tip": "end"})
    body = replace(body, markers={**body.markers, "grip": body.markers["tip"]})
    found = MeshedEnrichment(structure, modes, {"tip": "end", "start": "start"})(body, ["tip"])
    assert isinstance(found, EnrichedBody) and found.body.n_modes > 3 + 6
    grip, tip = (found.body.markers[name] for name in ("grip", "tip"))
    assert np.array_equal(grip.phi, tip.phi) and np.array_equal(grip.psi, tip.psi) and grip.phi.any()
    assert found.kept == pytest.approx(np.eye(found.body.n_modes)[:, :3])
    own, rich = body.moments, found.body.moments
    assert rich.first[:4] == pytest.approx(own.first[:4], abs=1e-9) and rich.mass == own.mass
    turn = np.array([np.cross(a, b) for a in np.eye(3) for b in np.eye(3)]).reshape(3, 3, 3)
    for k in range(1, 4):  # angular momentum of a shape, int r x phi dm
        assert np.einsum("ab,abc->c", rich.second[0, :, k, :], turn) == pytest.approx(
            np.einsum("ab,abc->c", own.second[0, :, k, :], turn), abs=1e-8
        )
        assert rich.second[k, :, 0, :] == pytest.approx(rich.second[0, :, k, :].T)
    assert rich.elastic_mass()[:3, :3] == pytest.approx(own.elastic_mass(), abs=1e-9)
    assert found.body.strain.V1[:3, :3] == pytest.approx(body.strain.V1, rel=1e-6, abs=1e-3)
    assert found.body.markers["tip"].phi[:, :3] == pytest.approx(body.markers["tip"].phi) and found.body.markers[
        "tip"
    ].psi[:, :3] == pytest.approx(body.markers["tip"].psi)
    for (group, way), x in found.choices.items():  # static shapes: unit load at the end deflects as K^-1 F does
        if group == "end":
            row = dict(
                zip(
                    ("x", "y", "z", "rx", "ry", "rz"),
                    np.vstack([found.body.markers["tip"].phi, found.body.markers["tip"].psi]),
                    strict=True,
                )
            )[way]
            assert np.linalg.solve(found.body.strain.V1, row)[3:] == pytest.approx(
                x[3:, 0], rel=1e-4, abs=1e-6 * np.abs(x).max()
            )
    assert {group for group, _ in found.choices} == {"start", "end"}


def test_shapes_are_chosen_by_the_energy_that_the_others_do_not_hold():
    """Three unit springs: a motion (0.6, 0.8 sin, 0.8 cos) / ..., kept e1; the larger part first, below SHARE none."""
    body = FlexibleBody(
        MassMoments(1.0, np.zeros((5, 3)), np.zeros((5, 3, 5, 3))),
        StrainTensors.linear(np.diag([1.0, 4.0, 9.0, 16.0])),
        np.zeros((4, 4)),
        {},
    )
    choices = {
        ("a", "x"): np.eye(4)[:, [1]],
        ("b", "y"): np.eye(4)[:, [2]],
        ("c", "z"): np.eye(4)[:, [3]],
        ("d", ""): np.eye(4)[:, [0]],
    }
    found = EnrichedBody(body, np.eye(4)[:, [0]], choices)
    small, large = 0.9 * np.sqrt(SHARE), 1.1 * np.sqrt(SHARE)
    motion = np.array([[0.9], [large / 2], [0.3 / 3], [small / 4]])
    assert selected_shapes(found, choices, motion) == [("b", "y"), ("a", "x")]
    two = np.column_stack([[0.9, 0.5 / 2, 0, 0], [0.1, 0, 0.4 / 3, large / 4]])
    assert selected_shapes(found, choices, two) == [("a", "x"), ("b", "y"), ("c", "z")]
    both = {("a", ""): np.eye(4)[:, 1:3], ("b", ""): np.array([[0.0], [1.0], [0.1], [0.0]])}
    assert selected_shapes(found, both, motion) == [("a", "")]  # which holds the other's


def tree() -> System:
    body = rigid_body(1.0, np.eye(3), markers={"p": Marker.rigid([1, 0, 0]), "q": Marker.rigid([0, 1, 0])})
    flexible = cloud(2, 5)
    joints = (
        weld("base"),
        weld("mast", "base", parent_marker="p", child_marker="a"),
        weld("top", "mast", parent_marker="b"),
        revolute("arm", "base", parent_marker="q"),
        weld("fin", "arm", parent_marker="p", child_marker="a"),
    )
    return System({"base": body, "mast": flexible, "top": body, "arm": body, "fin": flexible}, joints)


def test_a_root_cannot_move_where_all_that_carries_it_is_rigid_and_fixed():
    system = tree()
    assert {name: _stands(system, name) for name in system.bodies} == {
        "base": True,
        "mast": True,
        "top": False,
        "arm": False,
        "fin": False,
    }
    assert joint_markers(system) == {
        "base": {"origin", "p", "q"},
        "mast": {"a", "b"},
        "top": {"origin"},
        "arm": {"origin", "p"},
        "fin": {"a"},
    }


def test_times_of_an_estimate_are_dense_where_loads_jump_and_sines_turn():
    body = cloud(2, 6, stiff=50.0)
    load = Load(
        "kick",
        "b",
        "a",
        "body",
        np.array([[0.0, 0, 0], [0, 0, 0], [5.0, 0, 0], [5.0, 0, 0]]),
        times=np.array([0.0, 3.0, 3.0, 7.0]),
    )
    model = compile_system(System({"b": body}, (free("b"),), loads=(load,)))
    period = slowest_period(model)
    M, K = np.diag(body.moments.elastic_mass()), np.diag(body.strain.V1)
    assert shape_periods(body) == pytest.approx(2 * np.pi * np.sqrt(M / K)) and period == pytest.approx(
        max(shape_periods(body))
    )
    times = estimate_times(model, 10.0)
    assert times[0] == 0.0 and times[-1] == 10.0 and (np.diff(times) > 0).all()
    for wanted in (
        3.0,
        3.0 - 1e-8,
        3.0 + 1e-8,
        7.0,
        5.0,
        *(3.0 + period * np.arange(1, 9) / 8),
        *(period * np.arange(1, 9) / 8),
    ):
        assert np.abs(times - wanted).min() < 1e-9 if wanted <= 10 else True
    assert 2000 <= len(times) < 2100 and np.isin(np.linspace(0, 10, 2000), times).mean() > 0.99
    unloaded = estimate_times(compile_system(System({"b": body}, (free("b"),))), 10.0)
    assert all(np.abs(unloaded - at).min() < 1e-9 for at in period * np.arange(1, 9) / 8 if at <= 10.0)
    shaken = prismatic("b", axis=[1, 0, 0], motion=(Profile.sine(0.1, 60.0),))
    dense = estimate_times(compile_system(System({"b": body}, (shaken,))), 100.0)
    assert len(dense) >= 12 * 60.0 * 100 / (2 * np.pi) * 0.99


def test_sizes_of_states_are_one_but_for_rates_of_slow_joints():
    hub, beam = rigid_body(1.0, np.eye(3)), cloud(2, 7)
    system = System(
        {"hub": hub, "beam": beam}, (spherical("hub"), revolute("beam", "hub", child_marker="a")), orbit=Orbit(7e6)
    )
    model = compile_system(system)
    mean = np.sqrt(3.986004418e14 / 7e6**3)
    sizes = typical_sizes(model, 1e7)
    assert sizes[: model.n_q] == pytest.approx(1.0) and sizes[model.n_q :] == pytest.approx([mean] * 4 + [1.0, 1.0])
    assert (
        typical_sizes(model, 100.0)[model.n_q] == pytest.approx(2 * np.pi / 100)
        and typical_sizes(model, 0.1)[model.n_q] == 1.0
    )


@pytest.mark.parametrize(
    ("rate", "few", "told"), [(0.6, 3, True), (0.4, 3, False), (0.6, 6, False), (0.6, None, False), (0.6, 5, True)]
)
def test_a_body_of_few_shapes_that_spins_fast_wants_shapes_of_spin(rate: float, few: int | None, told: bool):
    body = cloud(2, 8)
    first = 2 * np.pi / max(shape_periods(body))
    spun = revolute("b", axis=[0, 0, 1], u0=[rate * first])
    system = System({"b": body}, (spun,))
    rigid = rigid_motion_of(compile_system(system), 1.0)
    found = spin_advice(system, rigid, KnownBodies({"b": Origin(open=LeftOpen(few=few))}))
    assert bool(found) == told
    if found:
        assert (found[0].body, found[0].decision, found[0].choice, found[0].limit) == ("b", "spin", True, 0.5)
        assert found[0].value == pytest.approx(rate, rel=0.2)


def test_an_output_step_is_held_against_the_first_mode_of_whole_bodies():
    slow, fast = cloud(2, 9, omega=np.array([0.3, 40.0])), cloud(2, 10, omega=np.array([9.0, 40.0]))
    system = System(
        {"a": fast, "b": slow, "c": slow},
        (free("a"), weld("b", "a", child_marker="a"), weld("c", "a", child_marker="b")),
    )
    assert not output_warnings(system, 0.99 * math.pi / 9.0)
    assert [one.body for one in output_warnings(system, 1.01 * math.pi / 9.0)] == ["a"]
    a, b = output_warnings(system, 20.0)
    assert (b.body, b.value, b.limit) == ("b", 20.0, pytest.approx(math.pi / 0.3)) and a.body == "a"
    assert (
        "an output step of 20 s resolves up to 0.025 Hz, and the first mode of body 'b' has "
        f"{0.3 / (2 * math.pi):.4g} Hz" in b.reason
    )
    cut = replace(system, segments={"wing": ("b", "c")})
    assert [one.body for one in output_warnings(cut, 20.0)] == ["a"]


def test_the_mass_that_modes_carry_is_their_largest_effective_mass():
    body = cloud(3, 11, kinds=("vibration",) * 3)
    mass, s = body.moments.mass, body.moments.first[1:]
    Me = body.moments.elastic_mass()
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(4000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    parts = np.einsum("pi,pi->p", ways @ s.T, np.linalg.solve(Me, s @ ways.T).T) / mass
    assert carried_mass(body) == pytest.approx(parts.max(), rel=2e-2) and carried_mass(body) >= parts.max() * (
        1 - 1e-12
    )
    system = System({"b": body}, (free("b"),))
    told = [one for one in model_warnings(system, KnownBodies({}), 1.0) if one.decision == "mass"]
    assert bool(told) == (carried_mass(body) < 0.75)
    for one in told:
        assert (
            one.value == pytest.approx(carried_mass(body))
            and f"its 3 modes is at most {carried_mass(body):.0%} of its mass" in one.reason
        )


def test_a_torque_that_no_shape_follows_is_told_of():
    still = Marker(np.zeros(3), np.ones((3, 2)), np.zeros((3, 2)))
    body = cloud(2, 12)
    body = replace(body, markers={**body.markers, "pin": still})
    loads = tuple(
        Load(name, "b", marker, "body", **what)
        for name, marker, what in (
            ("idle", "pin", {"torque": np.array([0, 0, 1.0])}),
            ("push", "pin", {"force": np.array([0, 0, 1.0])}),
            ("turn", "a", {"torque": np.array([0, 0, 1.0])}),
        )
    )
    found = [
        one
        for one in model_warnings(System({"b": body}, (free("b"),), loads=loads), KnownBodies({}), 1.0)
        if one.decision == "torque"
    ]
    assert len(found) == 1 and found[0].reason.startswith(
        "loads[idle]: none of the 2 shapes of body 'b' rotates its marker 'pin'"
    )


def test_the_phase_is_the_integral_of_the_change_of_frequency_unless_damping_ends_it():
    body = replace(cloud(1, 13), damping=np.zeros((1, 1)))
    system = System({"b": body}, (weld("b"),))
    omega = np.sqrt(body.strain.V1[0, 0] / body.moments.elastic_mass()[0, 0])
    times = np.linspace(0, 3, 400) ** 1.5
    gain = 0.3 * np.sin(times)
    rates = omega * np.abs(np.sqrt(1 + gain) - 1)
    assert _phase(system, "b", times, gain) == pytest.approx(np.trapezoid(rates, times))
    damped = replace(system, bodies={"b": replace(body, damping=np.array([[8.0]]))})
    assert _phase(damped, "b", times, gain) == pytest.approx(
        rates.max() / (8.0 / body.moments.elastic_mass()[0, 0] / 2)
    )
