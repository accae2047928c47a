"""A linear model in state space, with named states, inputs and outputs.

    x' = A x + B u,    y = C x + D u

x, u and y are departures from the values about which the model holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.extras import require
from femflex.noun.problems import suggestion_text

SLOW = 1e-6  # of the largest pole: slower ones are rigid-body motion
DECADES = 3.0  # above the slowest vibration, at most
POINTS = 1500  # over the whole range
AROUND = np.concatenate([-np.geomspace(30, 0.1, 12), [0.0], np.geomspace(0.1, 30, 12)])  # half widths of a resonance
LEAST = 1e-5  # damping ratio by which an undamped pole is passed
FEW = 40  # frequencies for which a Schur form does not pay
UNDAMPED = (
    "the model has an undamped pole near {omega:.6g} rad/s, where its response is infinite; omit this frequency, or "
    "give damping"
)


def response_grid(model: StateSpace) -> Array:
    """Frequencies (n,) [rad/s] from a tenth of the slowest vibration to three times the fastest.

    None of them is at an undamped pole.
    """
    poles = model.eigenvalues()
    size = np.abs(poles)
    moving = size[size > SLOW * size.max(initial=0.0)]
    low, high = (0.1 * moving.min(), 3.0 * moving.max()) if len(moving) else (0.1, 10.0)
    high = min(high, low * 10 ** (DECADES + 1))
    resonances = [
        p.imag + AROUND * max(-p.real, LEAST * abs(p)) for p in poles if p.imag > SLOW * size.max() and abs(p) <= high
    ]
    grid = np.unique(np.concatenate([np.geomspace(low, high, POINTS), *resonances]))
    grid = grid[(grid >= low) & (grid <= high)]
    undamped = poles[np.abs(poles.real) <= LEAST * np.abs(poles)]
    distance = np.abs(grid[:, None] - np.abs(undamped.imag)[None]).min(axis=1, initial=np.inf)
    return grid[distance > 0.05 * LEAST * grid]


@dataclass(frozen=True, eq=False)
class StateSpace:
    """A (n, n), B (n, n_in), C (n_out, n), D (n_out, n_in), and (name, unit) of every state, input and output.

    frames  name of an input or output -> axes of its component, as `Channel.frame`; nothing where it has no axes
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]
    frames: Mapping[str, str] = field(default_factory=dict, kw_only=True)

    def __post_init__(self) -> None:
        n, n_in, n_out = len(self.states), len(self.inputs), len(self.outputs)
        for key, shape in (("A", (n, n)), ("B", (n, n_in)), ("C", (n_out, n)), ("D", (n_out, n_in))):
            if getattr(self, key).shape != shape:
                raise ValueError(f"{key} of a linear model has the shape {getattr(self, key).shape}; expected {shape}")

    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues (n,) of A [1/s], by rising size."""
        values = np.asarray(np.linalg.eigvals(self.A), complex)
        return values[np.argsort(np.abs(values), kind="stable")]

    def frequency_response(self, omega: Array) -> ComplexArray:
        """G(i omega) = C (i omega I - A)^-1 B + D, (n_omega, n_out, n_in), at omega (n_omega,) [rad/s].

        Raises ValueError at an undamped pole, where there is none.
        """
        return resolvent_response(self.A, self.B, self.C, np.atleast_1d(np.asarray(omega, float))) + self.D

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> Self:
        """The model with only these inputs and outputs, in this order. Raises KeyError for unknown ones."""
        i, o = indices_of_names(inputs, self.inputs, "input"), indices_of_names(outputs, self.outputs, "output")
        return replace(
            self,
            B=self.B[:, i],
            C=self.C[o],
            D=self.D[np.ix_(o, i)],
            inputs=tuple(self.inputs[k] for k in i),
            outputs=tuple(self.outputs[k] for k in o),
        )

    def to_control(self) -> Any:
        """The model as a StateSpace of the package python-control. Raises MissingExtra."""
        require("control", "models of python-control")
        import control

        names = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        labels = {key: [name.replace(".", "_") for name, _ in pairs] for key, pairs in names.items()}
        return control.ss(self.A, self.B, self.C, self.D, **labels)


def indices_of_names(requested: Sequence[str] | None, pairs: Sequence[tuple[str, str]], kind: str) -> list[int]:
    """Indices of names among (name, unit) pairs; all of them if none are requested."""
    names = [name for name, _ in pairs]
    if requested is None:
        return list(range(len(names)))
    for name in requested:
        if name not in names:
            raise KeyError(f"the linear model has no {kind} {name!r}; {suggestion_text(name, names)}")
    return [names.index(name) for name in requested]


def resolvent_response(A: Array | ComplexArray, B: Array, C: Array, omega: Array) -> ComplexArray:
    """C (i w - A)^-1 B (n, n_out, n_in) at w (n,) [rad/s]. Raises ValueError at an undamped pole."""
    return resolvent(A, B, C, np.asarray(1j * omega, complex), lambda s: UNDAMPED.format(omega=s.imag))


def resolvent(
    A: Array | ComplexArray, B: Array, C: Array, points: ComplexArray, singular: Callable[[complex], str]
) -> ComplexArray:
    """C (s - A)^-1 B (n, n_out, n_in) at points s (n,), by a Schur form of the balanced A or, at a few, directly.

    Raises ValueError at an eigenvalue, with the text of `singular`.
    """
    from scipy.linalg import matrix_balance, schur

    if not len(A):
        return np.zeros((len(points), len(C), B.shape[1]), complex)
    if len(points) <= FEW:
        try:
            X = np.linalg.solve(points[:, None, None] * np.eye(len(A)) - A, B.astype(complex)[None])
        except np.linalg.LinAlgError:
            raise ValueError(singular(points[0])) from None
        return np.asarray(C @ X)
    balanced, (scale, order) = matrix_balance(A, permute=False, separate=True)
    T, U = schur(np.asarray(balanced, complex), output="complex")
    right, left = U.conj().T @ (B / scale[:, None])[order], (C * scale)[:, order] @ U
    n, X = len(A), np.empty((len(A), len(points), B.shape[1]), complex)
    for k in range(n - 1, -1, -1):
        pivot = points - T[k, k]
        if not pivot.all():
            raise ValueError(singular(points[np.argmin(np.abs(pivot))]))
        X[k] = (right[k] + np.tensordot(T[k, k + 1 :], X[k + 1 :], 1)) / pivot[:, None]
    return np.asarray(np.einsum("ok,kni->noi", left, X))
