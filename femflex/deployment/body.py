"""Deploying members as bodies of a system: a FlexibleBody at the first length, and its Variation along a profile."""

from __future__ import annotations

import itertools
import math
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, NamedTuple, TypedDict, Unpack

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody, Skin
from femflex.deployment.line import DeployingLine, LineFunctions, LineShapes
from femflex.deployment.material import MaterialPoints
from femflex.deployment.parts import Strain, exit_marker, member_parts, resting_rates
from femflex.deployment.sections import sections_of
from femflex.deployment.series import Series, derivative, evaluate
from femflex.deployment.shapes import MemberShapes, quadrilateral_grid
from femflex.deployment.strip import DeployingStrip, StripFunctions, StripShapes
from femflex.deployment.table import DeployingParts, deploying_variation
from femflex.deployment.tapered import MaterialTaper, pieces_of, tapered_line, unit_factor
from femflex.noun.table import Name, Table
from femflex.noun.values import PositiveLength, Quantity
from femflex.system import Effector, MovingPoints, Profile, Variation
from femflex.warning import PhysicsWarning

SAMPLES = 2001  # of a profile between its breaks, to find its least and largest length
SOFTENING_LIMIT = 0.02  # change of bending stiffness by axial inertia from which linear strain is warned of
MOST_FUNCTIONS = 24  # of a condensed member, or modes of elements; to check one takes 12 s, and more as n^4
BUCKLING = 7.837  # of m' |A| L^3 / EI, at which a cantilever under its own distributed load buckles


class DeployingBody(NamedTuple):
    """A member that deploys.

    body       as it is at t = 0
    variation  how it varies
    parts      its series in the length over the reference length
    shapes     its shapes over xi = x / L
    start      its length and the rate of that at t = 0
    """

    body: FlexibleBody
    variation: Variation
    parts: DeployingParts
    shapes: MemberShapes
    start: tuple[float, float]

    def resting_rates(self, delta: Array, rest: str = "place") -> Array:
        """Rates (n,) [delta/s] of coordinates delta (n,) at t = 0, for a deflection that is at rest.

        rest: "place" if the deflection rests at every distance from the exit, "material" if the points of the material
        rest, "coordinates" for rates of zero.
        """
        length, rate = self.start
        return resting_rates(self.shapes, length, rate, delta, rest)


def deploying_line(
    line: DeployingLine, functions: LineFunctions | None, length: Profile | Reel, **options: Unpack[DeployingOptions]
) -> DeployingBody:
    """Return a beam or tether that deploys along a profile of its length: its body at t = 0, and its variation.

    functions  admissible functions on xi = x / L (`BeamFunctions`, `StringFunctions`, ...); None: it stays straight
    length     L(t) [m], or a Reel whose states it is
    options    see `DeployingOptions`

    Raises ValueError for a length that reaches zero or exceeds the stock.
    """
    reference = _reference_length(length, options)
    member = _deploying_body(LineShapes(functions, reference, line=line), length, options)
    bends = member.shapes.slopes(np.linspace(0.0, 1.0, 9))[0].any()
    if options.get("strain") == "linear" and bends and isinstance(length, Profile):
        _warn_of_linear_strain(line, length, options.get("until", 0.0))
    return member


def deploying_strip(
    strip: DeployingStrip, functions: StripFunctions | None, length: Profile | Reel, **options: Unpack[DeployingOptions]
) -> DeployingBody:
    """A plate or membrane that rolls out along a profile of its length; as `deploying_line`."""
    return _deploying_body(StripShapes(functions, _reference_length(length, options), strip=strip), length, options)


