"""A table of random systems of every kind, and their equations of motion a second way: Kane's over material points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from femflex.body import MassMoments, StrainTensors
from femflex.body.symmetric import packed_size
from femflex.dynamics import Model, compile_system
from femflex.dynamics.joints.places import prescribed_places
from femflex.effectors import LowPass
from femflex.system import Frame, Load, Orbit, Spring, System, free, spherical, universal
from support.effector_builders import Sensor, reaction_wheel
from support.pointwise import Jet, Tree, const, equations, skew
from support.prescribed_systems import at_time, held_tree
from support.random_loops import random_loops, row_jets
from support.random_systems import random_body, random_state, random_tree

RATE = np.array([0.3, -0.5, 0.7])  # rad/s, of the spinning frame
ORBIT = Orbit(7e6, 0.3, inclination=0.4, node=0.2, perigee=1.0, true_anomaly=0.7, mu=5e20)  # a strong gradient
SPINNING = {"frame": Frame("spinning", RATE)}
ORBITAL = {"orbit": ORBIT, "frame": Frame("orbital")}
FLYING = {"orbit": ORBIT.model_copy(update={"kind": "free"}), "frame": Frame("orbital"), "root": free}


def at_rest(moving: bool) -> Jet:
    return Jet(np.eye(3))


def no_field(m, r):
    return np.zeros((len(m), 3))


def orbital_frame(orbit):
    """C_NO, rate, acceleration, vertical and mu/r^3 at the orbit's initial true anomaly, from the conic's equations."""
    nu, e, p = orbit.true_anomaly, orbit.eccentricity, orbit.semi_major_axis * (1 - orbit.eccentricity**2)
    r = p / (1 + e * np.cos(nu))
    rate = np.sqrt(orbit.mu * p) / r**2
    accel = -2 * np.sqrt(orbit.mu / p) * e * np.sin(nu) * rate / r
    up, ahead = np.array([np.cos(nu), np.sin(nu), 0]), np.array([-np.sin(nu), np.cos(nu), 0])
    C = orbit.C_NP() @ np.column_stack([[0, 0, 1], up, ahead])
    return C, rate, accel, C[:, 1], orbit.mu / r**3


def base_of(system):
    """Jet of the base frame at t = 0, the field at mass points, and whether the root's translation is eliminated."""
    if system.orbit is None:
        W = skew(system.frame.rate if system.frame.kind == "spinning" else np.zeros(3))
        return (lambda moving: Jet(np.eye(3), W, W @ W) if moving else Jet(np.eye(3))), no_field, False
    C, omega, alpha, up, k = orbital_frame(system.orbit)
    W, V = skew(np.array([omega, 0, 0])), skew(np.array([alpha, 0, 0]))

    def base(moving):
        return Jet(C, C @ W, C @ (W @ W + V)) if moving else Jet(C)

    return base, lambda m, r: -k * m[:, None] * (r - 3 * np.outer(r @ up, up)), not system.orbit.free


class DependentTree(Tree):
    """Points that move with the amplitudes of all shapes, the dependent ones too, as jets in time."""

    def points(self, q, u, udot, base, shift=None):
        bodies = {
            name: replace(
                body,
                slaves=np.zeros((0, 0, 0)),
                strain=StrainTensors.linear(np.zeros((body.n_shapes,) * 2)),
                damping=np.zeros((body.n_shapes,) * 2),
            )
            for name, body in self.system.bodies.items()
        }
        whole = Tree(replace(self.system, bodies=bodies), self.clouds)
        found = whole.points(*all_amplitudes(self.system, q, u, udot), base, shift)
        self.frames, self.delta = whole.frames, whole.delta
        return found


def all_amplitudes(system, q, u, udot):
    """Coordinates, rates and accelerations with every shape a coordinate."""
    rows, iq, iu = ([], [], []), 0, 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        eq, eu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        d = Jet(q[eq : eq + n], u[eu : eu + n], udot[eu : eu + n])
        parts = [d, *(d @ (const(A) @ d) * 0.5 for A in body.slaves)]
        jet = Jet(*(np.concatenate([np.atleast_1d(getattr(p, key)) for p in parts]) for key in ("v", "d", "dd")))
        for row, part, shapes in zip(rows, (q[iq:eq], u[iu:eu], udot[iu:eu]), (jet.v, jet.d, jet.dd), strict=True):
            row.extend([part, shapes])
        iq, iu = eq + n, eu + n
    return tuple(np.concatenate(row) for row in rows)


