"""Beams and tethers that deploy: straight members on functions of xi = x / L, drawn out of a drum along their axis."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal, Protocol, Self

import numpy as np
from pydantic import StrictBool, model_validator

from femflex.arrays import Array
from femflex.deployment.series import Series
from femflex.deployment.shapes import Drawing, MemberShapes, ShapeFunctions, quadrilateral_grid, without_rounding
from femflex.fem.line.chain import section_points, straight_frame
from femflex.noun.table import Table, exactly_one
from femflex.noun.values import Direction, Position, PositiveLength, Quantity
from femflex.reduction.beams.beam_functions import axial_characteristic, polynomials
from femflex.reduction.beams.beam_strain import pairs, weighted_square
from femflex.reduction.strain.tensors import packed_quartic

SIDES = 12  # of the tube that is drawn
STRING_ENDS = {"free": 0, "held": 1}


class LineFunctions(ShapeFunctions, Protocol):
    """Functions of the four fields u, v, w, theta of a straight member over 0 <= xi <= 1."""

    def fields(self, xi: Array, length: float, derivative: int = 0) -> Array:
        """Derivative by x (n_xi, 4, n) of u, v, w [m] and theta [rad] at x = xi length, xi (n_xi,) [1]."""


@dataclass(frozen=True)
class StringFunctions:
    """Functions of a member without bending stiffness, which turns freely where it leaves the drum.

    y, z, axial  how many for v(x), w(x), u(x)
    tip          "free", or "held" on the line of the member by the body at its end
    family       "polynomial": xi times Jacobi polynomials, the first is a straight turn about the exit (of a free tip);
                 "characteristic": sines
    straight     whether the straight turn is among them; False where a joint turns the member instead
    """

    y: int = 0
    z: int = 0
    axial: int = 0
    tip: Literal["free", "held"] = "free"
    family: Literal["polynomial", "characteristic"] = "polynomial"
    straight: bool = True

    def __post_init__(self) -> None:
        if min(self.y, self.z, self.axial) < 0 or not (self.y or self.z or self.axial):
            raise ValueError(
                f"numbers of string functions (y, z, axial) are {(self.y, self.z, self.axial)}; give at least one, "
                "and none negative"
            )
        if self.tip not in STRING_ENDS:
            raise ValueError(f"the tip of a string is {self.tip!r}; it is one of {sorted(STRING_ENDS)}")

    @property
    def count(self) -> int:
        """Number of functions."""
        return self.y + self.z + self.axial

    @property
    def max_count(self) -> int:
        """The largest number of functions of one field."""
        return max(self.y, self.z, self.axial) + 1

    def fields(self, xi: Array, length: float, derivative: int = 0) -> Array:
        """Derivative by x (n_xi, 4, n) of u, v, w [m] and theta [rad] at x = xi length, xi (n_xi,) [1]."""
        values, first = np.zeros((len(xi), 4, self.count)), 0
        for row, n in ((1, self.y), (2, self.z), (0, self.axial)):
            if n:
                values[:, row, first : first + n] = self._field(row, n, xi, derivative) / length**derivative
            first += n
        return values

    def _field(self, row: int, n: int, xi: Array, derivative: int) -> Array:
        fixed_tip = row > 0 and self.tip == "held"
        skipped = int(row > 0 and not self.straight and not fixed_tip)
        if self.family == "polynomial":
            return polynomials(1, int(fixed_tip), n + skipped, rigid=1)(xi, derivative)[:, skipped:]
        ends = "clamped-clamped" if fixed_tip else "clamped-free"
        return axial_characteristic(ends, n)(xi, derivative)


Stiffness = Annotated[float, Quantity("N m^2", least=0.0)]
Gyration = Annotated[float, Quantity("m", least=0.0)]


class DeployingMember(Table):
    """A straight uniform member stored on a drum, from which it comes out along its axis."""

    mass_per_length: Annotated[float, Quantity("kg/m", above=0.0)] = None  # type: ignore[assignment]
    """Mass per length. Give this or `mass`."""
    tension: Annotated[float, Quantity("N", least=0.0)] = 0.0
    """Axial force at the tip that supports outside the member hold up, such as booms on both sides of a blanket."""
    root: Position = (0.0, 0.0, 0.0)
    """Position of the exit in the body frame."""
    direction: Direction = (1.0, 0.0, 0.0)
    """Direction of the member from the exit to the tip, in the body frame."""
    orientation: Direction | None = None
    """Direction near the section's y axis; of plates and membranes across the width. Default: chosen automatically."""

    @model_validator(mode="after")
    def _keys_fit(self) -> Self:
        exactly_one(self, ("mass_per_length",))
        return self

    @property
    def frame(self) -> Array:
        """Member axes in the body frame, rows x, y, z (3, 3)."""
        return straight_frame(self.root, self.direction, self.orientation)


