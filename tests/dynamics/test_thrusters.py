"""Thrusters, tanks and releases: rockets, jet damping, momentum with the exhaust, pulses on flexible tips."""

from itertools import pairwise

import numpy as np
import pytest
from support.effector_builders import Supply, separation_spring, tank, tank_variation, thruster
from support.random_systems import random_body

from femflex.body import Marker
from femflex.body.flexible import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import Latch, System, free, turns, weld, with_attached

FINE = Dop853(rtol=1e-12, atol=1e-13)
ISP = 20.0
EXIT = 9.80665 * ISP


def run(system, end, n=41, method=FINE):
    model = compile_system(system)
    times = np.linspace(0.0, end, n)
    states = method.solve(model, times, model.x0).states
    return times, states, model.observe(times, states)


def rocket(mass, inertia, tanks, thrusters, start=(0.0,) * 6, markers=None):
    """A rigid body whose tanks (name: marker, mass, gyration) feed thrusters."""
    body = rigid_body(mass, inertia, markers=markers)
    fed = {name: [t.name for t in thrusters if f"{name}.feed" in t.inputs] for name in tanks}
    effectors = (*thrusters, *(tank(name, own[1], fed[name]) for name, own in tanks.items()))
    varying = {"hub": tank_variation(body, tanks)}
    return System({"hub": body}, (free("hub", u0=list(start)),), effectors=effectors, varying=varying)


def test_rocket_matches_tsiolkovsky_until_burn_out():
    """dv = c ln(m_0 / m), to rounding of the integration; the tank is empty at m c / F, and the thrust ends there."""
    push, full = 80.0, 3.0
    jet = thruster("jet", "hub", push, profile=([0.0], [1.0]), specific_impulse=ISP, supply=Supply("tank", "hub"))
    system = rocket(5.0, np.eye(3), {"tank": ("origin", full, 0.1)}, [jet])
    t, _, seen = run(system, 10.0, 101)
    empty = full * EXIT / push
    assert seen["effectors/tank/emptied"][-1] == pytest.approx(empty, rel=1e-12)
    mass = seen["bodies/hub/mass"]
    assert mass == pytest.approx(5.0 - np.minimum(t, empty) * push / EXIT, rel=1e-12)
    assert seen["monitors/momentum"][:, 0] / mass == pytest.approx(EXIT * np.log(5.0 / mass), abs=1e-9)
    assert not seen["effectors/jet/thrust"][t > empty].any() and seen["effectors/tank/feed"][-1] == 0.0
    assert seen["effectors/tank/mass"][-1] == 0.0


def test_jet_damping_of_a_spinning_rocket():
    """J dw/dt = -|mdot| (e^2 - b^2 - k^2) w for a transverse rate, J falling with b^2 + k^2 per mass (a rigid rocket
    whose nozzle lies at e and whose tank at b from the origin, which the body is held at)."""
    push, full, e, b, k = 40.0, 1.0, 1.5, 0.4, 0.3
    markers = {
        "nozzle": Marker.at_position(np.array([-e, 0.0, 0.0])),
        "tank": Marker.at_position(np.array([-b, 0.0, 0.0])),
        "origin": Marker.at_position(np.zeros(3)),
    }
    body = rigid_body(10.0, np.diag([2.0, 6.0, 6.0]), markers=markers)
    jet = thruster("jet", "hub", push, marker="nozzle", profile=([0.0], [1.0]), specific_impulse=ISP,
                   supply=Supply("tank", "hub", "tank", k))  # fmt: skip
    held = turns("hub", sequence="xyz", u0=np.array([0.0, 0.0, 0.8]))
    system = System({"hub": body}, (held,), effectors=(jet, tank("tank", full, ["jet"])),
                    varying={"hub": tank_variation(body, {"tank": ("tank", full, k)})})  # fmt: skip
    t, _, seen = run(system, 4.0)
    flow = push / EXIT
    own = b * b + k * k
    J = 6.0 - flow * t * own
    expected = 0.8 * (J / 6.0) ** ((e * e - own) / own)  # dw/w = -(e^2 - own)/own dJ / -J
    assert seen["bodies/hub/rate"][:, 2] == pytest.approx(expected, rel=1e-10)


def fed_across_bodies(u0):
    """A flexible craft in free flight with a tank on its boom and a nozzle on its hub, and u0 of the hub."""
    boom = with_attached(random_body(np.random.default_rng(3), 2)[0], "c", 0.5, np.zeros((3, 3)))
    markers = {"nozzle": Marker.at_position(np.array([-0.4, 0.1, 0.0])), "origin": Marker.at_position(np.zeros(3))}
    hub = rigid_body(20.0, np.diag([3.0, 4.0, 5.0]), markers=markers)
    jet = thruster("jet", "hub", 3.0, marker="nozzle", axis=(1, 0.2, 0), profile=([0.0], [1.0]),
                   specific_impulse=ISP, supply=Supply("tank", "boom", "c"))  # fmt: skip
    joints = (free("hub", u0=u0), weld("boom", "hub", child_marker="b"))
    varying = {"boom": tank_variation(boom, {"tank": ("c", 0.5, 0.0)})}
    return System({"hub": hub, "boom": boom}, joints, effectors=(jet, tank("tank", 0.5, ["jet"])), varying=varying)


