"""Numbers behind small motions: directions that loops leave, answers of modes, sizes and stiffness of coordinates."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import null_space
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.body.skin import Skin
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.closed_motion import closing_directions, independent_coordinates, least_multipliers
from femflex.dynamics.equilibria.elastic_response import elastic_places, modal_response
from femflex.dynamics.equilibria.equilibrium import Equilibrium
from femflex.dynamics.equilibria.frequency import damped, largest_eigenvalue
from femflex.dynamics.equilibria.linearised import (
    frame_rate,
    held_freedoms,
    linear_stiffness,
    span_of,
    turning,
    usual_sizes,
)
from femflex.dynamics.equilibria.rest_modes import RestModes, Truncation, linear_body, rest_modes
from femflex.dynamics.equilibria.small_motions import SmallMotions, growth_threshold
from femflex.dynamics.equilibria.states import StateEquations, moving_states
from femflex.dynamics.equilibria.system_modes import SystemModes
from femflex.system import (
    Effector,
    Frame,
    Friction,
    Joint,
    Orbit,
    Spring,
    System,
    free,
    revolute,
    spherical,
    universal,
    weld,
)


def dependent_rows(seed: int = 1) -> np.ndarray:
    """Five rows over eight coordinates, of which three are independent."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(5, 3)) @ rng.normal(size=(3, 8))


def test_directions_that_rows_leave_are_their_null_space_though_rows_depend_on_each_other():
    A, sizes = dependent_rows(), np.random.default_rng(2).uniform(0.1, 30.0, 8)
    Z = closing_directions(A, 1e-9)
    np.testing.assert_allclose(Z.T @ Z, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(A @ Z, 0.0, atol=1e-11)
    own, Y = independent_coordinates(A, sizes, 1e-9)
    assert len(own) == 5 and list(own) == sorted(own)
    np.testing.assert_allclose(A @ Y, 0.0, atol=1e-9)
    np.testing.assert_allclose(Y[own], np.eye(5), atol=1e-12)
    follow = np.setdiff1d(np.arange(8), own)
    assert int(np.argmax(np.linalg.norm(A * sizes, axis=0))) in follow  # what rows move most follows the others
    none, all_free = independent_coordinates(np.zeros((1, 3)), np.ones(3), 1e-9)
    np.testing.assert_array_equal(none, [0, 1, 2])
    np.testing.assert_array_equal(all_free, np.eye(3))


def test_multipliers_are_the_least_that_come_nearest_to_a_force():
    A, force = dependent_rows(3), np.random.default_rng(4).normal(size=8)
    found = least_multipliers(A, force, 1e-9)
    assert found @ A @ null_space(A) == pytest.approx(np.zeros(5), abs=1e-10)
    np.testing.assert_allclose(A @ (force - found @ A), 0.0, atol=1e-9)
    np.testing.assert_allclose(null_space(A.T).T @ found, 0.0, atol=1e-10)


def test_modes_answer_a_broken_line_of_forces_and_kicks_between_unequal_times():
    omega, damping = np.array([3.0, 0.8, 5.0]), np.array([0.4, 0.0, 2.0])
    times, rng = np.array([0.0, 0.5, 1.7, 1.9, 4.0]), np.random.default_rng(5)
    force, impulse, start = rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), rng.normal(size=(2, 3))
    y, rate = modal_response(omega, damping, times, force, impulse, start)
    state = np.concatenate(start)
    for k in range(4):

        def f(t, x, k=k):
            part = (t - times[k]) / (times[k + 1] - times[k])
            pushed = force[k] + part * (force[k + 1] - force[k])
            return np.concatenate([x[3:], pushed - damping * x[3:] - omega**2 * x[:3]])

        state = solve_ivp(f, times[k : k + 2], state, rtol=1e-10, atol=1e-12, method="DOP853").y[:, -1]
        state[3:] += impulse[k]
        np.testing.assert_allclose(np.concatenate([y[k + 1], rate[k + 1]]), state, atol=1e-8)


