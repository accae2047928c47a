"""Geometric stiffness by spin, thrust and loads that linear strain omits, and warnings of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eigh

from femflex.advice.advice import Advice, WorstRow, doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.limits import FREQUENCY_CHANGE, SPIN_SHARE, division_remedy
from femflex.arrays import Array
from femflex.body import FlexibleBody, Foreshortening
from femflex.rotations import dcm_from_quaternion
from femflex.system import System

if TYPE_CHECKING:
    from femflex.dynamics import Model


@dataclass(frozen=True)
class AxialForce:
    """Force that `body` and all bodies it carries apply at a point with the foreshortening theta (3,).

    sign: 1, or -1 for the force of the joint that supports these bodies.
    """

    theta: Array
    body: str
    sign: float


def body_rate(channels: Mapping[str, Array], name: str) -> Array:
    """Inertial rate (n_t, 3) of a body [rad/s]; zero for a body that cannot turn, since it has no rate channel."""
    return channels.get(f"bodies/{name}/rate", np.zeros((len(channels[f"bodies/{name}/attitude"]), 3)))


class OmittedStiffness:
    """Geometric stiffness of the lowest shape of each body over its elastic stiffness; negative where it softens.

    It includes the centripetal inertia of each body and of all bodies that it carries, at the body's rate; in orbit the
    gravity gradient; weight and loads on a body and on the bodies that it carries; and the linear acceleration of a
    free craft under them, without angular acceleration.
    """

    def __init__(self, system: System, displacements: Mapping[str, Foreshortening] | None = None) -> None:
        """displacements: by body, to be used instead of the foreshortening of the bodies' lowest shapes."""
        self._system = system
        foreshortenings = (
            {name: body.foreshortening for name, body in system.bodies.items()}
            if displacements is None
            else displacements
        )
        self.bodies = {name: theta for name, theta in foreshortenings.items() if theta is not None}
        self._axial_forces = {
            name: axial_forces(system, name, foreshortening) for name, foreshortening in self.bodies.items()
        }
        self._free = len(system.joint_of(system.root).translations) == 3
        self._gravity = system.environment.gravity
        self._about_mass = system.orbit is not None or self._free

    def gains(self, channels: Mapping[str, Array]) -> dict[str, Array]:
        """Geometric over elastic stiffness (n_t,) of each body, from channels over n_t rows."""
        if not self.bodies:
            return {}
        rotations = {name: dcm_from_quaternion(channels[f"bodies/{name}/attitude"]) for name in self._system.order}
        origin = channels["monitors/center_of_mass"] if self._about_mass else np.zeros(3)
        positions = {name: channels[f"bodies/{name}/position"] - origin for name in self._system.order}
        loads = {
            load.name: np.einsum("tab,tb->ta", rotations[load.body], channels[f"loads/{load.name}/force"])
            for load in self._system.loads
            if load.force.any()
        }
        first_moments, mass, forces = self._subtree_loads(positions, rotations, loads)
        acceleration = forces[self._system.root] / mass[self._system.root] if self._free else 0.0 * origin
        out = {}
        for name, foreshortening in self.bodies.items():
            omega, C = body_rate(channels, name), np.swapaxes(rotations[name], 1, 2)
            W = omega[:, :, None] * omega[:, None, :] - np.einsum("ta,ta,bc->tbc", omega, omega, np.eye(3))
            W = W - self._gradient(channels, C)
            accelerations = np.broadcast_to(acceleration, positions[name].shape)
            field = np.einsum("tab,tbc,tc->ta", W, C, positions[name]) + np.einsum(
                "tab,tb->ta", C, accelerations - self._gravity
            )
            gain = field @ foreshortening.mass[0] + np.einsum("tab,ab->t", W, foreshortening.mass[1:])
            for axial in self._axial_forces[name]:
                b = axial.body
                inertia = np.einsum("tab,tbc,tc->ta", W, C, first_moments[b]) + mass[b] * np.einsum(
                    "tab,tb->ta", C, accelerations
                )
                force = np.einsum("tab,tb->ta", C, np.broadcast_to(forces[b], accelerations.shape)) - inertia
                gain -= axial.sign * force @ axial.theta
            for load in self._system.loads:
                if load.body == name and load.marker in foreshortening.at and load.force.any():
                    gain -= channels[f"loads/{load.name}/force"] @ foreshortening.at[load.marker]
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

    def _subtree_loads(
        self, positions: Mapping[str, Array], rotations: Mapping[str, Array], loads: Mapping[str, Array]
    ) -> tuple[dict[str, Array], dict[str, float], dict[str, Array]]:
        """First moment (n_t, 3) [kg m], mass [kg], and weight with loads [N] of each body and all it carries."""
        first_moments: dict[str, Array] = {}
        mass: dict[str, float] = {}
        forces = {}
        for name, body in self._system.bodies.items():
            mass[name] = body.moments.mass
            forces[name] = mass[name] * self._gravity
            first_moments[name] = body.moments.mass * (
                positions[name] + rotations[name] @ body.moments.center_of_mass()
            )
        for load in (load for load in self._system.loads if load.name in loads):
            forces[load.body] = forces[load.body] + loads[load.name]
        for name in reversed(self._system.order):
            if (parent := self._system.joint_of(name).parent) is not None:
                mass[parent] += mass[name]
                first_moments[parent], forces[parent] = (
                    first_moments[parent] + first_moments[name],
                    forces[parent] + forces[name],
                )
        return first_moments, mass, forces