def deploying_tapered_line(
    line: DeployingLine,
    taper: MaterialTaper,
    functions: LineFunctions | None,
    length: Profile,
    **options: Unpack[DeployingOptions],
) -> DeployingBody:
    """A beam or tether whose section and density vary along the material.

    taper: factors on its stiffness and mass per length, over the distance from the end that comes out first. As
    `deploying_line`; the relative error of the table in the length is `variation.write.error`.
    """
    smallest, largest, first = length_range(length, options.get("until", 0.0))
    at_tip, radius = options.get("drum") == "tip", options.get("drum_radius")
    stock = options.get("stock") or largest
    check_length(smallest, largest, stock)
    shapes = LineShapes(functions, options.get("reference") or first, line=line)
    condensed = options.get("strain", "condensed") == "condensed"
    _check_count(shapes, options)
    if taper.covered < stock * (1.0 - 1e-9):
        warnings.warn(
            f"the taper of a deploying member is given up to {taper.covered:g} m from the end that comes out first, "
            f"and its stock is {stock:g} m long; the remaining {stock - taper.covered:g} m has the last factors. "
            "Extend the taper over the stock",
            PhysicsWarning,
            stacklevel=2,
        )
    tapered = tapered_line(shapes, taper, stock, condensed, options.get("damping", 0.0), at_tip)
    check_markers(options.get("markers") or {})
    markers = {"tip": 1.0, **(options.get("markers") or {})}
    pieces, error = pieces_of(tapered, (smallest, largest), markers, exit_marker(tapered.shapes))
    pieces = [_with_axes(part, options) for part in pieces]
    first_part = next((part for part in reversed(pieces) if part.origin <= first), pieces[0])
    body = first_part.body(first, skin=deployed_skin(tapered.shapes, first, stock, at_tip, radius))
    sections = sections_of(
        tapered.shapes, stock, at_tip, options.get("markers") or {},
        lambda sigma: line.mass_per_length * taper.mass(sigma), taper.bending,
    )  # fmt: skip
    table_options: dict[str, Any] = {
        "stock": stock,
        "drum_radius": radius,
        "at_tip": at_tip,
        "bounds": (smallest, largest),
        "error": error,
    }
    table_options["sections"] = sections
    variation = deploying_variation(pieces, body, length, **table_options)
    return DeployingBody(body, variation, first_part, tapered.shapes, (first, float(length(0.0)[1])))


class DeployingOptions(TypedDict, total=False):
    """Options that every deploying member may be given.

    stock        length of the whole member [m]; its mass stays constant. Left out: the largest length up to `until`
    until        last time of the run [s]; the length is checked up to it. Left out: 0
    reference    length at which coordinates are mass-normalised [m]. Left out: the first one
    strain       "condensed" (the default), or "linear" without the effect of axial forces and inertia on bending
    damping      fraction of critical damping, one or one for each coordinate
    drum         "root" (the default): material is drawn out of the parent; "tip": it is laid out from the tip
    drum_radius  [m], for the torque of the drum
    markers      name -> distance from the exit over the length, in addition to "root" and "tip"
    orientations marker -> its axes C_BM (3, 3). Left out: those of the member
    """

    stock: float | None
    until: float
    reference: float | None
    strain: Strain
    damping: float | Sequence[float]
    drum: Literal["root", "tip"]
    drum_radius: float | None
    markers: Mapping[str, float] | None
    orientations: Mapping[str, Array]


def _range(length: Profile | Reel, options: DeployingOptions) -> tuple[float, float, float]:
    """Least, largest and first length [m]."""
    if isinstance(length, Reel):
        return length.length, length.length, length.length
    return length_range(length, options.get("until", 0.0))


def _reference_length(length: Profile | Reel, options: DeployingOptions) -> float:
    return options.get("reference") or _range(length, options)[2]


