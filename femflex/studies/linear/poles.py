"""The poles of a linear model with their names and what takes part in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.studies.linear.linear_model import LinearModel
from femflex.studies.linear.space import StateSpace

ALIKE = 1e-3  # relative distance of a pole to the eigenvalue of a natural mode up to which it bears the mode's name
NEAR = 1e-4  # of the largest pole: poles of known rigid motion, double and defective, split by the root of rounding
SPLIT = 1e-7  # [1/s], of a craft without other poles
PART = 0.02  # share from which on a state is listed


@dataclass(frozen=True)
class Pole:
    """A pole [1/s], of a conjugate pair the one above the real axis.

    name           of the natural mode, such as "bending 1"; without one the state that takes part most
    rigid          whether it belongs to a motion that is known to neither grow nor decay
    participation  name of a state -> its share, of those that take part; they add up to 1 over all states
    """

    value: complex
    name: str
    rigid: bool
    participation: dict[str, float]

    @property
    def frequency(self) -> float:
        """[Hz]; 0 where it does not oscillate."""
        return float(self.value.imag / (2 * np.pi))

    @property
    def damping_ratio(self) -> float:
        """Part of critical; below 0 grows, 0 for known rigid motions."""
        return float(-self.value.real / abs(self.value)) if abs(self.value) > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Everything in plain numbers and text."""
        return {
            "real": self.value.real, "imag": self.value.imag, "name": self.name, "rigid": self.rigid,
            "frequency_hz": self.frequency, "damping_ratio": self.damping_ratio,
            "participation": self.participation,
        }  # fmt: skip


def poles_of(model: StateSpace) -> list[Pole]:
    """The poles of a model by rising size, those of rigid motion first.

    Participation of state k in pole i is |left_i k right_k i| over its sum over k; for rigid motions, whose poles are
    multiple and have no eigenvectors of their own, it is that of the squares of the displacements in the motion.
    """
    from scipy.linalg import eig

    # left vectors of their own, not the inverse of the right ones: that of a drift's double pole 0 does not exist
    values, left, right = (np.asarray(part, complex) for part in eig(model.A, left=True, right=True))
    rigid = np.zeros(len(values), bool)
    named: dict[int, str] = {}
    taking = np.abs(right * left)
    if isinstance(model, LinearModel):
        values, named, shapes = _with_known(values, right, model)
        rigid[list(named)] = True
        for k, shape in shapes.items():
            taking[:, k] = 0.0
            taking[: len(shape), k] = np.abs(shape) ** 2
    taking /= np.maximum(taking.sum(axis=0), 1e-300)
    order = [k for k in np.lexsort((np.abs(values), ~rigid)) if values[k].imag >= 0]
    return [_pole(model, complex(values[k]), named.get(k, ""), taking[:, k]) for k in order]


def _pole(model: StateSpace, value: complex, known: str, taking: Array) -> Pole:
    names = [name for name, _ in model.states]
    ranked = [int(k) for k in np.argsort(-np.round(taking, 6), kind="stable")]
    parts = {names[k]: float(taking[k]) for k in ranked if taking[k] >= PART}
    return Pole(value, known or _mode_name(model, value) or names[ranked[0]], bool(known), parts)


def _mode_name(model: StateSpace, value: complex) -> str:
    """The name of the natural mode that a pole belongs to, "" where there is none."""
    modes = model.modes if isinstance(model, LinearModel) else None
    if modes is None or not len(modes.eigenvalues):
        return ""
    apart = np.where(modes.known, np.inf, np.abs(np.asarray(modes.eigenvalues) - value))
    nearest = int(np.argmin(apart))
    return modes.names[nearest] if apart[nearest] <= ALIKE * abs(value) else ""


def _with_known(
    values: ComplexArray, right: ComplexArray, model: LinearModel
) -> tuple[ComplexArray, dict[int, str], dict[int, ComplexArray]]:
    """Eigenvalues with those of known rigid motion at what they are exactly; names and displacements of these by place.

    Displacements (n,) in the motion, of the model's coordinates.
    """
    wanted: list[complex] = []
    names: list[str] = []
    shapes: list[ComplexArray] = []
    order = [name for name, _ in model.model.system.velocity_names()]
    n = len(model.mass)
    own = [order.index(name) for name, _ in model.states[n : 2 * n]]
    for motion in () if model.modes is None else model.modes.about.motions.known:
        still = motion.eigenvalue == 0
        pair = [motion.eigenvalue] if still else [motion.eigenvalue, np.conj(motion.eigenvalue)]
        wanted += pair * (2 if still and motion.drifts else 1)  # across a spin two directions share two double poles
        names += [motion.name] * (len(wanted) - len(names))
        shapes += [motion.shape[own]] * (len(wanted) - len(shapes))
    if not wanted or not len(values):
        return values, {}, {}
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(np.array(wanted)[:, None] - values[None])
    near = max(NEAR * float(np.abs(values).max(initial=0.0)), SPLIT)
    there, fields = right[:n], np.array(shapes)
    like = np.abs(fields.conj() @ there) / np.maximum(
        np.linalg.norm(fields, axis=1)[:, None] * np.linalg.norm(there, axis=0), 1e-300
    )
    rows, columns = linear_sum_assignment(distance - near * like)
    held = distance[rows, columns] <= near
    exact = values.copy()
    exact[columns[held]] = np.array(wanted)[rows[held]]
    places = list(zip(columns[held].tolist(), rows[held].tolist(), strict=True))
    return exact, {c: names[r] for c, r in places}, {c: shapes[r] for c, r in places}
