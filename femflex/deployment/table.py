"""The LengthTable of a deploying body: series in lambda = L / L_0 written to the places of its block."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors
from femflex.deployment.material import Inertia
from femflex.deployment.series import Series, derivative, evaluate, scaled
from femflex.system import Block, LengthTable, Profile, Variation


@dataclass(frozen=True, eq=False)
class MarkerSeries:
    """A marker at a fixed xi: its place and rows as series in lambda."""

    position: Series
    phi: Series
    psi: Series
    orientation: Array = field(default_factory=lambda: np.eye(3))
    axis: Array = field(default_factory=lambda: np.zeros(3))

    def marker(self, ratio: float) -> Marker:
        """The marker at lambda = ratio."""
        position, phi, psi = (evaluate(part, ratio) for part in (self.position, self.phi, self.psi))
        return Marker(position, phi, psi, self.orientation, self.axis)

    @property
    def moves(self) -> bool:
        """Whether it depends on the length."""
        parts = (self.position, self.phi, self.psi)
        return any(power != 0 and value.any() for part in parts for power, value in part.items())


@dataclass(frozen=True, eq=False)
class DeployingParts:
    """Everything of a deploying body as series in lambda = (L - origin) / reference.

    reference   L_0 [m];  origin  0, except for a piece of a table over the length [m]
    inertia     moments and material flow
    V1, V3, damping  stiffness (n, n), packed quartic strain tensor (k,), none of linear strain; damping (n, n)
    markers     name -> MarkerSeries
    slaves      (n_s, n, n) as of a FlexibleBody: constant
    kinds       per shape
    """

    reference: float
    inertia: Inertia
    V1: Series
    V3: Series
    damping: Series
    markers: Mapping[str, MarkerSeries]
    slaves: Array
    kinds: tuple[str, ...]
    origin: float = 0.0

    @property
    def n(self) -> int:
        """Number of elastic coordinates."""
        return int(next(iter(self.V1.values())).shape[0])

    def body(self, length: float, **more: Any) -> FlexibleBody:
        """The body as it is at a length."""
        ratio, i = (length - self.origin) / self.reference, self.inertia
        V1 = evaluate(self.V1, ratio)
        Me = np.einsum("kaka->k", evaluate(i.second, ratio)[1:, :, 1:, :])[: self.n]
        omega = np.full(len(self.kinds), np.nan)
        omega[: self.n] = np.sqrt(np.maximum(np.diag(V1) / np.maximum(Me, 1e-300), 0.0))
        return FlexibleBody(
            moments=MassMoments(i.mass, evaluate(i.first, ratio), evaluate(i.second, ratio)),
            strain=StrainTensors(V1, np.zeros(self.n), V3=evaluate(self.V3, ratio) if self.V3 else np.zeros(0)),
            damping=evaluate(self.damping, ratio),
            markers={name: marker.marker(ratio) for name, marker in self.markers.items()},
            kinds=self.kinds,
            omega=omega,
            slaves=self.slaves,
            **more,
        )

    @property
    def varies(self) -> tuple[str, ...]:
        """The parts of a block that it writes."""
        parts = ["mass", "flow", "pickup"]
        parts += ["stiffness"] if self.n else []
        parts += ["strain"] if any(value.any() for value in self.V3.values()) else []
        parts += ["damping"] if self.n and any(value.any() for value in self.damping.values()) else []
        return (*parts, *(f"marker/{name}" for name, marker in self.markers.items() if marker.moves))


def deploying_variation(
    pieces: Sequence[DeployingParts], body: FlexibleBody, length: Profile | str, **more: Any
) -> Variation:
    """Return the Variation of a body that `pieces` describe, in order of the length; more: fields of LengthTable.

    length: profile of its length, or the name of the state that is its length.
    """
    varies = pieces[0].varies
    block = Block(body, varies)
    table = LengthTable(
        length,
        [_terms(parts, block, body.n_shapes) for parts in pieces],
        np.array([parts.origin for parts in pieces]),
        np.array([parts.reference for parts in pieces]),
        **more,
    )
    return Variation(table, varies)


def _terms(parts: DeployingParts, block: Block, n_shapes: int) -> dict[tuple[int, int, int], Array]:
    """Terms of the block of a body that is as `parts` says."""
    writer = _Writer(block, parts.reference)
    _write_inertia(writer, parts.inertia, n_shapes)
    if block.stiffness >= 0:
        zero_force = np.zeros(parts.n)
        writer.add(parts.V1, lambda out, V1: block.put_stiffness(out, V1, zero_force))
        writer.add(derivative(parts.V1), lambda out, V1: block.put_stiffness(out, V1, zero_force, True), rate=1)
    if block.strain >= 0:
        no_V2 = np.zeros(0)
        writer.add(parts.V3, lambda out, V3: block.put_strain(out, no_V2, V3))
        writer.add(derivative(parts.V3), lambda out, V3: block.put_strain(out, no_V2, V3, True), rate=1)
    if block.damping >= 0:
        writer.add(parts.damping, block.put_damping)
    for name in block.markers:
        _write_marker(writer, name, parts.markers[name])
    return writer.terms


class _Writer:
    """Collects terms of a table: coefficients of lambda^p lambdadot^a lambdaddot^b, written by functions of a block."""

    def __init__(self, block: Block, reference: float) -> None:
        self.block, self.reference = block, reference
        self.terms: dict[tuple[int, int, int], Array] = {}

    def add(self, series: Series, write: Callable[[Array, Array], Any], rate: int = 0, acceleration: int = 0) -> None:
        """Add the numbers that `write` puts into a block for every coefficient."""
        for power, value in series.items():
            if value.any():
                out = np.zeros(self.block.size)
                write(out, value / self.reference ** (rate + acceleration))
                term = (power, rate, acceleration)
                self.terms[term] = self.terms.get(term, 0.0) + out


def _write_inertia(writer: _Writer, i: Inertia, n_shapes: int) -> None:
    block, Z = writer.block, 1 + n_shapes
    zero_first, zero_second, form = np.zeros((Z, 3)), np.zeros((Z, 3, Z, 3)), np.zeros((Z, Z))
    zero = {
        "drift": zero_first,
        "kick": zero_first,
        "flow": zero_second,
        "turn": zero_second,
        "speed": form,
        "speed_rate": form,
    }

    def flow_writer(key: str) -> Callable[[Array, Array], None]:
        return lambda out, value: block.put_flow(out, **{**zero, key: value})

    writer.add(
        {0: np.array([i.mass])},
        lambda out, m: block.put_moments(out, MassMoments(float(m[0]), zero_first, zero_second)),
    )
    writer.add(i.first, lambda out, s: block.put_moments(out, MassMoments(0.0, s, zero_second)))
    writer.add(i.second, lambda out, P: block.put_moments(out, MassMoments(0.0, zero_first, P)))
    speed = {power: np.einsum("AaBa->AB", C) for power, C in i.speed.items()}
    writer.add(i.drift, flow_writer("drift"), 1)
    writer.add(i.drift, flow_writer("kick"), 0, 1)
    writer.add(derivative(i.drift), flow_writer("kick"), 2)
    writer.add(i.flow, flow_writer("flow"), 1)
    writer.add(i.flow, flow_writer("turn"), 0, 1)
    writer.add(derivative(i.flow), flow_writer("turn"), 2)
    writer.add(scaled(i.speed, -1.0), flow_writer("turn"), 2)
    writer.add(speed, flow_writer("speed"), 2)
    writer.add(scaled(speed, 2.0), flow_writer("speed_rate"), 1, 1)
    writer.add(derivative(speed), flow_writer("speed_rate"), 3)
    writer.add(scaled(i.pickup, writer.reference**-3), block.put_pickup)


def _write_marker(writer: _Writer, name: str, marker: MarkerSeries) -> None:
    block, zero_position = writer.block, np.zeros(3)
    zero_rows = np.zeros_like(next(iter(marker.phi.values())))
    axes = Marker(zero_position, zero_rows, zero_rows, marker.orientation, marker.axis)
    first = np.zeros(block.size)
    block.put_place(first, name, axes)
    writer.terms[0, 0, 0] = writer.terms.get((0, 0, 0), 0.0) + first
    for series, key in ((marker.position, "position"), (marker.phi, "phi"), (marker.psi, "psi")):
        _write_rows(writer, name, series, key)


def _write_rows(writer: _Writer, name: str, series: Series, key: str) -> None:
    block, turn = writer.block, np.zeros((3, 3))

    def marker_rows(value: Array) -> dict[str, Array]:
        rows = np.zeros((3, block.n_shapes))
        return {"position": np.zeros(3), "phi": rows, "psi": rows, key: value}

    def write_marker(out: Array, value: Array) -> None:
        block.put_place(out, name, Marker(orientation=turn, **marker_rows(value)))

    def motion(order: int) -> Callable[[Array, Array], None]:
        return lambda out, value: block.put_motion(out, name, order, **marker_rows(value))

    writer.add(series, write_marker)
    first = derivative(series)
    writer.add(first, motion(1), 1)
    writer.add(first, motion(2), 0, 1)
    writer.add(derivative(first), motion(2), 2)
