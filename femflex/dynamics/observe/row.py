"""The row that the compiled `observe` writes of an instant: what stands in it, in this order, and where.

It begins with FIXED, of the craft as a whole; per body in tree order BODY follows, per reported marker MARKER, then
what every force term reports. Kernels find their places in ROW, IN_BODY and IN_MARKER, by the last parts of the paths.
Words in braces depend on the system.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from femflex.rotations import EULER_PARAMETERS
from femflex.system.channel import Channel
from femflex.system.effector import Effector

if TYPE_CHECKING:
    from femflex.system import System


XYZ, EULER, ANGLES = ("x", "y", "z"), ("e0", "e1", "e2", "e3"), ("{angle1}", "{angle2}", "{angle3}")


def always(_system: System) -> bool:
    """True."""
    return True


def has_attitude(system: System) -> bool:
    """Whether the root body can have an attitude other than that of its marker."""
    joint = system.joint_of(system.root)
    return joint.ball is not None or len(joint.rotations) > 0


def in_orbit(system: System) -> bool:
    """Whether the craft is in an orbit."""
    return system.orbit is not None


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


FIXED: dict[str, tuple[Channel, Callable[[System], bool]]] = {  # and whether a system has it
    "attitude/angles": (
        Channel("rad", "attitude of {root} from the {frame} frame, {turns}", (3,), ANGLES), has_attitude
    ),
    "monitors/energy": (Channel("J", "total energy"), always),
    "monitors/kinetic": (Channel("J", "kinetic energy{relative}"), always),
    "monitors/momentum": (Channel("kg m/s", "linear momentum", (3,), XYZ, "inertial"), always),
    "monitors/angular_momentum": (
        Channel("kg m^2/s", "angular momentum about the centre of mass", (3,), XYZ, "inertial"), always
    ),
    "monitors/center_of_mass": (Channel("m", "centre of mass {where}", (3,), XYZ, "inertial"), always),
    "monitors/elastic": (Channel("J", "strain energy"), is_elastic),
    "monitors/quaternion_norm": (
        Channel("1", "largest departure of Euler parameters from unit length"),
        lambda s: any(joint.ball == EULER_PARAMETERS for joint in s.joints),
    ),
    "monitors/gravity": (Channel("J", "energy of the {attraction}"), lambda s: in_orbit(s) or s.environment.has_weight),
    "orbit/radius": (Channel("m", "distance of O from the Earth's centre"), in_orbit),
    "orbit/true_anomaly": (Channel("rad", "true anomaly of O"), in_orbit),
    "orbit/attitude": (Channel("1", "Euler parameters of the orbital frame, C_NO", (4,), EULER), in_orbit),
    "monitors/jacobi": (
        Channel("J", "Jacobi integral, constant on a specified circular orbit"),
        lambda s: s.orbit is not None and not s.orbit.free,
    ),
    # what force terms store, by ENERGY_*; springs with those of joints
    "monitors/spring": (Channel("J", "energy of joint springs"), has_springs),
    "monitors/load": (
        Channel("J", "energy of forces that are constant in inertial axes, -F.r"), lambda s: bool(conservative_loads(s))
    ),
    "monitors/effector": (Channel("J", "energy stored by effectors"), lambda s: accounts_for(s, "energy")),
    # what they take for good, and bring in
    "monitors/dissipation": (Channel("W", "power taken by dampers, friction, stops and structural damping"), is_damped),
    "monitors/supplied": (Channel("W", "power of loads without a potential, effectors and tides"), is_supplied),
}  # fmt: skip
BODY = {
    "position": Channel("m", "origin of {name} {where}", (3,), XYZ, "inertial"),
    "attitude": Channel("1", "Euler parameters of {name}, C_NB", (4,), EULER),
    "rate": Channel("rad/s", "inertial rate of {name}", (3,), XYZ, "body"),
}
MARKER = {
    "position": Channel("m", "position of {label} {where}", (3,), XYZ, "inertial"),
    "velocity": Channel("m/s", "velocity of {label} {where}", (3,), XYZ, "inertial"),
    "deflection": Channel(
        "m", "elastic displacement{stretch} of {label} in its own body; `displacement` includes joints",
        (3,), XYZ, "body",
    ),
}  # fmt: skip


def places(channels: Iterable[tuple[str, Channel]]) -> tuple[Any, int]:
    """Named tuple of the first columns of channels by the last parts of their paths, and the number of all columns."""
    starts, n = {}, 0
    for path, channel in channels:
        starts[path.rpartition("/")[2]] = n
        n += math.prod(channel.shape)
    return namedtuple("Places", list(starts))(**starts), n


ROW, FIXED_WIDTH = places((path, channel) for path, (channel, _) in FIXED.items())
IN_BODY, BODY_WIDTH = places(BODY.items())
IN_MARKER, MARKER_WIDTH = places(MARKER.items())


def worded(channel: Channel, words: Mapping[str, str], **changes: Any) -> Channel:
    """The channel with the words of a system in its description and names."""
    description, names = channel.description.format_map(words), tuple(name.format_map(words) for name in channel.names)
    return replace(channel, description=description, names=names, **changes)


def origin_text(system: System) -> str:
    """Text on the point from which positions count."""
    return "from O" if system.orbit else "from the inertial origin"
