"""Random trees of random point clouds, with every kind of joint, rigid and flexible, seeded."""

import numpy as np
from scipy.spatial.transform import Rotation

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors
from femflex.system import System, cylindrical, free, prismatic, revolute, spherical, universal, weld

KINDS = (weld, revolute, prismatic, universal, cylindrical, spherical, free)


def random_body(rng, n, moving_markers=True):
    """A body of seven points with n random shapes, and its cloud (mass, rho, phi)."""
    mass, rho, phi = rng.uniform(0.5, 2, 7), rng.normal(size=(7, 3)), 0.3 * rng.normal(size=(7, 3, n))
    z = np.concatenate([rho[:, None, :], phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    stiffness = rng.normal(size=(n, n))
    damping = rng.normal(size=(n, n))

    def marker():
        scale = 0.3 if moving_markers else 0.0
        C = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        return Marker(rng.normal(size=3), scale * rng.normal(size=(3, n)), scale * rng.normal(size=(3, n)), C)

    body = FlexibleBody(
        moments,
        StrainTensors(10 * stiffness @ stiffness.T, rng.normal(size=n)),
        damping @ damping.T,
        {name: marker() for name in ("a", "b", "c")},
    )
    return body, (mass, rho, phi)


def random_tree(seed, n_bodies=5, root=None, moving_markers=True, most=4, **more):
    """A random System, its clouds, and a random state (q, u)."""
    rng = np.random.default_rng(seed)
    bodies, clouds, joints = {}, {}, []
    names = [f"body{k}" for k in rng.permutation(n_bodies)]
    for k, name in enumerate(names):
        bodies[name], clouds[name] = random_body(rng, int(rng.integers(0, most)), moving_markers)
        parent = None if k == 0 else names[int(rng.integers(0, k))]
        kind = KINDS[int(rng.integers(0, len(KINDS)))] if k or root is None else root
        where = {
            "parent_marker": "origin" if parent is None else rng.choice(["a", "b"]),
            "child_marker": rng.choice(["b", "c"]),
        }
        if kind in (spherical, free):
            where["rotation"] = str(rng.choice(["euler_parameters", "xyz", "zxz", "xzy"]))
            if where["rotation"] == "zxz":  # whose zero angles are singular
                where["q0"] = [0.0] * (3 if kind is free else 0) + [0.0, 1.0, 0.0]
        elif kind is universal:
            where["axes"] = rng.normal(size=(2, 3))
        elif kind is not weld:
            where["axis"] = rng.normal(size=3)
        joints.append(kind(name, parent, **where))
    order = rng.permutation(n_bodies)
    system = System(
        {names[i]: bodies[names[i]] for i in order}, tuple(joints[i] for i in rng.permutation(n_bodies)), **more
    )
    return system, clouds, random_state(system, rng)


def random_state(system, rng):
    """q with unit Euler parameters, and u."""
    q = 0.4 * rng.normal(size=len(system.coordinate_names()))
    at = 0
    for name in system.order:
        joint = system.joint_of(name)
        if joint.ball == "euler_parameters":
            e = slice(at + len(joint.translations), at + joint.n_q)
            q[e] = rng.normal(size=4)
            q[e] /= np.linalg.norm(q[e])
        at += joint.n_q + system.bodies[name].n_modes
    return q, rng.normal(size=len(system.velocity_names()))
