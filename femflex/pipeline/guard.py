"""Monitors of a run: divergence, and angles near a singularity."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.deflections import DeflectionWatch, deflection_watches
from femflex.advice.limits import (
    DIVERGENCE_RATIO,
    LARGEST_RATES,
    LARGEST_SLIDE,
    SINGULARITY_DISTANCE,
    STRETCHING_RATIO,
    ZERO_RATE,
)
from femflex.arrays import Array
from femflex.dynamics.joints.places import joint_places
from femflex.rotations import dcm_from_quaternion
from femflex.system import LengthTable
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics import Model
    from femflex.integrate import Block, IntegrationError


class MotionGuard:
    """Finds rates, slides and elastic displacements beyond those of any craft, so that the run can be stopped.

    An unstable or overloaded motion grows for a long time, with ever smaller steps, before its numbers overflow.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        units = [unit for _, unit in model.system.velocity_names()]
        self._names = [name for name, _ in model.system.velocity_names()]
        self._units = units
        self._fastest = np.array([LARGEST_RATES.get(unit, np.inf) for unit in units])
        self._slides = [
            (joint, iq + k)
            for joint, iq, _ in joint_places(model.system)
            for k in range(len(joint.translations) if joint.parent is not None else 0)
        ]
        self._deflections = deflection_watches(model)

    def divergence(self, block: Block) -> IntegrationError | None:
        """The error about the first row of a block, or about the state at its end, that diverges; None if none does."""
        from femflex.integrate import Block, IntegrationError

        if not len(block.times) or block.t > block.times[-1]:
            states = np.concatenate([block.states.reshape(-1, len(block.x)), block.x[None]])
            block = Block(np.append(block.times, block.t), states, block.resume)
        if (error := self._rate_error(block) or self._slide_error(block)) is not None:
            return error
        for watch in self._deflections:
            shape_displacements, size = watch.shape_displacements(block.states), self._sizes(watch, block)
            displaced = shape_displacements.max(axis=1)
            large = displaced > size  # dependent shapes, of second order, may add to these
            if large.any():
                displaced[large] = np.maximum(
                    displaced[large], watch.size * watch.relative_displacements(block.states[large])
                )
            rows = np.flatnonzero(displaced > DIVERGENCE_RATIO * size)
            if len(rows):
                row = slice(rows[0], rows[0] + 1)
                k = int(np.argmax(shape_displacements[rows[0]]))
                advice = self._divergence_advice(watch.name, k, block, rows[0])
                text = (
                    f"the motion diverges: body {watch.name!r} is displaced by {displaced[rows[0]]:.3g} m, over "
                    f"{DIVERGENCE_RATIO:g} times its size of {size[rows[0]]:.3g} m. "
                    f"{self._cause_text(block, rows[0], advice)}"
                )
                return IntegrationError(
                    text, block.times[row], block.states[row], watch.first_coordinate + k, block.steps
                )
        return None

    def _sizes(self, watch: DeflectionWatch, block: Block) -> Array:
        """Size (n_t,) [m] of a body at the rows of a block; its length for a body that deploys."""
        variation = self._model.system.varying.get(watch.name)
        table = None if variation is None else variation.write
        if not isinstance(table, LengthTable):
            return np.full(len(block.times), watch.size)
        if isinstance(table.length, str):
            names = [name for name, _ in self._model.system.state_names()]
            return np.maximum(self._model.parts(block.states)[2][:, names.index(table.length)], table.bounds[0])
        return np.array([table.length(float(t))[0] for t in block.times])

    def _rate_error(self, block: Block) -> IntegrationError | None:
        from femflex.integrate import IntegrationError

        u = np.abs(self._model.parts(block.states)[1])
        rows = np.flatnonzero((u > self._fastest).any(axis=1))
        if not len(rows):
            return None
        row = slice(rows[0], rows[0] + 1)
        k = int(np.argmax(u[rows[0]] / self._fastest))
        advice = "Check for a load that is too large or in a wrong unit, and for negative damping"
        text = (
            f"the motion diverges: {self._names[k]} is {u[rows[0], k]:.3g} {self._units[k]}, beyond "
            f"{self._fastest[k]:g} {self._units[k]}, which no craft reaches. {self._cause_text(block, rows[0], advice)}"
        )
        column = self._model.n_q + k
        return IntegrationError(text, block.times[row], block.states[row], column, block.steps)

    def _slide_error(self, block: Block) -> IntegrationError | None:
        from femflex.integrate import IntegrationError

        slides = np.abs(block.states[:, [k for _, k in self._slides]])
        rows = np.flatnonzero((slides > LARGEST_SLIDE).any(axis=1))
        if not len(rows):
            return None
        row, worst = slice(rows[0], rows[0] + 1), int(np.argmax(slides[rows[0]]))
        joint, column = self._slides[worst]
        text = (
            f"the motion diverges: body {joint.child!r} is {slides[rows[0], worst]:.3g} m from {joint.parent!r} along "
            f"joint {joint.label!r}, beyond {LARGEST_SLIDE:g} m. Check for a load in a wrong unit; a spring or a stop "
            "limits the slide."
        )
        return IntegrationError(text, block.times[row], block.states[row], column, block.steps)

    def _divergence_advice(self, name: str, shape: int, block: Block, row: int) -> str:
        """Advice on the cause of a divergence in one shape of a body: spin, a stretching mode, or buckling."""
        channels = self._model.observe(block.times[row : row + 1], block.states[row : row + 1])
        rate = channels.get(f"bodies/{name}/rate", np.zeros((1, 3)))
        spin, omega = float(np.linalg.norm(rate)), self._model.system.bodies[name].omega
        first = float(np.nanmin(omega, initial=np.inf))
        shape_frequency = float(omega[shape]) if shape < len(omega) else np.nan
        if not np.abs(rate).max() <= ZERO_RATE:
            if shape_frequency > STRETCHING_RATIO * first and spin < first:
                return (
                    f"Its shape {shape + 1} at {shape_frequency / (2 * np.pi):.4g} Hz, {shape_frequency / first:.3g} "
                    "times the first, "
                    f"is a stretching mode, which bending excites. The body turns at {spin:.4g} rad/s, below its first "
                    f"frequency of {first:.4g} rad/s, so spin is not the cause. Remove that mode, or set "
                    "strain = 'condensed'"
                )
            return "Check for a spin above the lowest frequencies of the body, or an unstable attitude"
        return (
            "It does not turn. Check for a load in a wrong unit, and for buckling or snap-through: strain = "
            "'nonlinear' follows these (with `responses` in the reduction of a curved body)"
        )

    def _cause_text(self, block: Block, row: int, advice: str) -> str:
        """The model's diagnosis of a diverging row as a sentence; the advice where there is no diagnosis."""
        diagnosis = self._model.diagnosis(float(block.times[row]), block.states[row])[0]
        return f"{diagnosis[:1].upper()}{diagnosis[1:]}." if diagnosis else f"{advice}."