def axial_forces(system: System, name: str, foreshortening: Foreshortening) -> list[AxialForce]:
    """Axial forces on a body where its foreshortening is known: by the bodies that it carries and by its own joint."""
    ends = [(joint.parent_marker, joint.child, 1.0) for joint in system.joints if joint.parent == name]
    ends.append((system.joint_of(name).child_marker, name, -1.0))
    return [
        AxialForce(foreshortening.at[marker], body, sign) for marker, body, sign in ends if marker in foreshortening.at
    ]


class StiffeningWatch:
    """Watches the omitted stiffness of bodies with linear strain along a run, and warns of it."""

    def __init__(self, model: Model, origins: BodyOrigins, verb: str = "turned at up to") -> None:
        self._system = system = model.system
        self._origins, self._verb = origins, verb
        self._omitted = OmittedStiffness(system)
        whole = {piece: whole for whole, pieces in system.segments.items() for piece in pieces}
        self._whole = {name: whole.get(name, name) for name in self._omitted.bodies}
        self._most, self._least = ({name: WorstRow() for name in self._whole.values()} for _ in range(2))

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest and smallest gains over a block of rows (n_t, ...)."""
        for name, gain in self._omitted.gains(channels).items():
            spin = np.linalg.norm(body_rate(channels, name), axis=1)
            self._most[self._whole[name]].record(gain, spin=spin, body=name)
            self._least[self._whole[name]].record(-gain, body=name)

    def doubts(self) -> Iterator[Advice]:
        """Warnings of bodies whose first frequency would change by more than FREQUENCY_CHANGE."""
        for whole, largest in self._most.items():
            raised = float(np.sqrt(1.0 + max(largest.measure, 0.0)) - 1.0)
            if raised > FREQUENCY_CHANGE:
                cut, body, spin = whole in self._system.segments, largest.values["body"], largest.values["spin"]
                text = self._segment_text(whole, body) if cut else self._body_text(body, raised)
                spins = (spin / lowest_frequency(self._system.bodies[body], {})) ** 2 > SPIN_SHARE * largest.measure
                cause = f"{self._verb} {spin:.4g} rad/s" if spins else "is stretched by loads or weight"
                text = f"body {whole!r} {cause}: a stiffening of {raised:.0%} of {text}"
                yield doubt(whole, "stretch", text, raised, FREQUENCY_CHANGE)
        for whole, smallest in self._least.items():
            remaining = float(np.sqrt(max(1.0 - smallest.measure, 0.0)))
            if remaining < 1.0 - FREQUENCY_CHANGE and whole not in self._system.segments:
                effect = self._softening_text(smallest.values["body"], smallest.measure, remaining)
                text = f"body {whole!r} was compressed, by loads or inertia, {effect}"
                yield doubt(whole, "stretch", text, 1.0 - remaining, FREQUENCY_CHANGE)

    def _softening_text(self, name: str, load: float, remaining: float) -> str:
        """Text on a body whose first frequency is `remaining` times that with linear strain."""
        division = division_remedy(self._system.bodies[name])
        remedy = f"which linear strain leaves out. {self._remedy(name)}, or {division}."
        if remaining == 0.0:
            return f"up to {load:.3g} of its first buckling load, {remedy}"
        frequency = self._frequency_text(name, remaining)
        return f"so that its first frequency{frequency} falls by {1.0 - remaining:.0%}, {remedy}"

    def _frequency_text(self, name: str, factor: float) -> str:
        """Text with the lowest frequency of the clamped body and what it carries, and `factor` times it."""
        if not np.isfinite(self._system.bodies[name].omega).any():
            return ""
        attached = attached_masses(self._system, name)
        frequency = lowest_frequency(self._system.bodies[name], attached) / (2 * np.pi)
        attached_text = f", clamped, with the {sum(attached.values()):.4g} kg that it carries" if attached else ""
        return f" ({frequency:.4g} Hz, not {frequency * factor:.4g} Hz{attached_text})"

    def _remedy(self, name: str) -> str:
        text = self._origins.remedy(name)
        return text[:1].upper() + text[1:]

    def _body_text(self, name: str, raised: float) -> str:
        text = self._frequency_text(name, 1.0 + raised)
        return f"its first frequency{text} is left out by linear strain. {self._remedy(name)}."

    def _segment_text(self, whole: str, name: str) -> str:
        count = len(self._system.segments[whole])
        return (
            f"the first shape of its segment {name!r} is left out by linear strain within segments; limit "
            f"{FREQUENCY_CHANGE:.0%}. Cut it into more than {count} segments, or give it strain = 'condensed'."
        )


def attached_masses(system: System, name: str) -> dict[str, float]:
    """Mass [kg] that joints attach at each marker of a body, by the marker's name."""
    mass = {body: system.bodies[body].moments.mass for body in system.order}
    for body in reversed(system.order):
        if (parent := system.joint_of(body).parent) is not None:
            mass[parent] += mass[body]
    out: dict[str, float] = {}
    for joint in system.joints:
        if joint.parent == name:
            out[joint.parent_marker] = out.get(joint.parent_marker, 0.0) + mass[joint.child]
    return out


def lowest_frequency(body: FlexibleBody, attached: Mapping[str, float]) -> float:
    """Lowest frequency of a body clamped in its frame with point masses [kg] at its markers [rad/s]."""
    n, V1 = body.n_modes, (body.strain.V1 + body.strain.V1.T) / 2
    M = body.moments.elastic_mass()[:n, :n]
    for marker, mass in attached.items():
        phi = body.marker(marker).phi[:, :n]
        M = M + mass * phi.T @ phi
    return float(np.sqrt(max(eigh(V1, M, eigvals_only=True)[0], 0.0)))
