"""Condensed bodies: shapes that follow others, against material points that move with them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mechanisms import four_bar
from support.pointwise import Jet, Tree, const, equations, skew
from support.random_systems import random_state, random_tree
from test_curved_strain import curved
from test_equations import frozen, orbital_frame
from test_terms import along, furnished, one

from femflex.dynamics import compile_system
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.integrate import integrator
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import Frame, Orbit, free, spherical


class Followed(Tree):
    """Points that move with the amplitudes of all shapes, which follow the coordinates, as jets in time."""

    def points(self, q, u, udot, base, shift=None):
        bodies = {
            name: SimpleNamespace(n_modes=body.n_shapes, marker=body.marker)
            for name, body in self.system.bodies.items()
        }
        shown = SimpleNamespace(order=self.system.order, joint_of=self.system.joint_of, bodies=bodies)
        return Tree(shown, self.clouds).points(*widened(self.system, q, u, udot), base, shift)


def widened(system, q, u, udot):
    """Coordinates, rates and accelerations with every shape a coordinate."""
    rows, iq, iu = ([], [], []), 0, 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        eq, eu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        jet = tie(body, q[eq : eq + n], u[eu : eu + n], udot[eu : eu + n])
        for row, part, shapes in zip(rows, (q[iq:eq], u[iu:eu], udot[iu:eu]), (jet.v, jet.d, jet.dd), strict=True):
            row.extend([part, shapes])
        iq, iu = eq + n, eu + n
    return tuple(np.concatenate(row) for row in rows)


def tie(body, delta, ddelta, dddelta):
    """Jet of all amplitudes, from products of jets."""
    d = Jet(delta, ddelta, dddelta)
    parts = [d, *(d @ (const(A) @ d) * 0.5 for A in body.slaves)]
    return Jet(*(np.concatenate([np.atleast_1d(getattr(p, key)) for p in parts]) for key in ("v", "d", "dd")))


def follower(body, rng):
    """The body with its last shapes following the others."""
    n = body.n_shapes
    if n < 2:
        return body
    n_s = int(rng.integers(1, n))
    free = n - n_s
    A = rng.normal(size=(n_s, free, free))
    return replace(
        body, strain=body.strain.truncated(free), damping=body.damping[:free, :free], slaves=A + A.swapaxes(1, 2)
    )


def random_condensed(seed, n_bodies=4, most=7, size=0.5, **more):
    """A random tree of condensed bodies with up to `most` - 1 shapes, its clouds, and a state (q, u)."""
    system, clouds, _ = random_tree(seed, n_bodies=n_bodies, most=most, **more)
    rng = np.random.default_rng(seed)
    system = replace(system, bodies={name: follower(body, rng) for name, body in system.bodies.items()})
    system = curved(system, rng, size)
    return system, clouds, random_state(system, rng)


def strain_and_damping(system, q, u):
    out, iq, iu = np.zeros(len(u)), 0, 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        out[iu : iu + n] = body.strain.force(q[iq : iq + n]) + body.damping @ u[iu : iu + n]
        iq, iu = iq + n, iu + n
    return out


def hold_kanes_equations(system, clouds, q, u, seed):
    """The residual at some accelerations is that of Kane's equations over the points; returned (n_u,)."""
    model = compile_system(system)
    udot = np.random.default_rng(seed).normal(size=model.n_u)
    ours = model.residual(0.0, np.concatenate([q, u]), udot)
    theirs = equations(Followed(system, clouds), q, u, udot, frozen(np.eye(3)), lambda m, r: np.zeros((len(m), 3)))
    theirs = theirs + strain_and_damping(system, q, u)
    assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10 * np.abs(theirs).max(initial=1))
    return ours


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(10))
def test_residual_equals_kanes_equations_over_points_that_follow(seed):
    system, clouds, (q, u) = random_condensed(seed)
    assert sum(len(body.slaves) for body in system.bodies.values()) > 0
    hold_kanes_equations(system, clouds, q, u, seed)