def _deploying_body(shapes: MemberShapes, length: Profile | Reel, options: DeployingOptions) -> DeployingBody:
    least, largest, first = _range(length, options)
    stock, at_tip, markers = options.get("stock"), options.get("drum") == "tip", options.get("markers") or {}
    stock_length = max(largest, first) if stock is None else stock
    check_length(least, largest, stock_length)
    check_markers(markers)
    _check_count(shapes, options)
    total = shapes.member_mass / shapes.reference * stock_length
    strain, damping = options.get("strain", "condensed"), options.get("damping", 0.0)
    parts, shapes = member_parts(shapes, total, strain, damping, at_tip, markers)
    parts = _with_axes(parts, options)
    body = parts.body(first, skin=deployed_skin(shapes, first, stock_length, at_tip, options.get("drum_radius")))
    table_options: dict[str, Any] = {
        "stock": stock_length,
        "drum_radius": options.get("drum_radius"),
        "at_tip": at_tip,
        "bounds": (least, largest),
    }
    table_options["points"] = moving_points(shapes, total, at_tip)
    density = shapes.member_mass / shapes.reference
    table_options["sections"] = sections_of(
        shapes, stock_length, at_tip, markers, lambda sigma: density * unit_factor(sigma), unit_factor
    )
    if isinstance(length, Reel):
        variation = deploying_variation([parts], body, length.state, drum_mass=length.inertia, **table_options)
        return DeployingBody(body, variation, parts, shapes, (length.length, length.speed))
    start = (first, float(length(0.0)[1]))
    return DeployingBody(body, deploying_variation([parts], body, length, **table_options), parts, shapes, start)


def _check_count(shapes: MemberShapes, options: DeployingOptions) -> None:
    """Raise ValueError for condensed strain with so many functions that its energy of fourth degree takes minutes."""
    blocks = getattr(shapes.functions, "blocks", None)
    n = sum(kept for _, kept in blocks) if blocks else getattr(shapes.functions, "count", 0)
    if options.get("strain", "condensed") == "condensed" and n > MOST_FUNCTIONS:
        raise ValueError(
            f"a deploying member with {n} functions and condensed strain has a strain energy of fourth degree with "
            f"{(n * (n + 1) // 2) ** 2:,} numbers, which every instant needs (limit {MOST_FUNCTIONS} functions); take "
            "fewer functions (20 are more than a deployment shows), or strain = 'linear'"
        )


def _with_axes(parts: DeployingParts, options: DeployingOptions) -> DeployingParts:
    """The parts whose markers have the axes that the options give them."""
    orientations = options.get("orientations") or {}
    turned = {
        name: replace(marker, orientation=orientations.get(name, marker.orientation))
        for name, marker in parts.markers.items()
    }
    return replace(parts, markers=turned)


def check_markers(markers: Mapping[str, float]) -> None:
    """Raise ValueError for a marker that is not on the deployed part."""
    for name, xi in markers.items():
        if not 0.0 <= xi <= 1.0:
            raise ValueError(
                f"marker {name!r} stands at {xi:g} times the deployed length, which is still stowed or beyond the tip; "
                "give a number from 0 (exit) to 1 (tip)"
            )


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


def check_length(least: float, largest: float, stock: float) -> None:
    """Raise ValueError for a length that is not between zero and the stock."""
    if not least > 0.0:
        raise ValueError(
            f"the deployed length falls to {least:g} m; it must stay above zero: start from, and stop at, a short "
            "length"
        )
    if largest > stock * (1.0 + 1e-12):
        raise ValueError(
            f"the deployed length grows to {largest:g} m, above the total length of the member, stock = {stock:g} m; "
            "raise stock, or deploy less"
        )


def _warn_of_linear_strain(line: DeployingLine, length: Profile, until: float) -> None:
    """Warn where an accelerating deployment changes the bending stiffness that linear strain keeps."""
    EI = min((value for value in (line.EIy, line.EIz) if value > 0), default=0.0)
    times = np.linspace(0.0, until, SAMPLES)
    L, _, acceleration = length(times)
    load = line.mass_per_length * np.abs(acceleration) * L**3
    worst = float(np.nanmax(load))
    if worst > SOFTENING_LIMIT * BUCKLING * EI:
        load_text = "acts on a member without bending stiffness, which it alone stiffens or softens"
        if EI:
            load_text = f"reaches {worst / (BUCKLING * EI):.2g} of its buckling load (limit {SOFTENING_LIMIT:g})"
        warnings.warn(
            "deploying member with linear strain: the inertia load of its axial acceleration (up to "
            f"{np.abs(acceleration).max():.3g} m/s^2) {load_text}, and linear strain leaves it out; set strain = "
            "'condensed'",
            PhysicsWarning,
            stacklevel=3,
        )


