"""Watching what linear strain leaves out: how far spin, thrust and loads along a body stiffen it, or soften it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.rotations import dcm_from_quaternion
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.body import Foreshortening
    from femflex.dynamics import Model
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


@dataclass(frozen=True)
class Seen:
    """What was left out at an instant: gain, the part of the lowest shape's stiffness that is added; spin [rad/s]."""

    gain: float
    spin: float
    body: str


class Stiffening:
    """Watches how far bodies with linear strain would be stiffened or softened, row by row, and warns of it.

    Counted is the centripetal inertia of each body and of all that hangs on it, at the body's rate; loads, as they
    pull at a body and at what hangs on it; and how a free craft gives way to them as a whole, without turning faster.
    """

    def __init__(self, model: Model) -> None:
        self._system = system = model.system
        self._bodies = {name: body.ignored for name, body in system.bodies.items() if body.ignored is not None}
        self._pulls = {name: pulls(system, name, ignored) for name, ignored in self._bodies.items()}
        root = system.joint_of(system.root)
        self._free = len(root.translations) == 3
        self._about_mass = system.orbit is not None or self._free
        whole = {piece: whole for whole, pieces in system.segments.items() for piece in pieces}
        self._whole = {name: whole.get(name, name) for name in self._bodies}
        self._most: dict[str, Seen] = {}
        self._least: dict[str, Seen] = {}

    def watch(self, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows."""
        if not self._bodies:
            return
        turned = {name: dcm_from_quaternion(channels[f"bodies/{name}/attitude"]) for name in self._system.order}
        origin = channels["monitors/center_of_mass"] if self._about_mass else np.zeros(3)
        places = {name: channels[f"bodies/{name}/position"] - origin for name in self._system.order}
        loads = {
            load.name: np.einsum("tab,tb->ta", turned[load.body], channels[f"loads/{load.name}/force"])
            for load in self._system.loads
        }
        pushed, mass, loaded = self._hung(places, turned, loads)
        given_way = loaded[self._system.root] / mass[self._system.root] if self._free else 0.0 * origin
        for name, ignored in self._bodies.items():
            omega, C = channels[f"bodies/{name}/rate"], np.swapaxes(turned[name], 1, 2)
            W = omega[:, :, None] * omega[:, None, :] - np.einsum("ta,ta,bc->tbc", omega, omega, np.eye(3))
            moved = np.broadcast_to(given_way, places[name].shape)
            field = np.einsum("tab,tbc,tc->ta", W, C, places[name]) + np.einsum("tab,tb->ta", C, moved)
            gain = field @ ignored.mass[0] + np.einsum("tab,ab->t", W, ignored.mass[1:])
            for pull in self._pulls[name]:
                b = pull.body
                inertia = np.einsum("tab,tbc,tc->ta", W, C, pushed[b]) + mass[b] * np.einsum("tab,tb->ta", C, moved)
                force = np.einsum("tab,tb->ta", C, np.broadcast_to(loaded[b], moved.shape)) - inertia
                gain -= pull.sign * force @ pull.theta
            for load in self._system.loads:
                if load.body == name and load.marker in ignored.at:
                    gain -= channels[f"loads/{load.name}/force"] @ ignored.at[load.marker]
            self._note(name, gain, np.linalg.norm(omega, axis=1))

    def _hung(
        self, places: Mapping[str, Array], turned: Mapping[str, Array], loads: Mapping[str, Array]
    ) -> tuple[dict[str, Array], dict[str, float], dict[str, Array]]:
        """Of each body and all that hangs on it: mass times place, mass, and the sum of the loads, inertial axes."""
        pushed: dict[str, Array] = {}
        mass: dict[str, float] = {}
        loaded = {name: np.zeros(3) for name in self._system.order}
        for name, body in self._system.bodies.items():
            mass[name] = body.moments.mass
            pushed[name] = body.moments.mass * (places[name] + turned[name] @ body.moments.center_of_mass())
        for load in self._system.loads:
            loaded[load.body] = loaded[load.body] + loads[load.name]
        for name in reversed(self._system.order):
            if (parent := self._system.joint_of(name).parent) is not None:
                mass[parent] += mass[name]
                pushed[parent], loaded[parent] = pushed[parent] + pushed[name], loaded[parent] + loaded[name]
        return pushed, mass, loaded

    def _note(self, name: str, gain: Array, spin: Array) -> None:
        whole = self._whole[name]
        high, low = int(np.argmax(gain)), int(np.argmin(gain))
        if whole not in self._most or gain[high] > self._most[whole].gain:
            self._most[whole] = Seen(float(gain[high]), float(spin[high]), name)
        if whole not in self._least or gain[low] < self._least[whole].gain:
            self._least[whole] = Seen(float(gain[low]), float(spin[low]), name)

    def warn(self, verb: str = "turned at up to") -> None:
        """Warn of bodies whose first frequency would have been raised or lowered by more than STIFFENED, with both
        numbers."""
        for whole, seen in self._most.items():
            raised = float(np.sqrt(1.0 + max(seen.gain, 0.0)) - 1.0)
            if raised > STIFFENED:
                cut = whole in self._system.segments
                text = self._of_segment(whole, seen.body) if cut else self._of_body(seen.body, raised)
                self._warn(f"body {whole!r} {verb} {seen.spin:.4g} rad/s: a stiffening of {raised:.0%} of {text}")
        for whole, seen in self._least.items():
            left = float(np.sqrt(max(1.0 + seen.gain, 0.0)))
            if left < 1.0 - STIFFENED and whole not in self._system.segments:
                self._warn(f"body {whole!r} was pressed, by loads or inertia along it, {self._softened(seen, left)}")

    def _softened(self, seen: Seen, left: float) -> str:
        way = "which linear strain leaves out. Give it strain = 'condensed', or cut it into segments."
        if left == 0.0:
            return f"up to {-seen.gain:.3g} times as hard as makes it buckle in its first shape, {way}"
        return f"so that its first frequency{self._frequencies(seen.body, left)} falls by {1.0 - left:.0%}, {way}"

    def _frequencies(self, name: str, factor: float) -> str:
        omega = self._system.bodies[name].omega
        known = omega[np.isfinite(omega)] / (2 * np.pi)
        return f" ({known.min():.4g} Hz, not {known.min() * factor:.4g} Hz)" if len(known) else ""

    def _of_body(self, name: str, raised: float) -> str:
        told = self._frequencies(name, 1.0 + raised)
        return f"its first frequency{told} is ignored by linear strain. Give it strain = 'condensed'."

    @staticmethod
    def _warn(text: str) -> None:
        warnings.warn(text, PhysicsWarning, stacklevel=3)

    def _of_segment(self, whole: str, name: str) -> str:
        count = len(self._system.segments[whole])
        return (
            f"the first shape of its segment {name!r} is ignored by linear strain within segments, over "
            f"{STIFFENED:.0%}. Cut it into more than {count} segments, or give it strain = 'condensed'."
        )


def pulls(system: System, name: str, ignored: Foreshortening) -> list[Pull]:
    """What pulls at a body where its foreshortening is known: what hangs on it, and the joint it hangs by."""
    hung = [(joint.parent_marker, joint.child, 1.0) for joint in system.joints if joint.parent == name]
    hung.append((system.joint_of(name).child_marker, name, -1.0))
    return [Pull(ignored.at[marker], body, sign) for marker, body, sign in hung if marker in ignored.at]
