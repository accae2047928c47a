"""Watching what linear strain leaves out: how far spin, thrust and loads along a body stiffen it, or soften it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from femflex.advice.divided import divided
from femflex.advice.ignored import STIFFENED, IgnoredStiffness
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.dynamics import Model
    from femflex.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Seen:
    """What was left out at an instant: gain, the part of the lowest shape's stiffness that is added; spin [rad/s]."""

    gain: float
    spin: float
    body: str


class Stiffening:
    """Watches how far bodies with linear strain would be stiffened or softened, row by row, and warns of it."""

    def __init__(self, model: Model) -> None:
        self._system = system = model.system
        self._ignored = IgnoredStiffness(system)
        whole = {piece: whole for whole, pieces in system.segments.items() for piece in pieces}
        self._whole = {name: whole.get(name, name) for name in self._ignored.bodies}
        self._most: dict[str, Seen] = {}
        self._least: dict[str, Seen] = {}

    def watch(self, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows."""
        for name, gain in self._ignored.gains(channels).items():
            self._note(name, gain, np.linalg.norm(channels[f"bodies/{name}/rate"], axis=1))

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
        other = divided(self._system.bodies[seen.body])
        way = f"which linear strain leaves out. {self._remedy(seen.body)}, or {other}."
        if left == 0.0:
            return f"up to {-seen.gain:.3g} times as hard as makes it buckle in its first shape, {way}"
        return f"so that its first frequency{self._frequencies(seen.body, left)} falls by {1.0 - left:.0%}, {way}"

    def _frequencies(self, name: str, factor: float) -> str:
        """The lowest frequency of the held body and what hangs on it, as linear strain has it and as it would be."""
        if not np.isfinite(self._system.bodies[name].omega).any():
            return ""
        hung = masses_hung(self._system, name)
        known = lowest_frequency(self._system.bodies[name], hung) / (2 * np.pi)
        carrying = f", held, with the {sum(hung.values()):.4g} kg that hang on it" if hung else ""
        return f" ({known:.4g} Hz, not {known * factor:.4g} Hz{carrying})"

    def _remedy(self, name: str) -> str:
        ignored = self._system.bodies[name].ignored
        text = "" if ignored is None else ignored.remedy
        return text[:1].upper() + text[1:]

    def _of_body(self, name: str, raised: float) -> str:
        told = self._frequencies(name, 1.0 + raised)
        return f"its first frequency{told} is ignored by linear strain. {self._remedy(name)}."

    @staticmethod
    def _warn(text: str) -> None:
        warnings.warn(text, PhysicsWarning, stacklevel=3)

    def _of_segment(self, whole: str, name: str) -> str:
        count = len(self._system.segments[whole])
        return (
            f"the first shape of its segment {name!r} is ignored by linear strain within segments, over "
            f"{STIFFENED:.0%}. Cut it into more than {count} segments, or give it strain = 'condensed'."
        )


def masses_hung(system: System, name: str) -> dict[str, float]:
    """Mass of all that hangs at each marker of a body [kg]."""
    mass = {body: system.bodies[body].moments.mass for body in system.order}
    for body in reversed(system.order):
        if (parent := system.joint_of(body).parent) is not None:
            mass[parent] += mass[body]
    out: dict[str, float] = {}
    for joint in system.joints:
        if joint.parent == name:
            out[joint.parent_marker] = out.get(joint.parent_marker, 0.0) + mass[joint.child]
    return out


def lowest_frequency(body: FlexibleBody, hung: Mapping[str, float]) -> float:
    """Lowest frequency of a body held in its frame with point masses [kg] at its markers [rad/s]."""
    n, V1 = body.n_modes, (body.strain.V1 + body.strain.V1.T) / 2
    M = body.moments.elastic_mass()[:n, :n]
    for marker, mass in hung.items():
        phi = body.marker(marker).phi[:, :n]
        M = M + mass * phi.T @ phi
    return float(np.sqrt(max(eigh(V1, M, eigvals_only=True)[0], 0.0)))