def test_states_that_follow_at_once_add_the_stiffness_of_their_answer():
    rng = np.random.default_rng(6)
    R, F_x, F_u, F_z = rng.normal(size=(4, 2)), rng.normal(size=(2, 4)), rng.normal(size=(2, 4)), -np.eye(2) + 0.3
    one = StateEquations(R, F_x, F_u, F_z, ("a", "b"))
    xi = rng.normal(size=4)
    z = np.linalg.solve(F_z, -F_x @ xi)
    np.testing.assert_allclose(one.settled_stiffness() @ xi, R @ z, rtol=1e-10)
    Z = rng.normal(size=(4, 3))
    over, eta = one.along(Z), rng.normal(size=3)
    np.testing.assert_allclose(over.F_x @ eta, F_x @ (Z @ eta))
    np.testing.assert_allclose(over.F_u @ eta, F_u @ (Z @ eta))
    assert eta @ over.R @ z == pytest.approx((Z @ eta) @ R @ z)
    assert not StateEquations.none(3).settled_stiffness().any() and StateEquations.none(3).R.shape == (3, 0)


def motions(eigenvalues, owners=(), **more) -> SmallMotions:
    values = np.asarray(eigenvalues, complex)
    n = len(values)
    return SmallMotions(
        values, np.arange(2.0 * n).reshape(2, n) + 0j, values, (), np.eye(2), 0.0, {}, False,
        tuple(owners) or ("",) * n, np.full(n, 0.1), np.full(n, 0.1),
    )  # fmt: skip


def test_ratios_and_frequencies_are_those_of_the_eigenvalues():
    found = motions([-0.3 + 0.4j, 0.2, -2.0, 0.05 + 3j, 0.0], ["", "lag.x", "", "", ""])
    np.testing.assert_allclose(found.damping_ratios, [0.6, -1.0, 1.0, -0.05 / abs(0.05 + 3j), 0.0])
    np.testing.assert_allclose(found.frequencies, np.array([0.4, 0, 0, 3, 0]) / (2 * np.pi))
    np.testing.assert_array_equal(found.growing, [False, True, False, False, False])
    assert found.growth == pytest.approx(0.2) and motions([-1.0]).growth == 0.0
    left = found.of_craft()
    np.testing.assert_array_equal(left.eigenvalues, found.eigenvalues[[0, 2, 3, 4]])
    np.testing.assert_array_equal(left.shapes, found.shapes[:, [0, 2, 3, 4]])
    assert left.owners == ("",) * 4 and len(left.thresholds) == 4
    np.testing.assert_allclose(growth_threshold(np.array([3 + 4j, 0.1]), 2.0), [5e-8, 2e-8])


def found_modes() -> SystemModes:
    values = np.array([0.0, -0.3 + 0.4j, 1e-12 + 7j, 0.5])
    model = SimpleNamespace(system=SimpleNamespace(effectors=()))
    about = SimpleNamespace(stable=False, verdict="unstable: so", growth_threshold=1e-7, model=model)
    return SystemModes(
        values, ("translation x", "bending 1", "bending 2", "joint 1"), np.array([True, False, False, False]),
        np.array([False, False, False, True]),
        {"a": np.array([0.1, 0.2, 0.3, 0.4]), "b": np.array([0.9, 0.8, 0.7, 0.6])},
        np.zeros((2, 4), complex), about, ("load 'push'",),
    )  # fmt: skip


def test_modes_in_plain_numbers_hold_each_its_own():
    found = found_modes()
    plain = found.to_dict()
    one = plain["modes"][1]
    assert one == {
        "name": "bending 1", "frequency_hz": pytest.approx(0.4 / (2 * np.pi)), "omega_rad_s": pytest.approx(0.4),
        "damping_ratio": pytest.approx(0.6), "growth_per_s": pytest.approx(-0.3), "rigid": False, "stable": True,
        "kinetic_energy": {"a": 0.2, "b": 0.8},
    }  # fmt: skip
    assert [mode["rigid"] for mode in plain["modes"]] == [True, False, False, False]
    assert [mode["stable"] for mode in plain["modes"]] == [True, True, True, False]
    assert plain["modes"][2]["damping_ratio"] == 0.0 and plain["modes"][3]["damping_ratio"] == -1.0
    assert (plain["stable"], plain["verdict"], plain["growth_threshold"]) == (False, "unstable: so", 1e-7)
    assert plain["left_out"] == ["load 'push'"] and plain["held"] == []


