"""Terms of eq. (9) of bodies, joints, gravity and motion themselves, each with its description.

Force terms say the same of themselves in files of their own (see femflex.dynamics.forces.force_term). These here are
evaluated together, in one pass over the bodies: gravity is a field inside the inertia forces and costs nothing there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.system import Environment, Joint, LengthTable, System
from femflex.system.variation import MARKER

Change = Callable[[System], System]


@dataclass(frozen=True)
class EquationTerm:
    """A row of the ledger.

    meaning   what it says
    present   whether a system has it
    without   the system without it; None where there is none
    switched  whether the compiled equations leave it out instead (see `femflex.dynamics.ledger.without`)
    """

    name: str
    meaning: str
    present: Callable[[System], bool]
    without: Change | None = None
    switched: bool = False


def change_of_bodies(change: Callable[[FlexibleBody], FlexibleBody], frozen: str) -> Change:
    """Return the change of a system in which every body changes, with the variation of varying bodies."""
    return lambda system: replace(
        system,
        bodies={name: change(body) for name, body in system.bodies.items()},
        varying={name: variation.with_frozen(frozen) for name, variation in system.varying.items()},
    )


def change_of_joints(change: Callable[[Joint], Joint]) -> Change:
    """The change of a system in which every joint of the tree changes."""
    return lambda system: replace(system, joints=tuple(map(change, system.joints)))


def without_strain(name: str) -> Callable[[FlexibleBody], FlexibleBody]:
    """The change of a body that sets one array of its strain tensors to zero."""
    return lambda body: replace(body, strain=replace(body.strain, **{name: 0.0 * getattr(body.strain, name)}))


def change_of_degree(name: str, array: str) -> Change:
    """The system without the strain of one degree.

    Raises ValueError where the strain of a body varies as a whole: by a function of the user, or a table of both.
    """

    def change(system: System) -> System:
        bodies, varying = dict(system.bodies), dict(system.varying)
        for key, body in system.bodies.items():
            if not _has(system, key, array):
                continue
            if key in varying and "strain" in varying[key].acting:
                if all(_has(system, key, name_of_tensor) for name_of_tensor in ("V2", "V3")):
                    raise ValueError(
                        f"{name!r} cannot be switched off: the strain of body {key!r} varies with time as a whole; "
                        "switch off 'nonlinear_strain', or let its function write the part that is to stay"
                    )
                varying[key] = varying[key].with_frozen("strain")
            bodies[key] = without_strain(array)(body)
        return replace(system, bodies=bodies, varying=varying)

    return change


def has_degree(array: str) -> Callable[[System], bool]:
    """Whether a system has strain of one degree."""
    return lambda system: any(_has(system, key, array) for key in system.bodies)


def _has(system: System, key: str, array: str) -> bool:
    """Whether a body has V2 or V3; one that varies by a function of the user may have both at any time."""
    variation = system.varying.get(key)
    if variation is not None and "strain" in variation.acting and not isinstance(variation.write, LengthTable):
        return True
    return bool(getattr(system.bodies[key].strain, array).any())


def has_in_bodies(array: Callable[[FlexibleBody], Array], part: str) -> Callable[[System], bool]:
    """Whether an array of any body is not zero, or the part that it belongs to varies with time."""
    return lambda system: (
        any(part in variation.acting for variation in system.varying.values())
        or any(array(body).any() for body in system.bodies.values())
    )


def has_prescribed_motion(system: System) -> bool:
    """Whether joints or material move as prescribed."""
    if any(profile.moves for joint in system.joints for profile in joint.prescribed.values()):
        return True
    parts = (part for variation in system.varying.values() for part in variation.acting)
    return any(part == "flow" or part.startswith(MARKER) for part in parts)


def has_moving_reference(system: System) -> bool:
    """Return whether anything moves that is not among the coordinates."""
    return system.frame.kind != "inertial" or has_prescribed_motion(system)


EQUATION_TERMS = (  # in the order of the ledger's rows
    EquationTerm("inertia", "M udot", lambda system: True),
    EquationTerm("coriolis_centrifugal", "part of h quadratic in u", lambda system: True, switched=True),
    EquationTerm(
        "gyroscopic",
        "G u, linear in u, from a turning base frame, prescribed joints or moving material",
        has_moving_reference,
        switched=True,
    ),
    EquationTerm(
        "specified_motion",
        "Gamma_t - T0,q: the motion of base frame, prescribed joints and material by itself",
        has_moving_reference,
        switched=True,
    ),
    EquationTerm(
        "elastic",
        "K1 delta",
        has_in_bodies(lambda body: body.strain.V1, "stiffness"),
        change_of_bodies(without_strain("V1"), "V1"),
    ),
    EquationTerm("elastic_K2", "K2 delta, quadratic in delta", has_degree("V2"), change_of_degree("elastic_K2", "V2")),
    EquationTerm("elastic_K3", "K3 delta, cubic in delta", has_degree("V3"), change_of_degree("elastic_K3", "V3")),
    EquationTerm(
        "prestress",
        "f0, the force of an initial stress",
        has_in_bodies(lambda body: body.strain.f0, "stiffness"),
        change_of_bodies(without_strain("f0"), "f0"),
    ),
    EquationTerm(
        "damping",
        "D ddelta of the bodies",
        has_in_bodies(lambda body: body.damping, "damping"),
        change_of_bodies(lambda body: replace(body, damping=0.0 * body.damping), "damping"),
    ),
    EquationTerm(
        "joint_springs",
        "springs of joints",
        lambda system: any(joint.stiffness.any() for joint in system.joints),
        change_of_joints(lambda joint: replace(joint, stiffness=0.0 * joint.stiffness)),
    ),
    EquationTerm(
        "joint_dampers",
        "dampers of joints",
        lambda system: any(joint.damping.any() for joint in system.joints),
        change_of_joints(lambda joint: replace(joint, damping=0.0 * joint.damping)),
    ),
    EquationTerm("gravity_gradient", "gravity relative to O", lambda system: system.orbit is not None, switched=True),
    EquationTerm(
        "gravity",
        "weight of the bodies in uniform gravity",
        lambda system: system.environment.has_weight,
        lambda system: replace(system, environment=Environment()),
    ),
    EquationTerm(
        "moving_mass",
        "M_t u: the mass matrix changes with prescribed joints and moving material",
        has_prescribed_motion,
        switched=True,
    ),
)
BY_NAME = {term.name: term for term in EQUATION_TERMS}