def moving_points(shapes: MemberShapes, total: float, at_tip: bool) -> MovingPoints:
    """The points of quadrature of the deployed part, and the stowed part at the drum; total: mass of the whole [kg]."""
    deployed = shapes.material_points(*shapes.quadrature)
    drum = shapes.material_points(np.array([1.0 if at_tip else 0.0]), np.ones(1))
    density = shapes.member_mass / shapes.reference
    # material of the deployed part keeps its distance from the end that came out first; the drum keeps its xi
    deployed_points = _points(shapes, deployed, -deployed.xi if at_tip else 1.0 - deployed.xi)
    drum_points = _points(shapes, drum, np.zeros(len(drum.xi)))
    k, m = len(deployed.xi), len(drum.xi)
    joined = {key: np.concatenate([deployed_points[key], drum_points[key]]) for key in deployed_points}
    return MovingPoints(
        direction=shapes.axes.frame[0],
        mass=np.concatenate([np.zeros(k), total * drum.share]),
        density=density * np.concatenate([deployed.share, -drum.share]),
        drawn=np.concatenate([np.full(k, 0.0 if at_tip else 1.0), np.full(m, 1.0 if at_tip else 0.0)]),
        along=np.concatenate([deployed.xi, drum.xi]),
        **joined,
    )


def _points(shapes: MemberShapes, section_points: MaterialPoints, xi_rate: Array) -> dict[str, Array]:
    """Positions, shapes and their drift with the material; xi_rate: rate of its xi over that of ln L, (k,)."""
    L, xi_rates = shapes.reference, xi_rate[:, None, None]
    value, inverse = section_points.values[0], L * section_points.values[-1][:, :, 1:]
    return {
        "base": value[:, :, 0],
        "phi": value[:, :, 1:],
        "phi_inverse": inverse,
        "drift": xi_rates * section_points.slopes[0][:, :, 1:],
        "drift_inverse": xi_rates * L * section_points.slopes[-1][:, :, 1:] - inverse,
    }


class Reel(Table):
    """A drum whose length is free: it pulls with tension + damping x speed + stiffness x (length - rest)."""

    name: Name = ""
    """Name of its effector, whose states are length and speed. Default: that of the body with "_reel" added."""
    length: PositiveLength
    """Deployed length at t = 0."""
    speed: Annotated[float, Quantity("m/s")] = 0.0
    """Rate of the deployed length at t = 0."""
    tension: Annotated[float, Quantity("N")] = 0.0
    """Constant pull of the drum; negative for a motor that pushes the member out."""
    damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    """Brake: pull per rate of the length."""
    stiffness: Annotated[float, Quantity("N/m", least=0.0)] = 0.0
    """Pull per length beyond `rest`, as of a length controller."""
    rest: Annotated[float, Quantity("m")] = 0.0
    """Length at which `stiffness` does not pull."""
    inertia: Annotated[float, Quantity("kg", least=0.0)] = 0.0
    """Moment of inertia of the drum over its radius squared."""

    @classmethod
    def from_python(cls, keys: dict[str, Any]) -> dict[str, Any]:
        """The keys; the inertia may also be called `mass`."""
        return keys | ({"inertia": keys.pop("mass")} if "mass" in keys else {})

    @property
    def state(self) -> str:
        """Name of the state that is the length."""
        return f"{self.name}.length"

    def effector(self, stock: float = math.inf) -> Effector:
        """The effector of a system that has the length and its rate as states; stock: length of the whole member."""
        law = np.array([self.tension, self.damping, self.stiffness, self.rest, min(stock, sys.float_info.max)])
        return Effector(
            self.name,
            reel_law,
            states={"length": "m", "speed": "m/s"},
            z0=np.array([self.length, self.speed]),
            sizes=np.array([self.length, max(abs(self.speed), 1e-3 * self.length)]),
            channels={"tension": "N"},
            parameters=law,
        )


