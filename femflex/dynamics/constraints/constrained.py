"""Constraints of a compiled model: A and b for studies, multipliers and reactions, redundant rows, rows of the user."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.dynamics.constraints import projection as calls
from femflex.dynamics.joints.coordinates import kinematic
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraints import dependence_limit
from femflex.dynamics.layout.records import W_CIN, body_records, header_record
from femflex.dynamics.rate.rate import rate
from femflex.dynamics.workspace import ModelArrays, Workspace
from femflex.kernels.entries import plain_address
from femflex.system import System, VelocityRows

Function = Callable[[float, Array], tuple[Array, Array]]

STEP = 2e-3  # part of the time scale |q| / |qdot| over which the rates of A and b are taken
STENCIL = ((1, 45.0), (2, -9.0), (3, 1.0))  # central difference of sixth order, over 60 h
_numba: Any = numba  # its annotations do not cover what is used here
_REAL = ctypes.POINTER(ctypes.c_double)
_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, _REAL, _REAL, _REAL)


class Rows:
    """A user's function (t, q) -> A, b as compiled code calls it; keep it alive as long as its address is used."""

    def __init__(
        self, name: str, function: Function, n_rows: int, n_q: int, n_u: int, rates: Callable[[Array, Array], Array]
    ) -> None:
        self.name, self.function, self.rates = name, function, rates
        self.n_rows, self.n_q, self.n_u = n_rows, n_q, n_u
        self.error: Exception | None = None  # what the last call with a finite state raised
        self._callback = _PROTOTYPE(self._called)
        self.address = ctypes.cast(self._callback, ctypes.c_void_p).value or 0
        if _numba.config.DISABLE_JIT:
            self.address = plain_address(self.write)

    def checked(self, t: float, q: Array) -> tuple[Array, Array]:
        """Return A (n_rows, n_u) and b (n_rows,) at t and q; raise ValueError that names the fault in them."""
        A, b = (np.asarray(part, float) for part in self.function(t, q))
        if A.shape != (self.n_rows, self.n_u) or b.shape != (self.n_rows,):
            raise ValueError(
                f"the function of constraint {self.name!r} gave A of shape {A.shape} and b of shape {b.shape}; "
                f"expected ({self.n_rows}, {self.n_u}) and ({self.n_rows},)"
            )
        if not (np.isfinite(A).all() and np.isfinite(b).all()):
            row = int(np.argmin(np.isfinite(A).all(axis=1) & np.isfinite(b)))
            raise ValueError(
                f"the function of constraint {self.name!r} gave numbers that are not finite in row {row} at t = {t:.9g}"
                f" s: A = {A[row].tolist()}, b = {b[row]:g}"
            )
        return A, b

    def write(self, t: float, q: Array, u: Array, out: Array) -> None:
        """A, b, Adot u - bdot into out: rates along the motion by differences of sixth order."""
        q, u, n = q[: self.n_q].copy(), u[: self.n_u].copy(), self.n_rows * self.n_u
        A, b = self.checked(t, q)
        dq = self.rates(q, u)
        h = STEP * max(1.0, float(np.abs(q).max(initial=0.0))) / max(1.0, float(np.abs(dq).max(initial=0.0)))
        total = np.zeros(self.n_rows)
        for k, weight in STENCIL:
            for sign in (1.0, -1.0):
                A_k, b_k = self.checked(t + sign * k * h, q + sign * k * h * dq)
                total += sign * weight / (60.0 * h) * (A_k @ u - b_k)
        out[:n], out[n : n + self.n_rows], out[n + self.n_rows : n + 2 * self.n_rows] = A.ravel(), b, total

    def _called(self, t: float, q: Any, u: Any, out: Any) -> None:
        shape = np.ctypeslib.as_array
        values = shape(out, (self.n_rows * (self.n_u + 2),))
        q, u = shape(q, (self.n_q,)), shape(u, (self.n_u,))
        if not (np.isfinite(q).all() and np.isfinite(u).all()):  # of a trial that has failed already
            values[:] = np.nan
            return
        try:
            self.write(t, q, u, values)
            self.error = None
        except Exception as error:
            self.error = error
            values[:] = np.nan


