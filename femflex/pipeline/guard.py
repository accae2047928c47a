"""What a run is guarded against: motion that has run away, angles near a singularity."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.bodies import KnownBodies
from femflex.advice.deflections import DeflectionWatch, deflection_watches
from femflex.arrays import Array
from femflex.system import LengthTable
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics import Model
    from femflex.integrate import Block, IntegrationError


CLOSE = 0.05  # rad; angle left to the singularity of a rotation set below which a run warns of it
FASTEST = {"rad/s": 1e5, "m/s": 3e6}  # ten times what flywheels reach; a hundredth of the speed of light
STILL = 1e-12  # rad/s: rounding
STRETCH = 30.0  # frequency of a shape over the first from which on it is a stretch of a slender body, not a bend
FAR = 10.0  # elastic displacement over the body's size, or length at that time, beyond which the motion diverges


class MotionGuard:
    """Watches motion: stops a run whose rates or elastic displacements are beyond all craft, warns of large bends.

    An unstable or overloaded motion grows for long before its numbers overflow, with ever smaller steps; the model
    has lost its meaning long before.
    """

    def __init__(self, model: Model, known: KnownBodies | None = None, notes: Mapping[str, str] | None = None) -> None:
        self._model, self._notes = model, notes or {}
        units = [unit for _, unit in model.system.velocity_names()]
        self._names = [name for name, _ in model.system.velocity_names()]
        self._units = units
        self._fastest = np.array([FASTEST.get(unit, np.inf) for unit in units])
        self._bends = deflection_watches(model, known)

    def divergence(self, block: Block) -> IntegrationError | None:
        """The error that tells of the first row of a block that has run away, or of the state beyond it, if it has."""
        from femflex.integrate import Block, IntegrationError

        if not len(block.times) or block.t > block.times[-1]:
            states = np.concatenate([block.states.reshape(-1, len(block.x)), block.x[None]])
            block = Block(np.append(block.times, block.t), states, block.resume)
        if (error := self._too_fast(block)) is not None:
            return error
        for bend in self._bends:
            moved, size = bend.moved(block.states), self._sizes(bend, block)
            displaced = moved.max(axis=1)
            large = displaced > size  # there dependent shapes, of second order, may displace more
            if large.any():
                displaced[large] = np.maximum(displaced[large], bend.size * bend.over(block.states[large]))
            far = np.flatnonzero(displaced > FAR * size)
            if len(far):
                row = slice(far[0], far[0] + 1)
                k = int(np.argmax(moved[far[0]]))
                advice = self._advice(bend.name, k, block, far[0])
                text = (
                    f"the motion diverges: body {bend.name!r} is displaced by {displaced[far[0]]:.3g} m, over "
                    f"{FAR:g} times its size of {size[far[0]]:.3g} m. {self._cause(block, far[0], advice)}"
                )
                return IntegrationError(text, block.times[row], block.states[row], bend.at + k, block.steps)
        return None

    def _sizes(self, bend: DeflectionWatch, block: Block) -> Array:
        """Size (n_t,) of a body at the rows of a block [m]: of one that deploys, its length there."""
        variation = self._model.system.varying.get(bend.name)
        table = None if variation is None else variation.write
        if not isinstance(table, LengthTable):
            return np.full(len(block.times), bend.size)
        if isinstance(table.length, str):
            names = [name for name, _ in self._model.system.state_names()]
            return np.maximum(self._model.parts(block.states)[2][:, names.index(table.length)], table.bounds[0])
        return np.array([table.length(float(t))[0] for t in block.times])

    def _too_fast(self, block: Block) -> IntegrationError | None:
        from femflex.integrate import IntegrationError

        u = np.abs(self._model.parts(block.states)[1])
        over = np.flatnonzero((u > self._fastest).any(axis=1))
        if not len(over):
            return None
        row = slice(over[0], over[0] + 1)
        k = int(np.argmax(u[over[0]] / self._fastest))
        advice = "Check for a load that is too large or in a wrong unit, and for negative damping"
        text = (
            f"the motion diverges: {self._names[k]} is {u[over[0], k]:.3g} {self._units[k]}, beyond "
            f"{self._fastest[k]:g} {self._units[k]}, which no craft reaches. {self._cause(block, over[0], advice)}"
        )
        column = self._model.n_q + k
        return IntegrationError(text, block.times[row], block.states[row], column, block.steps)

    def _advice(self, name: str, shape: int, block: Block, row: int) -> str:
        """Where to look for what carried a body off in one of its shapes: a spin, a stretch, or a load that buckles."""
        seen = self._model.observe(block.times[row : row + 1], block.states[row : row + 1])
        rate = seen.get(f"bodies/{name}/rate", np.full((1, 3), np.nan))
        spin, omega = float(np.linalg.norm(rate)), self._model.system.bodies[name].omega
        first = float(np.nanmin(omega, initial=np.inf))
        own = float(omega[shape]) if shape < len(omega) else np.nan
        if not np.abs(rate).max() <= STILL:
            if own > STRETCH * first and spin < first:
                return (
                    f"Its shape {shape + 1} at {own / (2 * np.pi):.4g} Hz, {own / first:.3g} times the first, "
                    f"is a stretching mode, which bending excites. The body turns at {spin:.4g} rad/s, below its first "
                    f"frequency of {first:.4g} rad/s, so spin is not the cause. Remove that mode, or set "
                    "strain = 'condensed'"
                )
            return "Check for a spin above the lowest frequencies of the body, or an unstable attitude"
        return (
            "It does not turn. Check for a load in a wrong unit, and for buckling or snap-through: strain = "
            "'nonlinear' follows these (with `responses` in the reduction of a curved body)"
        )

    def _cause(self, block: Block, row: int, otherwise: str) -> str:
        """What the model says of a row that has run away, or else the advice given."""
        said = self._model.diagnosis(float(block.times[row]), block.states[row])[0]
        return f"{said[:1].upper()}{said[1:]}." if said else f"{otherwise}."

    def warn(self) -> None:
        """Warn of bodies that were bent by more than their strain is good for, with both numbers."""
        for bend in self._bends:
            bend.warn("was", self._notes.get(bend.name, ""))


def first_overflow(seen: Mapping[str, Array], block: Block) -> IntegrationError | None:
    """The error about the first row of a block with a channel that is not finite, or None. seen: channels (n_t, ...) in
    SI."""
    from femflex.integrate import IntegrationError

    finite = {path: np.isfinite(value).all(axis=tuple(range(1, value.ndim))) for path, value in seen.items()}
    bad = {path: int(np.argmin(rows)) for path, rows in finite.items() if not rows.all()}
    if not bad:
        return None
    path = min(bad, key=lambda name: bad[name])
    row = slice(bad[path], bad[path] + 1)
    text = f"{path} is not finite. Check for a load that is too large or in another unit."
    largest = int(np.abs(block.states[row]).argmax())
    return IntegrationError(text, block.times[row], block.states[row], largest, block.steps)


def warn_of_passage(model: Model) -> None:
    """Warn of loops that came close to losing the rank of their rows, with both numbers."""
    from femflex.dynamics.constraints.singular_passage import passage

    found = None if model.constraints is None else passage(model.constraints)
    if found is None or model.constraints is None:
        return
    names = ", ".join(model.constraints.kind_of(name) for name in model.constraints.names)
    how, many = "passed" if found.least <= found.lost else "came near", "a singular configuration"
    if found.count > 1:
        times = ", ".join(f"{t:.3g}" for t in found.first)
        many = f"at least {found.count} singular configurations, the first near t = {times} s"
    warnings.warn(
        f"{names} {how} {many}, closest at t = {found.t:.6g} s, where constraint rows become dependent and branches "
        f"of the motion meet (smallest pivot {found.least:.2g} of the largest; below {found.lost:.2g} the row is left "
        "out until it grows again). The run goes on along the same branch; a real mechanism may change it there.",
        PhysicsWarning,
        stacklevel=2,
    )


class Singularities:
    """Watches how near the rotation sets of joints come to their singularities, by steps and rows, and warns of it."""

    def __init__(self, model: Model) -> None:
        from femflex.dynamics.joints.channels import singularity_notes

        self._paths = [path for path in model.channels if path.startswith("joints/") and path.endswith("/singularity")]
        self._turning = {f"joints/{joint.label}/singularity" for joint in model.system.joints if joint.ball is None}
        self._notes, self._work = singularity_notes(model.system, model.table), model.work
        for note in self._notes.values():  # a trial of the integrator may have passed here before
            self._work[note] = np.inf
        self._least: dict[str, tuple[float, float]] = {}

    def watch(self, times: Array, channels: Mapping[str, Array]) -> None:
        """Record the smallest value of each channel (n_t,) over a block of times (n_t,) [s], and over the steps that
        led to it."""
        for path in self._paths:
            k = int(np.argmin(channels[path]))
            near = [self._least.get(path, (np.inf, 0.0)), (float(channels[path][k]), float(times[k]))]
            if path in self._notes:
                note = self._notes[path]
                near.append((float(self._work[note]), float(self._work[note + 1])))
            self._least[path] = min(near)

    def warn(self) -> None:
        """Warn of joints that came closer to their singularity than CLOSE, with both numbers."""
        for path, (least, t) in self._least.items():
            if least < CLOSE:
                name = path.removeprefix("joints/").removesuffix("/singularity")
                of, way = "the singularity of its rotation set", "Set rebase = true, or use Euler parameters."
                if path in self._turning:
                    of, way = "gimbal lock of its free turns", "Choose a sequence of turns that stays clear of it."
                warnings.warn(
                    f"joint {name!r} came within {least:.3g} rad of {of} at t = {t:.6g} s (below {CLOSE:g} rad "
                    f"coordinates turn fast, and steps are short for them alone). {way}",
                    PhysicsWarning,
                    stacklevel=2,
                )
