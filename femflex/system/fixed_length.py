"""Deploying bodies at one length: a body as its table has it there, and a length that stays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments, Skin, StrainTensors
from femflex.system.length_table import LengthTable
from femflex.system.profile import Profile
from femflex.system.system import System
from femflex.system.variation import PLACE, Block, Variation, strain_arrays


def with_fixed_lengths(system: System, at: float) -> System:
    """The system whose deploying bodies have the length of the time `at` [s], and keep it.

    Raises ValueError for a body whose length is free.
    """
    bodies, varying = dict(system.bodies), dict(system.varying)
    for name, variation in system.varying.items():
        table = variation.write
        if not isinstance(table, LengthTable):
            continue
        if isinstance(table.length, str):
            raise ValueError(
                f"the length of body {name!r} is free (state {table.length!r}), and an equilibrium needs a fixed one; "
                "replace reel by length"
            )
        if not table.length.moves:
            continue
        length = float(table.length(at)[0])
        if not np.isfinite(length):
            raise ValueError(
                f"the length of body {name!r} is known from {table.length.first:g} s to {table.length.last:g} s, and "
                f"needed at {at:g} s; give a time within, or the rest of its profile"
            )
        if variation.whole is None:
            bodies[name] = body_at_length(system.bodies[name], variation, length)
        varying[name] = replace(variation, write=replace(table, length=Profile.constant(length)))
    return replace(system, bodies=bodies, varying=varying)


def moving_lengths(system: System) -> list[str]:
    """Names of the bodies whose length is a profile that moves."""
    tables = {name: variation.write for name, variation in system.varying.items()}
    return [
        name
        for name, table in tables.items()
        if isinstance(table, LengthTable) and isinstance(table.length, Profile) and table.length.moves
    ]


def fixed_lengths(system: System) -> dict[str, float]:
    """Length [m] of every deploying body whose length stays."""
    tables = {name: variation.write for name, variation in system.varying.items()}
    return {
        name: float(table.length(0.0)[0])
        for name, table in tables.items()
        if isinstance(table, LengthTable) and isinstance(table.length, Profile) and not table.length.moves
    }


def body_at_length(body: FlexibleBody, variation: Variation, length: float) -> FlexibleBody:
    """The body (moments, stiffness, damping, markers, skin) as its LengthTable has it at a length [m].

    body: as it is at the first length of the profile.
    """
    table = variation.write
    assert isinstance(table, LengthTable)
    assert not isinstance(table.length, str)
    first = float(table.length(max(0.0, table.length.first))[0])
    parts, numbers, n, n_shapes = Block(body, variation.varies), table.block_at(length), body.n_modes, body.n_shapes

    def rows(offset: int, *shape: int, width: int) -> Array:
        wide = -(-width // 4) * 4
        return numbers[offset : offset + int(np.prod(shape)) * wide].reshape(*shape, wide)[..., :width]

    out = body
    if parts.mass >= 0:
        out = replace(out, moments=_moments(parts, numbers, n_shapes, rows))
    if parts.stiffness >= 0:
        V1 = rows(parts.stiffness, n, width=n)
        omega = body.omega.copy()
        mass = np.diag(out.moments.elastic_mass())[:n]
        omega[:n] = np.sqrt(np.maximum(np.diag(V1) / np.maximum(mass, 1e-300), 0.0))
        strain = StrainTensors.linear(V1.copy())
        if parts.strain >= 0:
            V2, V3 = strain_arrays(numbers[parts.strain : parts.strain_rate], n)
            strain = replace(strain, V2=V2, V3=V3)
        out = replace(out, strain=strain, omega=omega)
    if parts.damping >= 0:
        out = replace(out, damping=rows(parts.damping, n, width=n).T.copy())
    markers = dict(body.markers)
    for name, start in parts.markers.items():
        phi, psi = (rows(start + PLACE + 3 * k * parts.wide, 3, width=n_shapes).copy() for k in (0, 3))
        markers[name] = replace(markers[name], position=numbers[start : start + 3].copy(), phi=phi, psi=psi)
    return replace(out, markers=markers, skin=_skin(body, length / first))


def _moments(parts: Block, numbers: Array, n_shapes: int, rows: Any) -> MassMoments:
    first, second = np.zeros((1 + n_shapes, 3)), np.zeros((1 + n_shapes, 3, 1 + n_shapes, 3))
    mass = float(numbers[parts.mass])
    first[0] = numbers[parts.mass + 1 : parts.mass + 4]
    second[0, :, 0, :] = numbers[parts.mass + 4 : parts.mass + 13].reshape(3, 3)
    if n_shapes:
        first[1:] = rows(parts.first, 3, width=n_shapes).T
        second[:, :, 1:, :] = rows(parts.second, 1 + n_shapes, 3, 3, width=n_shapes).swapaxes(2, 3)
        second[1:, :, 0, :] = second[0, :, 1:, :].transpose(1, 2, 0)
    return MassMoments(mass, first, second)


def _skin(body: FlexibleBody, ratio: float) -> Skin | None:
    """The skin, grown by a ratio; shapes that draw the member in as it bends go with the inverse."""
    skin = body.skin
    if skin is None or skin.growth is None:
        return skin
    draws = np.array([kind == "derivative" for kind in body.kinds], np.bool_)
    shapes = np.where(draws[:, None, None], skin.shapes / ratio, skin.shapes)
    return Skin(skin.points + (ratio - 1.0) * skin.growth, skin.cells, shapes, ratio * skin.growth)