def first_fault(model: Model, channels: Mapping[str, Array], block: Block) -> IntegrationError | None:
    """The error about the first row of a block with a channel that is not finite, or below the ground; or None.

    channels: (n_t, ...) in SI
    """
    faults = [_overflow(channels, block), _impact(model, channels, block)]
    return min((fault for fault in faults if fault is not None), key=lambda fault: fault.t, default=None)


def _impact(model: Model, channels: Mapping[str, Array], block: Block) -> IntegrationError | None:
    """The error about the first row in which the root body of a craft on a free orbit is inside the central body."""
    from femflex.integrate import IntegrationError

    system, radius = model.system, model.system.environment.radius
    if (
        (orbit := system.orbit) is None
        or not orbit.free
        or orbit.semi_major_axis * (1.0 - orbit.eccentricity) <= radius
    ):
        return None
    position = channels[f"bodies/{system.root}/position"]
    vertical = dcm_from_quaternion(channels["orbit/attitude"])[:, :, 1]
    distance = np.linalg.norm(channels["orbit/radius"][:, None] * vertical + position, axis=1)
    rows = np.flatnonzero(distance < radius)
    if not len(rows):
        return None
    row = slice(rows[0], rows[0] + 1)
    text = (
        f"the craft falls to the ground: body {system.root!r} is {distance[rows[0]] / 1e3:.6g} km from the centre of a "
        f"body with a radius of {radius / 1e3:.6g} km. Run a shorter time, or raise the orbit."
    )
    return IntegrationError(text, block.times[row], block.states[row], 0, block.steps)