@dataclass(frozen=True, eq=False)
class Constraints:
    """Loops and nonholonomic constraints of a compiled system.

    workspace  the arrays of the model's calls
    users  functions of general rows, kept alive
    """

    system: System
    workspace: Workspace
    n_q: int
    n_u: int
    users: tuple[Rows, ...] = ()

    @property
    def arrays(self) -> ModelArrays:
        """Table, pool and work of the calling thread."""
        return self.workspace.arrays

    @cached_property
    def closing(self) -> np.void:
        """The CLOSING record."""
        record: np.void = layout.closing_record(self.workspace.table)[0]
        return record

    @cached_property
    def records(self) -> NDArray[np.void]:
        """The CONSTRAINT records."""
        return layout.constraint_records(self.workspace.table)

    @property
    def n_rows(self) -> int:
        """Number of constraint rows."""
        return int(self.closing["n_rows"])

    @property
    def names(self) -> list[str]:
        """Names of loops, then of nonholonomic constraints."""
        return [loop.label for loop in self.system.loops] + [c.name for c in self.system.constraints]

    @property
    def paths(self) -> list[str]:
        """The same with the folder of their channels in front."""
        loops = [f"loops/{loop.label}" for loop in self.system.loops]
        return loops + [f"constraints/{c.name}" for c in self.system.constraints]

    def rows_of(self, name: str) -> slice:
        """The rows of the constraint of that name."""
        record = self.records[self.names.index(name)]
        return slice(int(record["first"]), int(record["first"] + record["n_rows"]))

    def rows(self) -> Array:
        """Return the rows of the last call, (n_rows, ROW_SIZE); see constraint_layout."""
        first = int(self.closing["rows"])
        return self.arrays[2][first : first + layout.ROW_SIZE * self.n_rows].reshape(self.n_rows, layout.ROW_SIZE)

    def residuals(self, t: float, x: Array) -> tuple[Array, Array]:
        """Position residual g (n_rows,), zero where a row has none, and velocity residual A u - b (n_rows,)."""
        self._call_project(layout.TASK_MEASURE, t, x)
        rows = self.rows()
        return rows[:, layout.R_GAP].copy(), rows[:, layout.R_SPEED].copy()

    def matrix(self, t: float, x: Array) -> Array:
        """A of A u = b, (n_rows, n_u)."""
        x_rest = np.array(x, float)
        x_rest[self.n_q : self.n_q + self.n_u] = 0.0
        bias = self.residuals(t, x_rest)[1]
        columns = []
        for k in range(self.n_u):
            x_unit = x_rest.copy()
            x_unit[self.n_q + k] = 1.0
            columns.append(self.residuals(t, x_unit)[1] - bias)
        return np.column_stack(columns)

    def smallest_change(self, t: float, x: Array, targets: Array) -> tuple[Array, int]:
        """The smallest v (n_u,) by the mass matrix with A v = targets, and the rank of A."""
        self.rows()[:, layout.R_TARGET] = targets
        self._call_project(layout.TASK_NEAREST, t, x)
        step = int(self.closing["step"])
        return self.arrays[2][step : step + self.n_u].copy(), self.rank()

    def rank(self) -> int:
        """Number of rows that did not depend on others when they were last solved."""
        m = self.n_rows
        return int(self.arrays[2][int(self.closing["small"]) + 3 * m * m + 2 * m])

    def redundant(self, t: float, x: Array) -> int:
        """Return the number of rows at x that depend on the others; their multipliers are the smallest that suffice."""
        return self.n_rows - self.smallest_change(t, x, np.zeros(self.n_rows))[1]

    def text(self, t: float, x: Array) -> str:
        """Return a sentence on the number of rows and of redundant ones at x."""
        redundant, rows = self.redundant(t, x), "row" if self.n_rows == 1 else "rows"
        if redundant == 0:
            return f"{self.n_rows} constraint {rows}, none redundant."
        are = "is" if redundant == 1 else "are"
        return (
            f"{self.n_rows} constraint {rows}, of which {redundant} {are} redundant; of all possible reactions the "
            "smallest are given."
        )

    def solved(self, times: Array, states: Array) -> tuple[Array, Array, Array, Array]:
        """The constrained motion at times (n_t,) and states (n_t, n_x).

        udot (n_t, n_u), rows (n_t, n_rows, ROW_SIZE) with their multipliers, rank (n_t,), and C_iN of every body
        (n_t, n_bodies, 3, 3).
        """
        n_t, work = len(times), self.arrays[2]
        udot, rows, rank = np.empty((n_t, self.n_u)), np.empty((n_t, self.n_rows, layout.ROW_SIZE)), np.empty(n_t)
        positions = [int(b["work"]) + W_CIN for b in body_records(self.arrays[0])]
        turns, dx = np.empty((n_t, len(positions), 3, 3)), np.empty(states.shape[1])
        for j in range(n_t):
            rate(float(times[j]), np.ascontiguousarray(states[j], float), dx, *self.arrays)
            self._raise_errors()
            udot[j], rows[j], rank[j] = dx[self.n_q : self.n_q + self.n_u], self.rows(), self.rank()
            turns[j] = [work[offset : offset + 9].reshape(3, 3) for offset in positions]
        return udot, rows, rank, turns

    def forces(self, times: Array, states: Array) -> dict[str, Array]:
        """-A^T lambda (n_t, n_u) of every loop and constraint by its path, at times (n_t,) and states (n_t, n_x)."""
        _, rows, _, _ = self.solved(times, states)
        out = {path: np.empty((len(times), self.n_u)) for path in self.paths}
        for j in range(len(times)):
            A = self.matrix(float(times[j]), states[j])
            for path, name in zip(self.paths, self.names, strict=True):
                rows_of_name = self.rows_of(name)
                out[path][j] = -A[rows_of_name].T @ rows[j, rows_of_name, layout.R_LAMBDA]
        return out

    @cached_property
    def dependence_limit(self) -> float:
        """Return the part of the longest row below which a row's rest depends on the rows before it (at the start)."""
        return dependence_limit(self.system)

    @cached_property
    def row_plays(self) -> Array:
        """Return the residual that each row may keep (n_rows,): its loop's play [m], over the body size for angles."""
        out = np.zeros(self.n_rows)
        for loop in self.system.loops:
            out[self.rows_of(loop.label)] = loop.play
        return out / self.row_lengths

    @cached_property
    def row_lengths(self) -> Array:
        """Return the factors that turn the position residual of every row into metres, (n_rows,)."""
        out = np.ones(self.n_rows)
        size = self.arrays[1][int(self.closing["tolerance"]) + 1]
        for record in self.records:
            if record["kind"] == layout.CONSTRAINT_LOOP:
                out[int(record["first"] + record["n_slides"]) : int(record["first"] + record["n_rows"])] = size
        return out

    @contextmanager
    def pushed(self) -> Iterator[None]:
        """Let the residual count the forces of constraints, with the multipliers that were solved for last."""
        work, task = self.arrays[2], int(self.closing["task"])
        work[task] = layout.TASK_PUSH
        try:
            yield
        finally:
            work[task] = layout.TASK_PROJECT

    def _call_project(self, task: int, t: float, x: Array) -> None:
        """Call `project` for less than a projection. Raises ValueError for a state without its z."""
        size = self.n_q + self.n_u + int(header_record(self.arrays[0])["n_z"])
        if len(x) < size:  # compiled code would read beyond its end
            raise ValueError(f"a state of this model has {size} numbers (q, u, z); found {len(x)}")
        task_index, work = int(self.closing["task"]), self.arrays[2]
        work[task_index] = task
        try:
            calls.project(float(t), np.array(x, float), *self.arrays)
        finally:
            work[task_index] = layout.TASK_PROJECT
        self._raise_errors()

    def _raise_errors(self) -> None:
        """Raise the exception of a user's function that failed in the last compiled call."""
        if (failed := self.failed_user()) is not None:
            raise failed[1]

    def failed_user(self) -> tuple[str, Exception] | None:
        """Name of the constraint whose function raised an exception in its last call, and that exception."""
        for rows in self.users:
            if rows.error is not None:
                error, rows.error = rows.error, None
                return rows.name, error
        return None

    def reset_passage_notes(self) -> None:
        """Clear the notes of singular configurations passed along a run (see `singular_passage`)."""
        note = int(self.closing["note"])
        self.arrays[2][note + layout.N_RANK : note + layout.NOTE_SIZE] = 0.0
        self.arrays[2][note + layout.N_LEAST] = 1.0

    def kind_of(self, name: str) -> str:
        """The constraint of that name as sentences call it, such as "loop 'closure'"."""
        return f"{'loop' if name in [loop.label for loop in self.system.loops] else 'constraint'} {name!r}"

    def name_of_row(self, row: int) -> str:
        """The constraint that a row belongs to."""
        return next(name for name in self.names if self.rows_of(name).start <= row < self.rows_of(name).stop)


def build_constraints(system: System, workspace: Workspace, n_q: int, n_u: int) -> Constraints:
    """The constraints of a lowered system, addresses of the functions of its rows filled in."""
    header_record(workspace.table)["constrain"] = calls.constrain.address
    records, users = layout.constraint_records(workspace.table), []

    def rates(q: Array, u: Array) -> Array:
        dq = np.empty(n_q)
        kinematic(0.0, np.ascontiguousarray(q), np.ascontiguousarray(u), dq, *workspace.arrays)
        return dq

    for record, c in zip(records[len(system.loops) :], system.constraints, strict=True):
        if isinstance(c, VelocityRows):
            users.append(Rows(c.name, c.function, c.n_rows, n_q, n_u, rates))
            record["function"] = users[-1].address
    return Constraints(system, workspace, n_q, n_u, tuple(users))
