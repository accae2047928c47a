"""The interface between beams and their sections, outlines, and dimensions that vary along a member.

Axes: y and z of the section, x along the beam; I_y = int z^2 dA bends in the x-z plane, I_z = int y^2 dA in x-y. The
origin is the centroid, the axes are principal, and the shear centre is taken to lie at the centroid.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from femflex.arrays import Array, IntArray
from femflex.fem.formula import formula
from femflex.fem.sections.materials import Material
from femflex.noun.table import Table
from femflex.noun.values import AlongMember

WITH_UNIT = r"\s*[-+0-9.eE]+\s*[a-zA-Z][^*(+]*"  # a number with a unit, such as "3 mm" or "2e6 N/m^2"; no formula
ROUND_SIDES = 24  # sides of the polygon that draws a round section
Variation = float | str | Sequence[ArrayLike] | Array  # a number, a formula of s and L, or a table (s, values)


@dataclass(frozen=True, eq=False)
class Resultants:
    """Stiffness and mass of a section at stations along a member; every field has the stations' shape.

    EA, GJ, EIy, EIz  axial [N], torsional and bending stiffness [N m^2] (EIy for x-z, EIz for x-y)
    mass              mass per length [kg/m]
    ry2, rz2          squared radii of gyration of the mass, int z^2 dm and int y^2 dm per mass [m^2]
    polar2            polar radius squared I_p / A of the stiff area, for the shortening by twist [m^2]
    GAy, GAz          shear stiffness along y and z, shear factors included [N]; None: unknown
    coupled           (..., 6, 6) full stiffness over (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z); None: none
    centre            (..., 2) y and z of the mass centre from the node line [m]; None: on it
    product           int y z dm per mass, about the mass centre [m^2]; None: none
    """

    EA: Array
    GJ: Array
    EIy: Array
    EIz: Array
    mass: Array
    ry2: Array
    rz2: Array
    polar2: Array
    GAy: Array | None = None
    GAz: Array | None = None
    coupled: Array | None = None
    centre: Array | None = None
    product: Array | None = None


@dataclass(frozen=True, eq=False)
class Outline:
    """Polygon (..., k, 2) of y, z, counterclockwise seen from +x, and triangles (m, 3) of its corners that fill it."""

    points: Array
    triangles: IntArray


class Section(Protocol):
    """A beam section as beams use it, at arc lengths s (any shape) of a member of arc length `length`."""

    @property
    def varies(self) -> bool:
        """Whether anything changes along the member."""

    def resultants(self, material: Material | None, s: Array, length: Array) -> Resultants:
        """Stiffness and mass per length; shapes and units of `Resultants`."""

    def outline(self, s: Array, length: Array) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s (...) [m], for pictures."""


Along = float | str | tuple[tuple[float, ...], tuple[float, ...]]
LengthAlong = Annotated[Along, AlongMember("m")]
AreaAlong = Annotated[Along, AlongMember("m^2")]
SecondMomentAlong = Annotated[Along, AlongMember("m^4")]
RigidityAlong = Annotated[Along, AlongMember("N m^2")]
ForceAlong = Annotated[Along, AlongMember("N")]
MassAlong = Annotated[Along, AlongMember("kg/m")]


class Dimensioned(Table):
    """A section whose keys, `kind` aside, are its dimensions.

    In Python a dimension may also be a formula of s and L as a text, or a table (s, values).
    """

    @classmethod
    def from_python(cls, keys: dict[str, Any]) -> dict[str, Any]:
        """The keys with formulas and tables as case files have them."""
        return {key: value if key == "kind" else _along_member(value) for key, value in keys.items()}

    @property
    def given_dimensions(self) -> dict[str, Along]:
        """The dimensions that are given."""
        values = {name: getattr(self, name) for name in type(self).model_fields if name != "kind"}
        return {name: value for name, value in values.items() if value is not None}

    @property
    def varies(self) -> bool:
        """Whether any dimension changes along the member."""
        return any(varies(value) for value in self.given_dimensions.values())

    def dimensions(self, s: Array, length: Array | float, pointed: bool = False) -> dict[str, Array]:
        """Every dimension (...) [m] at the stations; ValueError where one is not positive (pointed: where one is
        negative)."""
        values_of_dimensions = {}
        for name, variation in self.given_dimensions.items():
            try:
                values = evaluate_variation(variation, s, length)
            except ValueError as error:
                raise ValueError(f"{name} of {type(self).__name__}: {error}") from None
            if not ((values >= 0).all() if pointed else (values > 0).all()):
                position = np.argmin(values)
                raise ValueError(
                    f"{name} of {type(self).__name__} is {values.flat[position]:.6g} at s = {s.flat[position]:.6g} "
                    "m; it must be positive along the whole member"
                )
            values_of_dimensions[name] = values
        return values_of_dimensions


