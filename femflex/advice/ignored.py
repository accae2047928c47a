"""What linear strain leaves out of the stiffness of bodies: the pull of spin, thrust and loads along them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.body import Foreshortening
from femflex.rotations import dcm_from_quaternion
from femflex.system import System

Array = NDArray[np.float64]

STIFFENED = 0.02  # of the first frequency: what spin or loads change of it from which its lack is told


@dataclass(frozen=True)
class Pull:
    """What pulls at a place of a body whose foreshortening there is theta (3,): a body and all that hangs on it.

    sign: 1, or -1 where it is the joint that holds them against it.
    """

    theta: Array
    body: str
    sign: float


class IgnoredStiffness:
    """The part of its lowest shape's stiffness that each body with linear strain leaves out; negative: it softens.

    Counted is the centripetal inertia of each body and of all that hangs on it, at the body's rate; weight and loads,
    as they pull at a body and at what hangs on it; and how a free craft gives way to them as a whole, without turning
    faster.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self.bodies = {name: body.ignored for name, body in system.bodies.items() if body.ignored is not None}
        self._pulls = {name: pulls(system, name, ignored) for name, ignored in self.bodies.items()}
        self._free = len(system.joint_of(system.root).translations) == 3
        self._gravity = system.environment.gravity
        self._about_mass = system.orbit is not None or self._free

    def gains(self, channels: Mapping[str, Array]) -> dict[str, Array]:
        """Of each body (n_t,), from channels over n_t rows."""
        if not self.bodies:
            return {}
        turned = {name: dcm_from_quaternion(channels[f"bodies/{name}/attitude"]) for name in self._system.order}
        origin = channels["monitors/center_of_mass"] if self._about_mass else np.zeros(3)
        places = {name: channels[f"bodies/{name}/position"] - origin for name in self._system.order}
        loads = {
            load.name: np.einsum("tab,tb->ta", turned[load.body], channels[f"loads/{load.name}/force"])
            for load in self._system.loads
        }
        pushed, mass, loaded = self._hung(places, turned, loads)
        given_way = loaded[self._system.root] / mass[self._system.root] if self._free else 0.0 * origin
        out = {}
        for name, ignored in self.bodies.items():
            omega, C = channels[f"bodies/{name}/rate"], np.swapaxes(turned[name], 1, 2)
            W = omega[:, :, None] * omega[:, None, :] - np.einsum("ta,ta,bc->tbc", omega, omega, np.eye(3))
            moved = np.broadcast_to(given_way, places[name].shape)
            field = np.einsum("tab,tbc,tc->ta", W, C, places[name]) + np.einsum("tab,tb->ta", C, moved - self._gravity)
            gain = field @ ignored.mass[0] + np.einsum("tab,ab->t", W, ignored.mass[1:])
            for pull in self._pulls[name]:
                b = pull.body
                inertia = np.einsum("tab,tbc,tc->ta", W, C, pushed[b]) + mass[b] * np.einsum("tab,tb->ta", C, moved)
                force = np.einsum("tab,tb->ta", C, np.broadcast_to(loaded[b], moved.shape)) - inertia
                gain -= pull.sign * force @ pull.theta
            for load in self._system.loads:
                if load.body == name and load.marker in ignored.at:
                    gain -= channels[f"loads/{load.name}/force"] @ ignored.at[load.marker]
            out[name] = gain
        return out

    def _hung(
        self, places: Mapping[str, Array], turned: Mapping[str, Array], loads: Mapping[str, Array]
    ) -> tuple[dict[str, Array], dict[str, float], dict[str, Array]]:
        """Of each body and all that hangs on it: mass times place, mass, and weight with loads, inertial axes."""
        pushed: dict[str, Array] = {}
        mass: dict[str, float] = {}
        loaded = {}
        for name, body in self._system.bodies.items():
            mass[name] = body.moments.mass
            loaded[name] = mass[name] * self._gravity
            pushed[name] = body.moments.mass * (places[name] + turned[name] @ body.moments.center_of_mass())
        for load in self._system.loads:
            loaded[load.body] = loaded[load.body] + loads[load.name]
        for name in reversed(self._system.order):
            if (parent := self._system.joint_of(name).parent) is not None:
                mass[parent] += mass[name]
                pushed[parent], loaded[parent] = pushed[parent] + pushed[name], loaded[parent] + loaded[name]
        return pushed, mass, loaded


def pulls(system: System, name: str, ignored: Foreshortening) -> list[Pull]:
    """What pulls at a body where its foreshortening is known: what hangs on it, and the joint it hangs by."""
    hung = [(joint.parent_marker, joint.child, 1.0) for joint in system.joints if joint.parent == name]
    hung.append((system.joint_of(name).child_marker, name, -1.0))
    return [Pull(ignored.at[marker], body, sign) for marker, body, sign in hung if marker in ignored.at]
