"""Departures and monodromy matrices of motions that are known in closed form, and what floquet refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import usual_sizes
from femflex.studies.floquet import (
    coming_back,
    departure,
    departure_sizes,
    departures,
    displaced,
    floquet,
    periodic_state,
)
from femflex.system import (
    Controller,
    Frame,
    Joint,
    Load,
    Sensor,
    System,
    prismatic,
    revolute,
    spherical,
)

SPAN = {"far": Marker.rigid([0.0, 0.0, 2.0])}


def carts(damping: float = 0.0) -> System:
    """Two carts on a rail, 3 kg and 2 kg, joined by a spring of 5 N/m."""
    slides = {"axis": [1, 0, 0]}
    return System(
        {"first": rigid_body(3.0, np.eye(3), markers=SPAN), "second": rigid_body(2.0, np.eye(3))},
        (
            prismatic("first", name="rail", **slides),
            prismatic("second", "first", name="gap", stiffness=[5.0], damping=[damping], **slides),
        ),
    )


def flow_of_carts(damping: float, period: float) -> np.ndarray:
    """exp(A T) of (rail, gap) and their rates."""
    M, K, D = np.array([[5.0, 2.0], [2.0, 2.0]]), np.diag([0.0, 5.0]), np.diag([0.0, damping])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    return expm(A * period)


@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_carts_at_rest_anywhere_on_their_rail_come_back_with_the_flow_of_their_equation(damping):
    period, place = 0.7, np.array([0.6, 0.0, 0.0, 0.0])
    found = floquet(carts(damping), period, place)
    assert found.names == ("rail.slide", "gap.slide", "rail.slide_rate", "gap.slide_rate")
    assert found.monodromy == pytest.approx(flow_of_carts(damping, period), abs=1e-6)
    assert found.trivial == ("translation x", "drift") and found.x.tolist() == place.tolist()
    assert found.period == period and found.gap < 1e-9 and found.stable and 0 <= found.split < 1e-3
    s = np.roots([1.0, damping * 5 / 6, 25 / 6])  # of the gap: m = 3 2 / 5
    assert np.sort_complex(found.multipliers) == pytest.approx(
        np.sort_complex(np.append(np.exp(s * period), [1, 1])), abs=1e-6
    )
    assert (np.diff(np.abs(found.multipliers)) <= 0).all() and (found.multipliers == 1.0).sum() == 2


def test_a_vibration_of_the_carts_comes_back_in_all_ways():
    period = 2 * np.pi / np.sqrt(25 / 6)
    found = floquet(carts(), period, np.array([0.1, 0.3, 0.0, 0.0]))
    assert found.trivial == ("translation x", "phase", "neutral", "drift") and (found.multipliers == 1.0).all()


def test_a_body_at_rest_in_inertial_space_circles_in_a_spinning_frame():
    """After a turn the frame is where it was: departures come back, and rates have moved it as in inertial axes."""
    w = 0.8
    system = System(
        {"stone": rigid_body(2.0, np.eye(3))},
        (Joint("stone", name="plane", translations=np.eye(3)[:2], kind="general"),),
        frame=Frame("spinning", np.array([0, 0, w])),
    )
    q, T = np.array([0.5, 0.2]), 2 * np.pi / w
    cross = np.array([[0.0, -w], [w, 0.0]])
    found = floquet(system, T, np.concatenate([q, -cross @ q]))
    wanted = np.block([[np.eye(2) + T * cross, T * np.eye(2)], [-T * cross @ cross, np.eye(2) - T * cross]])
    assert found.monodromy == pytest.approx(wanted, abs=1e-5)
    assert found.trivial == ("translation x", "translation y", "drift", "drift")


def generic() -> System:
    """A ball, a turn, a locked slide, a slide under a load and an accelerometer with a lag."""
    hub = rigid_body(2.0, np.diag([0.5, 0.4, 0.6]), [0.0, 0.02, 0.05])
    return System(
        {
            "hub": hub,
            "arm": rigid_body(1.0, np.eye(3)),
            "pin": rigid_body(1.0, np.eye(3)),
            "cart": rigid_body(1.0, np.eye(3), markers=SPAN),
        },
        (
            spherical("hub", name="ball"),
            revolute("arm", "hub", name="elbow", axis=[0, 1, 0], q0=[0.4]),
            prismatic("pin", "arm", name="lock", motion=(0.3,)),
            prismatic("cart", "pin", name="rail", q0=[0.2]),
        ),
        effectors=Sensor("gauge", "acceleration", "cart", bandwidth=4.0).effectors,
    )


def test_departures_are_free_coordinates_their_rates_and_states_each_in_its_usual_size():
    model = compile_system(generic())
    places = departures(model)
    own = [*(f"ball.turn_{a}" for a in "xyz"), "elbow.angle", "rail.slide"]
    rates = [*(f"ball.omega_{a}" for a in "xyz"), "elbow.angle_rate", "rail.slide_rate"]
    states = [f"gauge.lagged_{a}" for a in "xyz"]
    assert [name for _, name in places] == [*own, *rates, *states]
    assert [place for place, _ in places] == [0, 1, 2, 3, 5, 6, 7, 8, 9, 11, 12, 13, 14]
    sizes = departure_sizes(model, [place for place, _ in places], 4.0)
    usual = np.array([1.0, 1.0, 1.0, 1.0, 2.0])  # a radian, and the greatest span of a body [m]
    assert sizes == pytest.approx(np.concatenate([usual, usual / 4.0, generic().state_sizes()]))


def test_a_departure_is_found_again_whatever_the_sign_of_the_quaternion_and_the_turns_of_an_angle():
    model = compile_system(generic())
    places = departures(model)
    e = np.array([0.6, -0.5, 0.3, 0.2])
    x = model.x0.copy()
    x[:4] = e / np.linalg.norm(e)
    by = 1e-5 * np.arange(1.0, len(places) + 1) * (-1.0) ** np.arange(len(places))
    y = displaced(model, x, by, places)
    assert departure(model, x, y, places) == pytest.approx(by, rel=1e-3, abs=1e-9)
    again = y.copy()
    again[:4] *= -1.0
    again[4] += 4 * np.pi
    assert departure(model, x, again, places) == pytest.approx(by, rel=1e-3, abs=1e-9)
    again[6] += 2 * np.pi  # a slide has no turns
    assert departure(model, x, again, places)[4] == pytest.approx(by[4] + 2 * np.pi)
    u, z = slice(model.n_q, model.n_q + model.n_u), slice(model.n_q + model.n_u, None)
    free = [0, 1, 2, 3, 5]
    assert (y - x)[u][free] == pytest.approx(by[5:10]) and (y - x)[z] == pytest.approx(by[10:])
    assert y[5] == x[5] and y[u][4] == x[u][4]  # the locked slide


def test_departures_that_come_back_and_those_that_come_back_with_more_of_them():
    rng = np.random.default_rng(2)
    J = np.diag([1.0, 1.0, 1.0, 1.0, 0.5, -1.2])
    J[0, 1] = 0.7  # the second drifts along the first, the fourth stands alone
    J[1, 2] = 0.3  # the third along the second
    T = rng.normal(size=(6, 6))
    steps = coming_back(T @ J @ np.linalg.inv(T))
    assert [step.shape[1] for step in steps] == [2, 1, 1]
    R = np.hstack(steps)
    assert R.T @ R == pytest.approx(np.eye(4), abs=1e-12)
    for kept, columns in ((2, [0, 3]), (3, [0, 3, 1]), (4, [0, 3, 1, 2])):
        inside = R[:, :kept] @ R[:, :kept].T
        assert inside @ T[:, columns] == pytest.approx(T[:, columns], abs=1e-8)
    assert coming_back(np.diag([0.5, 2.0])) == []


def test_systems_without_free_coordinates_have_no_multipliers():
    still = System({"a": rigid_body(1.0, np.eye(3))}, (prismatic("a", motion=(0.2,)),))
    found = floquet(still, 1.0)
    assert found.multipliers.shape == (0,) and found.stable and found.trivial == () and found.gap == found.split == 0.0
    assert found.monodromy.shape == (0, 0)


def test_what_has_no_multipliers_is_refused():
    law = Controller("law", lambda t, seen, memory: (np.zeros(1), memory), 0.1, (), {"a": "N"})
    loop = spherical("second", name="tie")
    for more in ({"effectors": (law,)}, {"loops": (loop,)}):
        with pytest.raises(
            ValueError, match="are those of systems without loops, rolling and sampled controllers; open"
        ):
            floquet(replace(carts(), **more), 1.0)
    with pytest.raises(ValueError, match=r"the period is -2 s; it must be above 0"):
        floquet(carts(), -2)


def test_a_motion_that_comes_back_elsewhere_is_refused_with_the_worst_of_its_coordinates():
    """The rail drifts by 0.3 m in a period, over the span of 2 m; its rate stays."""
    rest = floquet(carts(), 2 * np.pi / np.sqrt(25 / 6)).period
    with pytest.raises(ValueError) as caught:
        floquet(carts(), rest, np.array([0.0, 0.2, 0.3 / rest, 0.0]))
    assert f"after {rest:.9g} s rail.slide differs by 0.15 of its usual size from its start" in str(caught.value)


def test_shooting_without_a_periodic_motion_says_what_is_left():
    """A cart of 3 kg under 6 N: its rate grows by 2 m/s^2 for 1.5 s, whatever the start."""
    cart = System(
        {"cart": rigid_body(3.0, np.eye(3), markers=SPAN)},
        (prismatic("cart", name="rail"),),
        loads=(Load("push", "cart", force=np.array([6.0, 0, 0])),),
    )
    left = 2.0 * 1.5 / (usual_sizes(compile_system(cart))[0] / 1.5)
    text = (
        rf"no motion of the period 1\.5 s was found near the start; after 12 steps of Newton's method {left:.3g} of the"
    )
    with pytest.raises(ValueError, match=text):
        periodic_state(cart, 1.5)


def test_shooting_changes_what_may_not_stay_and_keeps_where_the_motion_may_begin():
    """Drift and vibration of carts with a damper are taken out; the place on the rail stays near."""
    x = periodic_state(carts(0.5), 0.7, np.array([0.9, 0.1, 0.2, -0.1]))
    assert x[1:] == pytest.approx(np.zeros(3), abs=1e-8) and 0.5 < x[0] < 1.3