def test_a_mode_is_found_by_name_and_by_number_from_one():
    found = found_modes()
    assert found.frequency("bending 2") == found.frequency(3) == pytest.approx(7 / (2 * np.pi))
    assert found.frequency(1) == 0.0 and found.frequency(4) == 0.0
    for name, text in (("flap 1", "has no mode 'flap 1'; it has translation x, bending 1, bending 2, joint 1"),
                       (5, "the craft has no mode 5; its modes are 1 to 4"), (0, "no mode 0")):  # fmt: skip
        with pytest.raises(KeyError) as error:
            found.frequency(name)
        assert text in str(error.value)


def verdict_of(values, share=1.0, neutral=(), left=None, driven=False, known=()) -> Equilibrium:
    one = Equilibrium(None, np.zeros(0), share, 0.0, 3, tuple(neutral), np.zeros((0, 0)), None, left)
    found = replace(motions(values), driven=driven, known=known, spectrum_thresholds=np.full(len(values), 1e-6))
    vars(one)["motions"] = found  # what the property would find
    return one


STABLE, GROWS = "stable: no small motion grows", "unstable: a small motion grows"
KNOWN = [SimpleNamespace(name=name) for name in ("spin", "u", "spin")]


@pytest.mark.parametrize(
    ("about", "text", "stable"),
    [
        (verdict_of([-0.1 + 3j, -0.1 - 3j, -2 + 5j]), STABLE + "; its slowest vibration has 0.477465 Hz", True),
        (verdict_of([-0.1, -2.0]), STABLE, True),
        (verdict_of([0.25, -2.0]), GROWS + " monotonically by a factor e in 4 s", False),
        (verdict_of([0.25 + 1j, 0.2, -2.0]), GROWS + " in oscillations by a factor e in 4 s", False),
        (verdict_of([0.25 - 1j, 0.2, -2.0]), GROWS + " in oscillations by a factor e in 4 s", False),
        (verdict_of([]), "nothing is free to move", True),
        (verdict_of([], neutral=("a", "b")), STABLE + ", neutral along a, b", True),
        (verdict_of([4j], neutral=("a",)), STABLE + "; its slowest vibration has 0.63662 Hz, neutral along a", True),
        (verdict_of([1.0], share=0.5), "not known", True),
        (verdict_of([2e-4, 2j], left=verdict_of([0.1])), STABLE + "; its slowest vibration has 0.31831 Hz", True),
        (verdict_of([4e-4], left=verdict_of([0.1])), GROWS + " monotonically by a factor e in 2500 s", False),
        (
            verdict_of([-1.0], neutral=("x",), driven=True, known=KNOWN),
            STABLE + ", neutral along spin, u", True,
        ),
    ],
)  # fmt: skip
def test_an_equilibrium_says_how_it_stands(about, text, stable):
    assert about.verdict == text and about.stable is stable


def test_growth_is_measured_by_the_threshold_of_what_grows_most():
    about = verdict_of([0.3, -1.0 + 2j])
    assert about.growth == pytest.approx(0.3) and about.growth_threshold == pytest.approx(1e-6)
    assert verdict_of([]).growth_threshold == 0.0 and verdict_of([1.0], share=0.5).growth == 0.0


def test_the_lowest_elastic_modes_end_with_whole_pairs_and_fill_the_band():
    omega = np.array([0.0, 1.0, 2.0, 2.015, 3.0, 4.0])
    found = RestModes(omega, np.array([False, True, True, True, False, True]), {})
    np.testing.assert_array_equal(found.lowest_elastic(1), [1])
    np.testing.assert_array_equal(found.lowest_elastic(2), [1, 2, 3])
    np.testing.assert_array_equal(found.lowest_elastic(1, band=3.5 / (2 * np.pi)), [1, 2, 3])
    np.testing.assert_array_equal(found.lowest_elastic(1, band=4.5 / (2 * np.pi)), [1, 2, 3, 5])
    np.testing.assert_allclose(Truncation(np.array([2.0, 4.0]), np.array([1.5, 3.8])).errors, [0.25, 0.05])


