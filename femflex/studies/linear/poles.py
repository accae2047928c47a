"""Poles of a linear model with names and participating states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from femflex.arrays import Array, ComplexArray
from femflex.studies.linear.linear_model import LinearModel
from femflex.studies.linear.space import StateSpace

ALIKE = 1e-3  # relative distance of a pole to the eigenvalue of a natural mode up to which it has the mode's name
NEAR = 1e-4  # of the largest pole: double defective poles of rigid motion split by the square root of rounding
SPLIT = 1e-7  # [1/s], of a craft without other poles
LISTED = 0.02  # share from which on a state is listed


@dataclass(frozen=True)
class Pole:
    """A pole [1/s]; of a conjugate pair the one above the real axis.

    name           of the natural mode, such as "bending 1"; otherwise the state with the largest share
    rigid          whether it belongs to a rigid motion, which neither grows nor decays
    participation  name of a state -> its share, if above 0.02; the shares of all states sum to 1
    """

    value: complex
    name: str
    rigid: bool
    participation: dict[str, float]

    @property
    def frequency(self) -> float:
        """Frequency [Hz]; 0 where the motion does not oscillate."""
        return float(self.value.imag / (2 * np.pi))

    @property
    def damping_ratio(self) -> float:
        """Damping ratio; negative for growth, 0 for rigid motions."""
        return float(-self.value.real / abs(self.value)) if abs(self.value) > 0 else 0.0


def poles_of(model: StateSpace) -> list[Pole]:
    """The poles of a model by rising size, those of rigid motion first.

    Participation of state k in pole i is |left_i k right_k i| over its sum over k; for rigid motions, whose poles are
    multiple and have no eigenvectors of their own, it is that of the squares of the displacements in the motion.
    """
    from scipy.linalg import eig

    # left vectors from the solver: the matrix of right ones is singular for a drift's double pole 0
    values, left, right = (np.asarray(matrix, complex) for matrix in eig(model.A, left=True, right=True))
    rigid = np.zeros(len(values), bool)
    rigid_names: dict[int, str] = {}
    shares = np.abs(right * left)
    if isinstance(model, LinearModel):
        values, rigid_names, shapes = _with_exact_rigid_poles(values, right, model)
        rigid[list(rigid_names)] = True
        for k, shape in shapes.items():
            shares[:, k] = 0.0
            shares[: len(shape), k] = np.abs(shape) ** 2
    shares /= np.maximum(shares.sum(axis=0), 1e-300)
    order = [k for k in np.lexsort((np.abs(values), ~rigid)) if values[k].imag >= 0]
    return [_pole(model, complex(values[k]), rigid_names.get(k, ""), shares[:, k]) for k in order]


def _pole(model: StateSpace, value: complex, rigid_name: str, shares: Array) -> Pole:
    names = [name for name, _ in model.states]
    ranked = [int(k) for k in np.argsort(-np.round(shares, 6), kind="stable")]
    listed_shares = {names[k]: float(shares[k]) for k in ranked if shares[k] >= LISTED}
    return Pole(value, rigid_name or _mode_name(model, value) or names[ranked[0]], bool(rigid_name), listed_shares)


def _mode_name(model: StateSpace, value: complex) -> str:
    """The name of the natural mode that a pole belongs to, "" where there is none."""
    modes = model.modes if isinstance(model, LinearModel) else None
    if modes is None or not len(modes.eigenvalues):
        return ""
    distance = np.where(modes.known, np.inf, np.abs(np.asarray(modes.eigenvalues) - value))
    nearest = int(np.argmin(distance))
    return modes.names[nearest] if distance[nearest] <= ALIKE * abs(value) else ""


def _with_exact_rigid_poles(
    values: ComplexArray, right: ComplexArray, model: LinearModel
) -> tuple[ComplexArray, dict[int, str], dict[int, ComplexArray]]:
    """Eigenvalues with exact values for known rigid motions; names and displacements of these by index.

    Displacements (n,) in the motion, of the model's coordinates.
    """
    exact_values: list[complex] = []
    names: list[str] = []
    shapes: list[ComplexArray] = []
    order = [name for name, _ in model.model.system.velocity_names()]
    n = len(model.mass)
    coordinates = [order.index(name) for name, _ in model.states[n : 2 * n]]
    for motion in () if model.modes is None else model.modes.about.motions.known:
        is_zero = motion.eigenvalue == 0
        pair = [motion.eigenvalue] if is_zero else [motion.eigenvalue, np.conj(motion.eigenvalue)]
        exact_values += pair * (
            2 if is_zero and motion.drifts else 1
        )  # two directions normal to a spin share two double poles
        names += [motion.name] * (len(exact_values) - len(names))
        shapes += [motion.shape[coordinates]] * (len(exact_values) - len(shapes))
    if not exact_values or not len(values):
        return values, {}, {}

    distance = np.abs(np.array(exact_values)[:, None] - values[None])
    tolerance = max(NEAR * float(np.abs(values).max(initial=0.0)), SPLIT)
    displacements, fields = right[:n], np.array(shapes)
    likeness = np.abs(fields.conj() @ displacements) / np.maximum(
        np.linalg.norm(fields, axis=1)[:, None] * np.linalg.norm(displacements, axis=0), 1e-300
    )
    rows, columns = linear_sum_assignment(distance - tolerance * likeness)
    matched = distance[rows, columns] <= tolerance
    exact = values.copy()
    exact[columns[matched]] = np.array(exact_values)[rows[matched]]
    pairs = list(zip(columns[matched].tolist(), rows[matched].tolist(), strict=True))
    return exact, {c: names[r] for c, r in pairs}, {c: shapes[r] for c, r in pairs}
