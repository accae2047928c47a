"""Geometric stiffness that linear strain leaves out of bodies, by spin, thrust and loads, and warnings of it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eigh

from femflex.advice.bodies import KnownBodies
from femflex.advice.limits import STIFFENED
from femflex.advice.remedies import division_remedy
from femflex.arrays import Array
from femflex.body import FlexibleBody, Foreshortening
from femflex.rotations import dcm_from_quaternion
from femflex.system import System
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics import Model


TURNED = 0.01  # (rate / first frequency)^2 over what is added to the stiffness, below which no spin brings it about


@dataclass(frozen=True)
class AxialForce:
    """Axial force at a point of a body whose foreshortening there is theta (3,): that of a body and all it carries.

    sign: 1, or -1 where it is the joint that holds them against it.
    """

    theta: Array
    body: str
    sign: float


class OmittedStiffness:
    """The part of its lowest shape's stiffness that each body with linear strain leaves out; negative: it softens.

    Counted is the centripetal inertia of each body and of all bodies that it carries, at the body's rate; in orbit the
    gravity gradient; weight and loads, as they act on a body and on the bodies that it carries; and how a free craft
    accelerates under them as a whole, without turning faster.
    """

    def __init__(self, system: System, known: Mapping[str, Foreshortening] | None = None) -> None:
        """known: other displacements than the foreshortening of the bodies' lowest shapes, by body."""
        self._system = system
        own = {name: body.foreshortening for name, body in system.bodies.items()} if known is None else known
        self.bodies = {name: theta for name, theta in own.items() if theta is not None}
        self._pulls = {name: axial_forces(system, name, ignored) for name, ignored in self.bodies.items()}
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
            if load.force.any()
        }
        pushed, mass, loaded = self._carried(places, turned, loads)
        given_way = loaded[self._system.root] / mass[self._system.root] if self._free else 0.0 * origin
        out = {}
        for name, ignored in self.bodies.items():
            omega, C = channels[f"bodies/{name}/rate"], np.swapaxes(turned[name], 1, 2)
            W = omega[:, :, None] * omega[:, None, :] - np.einsum("ta,ta,bc->tbc", omega, omega, np.eye(3))
            W = W - self._gradient(channels, C)
            moved = np.broadcast_to(given_way, places[name].shape)
            field = np.einsum("tab,tbc,tc->ta", W, C, places[name]) + np.einsum("tab,tb->ta", C, moved - self._gravity)
            gain = field @ ignored.mass[0] + np.einsum("tab,ab->t", W, ignored.mass[1:])
            for pull in self._pulls[name]:
                b = pull.body
                inertia = np.einsum("tab,tbc,tc->ta", W, C, pushed[b]) + mass[b] * np.einsum("tab,tb->ta", C, moved)
                force = np.einsum("tab,tb->ta", C, np.broadcast_to(loaded[b], moved.shape)) - inertia
                gain -= pull.sign * force @ pull.theta
            for load in self._system.loads:
                if load.body == name and load.marker in ignored.at and load.force.any():
                    gain -= channels[f"loads/{load.name}/force"] @ ignored.at[load.marker]
            out[name] = gain
        return out

    def _gradient(self, channels: Mapping[str, Array], C: Array) -> Array:
        """Gravity gradient (n_t, 3, 3), -(mu / R^3) (1 - 3 l l^T), in body axes [1/s^2]; zero without an orbit.

        l: unit vector of the outward local vertical, y0 of the orbital frame. C (n_t, 3, 3) into body axes.
        """
        if self._system.orbit is None:
            return np.zeros_like(C)
        up = np.einsum("tab,tb->ta", C, dcm_from_quaternion(channels["orbit/attitude"])[:, :, 1])
        rate = self._system.orbit.mu / channels["orbit/radius"] ** 3
        return -rate[:, None, None] * (np.eye(3) - 3.0 * up[:, :, None] * up[:, None, :])

    def _carried(
        self, places: Mapping[str, Array], turned: Mapping[str, Array], loads: Mapping[str, Array]
    ) -> tuple[dict[str, Array], dict[str, float], dict[str, Array]]:
        """Of each body and all that it carries: mass times place, mass, and weight with loads, inertial axes."""
        pushed: dict[str, Array] = {}
        mass: dict[str, float] = {}
        loaded = {}
        for name, body in self._system.bodies.items():
            mass[name] = body.moments.mass
            loaded[name] = mass[name] * self._gravity
            pushed[name] = body.moments.mass * (places[name] + turned[name] @ body.moments.center_of_mass())
        for load in (load for load in self._system.loads if load.name in loads):
            loaded[load.body] = loaded[load.body] + loads[load.name]
        for name in reversed(self._system.order):
            if (parent := self._system.joint_of(name).parent) is not None:
                mass[parent] += mass[name]
                pushed[parent], loaded[parent] = pushed[parent] + pushed[name], loaded[parent] + loaded[name]
        return pushed, mass, loaded


def axial_forces(system: System, name: str, ignored: Foreshortening) -> list[AxialForce]:
    """Axial forces on a body where its foreshortening is known: of the bodies that it carries, and of its own joint."""
    carried = [(joint.parent_marker, joint.child, 1.0) for joint in system.joints if joint.parent == name]
    carried.append((system.joint_of(name).child_marker, name, -1.0))
    return [AxialForce(ignored.at[marker], body, sign) for marker, body, sign in carried if marker in ignored.at]


