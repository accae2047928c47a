"""What constraints add to a compiled model: its calls, A and b for studies, channels, and which rows are redundant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics import constraints as calls
from femflex.dynamics.constraint_layout import constraint_records
from femflex.dynamics.user import Rows
from femflex.system import Channel, Joint, Nonholonomic, System

Array = NDArray[np.float64]
Own = tuple[NDArray[np.int64], Array, Array]

XYZ = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Constraints:
    """Loops and nonholonomic constraints of a compiled system.

    own    table, pool and work of the model
    first  first row of each constraint, and the number of rows after the last
    users  functions of general rows, kept alive
    """

    system: System
    own: Own
    n_q: int
    n_u: int
    first: tuple[int, ...]
    users: tuple[Rows, ...] = ()

    @property
    def n_rows(self) -> int:
        """Number of constraint rows."""
        return self.first[-1]

    @property
    def names(self) -> list[str]:
        """Names of loops, then of nonholonomic constraints."""
        return [loop.label for loop in self.system.loops] + [c.name for c in self.system.constraints]

    def rows_of(self, name: str) -> slice:
        """The rows of the constraint of that name."""
        i = self.names.index(name)
        return slice(self.first[i], self.first[i + 1])

    def residuals(self, t: float, x: Array) -> tuple[Array, Array]:
        """Position residual g (n_rows,), zero where a row has none, and velocity residual A u - b (n_rows,)."""
        out = np.empty((self.n_rows, 2))
        calls.residuals(float(t), np.ascontiguousarray(x, float), out, *self.own)
        self.raise_errors()
        return out[:, 0], out[:, 1]

    def matrix(self, t: float, x: Array) -> Array:
        """A of A u = b, (n_rows, n_u)."""
        still = np.array(x, float)
        still[self.n_q :] = 0.0
        rest = self.residuals(t, still)[1]
        columns = []
        for k in range(self.n_u):
            moved = still.copy()
            moved[self.n_q + k] = 1.0
            columns.append(self.residuals(t, moved)[1] - rest)
        return np.column_stack(columns)

    def nearest(self, t: float, x: Array, targets: Array) -> tuple[Array, int]:
        """The smallest v (n_u,) by the mass matrix with A v = targets, and the rank of A."""
        out = np.empty(self.n_u)
        given = np.ascontiguousarray(targets, float)
        rank = calls.nearest(float(t), np.ascontiguousarray(x, float), given, out, *self.own)
        return out, int(rank)

    def redundant(self, t: float, x: Array) -> int:
        """Number of rows that follow from the others at x; their multipliers are the smallest that hold the motion."""
        return self.n_rows - self.nearest(t, x, np.zeros(self.n_rows))[1]

    def told(self, t: float, x: Array) -> str:
        """A sentence on the number of rows and how many of them are redundant at x."""
        redundant = self.redundant(t, x)
        if redundant == 0:
            return f"{self.n_rows} constraint rows, none redundant."
        return (
            f"{self.n_rows} constraint rows, of which {redundant} follow from the others; reactions are the smallest "
            "that hold the motion."
        )

    def raise_errors(self) -> None:
        """Raise what a user's function raised when compiled code called it."""
        for rows in self.users:
            if rows.error is not None:
                error, rows.error = rows.error, None
                raise error

    def observe(self, times: Array, states: Array) -> dict[str, Array]:
        """Channels of residuals, rank, multipliers and reactions at times (n_t,) and states (n_t, n_x)."""
        from femflex.dynamics import reactions as seen

        at = seen.ROW_FIRST + self.n_rows
        rows = np.empty((len(times), at + 6 * len(self.names)))
        seen.observe(times, states, rows, *self.own)
        out = {
            "monitors/constraint_position": rows[:, seen.ROW_POSITION],
            "monitors/constraint_velocity": rows[:, seen.ROW_VELOCITY],
            "monitors/constraint_rank": rows[:, seen.ROW_RANK],
        }
        known = channels(self.system)
        for i, path in enumerate(paths(self.system)):
            values = rows[:, seen.ROW_FIRST + self.first[i] : seen.ROW_FIRST + self.first[i + 1]]
            if path + "/multipliers" in known:
                out[path + "/multipliers"] = values
            else:
                out[path + "/force"] = rows[:, at + 6 * i : at + 6 * i + 3]
                out[path + "/torque"] = rows[:, at + 6 * i + 3 : at + 6 * i + 6]
        return out


def paths(system: System) -> list[str]:
    """Folder of each constraint's channels in the result file."""
    return [f"loops/{loop.label}" for loop in system.loops] + [f"constraints/{c.name}" for c in system.constraints]


def channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of what constraints report; nothing for a system without any."""
    given: list[Joint | Nonholonomic] = [*system.loops, *system.constraints]
    if not given:
        return {}
    out = {
        "monitors/constraint_position": Channel("m", "largest gap of the loops, angles times the bodies' size"),
        "monitors/constraint_velocity": Channel("m/s", "largest velocity residual (rad/s in rows of angles)"),
        "monitors/constraint_rank": Channel("1", "constraint rows that do not follow from others"),
    }
    for path, constraint in zip(paths(system), given, strict=True):
        if not isinstance(constraint, Joint) and constraint.body is None:
            out[f"{path}/multipliers"] = Channel("1", "multipliers lambda of A^T lambda", (constraint.n_rows,))
            continue
        body, marker = (
            (constraint.child, constraint.child_marker)
            if isinstance(constraint, Joint)
            else (constraint.body, constraint.marker)
        )
        out |= {
            f"{path}/force": Channel("N", f"force of the constraint on {body}", (3,), XYZ, "inertial"),
            f"{path}/torque": Channel("N m", f"its torque on {body} about {body}.{marker}", (3,), XYZ, "inertial"),
        }
    return out


def constraints_of_system(system: System, own: Own, n_q: int, n_u: int, kinematic: Any) -> Constraints:
    """The constraints of a lowered system, addresses of user functions filled in."""
    records, users = constraint_records(own[0]), []

    def rates(q: Array, u: Array) -> Array:
        dq = np.empty(n_q)
        kinematic(0.0, np.ascontiguousarray(q), np.ascontiguousarray(u), dq, *own)
        return dq

    for record, c in zip(records[len(system.loops) :], system.constraints, strict=True):
        if c.function is not None:
            users.append(Rows(c.name, c.function, c.n_rows, n_q, n_u, rates))
            record["function"] = users[-1].address
    first = (*(int(r["first"]) for r in records), int(records[-1]["first"] + records[-1]["n_rows"]))
    return Constraints(system, own, n_q, n_u, first, tuple(users))
