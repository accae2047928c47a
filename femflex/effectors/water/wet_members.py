"""Slender members, cables and rods in water: drag, added mass, buoyancy, waves and sea floor along the deformed axis.

Every patch of a group of lines, or piece of a straight rod, has a marker with the mean motion of its axis, and every
mass of a cable stands for its part of the length, along the line between its neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker
from femflex.body.patches import patch_marker
from femflex.effectors.cable import Cable
from femflex.effectors.noun import EffectorNoun
from femflex.effectors.water import morison as at
from femflex.effectors.water.morison import OnPiece, on_piece, wet_length
from femflex.effectors.water.water import Water, water_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import ACT, Entry, entry
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, Vector, add, cross, dot, load3, load9, scale, store3, sub, turn
from femflex.noun.problems import suggestion_text
from femflex.noun.table import refuse
from femflex.noun.values import Count, Position, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.segments import Segments, segment_name

Factor = Annotated[float, Quantity(least=0.0)]
CHANNELS = {"lift": "N", "drag_x": "N", "drag_y": "N", "drag_z": "N", "floor": "N", "wetted": "m"}
MATRIX = 36  # numbers of the mass at a marker
SHIFT = 1e-9  # of a length: ends of a rod closer than this are one point


class WetMember(EffectorNoun, heading="wet_members"):
    """A slender round member in water: a group of lines of a body, a straight rod on a body, or a cable with mass.

    Channels: lift, the buoyancy; drag_x, drag_y, drag_z along inertial axes; floor, the normal force of the sea floor;
    wetted, the length in water. Ends count as closed: buoyancy is the weight of the displaced water along the whole
    length.
    """

    body: str | None = None
    """Body that it is part of, with `group`, or with `start` and `end`."""
    group: str = "all"
    """Group of lines of the body. Of a beam on admissible functions and of a body in segments "all"."""
    start: Position | None = None
    """One end of a straight rod that is fixed to the body frame, with `end`."""
    end: Position | None = None
    """The other end of the rod."""
    pieces: Annotated[int, Count(1, 500)] = 10
    """Number of pieces of the rod."""
    cable: str | None = None
    """Cable with mass, by its name in [cables], in place of a body."""
    water: str | None = None
    """The water, a name in [water]. Default: the only one."""
    diameter: Annotated[float, Quantity("m", above=0.0)]
    """Outer diameter."""
    inner_diameter: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Inner diameter of a flooded tube."""
    flooded: bool = False
    """Whether the tube is full of water, which moves across with it and weighs nothing in water. Needs the inner
    diameter."""
    Ca: Factor = 1.0
    """Added mass across the axis, over that of the displaced water. There is none along it."""
    Cd: Factor = 1.2
    """Drag across the axis, by the diameter."""
    Cf: Factor = 0.0
    """Friction along the axis, by the circumference."""
    linear_drag: Literal["current", "amplitude", "sea_state"] = "current"
    """Drag in linear models and modes. current: the slope about the current, none in water at rest. amplitude: that
    which loses the same energy per period of a motion with `amplitude`. sea_state: that for the speeds of the waves."""
    amplitude: Annotated[float, Quantity("m/s", above=0.0)] | None = None
    """Amplitude of the velocity for linear_drag = "amplitude"."""

    label = "wet member"
    channels = CHANNELS
    accounts = ("energy", "dissipation", "supplied")
    exerts = ("force", "torque")
    writes_all = True

    @model_validator(mode="after")
    def _keys_fit(self) -> WetMember:
        if (self.body is None) == (self.cable is None):
            refuse("found body and cable together, or neither; give one of them")
        if (self.start is None) != (self.end is None):
            refuse("found one of start and end; a rod needs both")
        if self.start is not None and math.dist(self.start, self.end or self.start) <= SHIFT * self.diameter:
            refuse("found start and end at one place; a rod has a length")
        if self.cable is not None and (self.start is not None or self.group != "all"):
            refuse("found cable with start, end or group; a cable is in water along its whole length")
        if self.flooded != (self.inner_diameter > 0.0):
            refuse("found one of flooded and inner_diameter; a flooded tube needs both, others neither")
        if self.inner_diameter >= self.diameter:
            refuse(f"found inner_diameter {self.inner_diameter:g} m; it must be below the diameter")
        if (self.amplitude is None) == (self.linear_drag == "amplitude"):
            refuse('found one of amplitude and linear_drag = "amplitude"; give both, or neither')
        return self

    def needed_patches(self) -> tuple[tuple[str, str], ...]:
        """(body, group) of its patches, of a group of lines."""
        return () if self.body is None or self.start is not None else ((self.body, self.group),)

    def parameters(self) -> Array:
        """None but those of `effector`, which depend on the body."""
        return np.zeros(0)

    def carrier(self, name: str, body: FlexibleBody) -> FlexibleBody:
        """The body with a marker at the middle of every piece of a rod."""
        if self.start is None:
            return body
        places, _ = self._rod()
        markers = {f".{name}.{k}": Marker.at_position(place, n_modes=body.n_shapes) for k, place in enumerate(places)}
        return replace(body, markers=body.markers | markers)

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """Its one effector; none of a cable, whose masses are placed when its ends are known (`on_cable`).

        Raises ValueError for a body without such lines, and for a cable without mass.
        """
        if self.cable is not None:
            self._cable_pieces(context)
            return ()
        return (self._effector(name, *self._pieces(name, context), self.act, member_masses, context),)

    def on_cable(self, name: str, context: Context) -> Effector:
        """Its effector on the masses of a cable. Raises ValueError."""
        return self._effector(name, *self._cable_pieces(context), wet_cable, cable_masses, context)

    @property
    def displaced(self) -> float:
        """Area of the section whose water it displaces [m^2]."""
        return math.pi * (self.diameter**2 - self.inner_diameter**2) / 4

    def _effector(
        self,
        name: str,
        markers: tuple[tuple[str, str], ...],
        pieces: Array,
        act: Entry,
        masses: Entry,
        context: Context,
    ) -> Effector:
        water = water_of(context, self.water)
        sea = water.sea(context)
        outer, inner_area = math.pi * self.diameter**2 / 4, math.pi * self.inner_diameter**2 / 4
        speeds = {"current": at.CURRENT, "sea_state": at.SEA_STATE}
        amplitude = 8.0 / (3.0 * math.pi) * (self.amplitude or 0.0)
        head = [
            len(pieces),
            self.diameter,
            outer,
            self.displaced,
            sea[0] * self.Ca * outer,
            sea[0] * inner_area,
            self.Cd,
            self.Cf,
            0.0,
        ]
        head += [speeds.get(self.linear_drag, amplitude), at.HEAD + pieces.size]
        parameters = np.concatenate([head, pieces.ravel(), sea])

        effector = Effector(
            name, act, markers, channels=self.channels, accounts=self.accounts, exerts=self.exerts,
            parameters=parameters, kind=self.label, added_mass=masses, linear=_linear,
            linear_note=self._left_out(name, water),
        )  # fmt: skip
        return effector

    def _left_out(self, name: str, water: Water) -> str:
        """Names of the effects that linear models leave out."""
        parts = [f"waves of {name!r}"] if water.waves else []
        if self.linear_drag == "current" and not water.current and self.Cd + self.Cf > 0.0:
            parts.append(f"drag of {name!r}, which has no slope in water at rest (linear_drag)")
        return ", ".join([*parts, *([f"friction of the floor on {name!r}"] if water.friction else [])])

    def _rod(self) -> tuple[Array, Array]:
        """Middles (pieces, 3) of the pieces of the rod, and their rows."""
        start, end = np.array(self.start), np.array(self.end)
        length = float(np.linalg.norm(end - start))
        shares = (np.arange(self.pieces) + 0.5) / self.pieces
        row = np.append((end - start) / length, length / self.pieces)
        return start + shares[:, None] * (end - start), np.tile(row, (self.pieces, 1))

    def _pieces(self, name: str, context: Context) -> tuple[tuple[tuple[str, str], ...], Array]:
        """Markers, and a row of tangent and length for each."""
        assert self.body is not None
        body = context.bodies.get(self.body)
        if body is None:
            known = suggestion_text(self.body, context.bodies)
            raise ValueError(f"found body {self.body!r}, which does not exist; {known}")
        if self.start is not None:
            if isinstance(body, Segments):
                raise ValueError(f"body {self.body!r} is cut into segments; name a group of lines, not start and end")
            return tuple((self.body, f".{name}.{k}") for k in range(self.pieces)), self._rod()[1]
        cut = body.bodies if isinstance(body, Segments) else (body,)
        names = [segment_name(self.body, j) for j in range(len(cut))] if isinstance(body, Segments) else [self.body]
        markers, rows = [], []
        for part_name, part in zip(names, cut, strict=True):
            patches = part.patches.get(self.group)
            if patches is None or patches.dimension != 1:
                continue
            for k, (normal, size) in enumerate(zip(patches.normal, patches.size, strict=True)):
                marker = patch_marker(self.group, k)
                tangent = part.marker(marker).orientation.T @ normal / np.linalg.norm(normal)
                markers.append((part_name, marker))
                rows.append([*tangent, size])
        if not rows:
            raise ValueError(
                f"body {self.body!r} has no lines of group {self.group!r}; give a group of lines of a body with a "
                "mesh, a beam on admissible functions, or start and end of a rod"
            )
        return tuple(markers), np.array(rows)

    def _cable_pieces(self, context: Context) -> tuple[tuple[tuple[str, str], ...], Array]:
        """Ends and masses of the cable, and a row for each mass. Raises ValueError for a cable without mass."""
        assert self.cable is not None
        cable = context.nouns.get(self.cable)
        if not isinstance(cable, Cable):
            known = [key for key, noun in context.nouns.items() if isinstance(noun, Cable)]
            raise ValueError(
                f"found cable {self.cable!r}, which is not in [cables]; {suggestion_text(self.cable, known)}"
            )
        if cable.mass_per_length is None:
            raise ValueError(f"cable {self.cable!r} has no mass; give its mass_per_length, and it lies in water")
        n, ends = cable.masses, cable.markers()
        length = float(cable.profile(context)(0.0)[0])
        rows = np.tile([0.0, 0.0, 0.0, length / n], (n, 1))
        return (ends[0], *((f"{self.cable}_{k + 1}", "origin") for k in range(n)), ends[1]), rows


