"""Deploying members as bodies of a system: a FlexibleBody at the first length, and its Variation along a profile."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody
from femflex.deployment.line import DeployingLine, LineFunctions, Strain, line_parts
from femflex.deployment.table import variation_of
from femflex.system import Profile, Variation
from femflex.warning import PhysicsWarning

Array = NDArray[np.float64]

SAMPLES = 2001  # of a profile between its breaks, to find its least and largest length
SOFTENED = 0.02  # change of bending stiffness by axial inertia from which linear strain is warned of
BUCKLING = 7.837  # of m' |A| L^3 / EI, at which a cantilever under its own distributed load buckles


def deploying_line(
    line: DeployingLine,
    functions: LineFunctions | None,
    length: Profile,
    *,
    stock: float | None = None,
    until: float = 0.0,
    reference: float | None = None,
    strain: Strain = "condensed",
    damping: float | Sequence[float] = 0.0,
    drum: Literal["root", "tip"] = "root",
    drum_radius: float | None = None,
    markers: Mapping[str, float] | None = None,
) -> tuple[FlexibleBody, Variation]:
    """A beam or tether that deploys along a profile of its length: its body at t = 0, and how that varies.

    functions    admissible functions on xi = x / L (`BeamFunctions`, `StringFunctions`, ...); None: it stays straight
    length       L(t) [m]
    stock        length of the whole member [m]; its mass stays constant. None: the largest length up to `until`
    reference    length at which coordinates are mass-normalised [m]; None: the first one
    until        last time of the run [s]; the length is checked up to it
    strain       "condensed", or "linear" without what axial forces and inertia do to bending
    damping      fraction of critical damping, one or one for each coordinate
    drum         "root": material is drawn out of the parent; "tip": it is laid out from the tip
    drum_radius  [m], for the torque of the drum
    markers      name -> distance from the exit over the length, beside "root" and "tip"

    Raises ValueError for a length that reaches zero or exceeds the stock.
    """
    least, most, first = length_range(length, until)
    whole = max(most, first) if stock is None else stock
    check_length(least, most, whole)
    for name, xi in (markers or {}).items():
        if not 0.0 <= xi <= 1.0:
            raise ValueError(
                f"marker {name!r} stands at {xi:g} times the deployed length, which is still stowed or beyond the tip; "
                "give a number from 0 (exit) to 1 (tip)"
            )
    parts, _ = line_parts(
        line, functions, reference or first, line.mass_per_length * whole, strain, damping, drum == "tip", markers
    )
    if strain == "linear":
        _warn_of_linear_strain(line, length, until)
    body = parts.body(first)
    variation = variation_of(
        parts, body, length, stock=whole, drum_radius=drum_radius, at_tip=drum == "tip", bounds=(least, most)
    )
    return body, variation


def length_range(length: Profile, until: float) -> tuple[float, float, float]:
    """Least and largest length from t = 0 to `until`, and that at t = 0 [m].

    Raises ValueError where the profile is not known over this time.
    """
    knots = np.unique(np.concatenate([[0.0, until], length.breaks[(length.breaks > 0) & (length.breaks < until)]]))
    times = np.unique(
        np.concatenate([np.linspace(a, b, SAMPLES) for a, b in itertools.pairwise(knots)] or [np.zeros(1)])
    )
    values = length(times)[0]
    if not np.isfinite(values).all():
        raise ValueError(
            f"the length of a deploying member is known from {length.first:g} s to {length.last:g} s, and needed from "
            f"0 to {until:g} s; give the rest of its profile"
        )
    return float(values.min()), float(values.max()), float(values[0])


def check_length(least: float, most: float, stock: float) -> None:
    """Raise ValueError for a length that is not between zero and the stock."""
    if not least > 0.0:
        raise ValueError(
            f"the deployed length falls to {least:g} m; it must stay above zero: start from, and stop at, a short "
            "length"
        )
    if most > stock * (1.0 + 1e-12):
        raise ValueError(
            f"the deployed length grows to {most:g} m, and the stock is {stock:g} m; give a longer stock or a shorter "
            "length"
        )


def _warn_of_linear_strain(line: DeployingLine, length: Profile, until: float) -> None:
    """Warn where an accelerating deployment changes the bending stiffness that linear strain keeps."""
    EI = min((value for value in (line.EIy, line.EIz) if value > 0), default=0.0)
    times = np.linspace(0.0, until, SAMPLES)
    L, _, acceleration = length(times)
    load = line.mass_per_length * np.abs(acceleration) * L**3
    worst = float(np.nanmax(load))
    if worst > SOFTENED * BUCKLING * EI:
        warnings.warn(
            f"a deploying member with linear strain: its axial acceleration, up to {np.abs(acceleration).max():.3g} "
            f"m/s^2, reaches {worst / (BUCKLING * EI) if EI else np.inf:.2g} of the load that buckles it, and is left "
            f"out above {SOFTENED:g}; take strain = 'condensed'",
            PhysicsWarning,
            stacklevel=3,
        )
