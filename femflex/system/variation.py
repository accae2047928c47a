"""Bodies whose properties depend on time: the properties that change, and the function that writes their block.

THE SOCKET. A body of a System stays a FlexibleBody: its properties at the start, its size, its markers. A Variation
beside it (`System.varying`) names the parts that change and holds a function

    write(t, z, numbers, block)

which the compiled model calls at the beginning of every evaluation. It writes the parts that change, and their rates,
into `block` (see Block), and returns nothing.

    t        time [s]
    z        states of effectors, (n_z,)
    numbers  constants of the body, `Variation.numbers`
    block    (Block.size,) what the kernels read: the body's properties at the start, then what was written last

It is a function that Numba can compile, a compiled one (`numba.njit`), or a `numba.cfunc` over three pointers
(`void(float64, CPointer(float64), CPointer(float64), CPointer(float64))`). It must set every number that changes, each
time: calls come in any order of time. An exception stops the run. It is called once as plain Python at the initial
state, where an index outside its arrays is refused.

THE PHYSICS. A material point sits at r = z_A y_A with y = (1, delta); where the shapes z_A(t) = (rho, phi_1, ...) move
with time, it has the velocity w = zdot_A y_A besides that of the frame and of the coordinates, and the acceleration
2 zdot_A ddot(y)_A + zddot_A y_A (THEORY section 6). The integrals of these over the mass are the body's material flow:

    drift    int zdot dm            (1+n, 3)        kick     int zddot dm           (1+n, 3)
    flow     int z zdot^T dm        (1+n,3,1+n,3)   turn     int z zddot^T dm       (1+n,3,1+n,3)
    speed    int zdot . zdot dm     (1+n, 1+n)      and its rate

They make the terms M_t u, G u and Gamma_t - T0,q of eq. (9). The points are the same ones throughout: stowed material
counts as points at rest at the exit. int z zddot^T dm = d(flow)/dt - int zdot zdot^T dm then holds the momentum flux
at the exit; it is never added again. For such material the rate of `second` is flow + its transpose.

Where all of it follows from one length and its rate, a table stands in the place of the function: see
`femflex.system.length_table`. Of such a body the drum's force, its power and the energy lost are reported.

Mass that arrives or leaves (growth) does so at the velocity of its place: it changes the moments and adds no force. A
jet or an impact is a force of its own. The energy that it carries is reported (`growth`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker, MassMoments
from femflex.body.symmetric import packed_indices, unpacked
from femflex.system.length_table import LengthTable

LANE = 4  # rows over shapes are filled up with zeros to multiples of it
COLUMNS = 32  # entries of a block of the table of nonlinear strain
PARTS = ("mass", "flow", "pickup", "growth", "stiffness", "damping", "strain")
MARKER = "marker/"
RATES = 26  # of the undeformed body: drift 3, kick 3, flow 9, turn 9, speed, its rate
PLACE = 24  # of a marker: position 3, C_BM 9, axis 3, 0; velocity 3, acceleration 3, 0, 0


@dataclass(frozen=True, eq=False)
class Variation:
    """Properties of one body as functions of time.

    write    the function (see this module), or a LengthTable
    varies   what it writes: "mass", "flow" (how material moves inside the body), "growth" (mass that arrives), with
             "mass"; "pickup" (what the drum's report needs, of a LengthTable alone); "stiffness" (V1, f0), "damping",
             "strain" (V2, V3), "marker/<name>"
    numbers  (n,) constants handed to the function; those of a LengthTable are its own
    breaks   (n_b,) times at which what it writes, or a rate of it, is not smooth [s]
    frozen   parts that it writes and that are left out: they stay as the System's body has them; of stiffness also
             V1 or f0 alone
    whole    the body that the function writes for, where the System's has been made rigid; None: the System's
    states   names of states of effectors; their places in z stand before `numbers` in what the function gets

    In place of a function `write` may be the word of one that femflex brings (femflex.dynamics.layout.written_blocks).
    """

    write: Callable[..., Any] | LengthTable | str
    varies: tuple[str, ...]
    numbers: Array = field(default_factory=lambda: np.zeros(0))
    breaks: Array = field(default_factory=lambda: np.zeros(0))
    frozen: tuple[str, ...] = ()
    whole: FlexibleBody | None = None
    states: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if isinstance(self.write, LengthTable):
            object.__setattr__(self, "numbers", self.write.numbers())
            if not isinstance(self.write.length, str):
                object.__setattr__(self, "breaks", np.append(self.write.length.breaks, self.breaks))
        for key in ("numbers", "breaks"):
            value = np.atleast_1d(np.asarray(getattr(self, key), float))
            is_table = key == "numbers" and isinstance(self.write, LengthTable)
            if value.ndim != 1 or not (is_table or np.isfinite(value).all()):
                raise ValueError(f"{key} of a variation are {value.tolist()}; give a row of finite numbers")
            object.__setattr__(self, key, value)

    @property
    def acting(self) -> tuple[str, ...]:
        """The parts that change with time."""
        return tuple(part for part in self.varies if part not in self.frozen)

    def with_frozen(self, *parts: str) -> Variation:
        """A copy in which these parts stay as the body has them."""
        return replace(self, frozen=(*self.frozen, *parts))

    def for_rigid_body(self, body: FlexibleBody) -> Variation:
        """A copy for the body without its shapes; `body` is the one that the function writes for."""
        return replace(self.with_frozen("stiffness", "damping", "strain"), whole=self.whole or body)

    def problems(self, name: str, body: FlexibleBody) -> list[str]:
        """Return the problems of the variation of that body."""
        markers = [MARKER + marker for marker in sorted(body.markers)]
        known_parts = [*PARTS, *markers]
        out = [
            f"body {name!r} varies in {part!r}; what can vary is {', '.join(known_parts)}"
            for part in self.varies
            if part not in known_parts
        ]
        if not self.varies:
            out.append(
                f"body {name!r} has a variation in which nothing varies; name what it writes: {', '.join(known_parts)}"
            )
        for part in ("flow", "growth"):
            if part in self.varies and "mass" not in self.varies:
                out.append(f"body {name!r} varies in {part!r} but not in 'mass'; its moments change too: name both")
        if not body.n_modes and (elastic := [p for p in self.acting if p in ("stiffness", "damping", "strain")]):
            out.append(f"body {name!r} is rigid and varies in {', '.join(elastic)}; leave that out")
        return out


class Block:
    """Layout of the block that the function of a varying body writes: offsets of its parts, row by row.

    n, n_shapes   elastic coordinates and shapes; row, wide: these filled up to whole lanes, the length of rows
    mass          m; first moment (3); second moment int rho rho^T dm (9)
    first         s_k (3, wide)
    second        int z_Aa phi_kc dm (1+n_shapes, 3, 3, wide) over A, a, c, k; A = 0 for the position rho
    rates         drift (3), kick (3), flow (9), turn (9) of rho with rho; speed; rate of speed
    drift, kick   int phidot_k dm, int phiddot_k dm (3, wide)
    flow0, turn0  int rho_a phidot_kc dm, int rho_a phiddot_kc dm (3, 3, wide)
    flow, turn    int phi_ka zdot_Bc dm, int phi_ka zddot_Bc dm (1+n_shapes, 3, 3, wide) over B, a, c, k
    speed, speed_rate   int zdot_A . phidot_k dm (1+n_shapes, wide), and its rate
    pickup        what is picked up: mass per length times the square of its velocity at the exit per rate of the
                  length, of rho with rho; then over A, k: (1+n_shapes, wide)
    growth, growth_first, growth_second   as mass, first, second, of the mass that arrives in a unit of time
    stiffness, f0, stiffness_rate, f0_rate   V1 (n, row), f0 (row) and their rates
    damping       D^T (n, row)
    strain, strain_rate   table of V2 and V3 (see `strain_table`) and its rate
    markers       name -> place of its numbers: position (3), C_BM (9), axis (3), 0, velocity (3), acceleration (3),
                  0, 0; then phi, phidot, phiddot, psi, psidot, psiddot (3, wide) each
    size          of the whole

    Attributes of parts that do not vary are -1. Numbers past the last shape of a row stay zero.
    """

    def __init__(self, body: FlexibleBody, varies: tuple[str, ...]) -> None:
        self.n, self.n_shapes, self.varies = body.n_modes, body.n_shapes, varies
        self.row, self.wide = _padded(self.n), _padded(self.n_shapes)
        self.size = 0
        n, row, wide, square = self.n, self.row, self.wide, (1 + self.n_shapes) * 9 * self.wide
        pairs = n * (n + 1) // 2
        table = -(-pairs // COLUMNS) * (n + pairs) * COLUMNS
        inertia = {"mass": 13, "first": 3 * wide, "second": square}
        self.mass, self.first, self.second = self._reserve("mass", inertia)
        flow = {"rates": RATES, "drift": 3 * wide, "kick": 3 * wide, "flow0": 9 * wide, "flow": square}
        flow |= {"turn0": 9 * wide, "turn": square, "speed": (1 + self.n_shapes) * wide}
        flow |= {"speed_rate": (1 + self.n_shapes) * wide}
        self.rates, self.drift, self.kick, self.flow0, self.flow, self.turn0, self.turn, self.speed, self.speed_rate = (
            self._reserve("flow", flow)
        )
        self.pickup, self.pickup_shapes = self._reserve("pickup", {"rho": 1, "shapes": (1 + self.n_shapes) * wide})
        self.growth, self.growth_first, self.growth_second = self._reserve("growth", inertia)
        self.stiffness, self.f0, self.stiffness_rate, self.f0_rate = self._reserve(
            "stiffness", {"V1": n * row, "f0": row, "rate of V1": n * row, "rate of f0": row}
        )
        (self.damping,) = self._reserve("damping", {"D": n * row})
        self.strain, self.strain_rate = self._reserve("strain", {"table": table, "rate": table})
        self.markers = {}
        for part in varies:
            if part.startswith(MARKER):
                (self.markers[part.removeprefix(MARKER)],) = self._reserve(part, {"place": PLACE + 18 * wide})

    def _reserve(self, part: str, sizes: dict[str, int]) -> list[int]:
        """Places of the pieces of a part, -1 where it does not vary."""
        starts = []
        for size in sizes.values():
            starts.append(self.size if part in self.varies else -1)
            self.size += _padded(size) if part in self.varies else 0
        return starts

    def constant_block(self, body: FlexibleBody) -> Array:
        """Return the block of a body whose properties are constant, (size,)."""
        out = np.zeros(self.size)
        if self.mass >= 0:
            self.put_moments(out, body.moments)
        if self.stiffness >= 0:
            self.put_stiffness(out, (body.strain.V1 + body.strain.V1.T) / 2, body.strain.f0)
        if self.damping >= 0:
            self.put_damping(out, body.damping)
        if self.strain >= 0:
            self.put_strain(out, body.strain.V2, body.strain.V3)
        for name in self.markers:
            self.put_place(out, name, body.marker(name))
        return out

    def put_moments(self, out: Array, moments: MassMoments, growth: bool = False) -> None:
        """Write mass moments into a block; with `growth` those of the mass that arrives in a unit of time."""
        mass, first, second = (
            (self.growth, self.growth_first, self.growth_second) if growth else (self.mass, self.first, self.second)
        )
        P = moments.second
        out[mass : mass + 13] = np.concatenate([[moments.mass], moments.first[0], P[0, :, 0, :].ravel()])
        self._write_rows(out, first, moments.first[1:].T)
        self._write_rows(out, second, P[:, :, 1:, :].swapaxes(2, 3))

    def put_flow(
        self, out: Array, drift: Array, kick: Array, flow: Array, turn: Array, speed: Array, speed_rate: Array
    ) -> None:
        """Write the material flow (this module's integrals, over A = (rho, shapes)) into a block."""
        rates = [drift[0], kick[0], flow[0, :, 0].ravel(), turn[0, :, 0].ravel(), [speed[0, 0], speed_rate[0, 0]]]
        out[self.rates : self.rates + RATES] = np.concatenate(rates)
        self._write_rows(out, self.drift, drift[1:].T)
        self._write_rows(out, self.kick, kick[1:].T)
        for zero, full, integral in ((self.flow0, self.flow, flow), (self.turn0, self.turn, turn)):
            self._write_rows(out, zero, integral[0, :, 1:].swapaxes(1, 2))  # a c k
            self._write_rows(out, full, np.einsum("kaBc->Back", integral[1:]))
        self._write_rows(out, self.speed, speed[:, 1:])
        self._write_rows(out, self.speed_rate, speed_rate[:, 1:])

    def put_pickup(self, out: Array, pickup: Array) -> None:
        """Write the form (1 + n_shapes, 1 + n_shapes) of the material picked up into a block."""
        out[self.pickup] = pickup[0, 0]
        self._write_rows(out, self.pickup_shapes, pickup[:, 1:])

    def put_stiffness(self, out: Array, V1: Array, f0: Array, rates: bool = False) -> None:
        """Write V1 (n, n) and f0 (n,), or the rates of them, into a block."""
        self._write_rows(out, self.stiffness_rate if rates else self.stiffness, V1)
        self._write_rows(out, self.f0_rate if rates else self.f0, f0)

    def put_damping(self, out: Array, damping: Array) -> None:
        """Write the damping matrix (n, n) into a block."""
        self._write_rows(out, self.damping, damping.T)

    def put_strain(self, out: Array, V2: Array, V3: Array, rates: bool = False) -> None:
        """Write packed V2 and V3, or the rates of them, into a block."""
        table, start = strain_table(V2, V3, self.n), self.strain_rate if rates else self.strain
        out[start : start + table.size] = table.ravel()

    def put_place(self, out: Array, name: str, marker: Marker) -> None:
        """Write position, axes and rows of a marker that does not move of itself into a block."""
        start = self.markers[name]
        out[start : start + 15] = np.concatenate([marker.position, marker.orientation.ravel(), marker.axis])
        for k, rows in ((0, marker.phi), (3, marker.psi)):
            self._write_rows(out, start + PLACE + 3 * k * self.wide, rows)

    def put_motion(self, out: Array, name: str, order: int, position: Array, phi: Array, psi: Array) -> None:
        """Write velocities (order 1) or accelerations (order 2) of a marker's position (3,) and rows (3, n_shapes)."""
        start = self.markers[name]
        out[start + 13 + 3 * order : start + 16 + 3 * order] = position
        for k, rows in ((order, phi), (3 + order, psi)):
            self._write_rows(out, start + PLACE + 3 * k * self.wide, rows)

    @staticmethod
    def _write_rows(out: Array, start: int, rows: Array) -> None:
        rows = np.asarray(rows, float)
        wide = _padded(rows.shape[-1])
        padded = np.zeros((*rows.shape[:-1], wide))
        padded[..., : rows.shape[-1]] = rows
        out[start : start + padded.size] = padded.ravel()


def strain_table(V2: Array, V3: Array, n: int) -> Array:
    """Table of nonlinear strain (n_blocks, n + pairs, COLUMNS) from packed V2 and V3, zeros where these are empty.

    Row m is what the monomial d_i, or d_i d_j (i <= j), adds to the symmetric matrix whose entries k <= l are packed.
    """
    k, l = np.triu_indices(n)
    V2 = unpacked(V2, n, 3) if V2.size else np.zeros((n, n, n))
    V3 = unpacked(V3, n, 4) if V3.size else np.zeros((n, n, n, n))
    rows = np.concatenate([V2[:, k, l], np.where(k == l, 1.0, 2.0)[:, None] * V3[k, l][:, k, l]])
    blocks = -(-len(k) // COLUMNS)
    rows = np.pad(rows, [(0, 0), (0, blocks * COLUMNS - len(k))])
    return np.ascontiguousarray(rows.reshape(len(rows), blocks, COLUMNS).swapaxes(0, 1))


def strain_arrays(table: Array, n: int) -> tuple[Array, Array]:
    """Packed V2 and V3 of the numbers of a `strain_table`."""
    pairs = n * (n + 1) // 2
    rows = table.reshape(-1, n + pairs, COLUMNS).swapaxes(0, 1).reshape(n + pairs, -1)
    number = np.zeros((n, n), np.int64)
    number[np.triu_indices(n)] = np.arange(pairs)
    (a, b, c), (i, j, k, l) = packed_indices(n, 3).T, packed_indices(n, 4).T
    return rows[a, number[b, c]], rows[n + number[i, j], number[k, l]] / np.where(i == j, 1.0, 2.0)


def _padded(n: int) -> int:
    return -(-n // LANE) * LANE
