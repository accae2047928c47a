"""Moving bodies packed for the viewer of a report: a header in JSON and arrays, compressed, as text."""

from __future__ import annotations

import base64
import gzip
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.view.surface import Surface
from femflex.view.theme import THEMES
from femflex.view.units import length_unit

STEPS = 32767  # of a shape's largest displacement, in which the displacements of its points are written
COLOURS = 32  # of the colour map, between which the viewer interpolates


@dataclass(frozen=True, eq=False)
class ShownBody:
    """A body as the viewer draws it.

    grows  whether the last shape is the growth of its length, which is neither magnified nor coloured
    """

    name: str
    surface: Surface
    grows: bool = False


@dataclass(frozen=True, eq=False)
class Clip:
    """A motion of all bodies, over times (n_t,) [s], by the name of each.

    poses    (n_t, 7): place [m], and quaternion, scalar first;  weights  (n_t, k) amplitudes of its surface's shapes
    repeats  whether it goes round without a jump, as a vibration does
    scale    magnification of the elastic displacement at first
    """

    name: str
    times: Array
    poses: Mapping[str, Array]
    weights: Mapping[str, Array]
    scale: float
    repeats: bool = False


def packed(bodies: Sequence[ShownBody], clips: Sequence[Clip], up: int) -> str:
    """The scene as base64 of gzip of: length of the header, header in JSON, and its arrays, each a multiple of 4 bytes.

    up: axis (0, 1 or 2) that points up
    """
    blocks = _Blocks()
    theme = THEMES["light"]
    colours = theme.elastic_colours(COLOURS)
    largest = [max((_largest(body, clip) for body in bodies), default=0.0) for clip in clips]
    header = {
        "up": up,
        "map": np.round(colours, 4).tolist(),
        "bodies": [
            _body_entry(body, theme.rigid[k % len(theme.rigid)], clips, blocks) for k, body in enumerate(bodies)
        ],
        "clips": [
            {
                "name": clip.name,
                "times": blocks.add(clip.times - clip.times[0], np.float32),
                "start": float(clip.times[0]),
                "repeats": clip.repeats,
                "scale": clip.scale,
                "largest": reached,
                "unit": length_unit(reached),
            }
            for clip, reached in zip(clips, largest, strict=True)
        ],
    }
    text = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    data = struct.pack("<I", len(text)) + text + b"".join(blocks.chunks)
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


class _Blocks:
    """Arrays one after the other."""

    def __init__(self) -> None:
        self.chunks: list[bytes] = []
        self.size = 0

    def add(self, values: NDArray[Any], kind: type[np.generic]) -> list[Any]:
        """The entry of an array in the header: type, offset in bytes, and count of numbers."""
        data = np.ascontiguousarray(values, kind).tobytes()
        entry = [np.dtype(kind).str[1:], self.size, int(np.size(values))]
        self.chunks.append(data + b"\0" * (-len(data) % 4))
        self.size += len(self.chunks[-1])
        return entry


def _body_entry(body: ShownBody, colour: str, clips: Sequence[Clip], blocks: _Blocks) -> dict[str, Any]:
    """The header's entry of a body: points of faces first, then those that edges, lines and dots need besides."""
    surface = body.surface
    row_of = dict(zip(surface.skin.numbers.tolist(), range(len(surface.skin.numbers)), strict=True))
    other = [k for k, number in enumerate(surface.wires.numbers.tolist()) if number not in row_of]
    rows = np.array([row_of.get(number, -1) for number in surface.wires.numbers.tolist()], np.int64)
    rows[other] = len(surface.skin.numbers) + np.arange(len(other))
    points = np.concatenate([surface.skin.reference, surface.wires.reference[other]])
    shapes = np.concatenate([surface.skin.shapes, surface.wires.shapes[:, other]], axis=1)
    largest = np.abs(shapes).max(axis=(1, 2), initial=0.0)
    steps = np.where(largest > 0.0, largest, 1.0) / STEPS
    faces = np.concatenate([surface.triangles, surface.quads[:, [0, 1, 2]], surface.quads[:, [0, 2, 3]]])
    return {
        "name": body.name,
        "colour": colour,
        "points": blocks.add(points, np.float32),
        "steps": steps.tolist(),
        "shapes": blocks.add(np.round(shapes / steps[:, None, None]), np.int16),
        "grows": body.grows,
        "faces": blocks.add(faces, np.uint32),
        "edges": blocks.add(rows[surface.edges], np.uint32),
        "lines": blocks.add(rows[surface.lines], np.uint32),
        "dots": blocks.add(rows[surface.dots], np.uint32),
        "poses": [blocks.add(clip.poses[body.name], np.float32) for clip in clips],
        "weights": [blocks.add(clip.weights[body.name], np.float32) for clip in clips],
    }


def _largest(body: ShownBody, clip: Clip) -> float:
    """Largest elastic displacement of a point in a clip [m], among 300 points."""
    weights = clip.weights[body.name]
    count = weights.shape[1] - body.grows
    points = body.surface.skin if len(body.surface.skin.reference) else body.surface.wires
    if not count or not len(points.reference):
        return 0.0
    chosen = np.unique(np.linspace(0, len(points.reference) - 1, 300).round().astype(np.int64))
    u = np.tensordot(weights[:, :count], points.shapes[:count, chosen].astype(float), 1)
    return float(np.linalg.norm(u, axis=-1).max(initial=0.0))
