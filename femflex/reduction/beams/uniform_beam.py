"""A straight uniform beam, and the admissible functions its four fields may use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import SkipValidation, StrictBool, model_validator

from femflex.arrays import Array, BoolArray
from femflex.fem.line.chain import straight_frame
from femflex.noun.table import Table, exactly_one
from femflex.noun.values import MOST_FUNCTIONS, Count, Direction, Mass, Position, PositiveLength, Quantity
from femflex.reduction.beams.beam_functions import (
    STATIC_AXIAL,
    STATIC_BENDING,
    TIP_AXIAL,
    TIP_BENDING,
    FunctionSet,
    axial_characteristic,
    bending_characteristic,
    ends_of,
    polynomials,
    with_static,
)

BENDING_ORDER = {"free": 0, "pinned": 1, "clamped": 2}  # derivatives, from the value on, that vanish at an end


def constant_factor(xi: Array) -> Array:
    """1 at every xi (k,) [1]."""
    return np.ones_like(xi)


@dataclass(frozen=True)
class Taper:
    """The variation of a beam's section along xi = x / length: factors (k,) on mass, bending and axial stiffness.

    The torsional stiffness varies as the bending stiffness; radii of gyration are constant.
    """

    mass: Callable[[Array], Array] = constant_factor
    bending: Callable[[Array], Array] = constant_factor
    axial: Callable[[Array], Array] = constant_factor


class UniformBeam(Table):
    """A straight uniform Euler–Bernoulli beam."""

    length: PositiveLength
    """Length of the beam."""
    EA: Annotated[float, Quantity("N", above=0.0)]
    """Axial stiffness."""
    EIy: Annotated[float, Quantity("N m^2", above=0.0)]
    """Bending stiffness in the x-z plane."""
    EIz: Annotated[float, Quantity("N m^2", above=0.0)]
    """Bending stiffness in the x-y plane."""
    GJ: Annotated[float, Quantity("N m^2", above=0.0)]
    """Torsional stiffness."""
    mass_per_length: Annotated[float, Quantity("kg/m", above=0.0)] = None  # type: ignore[assignment]
    """Mass per length, in place of mass."""
    ry: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Radius of gyration of the section's mass about y: root of int z^2 dm over the mass."""
    rz: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Radius of gyration of the section's mass about z: root of int y^2 dm over the mass."""
    rotary_inertia: StrictBool = True
    """Rotary inertia of the sections in bending."""
    root: Position = (0.0, 0.0, 0.0)
    """Position of the beam's root in the body frame."""
    direction: Direction = (1.0, 0.0, 0.0)
    """Direction of the beam from root to tip, in the body frame."""
    orientation: Direction | None = None
    """Direction near the section's y axis. Default: chosen automatically."""
    bounded_energy: StrictBool | None = None
    """Nonlinear strain energy that stays bounded where a flat section bends far about its weak axis and twists. The
    price: a strip tips over late in its stiff plane, by the fraction 1 / (2 EIy / EIz). Default: true."""
    radius: PositiveLength | None = None
    """Radius of the tube that is drawn. Default: a line."""
    mass: Mass | None = None
    """Mass of the whole beam, in place of mass_per_length."""

    @model_validator(mode="after")
    def _one_mass(self) -> UniformBeam:
        exactly_one(self, ("mass", "mass_per_length"))
        if self.mass is not None:
            vars(self)["mass_per_length"] = self.mass / self.length
        return self

    @property
    def frame(self) -> Array:
        """Beam axes in the body frame, rows x, y, z (3, 3)."""
        return straight_frame(self.root, self.direction, self.orientation)

    @property
    def taper(self) -> Taper:
        """The variation of its section along its length."""
        return Taper()


class TaperedBeam(UniformBeam):
    """A straight beam whose section varies; its mass and its stiffness are those where the factors are 1."""

    factors: SkipValidation[Taper]
    """Factors along the beam."""

    @property
    def taper(self) -> Taper:
        """The variation of its section along its length."""
        return self.factors


