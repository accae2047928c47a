"""Random trees in which some freedoms are locked and some follow random profiles."""

from dataclasses import replace

import numpy as np

from femflex.dynamics.joints.places import prescribed_places
from femflex.system import Profile, turns
from support.random_systems import random_state, random_tree


def random_profile(rng):
    """A random profile of one of every kind, or a sum of two."""
    kinds = [
        lambda: Profile.constant(0.3 * rng.normal()),
        lambda: Profile.polynomial(*(0.3 * rng.normal(size=4))),
        lambda: Profile.sine(0.3 * rng.normal(), 3 * rng.normal(), rng.normal(), 0.2 * rng.normal()),
        lambda: Profile.smooth_step(-0.3, 1.0, 0.2 * rng.normal(), 0.5 * rng.normal()),
        lambda: Profile.spline(np.linspace(-1, 6, 12), 0.4 * rng.normal(size=12), int(rng.choice([3, 5]))),
    ]
    one = kinds[int(rng.integers(len(kinds)))]()
    return one + kinds[int(rng.integers(len(kinds)))]() if rng.random() < 0.3 else one


def holding(joint, rng, share=0.5):
    """The joint with a share of its freedoms held; balls become turns so that each may be held by itself."""
    if joint.ball is not None and rng.random() < 0.7:
        markers = {key: getattr(joint, key) for key in ("child_marker", "parent_marker")}
        joint = turns(joint.child, joint.parent, str(rng.choice(["xyz", "zxz"])), joint.translations, **markers)
        joint = joint.with_initial(np.array([*np.zeros(joint.n_q - 2), 1.0, 0.0]))  # clear of gimbal lock
    single = len(joint.translations) + len(joint.rotations)
    motion = [
        None
        if k >= single or rng.random() > share
        else 0.3 * rng.normal()
        if rng.random() < 0.3
        else random_profile(rng)
        for k in range(joint.n_u)
    ]
    q0 = joint.q0.copy()
    q0[[k for k in range(single) if motion[k] is not None]] = 0.0  # it begins where its motion begins
    return replace(joint, motion=tuple(motion), q0=q0, u0=np.zeros(0))


def held_tree(seed, n_bodies=5, share=0.5, **more):
    """A random System with held freedoms, its clouds, and a state with these where they are at time t."""
    system, clouds, _ = random_tree(seed, n_bodies=n_bodies, **more)
    rng = np.random.default_rng(1000 + seed)
    system = replace(system, joints=tuple(holding(joint, rng, share) for joint in system.joints))
    return system, clouds, random_state(system, rng)


def at_time(system, t, q, u, udot=None):
    """The state with held freedoms where they are at t; with udot also its held entries."""
    q, u, udot = q.copy(), u.copy(), None if udot is None else udot.copy()
    for joint, k, iq, iu in prescribed_places(system):
        q[iq], u[iu], acceleration = joint.prescribed[k](t)
        if udot is not None:
            udot[iu] = acceleration
    return (q, u) if udot is None else (q, u, udot)