def along_beams(system, rng):
    """The system with every marker that moves a section of a beam along some axis."""

    def turned(marker):
        axis = rng.normal(size=3)
        return replace(marker, axis=axis / np.linalg.norm(axis)) if marker.psi.any() else marker

    bodies = {
        name: replace(body, markers={key: turned(marker) for key, marker in body.markers.items()})
        for name, body in system.bodies.items()
    }
    return replace(system, bodies=bodies)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(6))
def test_markers_that_turn_as_sections_of_beams_do_so_in_the_equations_too(seed):
    system, clouds, (q, u) = random_condensed(seed)
    system = along_beams(system, np.random.default_rng(seed))
    ours = hold_kanes_equations(system, clouds, q, u, seed)
    model = compile_system(system)
    udot = model.state_rate(0.0, np.concatenate([q, u]))[model.n_q :]
    assert model.residual(0.0, np.concatenate([q, u]), udot) == pytest.approx(0 * udot, abs=1e-10 * np.abs(ours).max())


def test_torques_work_through_markers_that_turn_as_sections_of_beams():
    """Power of a force and torque in a marker's axes, over its velocity and rate by differences of what is reported."""
    system, _, (q, u) = random_condensed(3, root=free)
    system = along_beams(furnished(system, np.random.default_rng(3)), np.random.default_rng(5))
    model, (push, _) = compile_system(system), system.loads
    x, h = np.concatenate([q, u]), 1e-5
    states = x + h * np.array([-1, 0, 1])[:, None] * model.state_rate(0.0, x)
    times = np.zeros(3)
    place, C = marker_motion(system, times, model.observe(times, states), push.body, push.marker)
    rate = Rotation.from_matrix(C[2] @ C[0].T).as_rotvec() / (2 * h)
    power = (C[1] @ push.force) @ (place[2] - place[0]) / (2 * h) + (C[1] @ push.torque) @ rate
    assert -u @ one(model, x)["loads/push"] == pytest.approx(power, rel=1e-7)


@pytest.mark.parametrize("seed", range(10))
def test_recursion_solves_the_equations_of_condensed_bodies(seed):
    system, _, (q, u) = random_condensed(seed, n_bodies=6)
    model = compile_system(system)
    x = np.concatenate([q, u])
    udot = model.state_rate(0.0, x)[model.n_q :]
    scale = np.abs(model.bias(0.0, x)).max(initial=1)
    assert model.residual(0.0, x, udot) == pytest.approx(np.zeros(model.n_u), abs=1e-10 * scale)
    rhs, out = np.random.default_rng(seed).normal(size=model.n_u), np.empty(model.n_u)
    model.second_order.solve(0.0, q, rhs, out, 1.0, 0.0, 0.0, model.table, model.pool, model.work)
    assert model.mass_matrix(0.0, x) @ out == pytest.approx(rhs, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_condensed_bodies_on_a_specified_orbit(seed):
    orbit = Orbit(7e6, 0.3, inclination=0.4, node=0.2, perigee=1.0, true_anomaly=0.7, mu=5e20)
    system, clouds, (q, u) = random_condensed(seed, root=spherical, orbit=orbit, frame=Frame("orbital"))
    model = compile_system(system)
    C, omega, alpha, r_hat, k = orbital_frame(orbit)

    def base(moving):
        W = skew([omega, 0, 0])
        return Jet(C, C @ W, C @ (W @ W + skew([alpha, 0, 0]))) if moving else Jet(C)

    def gradient(m, r):
        return -k * m[:, None] * (r - 3 * np.outer(r @ r_hat, r_hat))

    udot = np.random.default_rng(seed).normal(size=model.n_u)
    x = np.concatenate([q, u])
    ours = model.residual(0.0, x, udot)
    theirs = equations(Followed(system, clouds), q, u, udot, base, gradient, hidden=True)
    theirs = theirs + strain_and_damping(system, q, u)
    assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10 * np.abs(theirs).max(initial=1))
    found = model.state_rate(0.0, x)[model.n_q :]
    assert model.residual(0.0, x, found) == pytest.approx(np.zeros(model.n_u), abs=1e-9 * np.abs(theirs).max(initial=1))