def _along_member(value: Any) -> Any:
    if isinstance(value, str) and not re.fullmatch(WITH_UNIT, value):
        return {"formula": value}
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        return dict(zip(("s", "values"), value, strict=True))
    return value


def polygon(y: Array, z: Array) -> Outline:
    """Outline of the convex polygon with corners y, z (..., k) [m], counterclockwise."""
    k = y.shape[-1]
    corners = np.arange(1, k - 1)
    return Outline(np.stack([y, z], axis=-1), np.stack([0 * corners, corners, corners + 1], axis=1))


def ellipse(a: Array, b: Array) -> Outline:
    """Outline of ellipses with semi-axes a along y and b along z (...) [m]."""
    angle = 2 * np.pi * np.arange(ROUND_SIDES) / ROUND_SIDES
    return polygon(a[..., None] * np.cos(angle), b[..., None] * np.sin(angle))


def varies(value: Variation) -> bool:
    """Whether the quantity is a table or a formula rather than a number."""
    return not isinstance(value, (int, float, np.number))


def evaluate_variation(value: Variation, s: Array, length: Array | float) -> Array:
    """The quantity at arc lengths s [m] of a member whose whole arc length is `length` [m], in the shape of s.

    A table (s, values) is interpolated by a monotone cubic (PCHIP): through its points, C1, without overshoot, linear
    between two points; error O(h^3) for smooth data, O(h^2) at its extrema. A formula is
    arithmetic of s, L (the whole arc length) and pi (see `femflex.fem.formula`).
    Raises ValueError on a formula or table that is not understood, is short of s, or is not finite.
    """
    if isinstance(value, str):
        values = formula(value, s, length)
    elif isinstance(value, (int, float, np.number)):
        values = np.asarray(value, float)
    else:
        values = interpolate_table(value, s)
    values = np.broadcast_to(values, s.shape)
    bad = ~np.isfinite(values)
    if bad.any():
        position, bad_value = s[bad].flat[0], values[bad].flat[0]
        raise ValueError(f"{value!r} is {bad_value} at s = {position:.6g} m; it must be finite along the whole member")
    return values


def interpolate_table(rows: Sequence[ArrayLike] | Array, s: Array) -> Array:
    """Values (...) at s (...) [m] of a table (s, values) by monotone cubic interpolation."""
    if len(rows) != 2 or np.shape(rows[0]) != np.shape(rows[1]) or np.ndim(rows[0]) != 1 or np.size(rows[0]) < 2:
        raise ValueError(f"a table along a member is (s, values), two rows of equal length, at least 2; got {rows!r}")
    s_table, values = np.asarray(rows[0], float), np.asarray(rows[1], float)
    if not (np.isfinite(s_table).all() and np.isfinite(values).all()):
        raise ValueError(
            f"a table along a member holds numbers that are not finite: s {s_table.tolist()}, {values.tolist()}"
        )
    if not (np.diff(s_table) > 0).all():
        raise ValueError(f"arc lengths of a table along a member must increase; got {s_table.tolist()} m")
    slack = 1e-9 * (s_table[-1] - s_table[0])
    if s.min() < s_table[0] - slack or s.max() > s_table[-1] + slack:
        raise ValueError(
            f"a table covers s = {s_table[0]:g} to {s_table[-1]:g} m, but the member is used from {s.min():.6g} to "
            f"{s.max():.6g} m; extend the table over the whole arc length"
        )
    return np.asarray(PchipInterpolator(s_table, values)(np.clip(s, s_table[0], s_table[-1])), float)