def _linear(effector: Effector) -> Effector:
    """The effector without waves, its drag to first order in velocities."""
    changed = effector.parameters.copy()
    changed[at.IS_LINEAR] = 1.0
    return replace(effector, parameters=changed, linear=None)


@inner
def store_sums(out: Array, first: int, sums: OnPiece) -> None:
    """Write channels and accounts behind forces and torques."""
    out[first] = sums.lifted
    store3(out, first + 1, sums.drag)
    out[first + 4], out[first + 5] = sums.pressed, sums.wet
    out[first + 6], out[first + 7], out[first + 8], out[first + 9] = sums.energy, sums.lost, sums.brought, 0.0


@inner
def no_sums() -> OnPiece:
    """Sums to begin with."""
    return OnPiece(ZERO, ZERO, ZERO, 0.0, 0.0, 0.0, 0.0, 0.0, ZERO, 0.0, 0.0)


@inner
def added(a: OnPiece, b: OnPiece, power: float) -> OnPiece:
    """Sums of what pieces say; power: that of the force and couple of b."""
    return OnPiece(
        ZERO, ZERO, ZERO, 0.0, a.energy + b.energy, a.lost + b.lost, a.brought + b.brought + power,
        a.lifted + b.lifted, add(a.drag, b.drag), a.pressed + b.pressed, a.wet + b.wet,
    )  # fmt: skip