def test_terms_of_condensed_bodies_sum_to_zero_and_loads_work_through_their_markers():
    system, _, (q, u) = random_condensed(3, frame=Frame("spinning", np.array([0.3, -0.5, 0.7])))
    model = compile_system(furnished(system, np.random.default_rng(3)))
    x = np.concatenate([q, u])
    found = one(model, x, t=1.0)
    assert np.abs(sum(found.values())).max() < 1e-11 * max(np.abs(row).max() for row in found.values())
    load = next(load for load in model.system.loads if load.name == "pull")
    seen = model.observe(np.ones(1), x[None])
    at = seen[f"markers/{load.body}.{load.marker}/velocity"][0] - np.cross(
        system.frame.rate, seen[f"markers/{load.body}.{load.marker}/position"][0]
    )
    assert u @ found["loads/pull"] == pytest.approx(-at @ (2 * load.force[0] + load.force[1]) / 3, rel=1e-9)
    pull = sum(found[name] for name in ("elastic", "elastic_K2", "elastic_K3", "prestress"))
    assert u @ pull == pytest.approx(along(model, x, "monitors/elastic"), rel=1e-7)


def test_markers_and_amplitudes_follow_the_coordinates():
    system, _, (q, u) = random_condensed(3)
    model = compile_system(system)
    seen, at = model.observe(np.zeros(1), np.concatenate([q, u])[None]), 0
    checked = 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        at += joint.n_q
        eta = body.amplitudes(q[at : at + body.n_modes])
        assert eta.shape == (body.n_shapes,)
        for s, A in enumerate(body.slaves):
            d = q[at : at + body.n_modes]
            assert eta[body.n_modes + s] == pytest.approx(d @ A @ d / 2, rel=1e-12)
            checked += 1
        assert seen[f"bodies/{name}/delta"][0] == pytest.approx(eta)
        assert seen[f"markers/{name}.a/deflection"][0] == pytest.approx(body.marker("a").phi @ eta, abs=1e-12)
        at += body.n_modes
    assert checked > 2


@pytest.mark.parametrize("method, tolerance, drift", [("dop853", 1e-12, 1e-9), ("esdirk4", 1e-6, 2e-4)])
def test_energy_and_momentum_of_condensed_bodies_are_kept(method, tolerance, drift):
    system, _, (q, u) = random_condensed(4, n_bodies=3, root=free, size=0.01)
    bodies = {name: replace(body, damping=0 * body.damping) for name, body in system.bodies.items()}
    model = compile_system(replace(system, bodies=bodies))
    times = np.linspace(0, 2, 41)
    states = integrator(method, rtol=tolerance, atol=tolerance).solve(model, times, np.concatenate([q, u])).states
    seen = model.observe(times, states)
    for path in ("energy", "momentum", "angular_momentum"):
        monitor = seen[f"monitors/{path}"]
        assert np.ptp(monitor, axis=0).max() < drift * np.abs(monitor).max()


def test_a_closed_loop_of_condensed_beams_keeps_its_energy():
    rigid = four_bar(speed=3.0)
    bodies = dict(rigid.bodies)
    for name, length in (("crank", 0.5), ("coupler", 2.0), ("rocker", 1.2)):
        beam = UniformBeam(length, 1e5, 1.0, 1.0, 1.0, 1.0)
        body = beam_body(beam, BeamFunctions(y=2, family="polynomial"), strain="condensed")
        bodies[name] = replace(body, markers={**body.markers, "end": body.markers["tip"]})
    model = compile_system(replace(rigid, bodies=bodies))
    times = np.linspace(0, 2, 41)
    states = integrator("dop853", rtol=1e-10, atol=1e-10).solve(model, times, model.x0).states
    seen = model.observe(times, states)
    bent = np.abs(seen["markers/coupler.end/deflection"][:, 1]).max()
    assert bent > 0.02  # of a bar of 2 m
    assert np.ptp(seen["monitors/energy"]) < 1e-7 * seen["monitors/energy"][0]
    apart = seen["markers/coupler.end/position"] - seen["markers/rocker.end/position"]
    assert np.abs(apart).max() < 1e-8