def _overflow(channels: Mapping[str, Array], block: Block) -> IntegrationError | None:
    """The error about the first row of a block with a channel that is not finite, or None."""
    from femflex.integrate import IntegrationError

    finite = {path: np.isfinite(value).all(axis=tuple(range(1, value.ndim))) for path, value in channels.items()}
    first_rows = {path: int(np.argmin(rows)) for path, rows in finite.items() if not rows.all()}
    if not first_rows:
        return None
    path = min(first_rows, key=lambda name: first_rows[name])
    row = slice(first_rows[path], first_rows[path] + 1)
    text = f"{path} is not finite. Check for a load that is too large or in another unit."
    largest = int(np.abs(block.states[row]).argmax())
    return IntegrationError(text, block.times[row], block.states[row], largest, block.steps)


def warn_of_passage(model: Model) -> None:
    """Warn of loops that came close to a singular configuration, with both numbers."""
    from femflex.dynamics.constraints.singular_passage import passage

    passages = None if model.constraints is None else passage(model.constraints)
    if passages is None or model.constraints is None:
        return
    names = ", ".join(model.constraints.kind_of(name) for name in model.constraints.names)
    verb, what = "passed" if passages.least <= passages.lost else "came near", "a singular configuration"
    if passages.count > 1:
        times = ", ".join(f"{t:.3g}" for t in passages.first)
        what = f"at least {passages.count} singular configurations, the first near t = {times} s"
    warnings.warn(
        f"{names} {verb} {what}, closest at t = {passages.t:.6g} s, where constraint rows become dependent and "
        "branches "
        f"of the motion meet (smallest pivot {passages.least:.2g} of the largest; below {passages.lost:.2g} the row "
        "is left "
        "out until it grows again). The run goes on along the same branch; a real mechanism may change it there.",
        PhysicsWarning,
        stacklevel=2,
    )


class Singularities:
    """Watches the distance of the rotation sets of joints to their singularities, and warns where it is small."""

    def __init__(self, model: Model) -> None:
        from femflex.dynamics.joints.places import singularity_notes

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
            candidates = [self._least.get(path, (np.inf, 0.0)), (float(channels[path][k]), float(times[k]))]
            if path in self._notes:
                note = self._notes[path]
                candidates.append((float(self._work[note]), float(self._work[note + 1])))
            self._least[path] = min(candidates)

    def warn(self) -> None:
        """Warn of joints that came closer to their singularity than SINGULARITY_DISTANCE, with both numbers."""
        for path, (least, t) in self._least.items():
            if least < SINGULARITY_DISTANCE:
                name = path.removeprefix("joints/").removesuffix("/singularity")
                singularity, remedy = (
                    "the singularity of its rotation set",
                    "Set rebase = true, or use Euler parameters.",
                )
                if path in self._turning:
                    singularity, remedy = (
                        "gimbal lock of its free turns",
                        "Choose a sequence of turns that stays clear of it.",
                    )
                warnings.warn(
                    f"joint {name!r} came within {least:.3g} rad of {singularity} at t = {t:.6g} s (below "
                    f"{SINGULARITY_DISTANCE:g} rad its coordinates change fast and require short steps). {remedy}",
                    PhysicsWarning,
                    stacklevel=2,
                )