@inner
def store_mass(out: Array, k: int, mass: float, square: float, tangent: Vector) -> None:
    """Write mass times 1 - t t^T, and for turns times the square of a gyration, as the mass (6, 6) of marker k."""
    first = MATRIX * k
    for j in range(MATRIX):
        out[first + j] = 0.0
    for i in range(3):
        for j in range(3):
            across = mass * ((1.0 if i == j else 0.0) - tangent[i] * tangent[j])
            out[first + 6 * i + j] = across
            out[first + 6 * (3 + i) + 3 + j] = square * across


@WetMember.kernel
def wet_member(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Forces and torques on the pieces of lines and rods."""
    p = parameters
    m, w = int(p[at.COUNT]), offset(p, int(p[at.SEA]))
    sums = no_sums()
    for k in range(m):
        piece = at.HEAD + at.PIECE * k
        tangent = turn(load9(seen, 3 * m + 9 * k), load3(p, piece + at.TANGENT))
        v, omega = load3(seen, 12 * m + 3 * k), load3(seen, 15 * m + 3 * k)
        turning, length = cross(omega, tangent), p[piece + at.LENGTH]
        felt = on_piece(t, load3(seen, 3 * k), tangent, v, turning, length, 1.0, p, w)
        gyroscopic = scale(felt.mass * length * length / 12.0 * dot(tangent, omega), turning)
        store3(out, 3 * k, felt.force)
        store3(out, 3 * m + 3 * k, add(felt.couple, gyroscopic))
        sums = added(sums, felt, dot(felt.force, v) + dot(felt.couple, omega))
    store_sums(out, 6 * m, sums)


@entry(ACT)
def member_masses(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Added mass of the pieces."""
    p = parameters
    m, w = int(p[at.COUNT]), offset(p, int(p[at.SEA]))
    for k in range(m):
        piece = at.HEAD + at.PIECE * k
        tangent = turn(load9(seen, 3 * m + 9 * k), load3(p, piece + at.TANGENT))
        length = p[piece + at.LENGTH]
        wet = wet_length(t, load3(seen, 3 * k), tangent, length, p, w)
        store_mass(out, k, (p[at.ADDED] + p[at.INSIDE]) * wet, length * length / 12.0, tangent)


@inner
def chord(seen: Array, k: int) -> tuple[Vector, float]:
    """Unit vector between the neighbours of mass k of a cable, and their distance."""
    line = sub(load3(seen, 3 * k + 3), load3(seen, 3 * k - 3))
    d = math.sqrt(dot(line, line))
    return scale(1.0 / d, line), d


@entry(ACT)
def wet_cable(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Forces on the masses of a cable, and on their neighbours as these turn the tangent."""
    p = parameters
    n, w = int(p[at.COUNT]), offset(p, int(p[at.SEA]))
    m, sums = n + 2, no_sums()
    for k in range(6 * m):
        out[k] = 0.0
    for k in range(1, n + 1):
        tangent, d = chord(seen, k)
        before, v = load3(seen, 12 * m + 3 * k - 3), load3(seen, 12 * m + 3 * k)
        after = load3(seen, 12 * m + 3 * k + 3)
        change = sub(after, before)
        turning = scale(1.0 / d, sub(change, scale(dot(change, tangent), tangent)))
        felt = on_piece(t, load3(seen, 3 * k), tangent, v, turning, p[at.HEAD + at.LENGTH], 0.0, p, w)
        across = scale(1.0 / d, sub(felt.by_tangent, scale(dot(felt.by_tangent, tangent), tangent)))
        store3(out, 3 * k, add(load3(out, 3 * k), felt.force))
        store3(out, 3 * k + 3, add(load3(out, 3 * k + 3), across))
        store3(out, 3 * k - 3, sub(load3(out, 3 * k - 3), across))
        sums = added(sums, felt, dot(felt.force, v) + dot(across, change))
    store_sums(out, 6 * m, sums)


@entry(ACT)
def cable_masses(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Added mass of the masses of a cable."""
    p = parameters
    n, w = int(p[at.COUNT]), offset(p, int(p[at.SEA]))
    store_mass(out, 0, 0.0, 0.0, ZERO)
    store_mass(out, n + 1, 0.0, 0.0, ZERO)
    for k in range(1, n + 1):
        tangent, _ = chord(seen, k)
        wet = wet_length(t, load3(seen, 3 * k), tangent, p[at.HEAD + at.LENGTH], p, w)
        store_mass(out, k, (p[at.ADDED] + p[at.INSIDE]) * wet, 0.0, tangent)
