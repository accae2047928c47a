"""Random closed loops: random trees with markers added where cut joints close; their rows from the jets of a Tree."""

from dataclasses import replace

import numpy as np
from scipy.linalg import expm as matrix_exponential
from scipy.spatial.transform import Rotation

from femflex.body import Marker
from femflex.system import closure, free
from support.pointwise import Jet, Tree, const
from support.random_systems import KINDS, random_tree


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def random_loops(seed, n_loops=1, **more):
    """A System with loops that its state (q, u) closes, its clouds, and that state; u is any."""
    system, clouds, (q, u) = random_tree(seed, n_bodies=6, **more)
    rng = np.random.default_rng(1000 + seed)
    tree = Tree(system, clouds)
    tree.points(q, 0 * u, 0 * u, Jet(np.eye(3)))
    bodies = dict(system.bodies)
    kinds = [kind for kind in KINDS if kind is not free]
    loops = []
    for k in range(n_loops):
        parent, child = rng.choice(list(bodies), 2, replace=False)
        where = {"name": f"loop{k}", "parent_marker": "a", "child_marker": f"cut{k}"}
        kind = kinds[int(rng.integers(len(kinds)))]
        if kind.__name__ == "universal":
            where["axes"] = rng.normal(size=(2, 3))
        elif kind.__name__ not in ("weld", "spherical"):
            where["axis"] = rng.normal(size=3)
        joint = kind(str(child), str(parent), **where)
        bodies[child] = with_marker(bodies[child], f"cut{k}", joint, tree, system, rng)
        loops.append(joint)
    joints, at, delta0 = {}, 0, {}
    for name in system.order:
        joint = system.joint_of(name)
        joints[name] = joint.with_initial(q0=q[at : at + joint.n_q])
        at += joint.n_q
        delta0[name] = q[at : at + bodies[name].n_modes]
        at += bodies[name].n_modes
    closed = replace(
        system, bodies=bodies, joints=tuple(joints[j.child] for j in system.joints), loops=tuple(loops), delta0=delta0
    )
    return closed, clouds, (q, u)


def with_marker(body, name, joint, tree, system, rng):
    """The body with a marker that lies, along the joint's freedom, on marker P in the tree's present state."""
    C_P, r_P = tree.marker(system.bodies[joint.parent].marker(joint.parent_marker), tree.delta[joint.parent])
    C_Np, r_p = tree.frames[joint.parent]
    C_Ni, r_i = tree.frames[joint.child]
    C_NP, place = C_Np.v @ C_P.v, r_p.v + C_Np.v @ r_P.v
    place = place + C_NP @ (rng.normal(size=len(joint.translations)) @ joint.translations)
    C_PQ = np.eye(3) if joint.ball is None else Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    for axis in joint.rotations:
        C_PQ = C_PQ @ matrix_exponential(skew(axis * rng.normal()))
    delta = tree.delta[joint.child].v
    phi, psi = 0.3 * rng.normal(size=(2, 3, body.n_modes))
    bend = matrix_exponential(skew(psi @ delta))
    marker = Marker(C_Ni.v.T @ (place - r_i.v) - phi @ delta, phi, psi, bend.T @ C_Ni.v.T @ C_NP @ C_PQ)
    return replace(body, markers=body.markers | {name: marker})


def row_jets(tree, q, u, udot, base):
    """Jets of all rows' residuals g along a motion."""
    tree.points(q, u, udot, base)
    out = []
    for loop in tree.system.loops:
        ends = []
        for body, marker in ((loop.parent, loop.parent_marker), (loop.child, loop.child_marker)):
            C, r = tree.frames[body]
            C_M, r_M = tree.marker(tree.system.bodies[body].marker(marker), tree.delta[body])
            ends.append((C @ C_M, r + C @ r_M))
        (C_P, r_P), (C_Q, r_Q) = ends
        rows = closure(loop)
        d = C_P.T @ (r_Q - r_P)
        C = C_P.T @ C_Q
        out += [const(e[None, :3]) @ d - Jet(e[3:]) for e in rows.slides]
        out += [const(row[None, :3]) @ C @ const(row[3:6]) - Jet(row[6:]) for row in rows.pairs]
    return out