def test_modes_at_rest_are_those_of_mass_and_linear_stiffness_without_what_acts():
    rng = np.random.default_rng(12)
    body, _ = random_body(rng, 4)
    hub = rigid_body(3.0, [1.0, 2.0, 2.5], [0.1, 0.2, 0.3], {"m": Marker.rigid(np.array([0.3, -0.2, 0.5]))})
    system = System({"hub": hub, "arm": body}, (
        weld("hub"), revolute("arm", "hub", axis=(1.0, 2.0, 2.0), stiffness=40.0, parent_marker="m", child_marker="a")
    ), frame=Frame("spinning", np.array([0.0, 0.0, 3.0])))  # fmt: skip
    found = rest_modes(system)
    model = compile_system(system)
    M = model.mass_matrix(0.0, model.at_rest(model.x0[: model.n_q]))
    K = np.zeros((5, 5))
    K[0, 0], K[1:, 1:] = 40.0, body.strain.V1
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    np.testing.assert_allclose(found.omega, np.sqrt(squares), rtol=1e-7)
    phi = found.shapes["arm"]
    np.testing.assert_allclose(np.diag(phi.T @ body.strain.V1 @ phi) <= squares * (1 + 1e-9), True)
    shares = np.diag(phi.T @ body.strain.V1 @ phi) / squares
    np.testing.assert_array_equal(found.elastic, shares > 0.01)
    plain = linear_body(body)
    assert plain.strain.is_linear and not plain.strain.f0.any()


