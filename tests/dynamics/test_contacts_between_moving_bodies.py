"""Discs that roll and blades that slide on bodies that move and bend themselves: rows, forces and accelerations
against the velocities of the touching material points."""

from dataclasses import replace

import numpy as np
import pytest
from support.pointwise import Jet, Tree
from support.random_systems import random_tree

from femflex.dynamics import compile_system
from femflex.system import rolling_disc

AXIS, NORMAL = np.array([0.6, -0.48, 0.64]), np.array([2 / 3, 1 / 3, -2 / 3])


def tree_of(seed):
    """A random tree that starts where its random state is, and the state."""
    system, _, (q, u) = random_tree(seed, n_bodies=4)
    joints, at, delta0 = [], 0, {}
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        joints.append(joint.with_initial(q0=q[at : at + joint.n_q]))
        delta0[name] = q[at + joint.n_q : at + joint.n_q + n]
        at += joint.n_q + n
    return replace(system, joints=tuple(joints), delta0=delta0), q, u


def motions(system, q, u, *ends):
    """Place, axes, velocity and angular rate of markers (body, marker); of the base frame where the body is None."""
    tree = Tree(system, {name: ((), (), ()) for name in system.bodies})
    tree.points(q, u, 0 * u, Jet(np.eye(3)))
    out = []
    for body, marker in ends:
        if body is None:
            out.append((np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3)))
            continue
        C, r = tree.frames[body]
        C_M, r_M = tree.marker(system.bodies[body].marker(marker), tree.delta[body])
        axes, place = C @ C_M, r + C @ r_M
        W = axes.d @ axes.v.T
        out.append((place.v, axes.v, place.d, np.array([W[2, 1], W[0, 2], W[1, 0]])))
    return out


def arm(C_P, C_Q, radius, normal):
    """From the disc's centre to where it touches, and the centre's height above the plane."""
    n, a = C_P @ normal, C_Q @ AXIS
    m = n - (n @ a) * a
    return -radius * m / np.linalg.norm(m), radius * np.linalg.norm(m)


def slip(system, q, u, P, Q, radius, normal):
    """Velocity at the touching point of Q's material past P's, inertial components."""
    (p, C_P, v_P, w_P), (o, C_Q, v_Q, w_Q) = motions(system, q, u, P, Q)
    rho = arm(C_P, C_Q, radius, normal)[0] if radius else np.zeros(3)
    return v_Q + np.cross(w_Q, rho) - v_P - np.cross(w_P, o + rho - p)


def rates_along(model, x, rows, h=1e-6):
    """Change of rows(q, u) along the motion of the constrained model at x."""
    dx, n = model.state_rate(0.0, x), model.n_q
    ahead, behind = (rows((x + s * h * dx)[:n], (x + s * h * dx)[n:]) for s in (1, -1))
    return (ahead - behind) / (2 * h)


@pytest.mark.parametrize("seed", (4, 28))
@pytest.mark.parametrize("based", [False, True])
def test_disc_rolls_on_plane_of_flexible_body(seed, based):
    system, q, u = tree_of(seed)
    P, Q = (None if based else system.order[1], "origin" if based else "a"), (system.order[-1], "a")
    (p, C_P, _, _), (o, C_Q, _, _) = motions(system, q, 0 * u, P, Q)
    normal = NORMAL * np.sign((o - p) @ C_P @ NORMAL)
    radius = (o - p) @ C_P @ normal / arm(C_P, C_Q, 1.0, normal)[1]  # it touches at the start
    disc = rolling_disc("roll", Q[0], radius, marker=Q[1], parent=P[0], parent_marker=P[1], axis=AXIS, normal=normal)
    model, bare = compile_system(replace(system, constraints=(disc,))), compile_system(system)
    assert model.x0[: model.n_q] == pytest.approx(q, abs=1e-9)
    rng = np.random.default_rng(seed)
    off = q.copy()
    off[-1] += 0.3 * rng.normal()
    (p, C_P, _, _), (o, C_Q, _, _) = motions(system, off, u, P, Q)
    rho, height = arm(C_P, C_Q, radius, normal)
    n, across = C_P @ normal, np.eye(3) - np.outer(C_P @ normal, C_P @ normal)
    x = np.concatenate([off, u])
    gap, speed = model.constraints.residuals(0.0, x)
    s = slip(system, off, u, P, Q, radius, normal)
    assert gap == pytest.approx([n @ (o - p) - height, 0.0, 0.0], abs=1e-12)
    assert speed[0] == pytest.approx(n @ s, abs=1e-11)
    assert np.linalg.norm(speed[1:]) == pytest.approx(np.linalg.norm(across @ s), rel=1e-10)
    S = np.array([slip(system, off, along, P, Q, radius, normal) for along in np.eye(model.n_u)]).T
    A = model.constraints.matrix(0.0, x)
    assert A[0] == pytest.approx(n @ S, abs=1e-11)
    assert A[1:].T @ A[1:] == pytest.approx(S.T @ across @ S, abs=1e-10)
    udot = model.state_rate(0.0, x)[model.n_q :]
    seen = {path: v[0] for path, v in model.observe(np.zeros(1), x[None]).items()}
    force = seen["constraints/roll/force"]
    assert bare.residual(0.0, x, udot) == pytest.approx(S.T @ force, abs=1e-9 * max(1.0, np.abs(force).max()))
    assert seen["constraints/roll/torque"] == pytest.approx(np.cross(rho, force), abs=1e-11 * np.abs(force).max())
    assert seen["constraints/roll/place"] == pytest.approx(o + rho, abs=1e-11)
    size = np.abs(udot).max()

    def in_plane(q, u):
        (_, C, _, _), _ = motions(system, q, u, P, Q)
        return C.T @ slip(system, q, u, P, Q, radius, normal)

    assert rates_along(model, x, in_plane) == pytest.approx(np.zeros(3), abs=1e-7 * size)
