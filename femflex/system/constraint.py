"""Nonholonomic constraints A(q) u = b(t): a disc that rolls on a plane, a knife edge, and rows that the user writes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array

Rows = Callable[[float, Array], tuple[Array, Array]]  # (t, q) -> A (n_rows, n_u), b (n_rows,)

ROWS_OF = {"rolling_disc": 3, "knife_edge": 1}


@dataclass(frozen=True, eq=False)
class Nonholonomic:
    """A constraint on velocities; made by rolling_disc, knife_edge or velocity_rows.

    body, marker            what rolls or slides: marker Q, at the disc's centre or on the edge
    parent, parent_marker   marker P of what carries the plane; None: the base frame
    axis    (3,)  disc: its axis, components of Q;  edge: the direction across the blade, components of Q
    normal  (3,)  disc: normal of the plane through P, components of P, on the disc's side
    radius        of the disc [m]
    function, n_rows   of the general form: (t, q) -> A (n_rows, n_u), b (n_rows,)
    """

    name: str
    kind: str
    body: str | None = None
    marker: str = "origin"
    parent: str | None = None
    parent_marker: str = "origin"
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    normal: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    radius: float = 0.0
    function: Rows | None = None
    n_rows: int = 0

    def __post_init__(self) -> None:
        for key in ("axis", "normal"):
            value = np.asarray(getattr(self, key), float)
            length = np.linalg.norm(value)
            if value.shape != (3,) or not np.isfinite(length) or length == 0.0:
                raise ValueError(f"{key} of constraint {self.name!r} has no direction: {value.tolist()}")
            object.__setattr__(self, key, value / length)
        if self.kind == "rolling_disc" and not self.radius > 0.0:
            raise ValueError(f"radius of constraint {self.name!r} is {self.radius} m; a disc needs a positive radius")
        if self.kind in ROWS_OF:
            object.__setattr__(self, "n_rows", ROWS_OF[self.kind])
        elif self.n_rows < 1:
            raise ValueError(f"constraint {self.name!r} has {self.n_rows} rows; give at least one")


def rolling_disc(name: str, body: str, radius: float, **where: object) -> Nonholonomic:
    """A sharp-edged disc of that radius [m] that rolls without slip on the plane through marker P."""
    return Nonholonomic(name, "rolling_disc", body, radius=radius, **where)  # type: ignore[arg-type]


def knife_edge(name: str, body: str, across: object, **where: object) -> Nonholonomic:
    """A blade at marker Q that does not move in the direction `across` (3,), components of Q."""
    return Nonholonomic(name, "knife_edge", body, axis=np.asarray(across, float), **where)  # type: ignore[arg-type]


def velocity_rows(name: str, n_rows: int, function: Rows) -> Nonholonomic:
    """The general form A(q) u = b(t): function(t, q) gives A (n_rows, n_u) and b (n_rows,).

    u is that of System.velocity_names(). The function is called from Python several times per step, which takes some
    ten microseconds each; A and b must be smooth, for their rates along the motion are taken by differences.
    """
    return Nonholonomic(name, "rows", function=function, n_rows=n_rows)