def test_momentum_with_flow_and_exhaust_is_conserved():
    """Craft, propellant on its way and exhaust together, of a tumbling flexible craft."""
    model = compile_system(fed_across_bodies([0.1, 0, 0.05, 0.2, -0.3, 0.4]))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = np.linspace(0.0, 2.0, 17)
    times = np.concatenate([[0.0], *((a + b) / 2 + (b - a) / 2 * nodes for a, b in pairwise(edges)), [2.0]])
    w = np.concatenate([[0.0], *((b - a) / 2 * weights for a, b in pairwise(edges)), [0.0]])
    seen = model.observe(times, FINE.solve(model, times, model.x0).states)
    flow, force = seen["effectors/jet/flow"][:, None], seen["effectors/jet/force"]
    e, v_e = seen["markers/hub.nozzle/position"], seen["markers/hub.nozzle/velocity"]
    b, v_b = seen["markers/boom.c/position"], seen["markers/boom.c/velocity"]
    push = force[:, :3] + flow * (v_e - v_b)  # F d
    exhaust = flow * v_e - push  # |mdot| (v_e + c)
    P = seen["monitors/momentum"] + flow * (e - b)
    assert np.abs(P[-1] + w @ exhaust - P[0]).max() < 1e-10 * np.linalg.norm(w @ push)
    H = seen["monitors/angular_momentum"] + np.cross(seen["monitors/center_of_mass"], seen["monitors/momentum"])
    H = H + flow * np.cross(b, e)
    assert np.abs(H[-1] + w @ np.cross(e, exhaust) - H[0]).max() < 1e-10 * np.linalg.norm(H[0])
    assert flow.max() > 0.01 and seen["bodies/boom/mass"][-1] < seen["bodies/boom/mass"][0] - 0.02
    E = seen["monitors/energy"][-1] - w @ (seen["monitors/supplied"] - seen["monitors/dissipation"])
    assert E == pytest.approx(seen["monitors/energy"][0], abs=1e-9)


def test_pulse_on_beam_tip_matches_modal_solution():
    """delta_k = phi_k F int sin(w_k (t - s)) / w_k ds over the pulse, for small motions of a clamped beam."""
    beam = UniformBeam(length=4.0, EA=1e6, EIy=50.0, EIz=60.0, GJ=40.0, mass_per_length=0.5)
    body = beam_body(beam, BeamFunctions(y=3, z=0))
    force, begin, end = 1e-5, 0.2, 0.7
    jet = thruster("jet", "beam", force, marker="tip", axis=(0, 1, 0), pulses=[(begin, end - begin)])
    system = System({"beam": body}, (weld("beam", child_marker="root"),), effectors=(jet,))
    t, _, seen = run(system, 3.0, 61)
    w, phi = body.omega, body.marker("tip").phi[1]
    since, until = np.maximum(t - begin, 0.0)[:, None], np.maximum(t - end, 0.0)[:, None]
    expected = phi * force / w**2 * (np.cos(w * until) - np.cos(w * since))
    assert seen["bodies/beam/delta"] == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    assert np.abs(expected[-1]).min() > 0.0


def test_separation_by_spring_conserves_momentum():
    """A body that is locked to another until 0.3 s, then pushed off: momentum, and the closed form of the spring."""
    k, length, m1, m2 = 50.0, 0.2, 3.0, 1.0
    base = rigid_body(m1, np.eye(3), markers={"top": Marker.at_position(np.zeros(3))})
    top = rigid_body(m2, np.eye(3) * 0.2)
    latches = tuple(Latch(i, [0.1, 0, 0, 0, 0, 0][i], opens=0.3) for i in range(6))
    free_after = turns("top", "base", slides=np.eye(3), q0=np.array([0.1, 0, 0, 0, 0, 0]), latches=latches)
    spring = separation_spring("spring", (("base", "top"), ("top", "origin")), k, length)
    start = [0.1, 0.2, 0, 0, 0, 0.3]
    system = System({"base": base, "top": top}, (free("base", u0=start), free_after), effectors=(spring,))
    t, _, seen = run(system, 1.5, 151)
    H, p = seen["monitors/angular_momentum"], seen["monitors/momentum"]
    assert np.abs(p - p[0]).max() < 1e-12 and np.abs(H - H[0]).max() < 1e-12
    distance = seen["effectors/spring/distance"]
    assert distance[t <= 0.3] == pytest.approx(0.1, abs=1e-13)
    assert distance[-1] > 1.0
    E = seen["monitors/energy"]
    assert np.abs(E - E[0]).max() < 1e-11
    times = [values[-1] for path, values in seen.items() if path.startswith("latches/") and path.endswith("/time")]
    assert times == pytest.approx([-2.0 - 0.3] * 6, abs=1e-12)  # that of the release is kept


def test_release_without_spring_conserves_momentum():
    """An arm's end body keeps the velocity that it has when it is let go."""
    arm = rigid_body(3.0, np.eye(3), markers={"end": Marker.at_position(np.array([1.0, 0, 0]))})
    ball = rigid_body(1.0, np.eye(3) * 0.1)
    latches = tuple(Latch(i, 0.0, opens=1.0) for i in range(6))
    joints = (
        free("arm", u0=[0, 0, 0, 0, 0, 0.7]),
        turns("ball", "arm", slides=np.eye(3), parent_marker="end", latches=latches),
    )
    t, _, seen = run(System({"arm": arm, "ball": ball}, joints), 2.0, 21)
    p, H = seen["monitors/momentum"], seen["monitors/angular_momentum"]
    assert np.abs(p - p[0]).max() < 1e-12 and np.abs(H - H[0]).max() < 1e-12
    x = seen["bodies/ball/position"]
    late = t >= 1.0
    v = (x[-1] - x[10]) / 1.0
    assert x[late] == pytest.approx(x[10] + np.outer(t[late] - 1.0, v), abs=1e-11)
