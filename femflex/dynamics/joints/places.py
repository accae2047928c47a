"""Places of joints in the state, and where steps note how near a free rotation came to its singularity."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.arrays import IntArray
from femflex.dynamics.lowering.layout import W_NEAR, body_records
from femflex.rotations import EULER_PARAMETERS
from femflex.system import Joint, System


def joint_places(system: System) -> Iterator[tuple[Joint, int, int]]:
    """Return every joint with the first places of its coordinates in q and of its quasi-velocities in u."""
    iq = iu = 0
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        yield joint, iq, iu
        iq, iu = iq + joint.n_q + n, iu + joint.n_u + n


def has_singularity(joint: Joint) -> bool:
    """Whether a joint is a ball whose rotation set has a singularity."""
    return joint.ball is not None and joint.ball != EULER_PARAMETERS


def singularity_notes(system: System, table: IntArray) -> dict[str, int]:
    """Return by channel where in the work array steps note how near a ball came to its singularity, and when."""
    blocks = {name: int(b["work"]) + W_NEAR for name, b in zip(system.order, body_records(table)[1:], strict=True)}
    balls = [joint for joint in map(system.joint_of, system.order) if has_singularity(joint)]
    return {f"joints/{joint.label}/singularity": blocks[joint.child] for joint in balls}