@dataclass(frozen=True)
class BeamFunctions:
    """The family and the numbers of admissible functions for the four fields of a beam.

    y, z, axial, torsion   numbers of functions for v(x), w(x), u(x), theta(x)
    family                 "characteristic": vibration shapes; "polynomial": Jacobi polynomials that meet the supports
    ends                   supports of root and tip, of "free", "pinned", "clamped", in the body frame
    followers              axial polynomials dependent on bending, after all others (beam_body, strain "condensed")
    static                 the last two of y and z, and the last of axial and torsion, are the static shapes of an
                           accelerated root (characteristic, "clamped-free"): for fast convergence with a light hub
    tip                    the last two of y and z, and the last of axial and torsion, are the static shapes of a force
                           and a moment at the tip, after those of `static` (likewise): for bodies at the tip
    """

    y: int = 0
    z: int = 0
    axial: int = 0
    torsion: int = 0
    family: Literal["characteristic", "polynomial"] = "characteristic"
    ends: str = "clamped-free"
    static: bool = False
    followers: int = 0
    tip: bool = False

    def __post_init__(self) -> None:
        ends_of(self.ends)
        if self.family not in ("characteristic", "polynomial"):
            raise ValueError(
                f"family {self.family!r} of beam functions is not known; give 'characteristic' or 'polynomial'."
            )
        counts = (self.y, self.z, self.axial, self.torsion)
        if min(counts) < 0 or not any(counts):
            raise ValueError(
                f"numbers of beam functions (y, z, axial, torsion) are {counts}; give at least one, and none negative."
            )
        if (self.static or self.tip) and (self.family, self.ends) != ("characteristic", "clamped-free"):
            raise ValueError(
                "static shapes go with characteristic functions of clamped-free ends only; change family or ends."
            )
        if any(0 < n < least for n, least in zip(counts, self._static_counts(), strict=True)):
            raise ValueError(
                "static shapes of bending come in twos; give at least two functions along y and z for each of "
                "static and tip, or none."
            )

    @property
    def count(self) -> int:
        """Number of functions in all."""
        return self.n_independent + self.followers

    @property
    def n_independent(self) -> int:
        """Number of functions that are independent coordinates."""
        return self.y + self.z + self.axial + self.torsion

    @property
    def max_count(self) -> int:
        """The largest number of functions of one field."""
        return max(self.y, self.z, self.axial, self.torsion, self.followers)

    @property
    def holds_squares(self) -> bool:
        """Whether the axial functions contain all products of two slopes: polynomials of sufficient degree."""
        clamps = [BENDING_ORDER[support] for support in ends_of(self.ends)]
        degree = max(2, sum(clamps)) + max(self.y, self.z) - 1  # of bending, which has no rigid motion
        lowest = max(1, sum(min(order, 1) for order in clamps))  # u has the degree of the integral of squared slopes
        return self.family == "polynomial" and self.axial >= 2 * degree - lowest

    def with_followers(self) -> BeamFunctions:
        """The functions with enough dependent ones for all products of two slopes: exact for polynomials."""
        n = 2 * max(self.y, self.z)
        return replace(self, followers=n + 4 if self.family == "polynomial" else n + 14)

    def fields(self, xi: Array, length: float, derivative: int = 0) -> Array:
        """Derivative by x (n_xi, 4, n) of u, v, w [m] and theta [rad] at x = xi length, xi (n_xi,) [1]."""
        out = np.zeros((len(xi), 4, self.count))
        column = 0
        for row, n, bends in ((1, self.y, True), (2, self.z, True), (0, self.axial, False), (3, self.torsion, False)):
            if n:
                functions = (_bending if bends else _axial)(self.family, self.ends, self.static, self.tip, n)
                out[:, row, column : column + n] = functions(xi, derivative) / length**derivative
            column += n
        if self.followers:
            functions = _axial("polynomial", self.ends, False, False, self.followers)
            out[:, 0, column:] = functions(xi, derivative) / length**derivative
        return out

    def _static_counts(self) -> tuple[int, int, int, int]:
        """Numbers of static shapes among the functions of each field that has functions."""
        kinds = int(self.static) + int(self.tip)
        return 2 * kinds, 2 * kinds, kinds, kinds

    @property
    def added(self) -> BoolArray:
        """(n_functions,): whether each function is an added static shape."""
        counts = (self.y, self.z, self.axial, self.torsion)
        return np.concatenate(
            [np.arange(n) >= n - n_static for n, n_static in zip(counts, self._static_counts(), strict=True)]
        )

    @property
    def only_static(self) -> BoolArray:
        """(n,): whether each function is a static shape in a bending or torsion field without other functions."""
        counts = (self.y, self.z, 0, self.torsion)
        only = [n <= n_static for n, n_static in zip(counts, self._static_counts(), strict=True)]
        return self.added & np.repeat([*only[:2], False, only[3]], (self.y, self.z, self.axial, self.torsion))


class FunctionsTable(Table):
    """Admissible functions of a beam: how many for each field, and which."""

    y: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for bending along the section's y axis."""
    z: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for bending along the section's z axis."""
    axial: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for axial displacement."""
    torsion: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for the twist angle."""
    family: Literal["characteristic", "polynomial"] = "characteristic"
    """Functions: "characteristic", the vibration modes of a uniform beam; "polynomial", polynomials of the same
    supports."""
    ends: str = "clamped-free"
    """Supports of root and tip in the body frame, such as "clamped-free"; each is free, pinned or clamped."""
    static: StrictBool = False
    """The last functions are the static shapes of an accelerated root."""
    spin: StrictBool | None = None
    """Static shapes of a spin in addition to the functions: two more along y and along z, one of axial
    displacement and one of torsion, where strain is not linear. Only for clamped-free characteristic functions. Left
    out: true where the case spins steadily, unless `static` is given."""
    joints: list[Literal["root", "tip"]] | None = None
    """Static shapes of an accelerated root and of a tip force and moment in addition to the functions: two more along y
    and z for each, one of axial displacement and one of torsion. Only for clamped-free characteristic functions. Left
    out: those that change by 0.05 % one of the craft's first three elastic frequencies, one below `band`, or one that
    the run excites, unless `static` is given."""
    loads: StrictBool | None = None
    """Static shapes of a force and a moment at the tip in addition to the functions, as those of `joints`: for loads at
    the tip. Only for clamped-free characteristic functions. Left out: where the functions answer such a load by less
    than 99 % of its static work, as one function answers a force (97 %), and many a moment or a torque."""


@lru_cache(maxsize=256)
def _bending(family: str, ends: str, static: bool, tip: bool, n: int) -> FunctionSet:
    """The n functions of v or w."""
    if family == "polynomial":
        root, end = (BENDING_ORDER[support] for support in ends_of(ends))
        return polynomials(root, end, n)
    added = (*STATIC_BENDING * static, *TIP_BENDING * tip)
    return with_static(bending_characteristic(ends, n - len(added)), added, n)


@lru_cache(maxsize=256)
def _axial(family: str, ends: str, static: bool, tip: bool, n: int) -> FunctionSet:
    """The n functions of u or theta."""
    if family == "polynomial":
        root, end = (min(BENDING_ORDER[support], 1) for support in ends_of(ends))
        return polynomials(root, end, n, rigid=1)
    added = (*STATIC_AXIAL * static, *TIP_AXIAL * tip)
    return with_static(axial_characteristic(ends, n - len(added)), added, n)