@dataclass(frozen=True)
class LargestGain:
    """What was left out at an instant: gain, the part of the lowest shape's stiffness that is added; spin [rad/s]."""

    gain: float
    spin: float
    body: str


class StiffeningWatch:
    """Watches how far bodies with linear strain would be stiffened or softened, row by row, and warns of it."""

    def __init__(self, model: Model, known: KnownBodies | None = None) -> None:
        self._system = system = model.system
        self._known = known or KnownBodies({})
        self._ignored = OmittedStiffness(system)
        whole = {piece: whole for whole, pieces in system.segments.items() for piece in pieces}
        self._whole = {name: whole.get(name, name) for name in self._ignored.bodies}
        self._most: dict[str, LargestGain] = {}
        self._least: dict[str, LargestGain] = {}

    def watch(self, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows (n_t, ...)."""
        for name, gain in self._ignored.gains(channels).items():
            self._note(name, gain, np.linalg.norm(channels[f"bodies/{name}/rate"], axis=1))

    def _note(self, name: str, gain: Array, spin: Array) -> None:
        whole = self._whole[name]
        high, low = int(np.argmax(gain)), int(np.argmin(gain))
        if whole not in self._most or gain[high] > self._most[whole].gain:
            self._most[whole] = LargestGain(float(gain[high]), float(spin[high]), name)
        if whole not in self._least or gain[low] < self._least[whole].gain:
            self._least[whole] = LargestGain(float(gain[low]), float(spin[low]), name)

    def warn(self, verb: str = "turned at up to") -> None:
        """Warn of bodies whose first frequency would have been raised or lowered by more than STIFFENED, with both
        numbers."""
        for whole, seen in self._most.items():
            raised = float(np.sqrt(1.0 + max(seen.gain, 0.0)) - 1.0)
            if raised > STIFFENED:
                cut = whole in self._system.segments
                text = self._of_segment(whole, seen.body) if cut else self._of_body(seen.body, raised)
                way = f"{verb} {seen.spin:.4g} rad/s" if self._spins(seen) else "is stretched by loads or weight"
                self._warn(f"body {whole!r} {way}: a stiffening of {raised:.0%} of {text}")
        for whole, seen in self._least.items():
            left = float(np.sqrt(max(1.0 + seen.gain, 0.0)))
            if left < 1.0 - STIFFENED and whole not in self._system.segments:
                self._warn(f"body {whole!r} was compressed, by loads or inertia, {self._softened(seen, left)}")

    def _spins(self, seen: LargestGain) -> bool:
        """Whether it is the spin of a body that stiffens it, not loads or weight along it."""
        body = self._system.bodies[seen.body]
        return (seen.spin / lowest_frequency(body, {})) ** 2 > TURNED * seen.gain

    def _softened(self, seen: LargestGain, left: float) -> str:
        other = division_remedy(self._system.bodies[seen.body])
        way = f"which linear strain leaves out. {self._remedy(seen.body)}, or {other}."
        if left == 0.0:
            return f"up to {-seen.gain:.3g} of its first buckling load, {way}"
        return f"so that its first frequency{self._frequencies(seen.body, left)} falls by {1.0 - left:.0%}, {way}"

    def _frequencies(self, name: str, factor: float) -> str:
        """Lowest frequency of the clamped body with what it carries, with linear strain and with the stiffening."""
        if not np.isfinite(self._system.bodies[name].omega).any():
            return ""
        carried = attached_masses(self._system, name)
        known = lowest_frequency(self._system.bodies[name], carried) / (2 * np.pi)
        carrying = f", clamped, with the {sum(carried.values()):.4g} kg that it carries" if carried else ""
        return f" ({known:.4g} Hz, not {known * factor:.4g} Hz{carrying})"

    def _remedy(self, name: str) -> str:
        text = self._known.remedy(name)
        return text[:1].upper() + text[1:]

    def _of_body(self, name: str, raised: float) -> str:
        text = self._frequencies(name, 1.0 + raised)
        return f"its first frequency{text} is left out by linear strain. {self._remedy(name)}."

    @staticmethod
    def _warn(text: str) -> None:
        warnings.warn(text, PhysicsWarning, stacklevel=3)

    def _of_segment(self, whole: str, name: str) -> str:
        count = len(self._system.segments[whole])
        return (
            f"the first shape of its segment {name!r} is left out by linear strain within segments; limit "
            f"{STIFFENED:.0%}. Cut it into more than {count} segments, or give it strain = 'condensed'."
        )


def attached_masses(system: System, name: str) -> dict[str, float]:
    """Mass carried at each marker of a body [kg]."""
    mass = {body: system.bodies[body].moments.mass for body in system.order}
    for body in reversed(system.order):
        if (parent := system.joint_of(body).parent) is not None:
            mass[parent] += mass[body]
    out: dict[str, float] = {}
    for joint in system.joints:
        if joint.parent == name:
            out[joint.parent_marker] = out.get(joint.parent_marker, 0.0) + mass[joint.child]
    return out


def lowest_frequency(body: FlexibleBody, carried: Mapping[str, float]) -> float:
    """Lowest frequency of a body held in its frame with point masses [kg] at its markers [rad/s]."""
    n, V1 = body.n_modes, (body.strain.V1 + body.strain.V1.T) / 2
    M = body.moments.elastic_mass()[:n, :n]
    for marker, mass in carried.items():
        phi = body.marker(marker).phi[:, :n]
        M = M + mass * phi.T @ phi
    return float(np.sqrt(max(eigh(V1, M, eigvals_only=True)[0], 0.0)))