def reel_law(seen, out):  # type: ignore[no-untyped-def]
    """Rate of the length, and in place of the rate of the speed the force on the length."""
    p, length, speed = seen.parameters, seen.z[0], seen.z[1]
    tension = p[0] + p[1] * speed + p[2] * (length - p[3])
    out.zdot[0] = speed
    out.zdot[1] = -tension if 0.0 < length <= p[4] else np.nan  # which ends the run
    out.channel[0] = tension


SIDES = 16  # of the coil
LEAST = 0.3  # radius of an empty drum over that of a full one
COIL = 0.02  # radius of a full drum over the stock, where it is not given
LARGEST = 1.0  # m; largest radius of such a drum


def deployed_skin(shapes: MemberShapes, length: float, stock: float, at_tip: bool, radius: float | None) -> Skin:
    """The skin at a length, with its growth; radius: of the full drum [m], None: by the stock."""
    series, cells = shapes.drawn_series()
    coil, coil_cells = _coil(shapes, stock, at_tip, radius)
    first = len(next(iter(series.values())))
    kinds = sorted({*cells, *coil_cells})
    joined = {
        kind: np.concatenate(
            [part for part in (cells.get(kind), _shifted(coil_cells.get(kind), first)) if part is not None]
        )
        for kind in kinds
    }
    series_of_all: Series = {}
    powers = {*series, *coil}
    for p in powers:
        parts = [part[p] if p in part else np.zeros_like(next(iter(part.values()))) for part in (series, coil)]
        series_of_all[p] = np.concatenate(parts)
    ratio = length / shapes.reference
    values, rates = evaluate(series_of_all, ratio), evaluate(derivative(series_of_all), ratio) * ratio
    return Skin(values[:, :, 0], joined, np.ascontiguousarray(values[:, :, 1:].transpose(2, 0, 1)), rates[:, :, 0])


def _shifted(cells: IntArray | None, first: int) -> IntArray | None:
    return None if cells is None else cells + first


def _coil(shapes: MemberShapes, stock: float, at_tip: bool, radius: float | None) -> tuple[Series, dict[str, IntArray]]:
    """A drum across the member, behind the exit or ahead of the tip, whose radius falls with the stowed length."""
    full = radius or max(min(COIL * stock, LARGEST), 3.0 * shapes.thickness)
    width = shapes.half_width or full
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    turn = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    per_length = (1.0 - LEAST) * full / stock * shapes.reference  # loss of radius per lambda
    rim = np.repeat(turn[None], 2, axis=0)
    side = np.array([-width, width])[:, None, None] * np.array([0.0, 1.0, 0.0])
    centre = np.array([1.0 if at_tip else -1.0, 0.0, 0.0]) * full
    points = (full * rim + side + centre).reshape(-1, 3)
    shrink = (-per_length * rim).reshape(-1, 3)
    marker = shapes.marker(1.0 if at_tip else 0.0)
    count, n = len(points), shapes.n_shapes
    out: Series = {}
    for p in {0, 1, *marker.position}:
        part = np.zeros((count, 3, 1 + n))
        if p in marker.position:
            part[:, :, 0] += marker.position[p]
            part[:, :, 1:] += marker.phi[p]
        local = points if p == 0 else shrink if p == 1 else np.zeros_like(points)
        part[:, :, 0] += local @ shapes.axes.frame
        out[p] = part
    return out, {"quad": quadrilateral_grid(2, SIDES, closed=True)}
