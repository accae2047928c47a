"""The attribute part of legacy VTK files: arrays over cells and points, text and binary."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

TYPES = {
    "bit": "u1", "unsigned_char": "u1", "char": "i1", "unsigned_short": "u2", "short": "i2", "unsigned_int": "u4",
    "int": "i4", "unsigned_long": "u8", "long": "i8", "float": "f4", "double": "f8", "vtkidtype": "i8",
    "vtktypeint8": "i1", "vtktypeint16": "i2", "vtktypeint32": "i4", "vtktypeint64": "i8",
    "vtktypeuint8": "u1", "vtktypeuint16": "u2", "vtktypeuint32": "u4", "vtktypeuint64": "u8",
}  # fmt: skip
FIXED = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6, "GLOBAL_IDS": 1, "PEDIGREE_IDS": 1}  # components
Arrays = dict[str, NDArray[Any]]


def geometry_and_attributes(data: bytes) -> tuple[bytes, bytes]:
    """The file up to its CELL_DATA or POINT_DATA, and the rest."""
    found = re.search(rb"\n(CELL_DATA|POINT_DATA)\s+\d+\s*\n", data, re.I)
    return (data[: found.start() + 1], data[found.start() + 1 :]) if found else (data, b"")


def is_binary(data: bytes) -> bool:
    """Whether the third line says BINARY."""
    lines = data.split(b"\n", 3)
    return len(lines) > 2 and lines[2].strip().upper() == b"BINARY"


def cell_types(geometry: bytes) -> NDArray[np.int64]:
    """VTK's type number (n_cells,) of every cell."""
    found = re.search(rb"\nCELL_TYPES\s+(\d+)\s*?\n", geometry, re.I)
    if not found:
        return np.empty(0, np.int64)
    reader = _Reader(geometry[found.end() :], is_binary(geometry))
    return reader.values(int(found[1]), "int").astype(np.int64)


def read_attributes(attributes: bytes, binary: bool) -> tuple[Arrays, Arrays]:
    """Arrays (n,) or (n, components) over cells and over points, by name."""
    reader, found = _Reader(attributes, binary), dict[str, Arrays](CELL_DATA={}, POINT_DATA={})
    into, count = found["CELL_DATA"], 0
    while words := reader.words():
        section = words[0].upper()
        if section in found:
            into, count = found[section], int(words[1])
        elif section == "METADATA":
            reader.skip_block()
        elif section == "FIELD":
            for _ in range(int(words[2])):
                head = reader.words()
                if head and head[0].upper() == "METADATA":
                    reader.skip_block()
                    head = reader.words()
                into[head[0]] = reader.array(int(head[2]), int(head[1]), head[3])
        elif section == "SCALARS":
            reader.words()  # LOOKUP_TABLE name
            into[words[1]] = reader.array(count, int(words[3]) if len(words) > 3 else 1, words[2])
        elif section == "COLOR_SCALARS":  # unsigned char in binary, shares of 255 in text
            values = reader.array(count, int(words[2]), "unsigned_char" if binary else "float")
            into[words[1]] = values if binary else np.rint(values * 255).astype(np.uint8)
        elif section == "LOOKUP_TABLE":
            reader.array(int(words[2]), 4, "unsigned_char" if binary else "float")
        elif section == "TEXTURE_COORDINATES":
            into[words[1]] = reader.array(count, int(words[2]), words[3])
        elif section in FIXED:
            into[words[1]] = reader.array(count, FIXED[section], words[2])
        else:
            raise ValueError(f"section {words[0]!r} of the attributes is not known")
    return found["CELL_DATA"], found["POINT_DATA"]


def attributes_section(cells: Mapping[str, NDArray[Any]], points: Mapping[str, NDArray[Any]], binary: bool) -> bytes:
    """Arrays of whole numbers over cells (e,) and points (n_p,) as the attribute part of a file."""
    parts = []
    for section, arrays in (("CELL_DATA", cells), ("POINT_DATA", points)):
        if not arrays:
            continue
        count = len(next(iter(arrays.values())))
        parts.append(f"{section} {count}\nFIELD FieldData {len(arrays)}\n".encode())
        for name, values in arrays.items():
            body = values.astype(">i4").tobytes() if binary else " ".join(map(str, values)).encode()
            parts.append(f"{name} 1 {count} int\n".encode() + body + b"\n")
    return b"".join(parts)


class _Reader:
    """Steps through lines and arrays of bytes."""

    def __init__(self, data: bytes, binary: bool) -> None:
        self._data, self._binary, self._at = data, binary, 0

    def words(self) -> list[str]:
        """Words of the next line that is not blank; none at the end."""
        while self._at < len(self._data):
            line = self._line()
            if line.strip():
                return line.decode("utf-8", "replace").split()
        return []

    def skip_block(self) -> None:
        """Go on behind the next blank line."""
        while self._at < len(self._data) and self._line().strip():
            pass

    def array(self, count: int, components: int, kind: str) -> NDArray[Any]:
        values = self.values(count * components, kind)
        return values if components == 1 else values.reshape(count, components)

    def values(self, count: int, kind: str) -> NDArray[Any]:
        """The next count values; binary ones have the most significant byte first."""
        dtype = np.dtype(TYPES[kind.lower()])
        if self._binary:
            values = np.frombuffer(self._data, dtype.newbyteorder(">"), count, self._at)
            self._at += values.nbytes
            return values.astype(dtype)
        words = list(islice(re.compile(rb"\S+").finditer(self._data, self._at), count))
        if len(words) < count:
            raise ValueError(f"{count} values are announced, and {len(words)} are there")
        if words:
            self._at = words[-1].end()
        return np.array([word[0] for word in words]).astype(float).astype(dtype)

    def _line(self) -> bytes:
        end = self._data.find(b"\n", self._at)
        end = len(self._data) if end < 0 else end
        line, self._at = self._data[self._at : end], end + 1
        return line