class DeployingLine(DeployingMember):
    """A straight beam or tether of one section."""

    EA: Annotated[float, Quantity("N", least=0.0)] = 0.0
    """Axial stiffness; needed with axial functions."""
    EIy: Stiffness = 0.0
    """Bending stiffness in the x-z plane."""
    EIz: Stiffness = 0.0
    """Bending stiffness in the x-y plane."""
    GJ: Stiffness = 0.0
    """Torsional stiffness; needed with torsion functions."""
    ry: Gyration = 0.0
    """Radius of gyration of the section's mass about y: root of int z^2 dm over the mass."""
    rz: Gyration = 0.0
    """Radius of gyration of the section's mass about z: root of int y^2 dm over the mass."""
    rotary_inertia: StrictBool = False
    """Rotary inertia of the sections in bending."""
    radius: PositiveLength | None = None
    """Radius of the tube that is drawn. Default: a line."""

    @property
    def sections(self) -> tuple[Array, Array]:
        """Offsets (k, 3) [m] of points of a section, member axes, and their shares of its mass (k,)."""
        if not (self.ry or self.rz):
            return np.zeros((1, 3)), np.ones(1)
        return section_points(np.array(self.rz**2), np.array(self.ry**2), self.rotary_inertia)


@dataclass(frozen=True, eq=False)
class LineShapes(MemberShapes):
    """The shapes of a deploying line."""

    line: DeployingLine = field(kw_only=True)

    @property
    def axes(self) -> DeployingLine:
        """The line itself."""
        return self.line

    @property
    def member_mass(self) -> float:
        """Mass of the reference length [kg]."""
        return self.line.mass_per_length * self.reference

    @property
    def section(self) -> tuple[Array, Array]:
        """Offsets (m, 3) of points of a section, member axes, and their shares of its mass (m,)."""
        return self.line.sections

    @property
    def thickness(self) -> float:
        """Radius of the tube that is drawn [m]; 0 for a line."""
        return self.line.radius or 0.0

    @property
    def half_width(self) -> None:
        """None: its drum is as wide as thick."""
        return None

    def fields(self, xi: Array, derivative: int) -> Array:
        """Derivative (n_xi, 4, n) by xi of u, v, w [m] and theta [rad] per coordinate."""
        if self.functions is None:
            return np.zeros((len(xi), 4, 0))
        functions = self.functions
        return without_rounding(lambda x: functions.fields(x, 1.0, derivative) @ self.X, xi)

    def slopes(self, xi: Array) -> tuple[Array, Array]:
        """Slopes (n_xi, 2, n) [m] by xi of v and w, and the weight (2,) [1] of each."""
        return self.fields(xi, 1)[:, 1:3], np.ones(2)

    def turns(self, xi: Array) -> Array:
        """Twist, -dw/dx and dv/dx (k, 3, n) [rad per coordinate] of the columns at xi and the reference length."""
        value, slope = self.fields(xi, 0), self.fields(xi, 1) / self.reference
        return np.stack([value[:, 3], -slope[:, 2], slope[:, 1]], axis=1)

    def matrices(self, xi: Array, weight: Array) -> tuple[Array, Series]:
        """Mass matrix (n, n) [kg] at the reference length, and V1 (n, n) [N/m] as a series in lambda, over the
        functions."""
        line, L, mass = self.line, self.reference, self.member_mass
        assert self.functions is not None
        value, slope, bend = (self.functions.fields(xi, 1.0, d) for d in range(3))

        def integral(f: Array, row: int) -> Array:
            return np.asarray((f[:, row] * weight[:, None]).T @ f[:, row])

        offsets, share = line.sections
        polar = float(share @ (offsets[:, 1] ** 2 + offsets[:, 2] ** 2))
        M = mass * (sum(integral(value, row) for row in range(3)) + polar * integral(value, 3))
        if line.rotary_inertia:
            M = M + mass / L**2 * (line.rz**2 * integral(slope, 1) + line.ry**2 * integral(slope, 2))
        V1: Series = {
            -3: (line.EIz * integral(bend, 1) + line.EIy * integral(bend, 2)) / L**3,
            -1: (line.EA * integral(slope, 0) + line.GJ * integral(slope, 3)) / L
            + line.tension * (integral(slope, 1) + integral(slope, 2)) / L,
        }
        return M, V1

    def quartic(self, xi: Array, weight: Array) -> Series:
        """Packed V3 (k,) [SI] of the curvature of large bends over the columns, as a series in lambda.

        Where the axis keeps its length, V_4 = 1/2 int (a + b) (EIz a + EIy b) dx with a = v' v'', b = w' w'', as of
        other condensed beams (`femflex.reduction.beams.beam_strain.inextensible`). weight (q,): factors on the bending
        stiffness included.
        """
        line, slope, bend = self.line, self.fields(xi, 1), self.fields(xi, 2)
        a, b = (pairs(slope[:, row : row + 1], bend[:, row : row + 1]) for row in (1, 2))
        mean = (line.EIy + line.EIz) / 2
        parts = ((a + b, mean), (a, line.EIz - mean), (b, line.EIy - mean))
        total = sum((weighted_square(part, weight * EI) for part, EI in parts), np.zeros((a.shape[1],) * 2))
        return {-5: packed_quartic(total, self.n) / self.reference**5}

    def displacements(self, xi: Array, offsets: Array, derivative: int) -> Series:
        """Shapes of the columns at offsets (m, 3), member axes, or their derivative by xi: p -> (k, m, 3, n)."""
        u, v, w, theta = self.fields(xi, derivative).transpose(1, 0, 2)[:, :, None]  # k 1 n
        steep = self.fields(xi, derivative + 1)[:, None] / self.reference
        dv, dw = steep[:, :, 1], steep[:, :, 2]
        x, y, z = (offsets[:, i, None] for i in range(3))
        zeros = np.zeros((len(xi), len(offsets), self.n))
        return {
            0: np.stack([zeros + u, zeros + v - z * theta, zeros + w + y * theta], axis=2),
            -1: np.stack([zeros - y * dv - z * dw, zeros + x * dv, zeros + x * dw], axis=2),
        }

    def drawing(self) -> Drawing:
        """A line, or a tube of the line's radius."""
        xi = np.linspace(0.0, 1.0, 1 + 4 * max(5, self.max_count))
        if self.line.radius is None:
            lines = np.stack([np.arange(len(xi) - 1), np.arange(1, len(xi))], axis=1)
            return Drawing(xi, np.zeros((1, 3)), {"line": lines})
        angle = np.arange(SIDES) * 2 * np.pi / SIDES
        offsets = self.line.radius * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
        return Drawing(xi, offsets, {"quad": quadrilateral_grid(len(xi), SIDES, closed=True)})
