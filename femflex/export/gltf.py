"""glTF 2.0 (ISO/IEC 12113:2022) in one binary file: bodies are nodes that move, shapes are morph targets.

A long run is small: an instant has seven numbers of each body and one of each shape. At the written instants the points
are exact (single precision). The normals of a morph target are the secant at the largest amplitude of the run.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.export.moving_bodies import MovingBody, described, moving_craft
from femflex.results import Run
from femflex.view.theme import THEMES
from femflex.writing import atomic_file

FLOAT, UNSIGNED = 5126, 5125  # component types
VERTICES, INDICES = 34962, 34963  # targets of buffer views
LINES, TRIANGLES, POINTS = 1, 4, 0  # modes of primitives
UPRIGHT = {1: [0.0, 0.0, 0.0, 1.0], 2: [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]}  # that turn an axis to +Y, glTF's up


def write_glb(run: Run, path: str | Path, camera: str = "auto", instants: int = 0, force: bool = False) -> list[str]:
    """Write the drawn bodies of a run and their motion. Returns what is worth saying, as lines.

    camera, instants: see `femflex.export.export_run`. Raises ValueError where nothing can be drawn, and OSError.
    """
    craft = moving_craft(run, camera, instants)
    buffer = _Buffer()
    theme = THEMES["light"]
    colours = theme.rigid[: len(craft.bodies)]
    materials = [_material(colour) for colour in (*colours, theme.edge)]
    times = buffer.add((craft.times - craft.times[0]).astype(np.float32), "SCALAR", bounds=True)
    nodes: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []

    def animate(node: int, path: str, values: Array, kind: str) -> None:
        output = buffer.add(values.astype(np.float32), kind)
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})

    for k, body in enumerate(craft.bodies):
        turn = body.quaternion[:, [1, 2, 3, 0]]
        node = {"name": body.name, "translation": body.position[0].tolist(), "rotation": turn[0].tolist()}
        primitives = _primitives(body, buffer, k % len(colours), len(colours))
        if primitives:
            node["mesh"] = len(meshes)
            mesh: dict[str, Any] = {"name": body.name, "primitives": primitives}
            if body.weights.shape[1]:
                mesh["weights"] = body.weights[0].tolist()
                mesh["extras"] = {"targetNames": [f"shape {i + 1}" for i in range(body.weights.shape[1])]}
            meshes.append(mesh)
        animate(k, "translation", body.position, "VEC3")
        animate(k, "rotation", turn, "VEC4")
        if body.weights.shape[1]:
            animate(k, "weights", body.weights.ravel(), "SCALAR")
        nodes.append(node)
    nodes.append({"name": "craft", "children": list(range(len(nodes))), "rotation": UPRIGHT[craft.up]})
    facts = described(craft)
    document = {
        "asset": {"version": "2.0", "generator": "femflex", "extras": {"title": run.title, **facts}},
        "scene": 0,
        "scenes": [{"nodes": [len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "animations": [{"name": "run", "samplers": samplers, "channels": channels}],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.size}],
    }
    if not meshes:
        del document["meshes"]
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    with atomic_file(path, force) as part, open(part, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + buffer.size))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", buffer.size, b"BIN\0"))
        for chunk in buffer.chunks:
            file.write(chunk)
    error = facts["largest_error_between_instants_m"]
    return [
        f"{len(craft.bodies)} bodies at {len(craft.times)} instants, {facts['axes']} axes",
        f"exact at the instants; between them points are at most {error:.2g} m off",
    ]


class _Buffer:
    """The binary part of the file, with its accessors and views."""

    def __init__(self) -> None:
        self.chunks: list[bytes] = []
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.size = 0

    def add(self, values: NDArray[Any], kind: str, bounds: bool = False, target: int = 0) -> int:
        """Number of a new accessor of values (n,) or (n, k), of a kind such as "VEC3"."""
        data = np.ascontiguousarray(values).tobytes()
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self.size, "byteLength": len(data)}
        accessor: dict[str, Any] = {
            "bufferView": len(self.views),
            "componentType": UNSIGNED if values.dtype == np.uint32 else FLOAT,
            "count": len(values),
            "type": kind,
        }
        if target:
            view["target"] = target
        if bounds:
            rows = values.reshape(len(values), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.views.append(view)
        self.accessors.append(accessor)
        self.chunks.append(data + b"\0" * (-len(data) % 4))
        self.size += len(self.chunks[-1])
        return len(self.accessors) - 1


def _primitives(body: MovingBody, buffer: _Buffer, colour: int, edge: int) -> list[dict[str, Any]]:
    """Faces, and edges, lines and dots, of one body, with materials by their numbers."""
    surface, out = body.surface, []
    faces = np.concatenate([surface.triangles, surface.quads[:, [0, 1, 2]], surface.quads[:, [0, 2, 3]]])
    if len(faces):
        rest, shapes = surface.skin.reference, surface.skin.shapes
        normals = surface.normals(rest)
        largest = np.maximum(np.abs(body.weights).max(axis=0, initial=0.0), np.finfo(np.float32).tiny)
        bent = [(surface.normals(rest + A * shape) - normals) / A for A, shape in zip(largest, shapes, strict=True)]
        attributes = {"POSITION": buffer.add(rest, "VEC3", True, VERTICES)}
        attributes["NORMAL"] = buffer.add(_unit(normals), "VEC3", False, VERTICES)
        targets = [
            {
                "POSITION": buffer.add(shape, "VEC3", True, VERTICES),
                "NORMAL": buffer.add(change, "VEC3", False, VERTICES),
            }
            for shape, change in zip(shapes, np.asarray(bent, np.float32), strict=True)
        ]
        out.append(
            _primitive(attributes, buffer.add(_flat(faces), "SCALAR", False, INDICES), TRIANGLES, colour, targets)
        )
    if len(surface.wires.reference):
        attributes = {"POSITION": buffer.add(surface.wires.reference, "VEC3", True, VERTICES)}
        targets = [{"POSITION": buffer.add(shape, "VEC3", True, VERTICES)} for shape in surface.wires.shapes]
        for cells, mode, material in (
            (surface.edges, LINES, edge),
            (surface.lines, LINES, colour),
            (surface.dots, POINTS, colour),
        ):
            if len(cells):
                indices = buffer.add(_flat(cells), "SCALAR", False, INDICES)
                out.append(_primitive(attributes, indices, mode, material, targets))
    return out


def _primitive(
    attributes: dict[str, int], indices: int, mode: int, material: int, targets: Sequence[dict[str, int]]
) -> dict[str, Any]:
    primitive = {"attributes": attributes, "indices": indices, "mode": mode, "material": material}
    return primitive | ({"targets": list(targets)} if targets else {})


def _flat(cells: NDArray[Any]) -> NDArray[Any]:
    return cells.ravel().astype(np.uint32)


def _unit(normals: NDArray[Any]) -> NDArray[Any]:
    """The normals, with +Z in place of those without a direction, which glTF does not allow."""
    bad = np.abs(np.linalg.norm(normals, axis=1) - 1.0) > 1e-3
    return np.where(bad[:, None], np.array([0.0, 0.0, 1.0], np.float32), normals)


def _material(colour: str) -> dict[str, Any]:
    """A matt material of a colour such as "#4477aa"; glTF counts light linearly."""
    shown = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
    surface = {"baseColorFactor": [*linear.tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}
    return {"pbrMetallicRoughness": surface, "doubleSided": True}