def elastic_forces(system, q, u):
    """Forces of strain and damping of the bodies, of springs and dampers of the joints, each on its own row."""
    out, iq, iu = np.zeros(len(u)), 0, 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        own = slice(iu, iu + joint.n_u)
        out[own] = joint.damping * u[own]
        if joint.ball is None:
            out[own] += joint.stiffness * (q[iq : iq + joint.n_q] - joint.rest)
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        out[iu : iu + n] = body.strain.force(q[iq : iq + n]) + body.damping @ u[iu : iu + n]
        iq, iu = iq + n, iu + n
    return out


@dataclass(frozen=True, eq=False)
class Problem:
    """A system, the clouds of points of its bodies, and a state of it at a time."""

    system: System
    clouds: dict[str, Any]
    state: tuple[Any, Any]
    t: float = 0.0
    tree: type[Tree] = field(default=Tree)

    @cached_property
    def model(self) -> Model:
        return compile_system(self.system)

    @cached_property
    def x(self):
        """The state; prescribed coordinates where they are at t, velocities as the loops allow."""
        q, u = at_time(self.system, self.t, *self.state)
        if self.system.loops:
            A, drift, _ = self.rows(u)
            u = u - np.linalg.pinv(A, rcond=1e-10) @ (A @ u + drift)
        z = self.model.parts(self.model.x0)[2]
        return np.concatenate([q, u, z])

    @property
    def q(self):
        return self.x[: self.model.n_q]

    @property
    def u(self):
        return self.x[self.model.n_q : self.model.n_q + self.model.n_u]

    @cached_property
    def udot(self):
        return self.model.parts(self.model.state_rate(self.t, self.x))[1]

    @cached_property
    def prescribed(self):
        """Rows of the prescribed velocities."""
        return [iu for *_, iu in prescribed_places(self.system)]

    @cached_property
    def partial(self):
        """Per unit of every u (n_u, ...): velocities of all points, and of each load's marker velocity and rate."""
        base, tree, points, ends = base_of(self.system)[0], self.tree(self.system, self.clouds), [], []
        for unit in np.eye(len(self.u)):
            points.append([place.d for _, place in tree.points(self.q, unit, 0 * unit, base(False))])
            ends.append([])
            for load in self.system.loads:
                place, attitude, _ = end_of(tree, load)
                W = attitude.d @ attitude.v.T
                ends[-1].append(np.concatenate([place.d, [W[2, 1], W[0, 2], W[1, 0]]]))
        return np.array(points), np.array(ends)

    def kane(self, udot):
        """M udot + h - Q (n_u,) from the points, the bodies' and joints' own forces, and the loads."""
        base, pull, hidden = base_of(self.system)
        points = self.tree(self.system, self.clouds)
        out = equations(points, self.q, self.u, udot, base, pull, hidden, self.partial[0])
        return out + elastic_forces(self.system, self.q, self.u) - self.load_forces(points, hidden)

    def load_forces(self, tree, hidden):
        """Generalised forces (n_u,) of the loads, by the velocity and rate of their markers per unit of each u."""
        points, ends = self.partial
        masses = np.concatenate([self.clouds[name][0] for name in self.system.order])
        center = np.einsum("kpa,p->ka", points, masses) / masses.sum() * hidden
        out = np.zeros(len(self.u))
        for k, load in enumerate(self.system.loads):
            _, attitude, C = end_of(tree, load)
            axes = {"marker": attitude.v, "body": C.v, "inertial": np.eye(3)}[load.frame]
            force, torque = axes @ load_at(load, load.force, self.t), axes @ load_at(load, load.torque, self.t)
            out += (ends[:, k, :3] - center) @ force + ends[:, k, 3:] @ torque
        return out

    def rows(self, u):
        """A, its drift and the swept acceleration of the loops, A udot + swept = 0, at the velocities u."""
        tree, base, n = self.tree(self.system, self.clouds), base_of(self.system)[0], len(u)
        q, zero = self.state[0], np.zeros(n)
        A = np.array([[g.d.item() for g in row_jets(tree, q, unit, zero, base(False))] for unit in np.eye(n)]).T
        drift = np.array([g.d.item() for g in row_jets(tree, q, zero, zero, base(True))])
        return A, drift, np.array([g.dd.item() for g in row_jets(tree, q, u, zero, base(True))])


