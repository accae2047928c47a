"""Bodies that cannot turn, or not move at all, in inertial axes: their rates are zero, and are not reported."""

from __future__ import annotations

from femflex.system import System


def can_turn(system: System, name: str) -> bool:
    """Whether a body can turn in inertial axes: by its frame, its joint, or the bodies that carry it."""
    joint = system.joint_of(name)
    if joint.ball is not None or len(joint.rotations) or system.bodies[name].marker(joint.child_marker).psi.any():
        return True
    if joint.parent is None:
        return system.frame.kind != "inertial"
    return bool(system.bodies[joint.parent].marker(joint.parent_marker).psi.any()) or can_turn(system, joint.parent)


def can_move(system: System, name: str) -> bool:
    """Whether the origin of a body can move in inertial axes."""
    joint = system.joint_of(name)
    if can_turn(system, name) or len(joint.translations) or name in system.varying:
        return True
    if system.bodies[name].marker(joint.child_marker).phi.any():
        return True
    if joint.parent is None:
        return False
    carrier = system.bodies[joint.parent].marker(joint.parent_marker)
    return bool(carrier.phi.any()) or joint.parent in system.varying or can_move(system, joint.parent)