def tree_with_everything():
    """Bodies of 0 to 3 shapes on joints of every kind, one freedom held."""
    rng = np.random.default_rng(31)
    bodies = {name: random_body(rng, n)[0] for name, n in (("a", 2), ("b", 0), ("c", 3), ("d", 1))}
    skin = Skin(4.0 * rng.normal(size=(5, 3)), {}, rng.normal(size=(3, 5, 3)))
    bodies["c"] = replace(bodies["c"], skin=skin)
    joints = (
        free("a", stiffness=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
        universal("b", "a", stiffness=[7.0, 0.0], motion=(None, 0.2), parent_marker="a"),
        spherical("c", "b", rotation="xzy", stiffness=8.0, parent_marker="b", child_marker="c"),
        Joint("d", "a", translations=[[1.0, 2.0, 0.0]], rotations=[[0.0, 0.0, 1.0]], stiffness=[9.0, 10.0]),
    )
    return System(bodies, joints)


def test_stiffness_sizes_and_held_freedoms_stand_at_their_coordinates():
    system = tree_with_everything()
    model = compile_system(system)
    names, q_names = [n for n, _ in system.velocity_names()], [n for n, _ in system.coordinate_names()]
    K, at = linear_stiffness(model)
    wanted = dict(zip(("base-a.slide1", "base-a.slide2", "base-a.slide3"), (1.0, 2.0, 3.0), strict=True))
    wanted |= {"a-b.angle1": 7.0, "a-b.angle2": 0.0, "a-d.slide": 9.0, "a-d.angle": 10.0}
    place = {}
    for k, name in enumerate(names):
        plain = name.removesuffix("_rate")
        if plain in wanted:
            assert K[k, k] == wanted[plain] and q_names[at[k]] == plain
        if ".omega" in name:
            assert at[k] == -1 and not K[k].any()
        if ".delta" in name:
            assert q_names[at[k]] == plain
            place.setdefault(plain.partition(".")[0], []).append(k)
    for name, rows in place.items():
        V1 = system.bodies[name].strain.V1
        np.testing.assert_allclose(K[np.ix_(rows, rows)], (V1 + V1.T) / 2)
    assert [names[k] for k in np.flatnonzero(held_freedoms(model))] == ["a-b.angle2_rate"]
    qe, ue = elastic_places(model)
    assert sorted(q_names[k] for k in qe) == sorted(n.removesuffix("_rate") for n in (names[k] for k in ue))
    assert len(qe) == 6 and all(".delta" in q_names[k] for k in qe)
    sizes, spans = usual_sizes(model), {}
    for name, body in system.bodies.items():
        points = np.array([m.position for m in body.markers.values()])
        points = points if body.skin is None else np.concatenate([points, body.skin.points])
        spans[name] = np.linalg.norm(points.max(axis=0) - points.min(axis=0))
        assert span_of(body) == pytest.approx(spans[name])
        for k, row in enumerate(place.get(name, ())):
            reach = [np.linalg.norm(m.phi[:, k]) / spans[name] for m in body.markers.values()]
            reach += [np.linalg.norm(m.psi[:, k]) for m in body.markers.values()]
            if body.skin is not None:
                reach += [np.linalg.norm(p) / spans[name] for p in body.skin.shapes[k]]
            assert sizes[row] == pytest.approx(1.0 / max(reach))
    for k, name in enumerate(names):
        if "slide" in name:
            assert sizes[k] == pytest.approx(max(spans.values()))
        elif ".delta" not in name:
            assert sizes[k] == 1.0
    assert span_of(rigid_body(1.0, [1.0] * 3)) == 1.0


def test_increments_of_balls_turn_back_with_their_rates():
    system = tree_with_everything()
    model, u = compile_system(system), np.random.default_rng(3).normal(size=len(system.velocity_names()))
    W = turning(model, u)
    names, xi = [n for n, _ in system.velocity_names()], np.random.default_rng(4).normal(size=len(u))
    wanted = np.zeros(len(u))
    for ball in ("base-a", "b-c"):
        rows = [
            names.index(f"{ball}.omega_{a}_rate" if f"{ball}.omega_{a}_rate" in names else f"{ball}.omega_{a}")
            for a in "xyz"
        ]
        wanted[rows] = -np.cross(u[rows], xi[rows])
    np.testing.assert_allclose(W @ xi, wanted, atol=1e-12)


def test_the_rate_of_a_frame_is_that_of_its_spin_or_of_its_orbit():
    body, orbit = rigid_body(1.0, [1.0] * 3), Orbit(7e6, 0.1, mu=4e14)
    spun = System({"a": body}, (free("a"),), frame=Frame("spinning", np.array([0.2, -0.3, 0.6])))
    assert frame_rate(spun) == pytest.approx(0.7)
    carried = System({"a": body}, (spherical("a"),), frame=Frame("orbital"), orbit=orbit)
    assert frame_rate(carried) == pytest.approx(np.sqrt(4e14 / 7e6**3))
    assert frame_rate(System({"a": body}, (spherical("a"),), orbit=orbit)) == 0.0
    assert frame_rate(System({"a": body}, (free("a"),))) == 0.0


def test_a_system_is_damped_by_any_of_its_parts():
    body, flexible = rigid_body(1.0, [1.0] * 3), random_body(np.random.default_rng(0), 2)[0]
    bare = System(
        {"a": body, "b": body}, (free("a"), revolute("b", "a", stiffness=1.0)), springs=(Spring("s", "a", "b"),)
    )
    assert not damped(bare)
    jet = Effector("jet", lambda seen, out: None, states={"m": "kg"})
    for change in (
        {"joints": (free("a"), revolute("b", "a", damping=0.1))},
        {"joints": (free("a"), revolute("b", "a", laws=(Friction(limit=1.0),)))},
        {"springs": (Spring("s", "a", "b"), Spring("t", "a", damping=0.1))},
        {"effectors": (jet,)},
        {"bodies": {"a": body, "b": flexible}},
    ):
        assert damped(replace(bare, **change))
    assert not damped(replace(bare, bodies={"a": body, "b": replace(flexible, damping=np.zeros((2, 2)))}))
    latched = replace(bare, effectors=(jet,))
    assert moving_states(latched) == [0] and moving_states(bare) == []


@pytest.mark.parametrize("n", [3, 130])
def test_the_largest_eigenvalue_is_found_with_and_without_the_matrix(n):
    rng = np.random.default_rng(n)
    values = np.concatenate([[5.0, 4.0, -9.0], rng.uniform(-1.0, 1.0, n - 3)])
    X = np.eye(n) + 0.05 * rng.normal(size=(n, n)) / np.sqrt(n)
    A = X @ np.diag(values) @ np.linalg.inv(X)
    assert largest_eigenvalue(lambda v: v @ A.T, n) == pytest.approx(5.0, rel=1e-5)
    assert largest_eigenvalue(lambda v: v, 0) == 0.0