def end_of(tree, load):
    """Place and attitude of a load's marker, and its body's attitude, as jets of the tree's present motion."""
    C, r = tree.frames[load.body]
    C_M, r_M = tree.marker(tree.system.bodies[load.body].marker(load.marker), tree.delta[load.body])
    return r + C @ r_M, C @ C_M, C


def load_at(load, table, t):
    """Force or torque of a load at a time."""
    if load.times is None:
        return table
    return np.array([np.interp(t, load.times, column) for column in np.broadcast_to(table, (len(load.times), 3)).T])


def furnished(system, rng, balls=False):
    """The system with springs and dampers in its joints, springs of balls only on request, and two loads."""
    joints = []
    for joint in system.joints:
        parts = {key: rng.uniform(0.5, 2, joint.n_u) for key in ("stiffness", "damping", "rest")}
        if joint.ball is not None and not balls:
            parts["stiffness"] = np.zeros(joint.n_u)
        for part in parts.values():
            part[list(joint.prescribed)] = 0.0
        joints.append(joint if joint.parent is None else replace(joint, **parts))
    loads = (
        Load("push", system.order[-1], "a", "marker", force=rng.normal(size=3), torque=rng.normal(size=3)),
        Load("pull", system.root, "b", "inertial", force=rng.normal(size=(2, 3)), times=np.array([-1.0, 3.0])),
    )
    return replace(system, joints=tuple(joints), loads=loads)


def curved(system, rng, size=0.5):
    """The system with random nonlinear strain, V2 and V3, of every flexible body."""

    def bent(body):
        n = body.n_modes
        V2, V3 = (size * rng.normal(size=packed_size(n, degree)) for degree in (3, 4))
        return replace(body, strain=replace(body.strain, V2=V2, V3=V3)) if n else body

    return replace(system, bodies={name: bent(body) for name, body in system.bodies.items()})


def condensed(body, rng):
    """The body with its last shapes dependent on the others."""
    n = body.n_shapes
    if n < 2:
        return body
    n_s = int(rng.integers(1, n))
    left = n - n_s
    A = rng.normal(size=(n_s, left, left))
    return replace(
        body, strain=body.strain.truncated(left), damping=body.damping[:left, :left], slaves=A + A.swapaxes(1, 2)
    )


def random_condensed(seed, n_bodies=4, most=7, size=0.5, **more):
    """A random tree of condensed bodies with up to `most` - 1 shapes, its clouds, and a state (q, u)."""
    system, clouds, _ = random_tree(seed, n_bodies=n_bodies, most=most, **more)
    rng = np.random.default_rng(seed)
    system = replace(system, bodies={name: condensed(body, rng) for name, body in system.bodies.items()})
    system = curved(system, rng, size)
    return system, clouds, random_state(system, rng)


def along_beams(system, rng):
    """The system with every marker that moves a section of a beam along some axis."""

    def with_axis(marker):
        axis = rng.normal(size=3)
        return replace(marker, axis=axis / np.linalg.norm(axis)) if marker.psi.any() else marker

    bodies = {
        name: replace(body, markers={key: with_axis(marker) for key, marker in body.markers.items()})
        for name, body in system.bodies.items()
    }
    return replace(system, bodies=bodies)


def many_shapes(seed, moving_markers=True, orthonormal=False):
    """A random tree whose bodies have up to nine shapes, more than a lane holds."""
    system, _, _ = random_tree(seed, n_bodies=4)
    rng = np.random.default_rng(seed)
    counts = rng.permutation((0, 4, 5, 8, 9))
    pairs = {name: random_body(rng, int(n), moving_markers) for name, n in zip(system.bodies, counts, strict=False)}
    bodies, clouds = (
        {name: body for name, (body, _) in pairs.items()},
        {name: cloud for name, (_, cloud) in pairs.items()},
    )
    system = replace(system, bodies=bodies)
    state = random_state(system, rng)
    if orthonormal:
        for name, body in bodies.items():
            T = np.linalg.inv(np.linalg.cholesky(body.moments.elastic_mass())).T
            full = np.eye(1 + body.n_modes)
            full[1:, 1:] = T
            moments = body.moments
            second = np.einsum("AaBb,AC,BD->CaDb", moments.second, full, full)
            bodies[name] = replace(body, moments=MassMoments(moments.mass, full.T @ moments.first, second))
            mass, rho, phi = clouds[name]
            clouds[name] = mass, rho, phi @ T
        system = replace(system, bodies=bodies)
    return system, clouds, state


