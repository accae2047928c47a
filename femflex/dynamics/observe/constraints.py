"""Loops and constraints: residuals, independent rows, multipliers, reactions; contact points of discs and edges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.observe.markers import marker_motion
from femflex.dynamics.observe.row import XYZ
from femflex.dynamics.report import Observation, Report
from femflex.system import Channel, KnifeEdge, RollingDisc, System, VelocityRows
from femflex.system.loop import closure


class ConstraintForces(Report):
    """Monitors of all rows; per loop, then per constraint its reaction, of a general one its multipliers."""

    def channels(self, system: System) -> dict[str, Channel]:
        if not (system.loops or system.constraints):
            return {}
        out = {
            "monitors/constraint_position": Channel("m", "largest gap of the loops, angles times the bodies' size"),
            "monitors/constraint_velocity": Channel("m/s", "largest velocity residual (rad/s in rows of angles)"),
            "monitors/constraint_rank": Channel("1", "number of independent constraint rows"),
        }
        for loop in system.loops:
            turns = len(closure(loop).pairs) > 0
            out |= reaction_channels(f"loops/{loop.label}", loop.child, loop.child_marker, turns)
        for c in system.constraints:
            path = f"constraints/{c.name}"
            if c.body is None:
                out[f"{path}/multipliers"] = Channel("1", "multipliers lambda of A^T lambda", (c.n_rows,))
            else:
                out |= reaction_channels(path, c.body, c.marker, isinstance(c, RollingDisc))
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        constraints = seen.model.constraints
        assert constraints is not None
        _, rows, rank, turns = constraints.solved(seen.times, seen.states)
        yield np.abs(rows[:, :, layout.R_GAP] * constraints.row_lengths).max(axis=1)
        yield np.abs(rows[:, :, layout.R_SPEED]).max(axis=1)
        yield rank
        for name, record in zip(constraints.names, constraints.records, strict=True):
            rows_of_name = rows[:, constraints.rows_of(name)]
            multipliers = rows_of_name[:, :, layout.R_LAMBDA]
            if record["kind"] == layout.CONSTRAINT_GENERAL:
                yield multipliers
                continue
            C_iN = turns[:, int(record["child"])]
            for first in (layout.R_FQ, layout.R_TQ):
                yield np.einsum("tk,tkj,tji->ti", multipliers, rows_of_name[:, :, first : first + 3], C_iN)


def reaction_channels(path: str, body: str, marker: str, turns: bool) -> dict[str, Channel]:
    """Channels of the reaction of one loop or constraint on a body; turns: whether it can exert a torque."""
    torque = f"its torque on {body} about {body}.{marker}"
    return {
        f"{path}/force": Channel("N", f"force of the constraint on {body}", (3,), XYZ, "inertial"),
        f"{path}/torque": Channel("N m", torque, (3,), XYZ, "inertial", turns),
    }


class Contacts(Report):
    """Places of contact: the edge's marker, or the lowest point of a disc.

    A disc with axis a over a plane with normal n touches at its centre less R (n - a (a.n)) / |n - a (a.n)|.
    """

    def channels(self, system: System) -> dict[str, Channel]:
        text = "where {} touches, from the inertial origin (from O in an orbit)"
        return {
            f"constraints/{c.name}/place": Channel("m", text.format(c.body), (3,), XYZ, "inertial")
            for c in touching(system)
        }

    def observe(self, seen: Observation) -> Iterator[Array]:
        for c in touching(seen.system):
            point, C_NQ = marker_motion(seen.system, seen.times, seen, c.body, c.marker)
            if isinstance(c, RollingDisc):
                C_NP = marker_motion(seen.system, seen.times, seen, c.parent, c.parent_marker)[1]
                axis, normal = C_NQ @ c.axis, C_NP @ c.normal
                up = normal - axis * np.einsum("ti,ti->t", axis, normal)[:, None]
                point = point - c.radius * up / np.linalg.norm(up, axis=1, keepdims=True)
            yield point


def touching(system: System) -> list[RollingDisc | KnifeEdge]:
    """The constraints that have a place of contact."""
    return [c for c in system.constraints if not isinstance(c, VelocityRows)]
