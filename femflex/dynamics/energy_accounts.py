"""Energies that a system stores, and powers that it takes or brings in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femflex.system.effector import Effector

if TYPE_CHECKING:
    from femflex.system import System


def conservative_loads(system: System) -> list[str]:
    """Names of the loads whose potential is part of the energy."""
    return [load.name for load in system.loads if load.conservative and system.orbit is None]


def accounts_for(system: System, account: str) -> bool:
    """Whether an effector reports that energy or power (see femflex.system.effector.ACCOUNTS)."""
    return any(isinstance(e, Effector) and account in e.accounts for e in system.effectors)


def is_elastic(system: System) -> bool:
    """Whether bodies store strain energy."""
    whole = (variation.whole for variation in system.varying.values() if variation.whole is not None)
    return any(body.n_shapes for body in (*system.bodies.values(), *whole))


def has_springs(system: System) -> bool:
    """Whether joints or springs store energy."""
    return any(joint.stiffness.any() or joint.laws or joint.latches for joint in system.joints) or bool(system.springs)


def is_supplied(system: System) -> bool:
    """Whether an element may supply power: a load whose potential is not part of the energy, an effector, or a tide."""
    acting = any(isinstance(e, Effector) and e.acts for e in system.effectors)
    acting = acting or bool(system.environment.third_bodies)
    return acting or accounts_for(system, "supplied") or len(conservative_loads(system)) < len(system.loads)


def is_damped(system: System) -> bool:
    """Whether any element dissipates energy of the motion."""
    joints = any(joint.damping.any() or joint.laws or joint.latches for joint in system.joints)
    bodies = any(body.damping.any() for body in system.bodies.values())
    springs = any(spring.damping for spring in system.springs)
    return joints or bodies or springs or accounts_for(system, "dissipation")