def problem_of(made, dressed=True, seed=0, **more) -> Problem:
    """The problem of a system, its clouds and a state; dressed with springs, dampers and loads."""
    system, clouds, state = made
    return Problem(furnished(system, np.random.default_rng(seed)) if dressed else system, clouds, state, **more)


def with_effectors() -> Problem:
    """A free tree with a wheel whose torque a filtered sensor commands, and a damped spring between two bodies."""
    system, clouds, state = random_tree(5, n_bodies=4, root=free)
    root, last = system.root, system.order[-1]
    law = LowPass(inputs=["gyro.x"], outputs=["torque"], frequency=2.0, order=2, damping=0.7).controller("law")
    wheel = reaction_wheel(
        "wheel", root, 0.4, axis=(0, 0, 1), marker="a", torque="law.torque", initial_speed=5.0, viscous=0.1
    )
    spring = Spring("line", last, root, "a", "b", stiffness=6.0, damping=0.8, length=0.3)
    effectors = (*Sensor("gyro", "rate", root).effectors, law, wheel)
    return problem_of((replace(system, effectors=effectors, springs=(spring,)), clouds, state))


SYSTEMS: dict[str, Callable[[], Problem]] = {
    **{f"tree {seed}": lambda seed=seed: problem_of(random_tree(seed), t=0.4) for seed in (1, 5)},
    "rigid markers": lambda: problem_of(random_tree(3, n_bodies=4, moving_markers=False)),
    "spinning frame": lambda: problem_of(random_tree(2, n_bodies=4, **SPINNING)),
    "specified orbit": lambda: problem_of(random_tree(1, root=spherical, **ORBITAL)),
    "specified orbit, two angles": lambda: problem_of(random_tree(4, root=universal, **ORBITAL)),
    "free orbit": lambda: problem_of(random_tree(3, **FLYING)),
    "many shapes": lambda: problem_of(many_shapes(0)),
    "orthonormal shapes": lambda: problem_of(many_shapes(3, False, True)),
    "nonlinear strain": lambda: problem_of(make_curved(5)),
    "condensed": lambda: problem_of(random_condensed(3), tree=DependentTree),
    "condensed, sections of beams": lambda: problem_of(beams(random_condensed(1)), tree=DependentTree),
    "condensed, specified orbit": lambda: problem_of(
        random_condensed(2, root=spherical, **ORBITAL), tree=DependentTree
    ),
    "prescribed": lambda: problem_of(held_tree(2), t=0.4),
    "prescribed, other joints": lambda: problem_of(held_tree(4), t=0.4),
    "prescribed, specified orbit": lambda: problem_of(held_tree(1, root=universal, **ORBITAL)),
    "loop": lambda: problem_of(random_loops(1, most=3)),
    "two loops": lambda: problem_of(random_loops(2, 2, most=3)),
    "loop, spinning frame": lambda: problem_of(random_loops(3, most=2, **SPINNING)),
    "loop, specified orbit": lambda: problem_of(random_loops(1, most=2, root=spherical, **ORBITAL)),
    "effectors": with_effectors,
}


def make_curved(seed):
    system, clouds, state = random_tree(seed)
    return curved(system, np.random.default_rng(seed)), clouds, state


def beams(made):
    system, clouds, state = made
    return along_beams(system, np.random.default_rng(4)), clouds, state


def answers(names) -> dict[str, Any]:
    """Rates, residuals and channels of the systems of these names, each at its state."""
    out = {}
    for name in names:
        p = SYSTEMS[name]()
        rows = p.model.observe(np.array([p.t]), p.x[None])
        out |= {f"{name}: rate": p.model.state_rate(p.t, p.x), **{f"{name}: {path}": v for path, v in rows.items()}}
        out |= {f"{name}: residual": p.model.residual(p.t, p.x, np.cos(p.u))}
    return out
