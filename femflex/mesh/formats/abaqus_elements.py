"""Abaqus and CalculiX element types: the mesh cell of each type, and the type written for each cell."""

from __future__ import annotations

import re
from functools import cache

# Pattern of the element type, its cell, and the number of nodes of the cell. The first match is used.
ELEMENTS: list[tuple[str, str, int]] = [
    (
        r"(B21|B23|B31|B33|T2D2|T3D2|B31OS|PIPE[23]1|ELBOW31[BC]?|FRAME[23]D|F[23]D2|R[23]D2|RB[23]D2|LINE2)"
        r"(H|OS|OSH|R|E|T)?$",
        "line",
        2,
    ),
    (r"(B22|B32|T2D3|T3D3|PIPE[23]2|ELBOW32)(H|OS|OSH|R|E|T)?$", "line3", 3),
    (r"(S3|STRI3|DS3|CP[SE]3|CPEG3|M3D3|SFM3D3|R3D3|CAX3|AC2D3|DC2D3)(R|RS|H|T)*$", "triangle", 3),
    (r"(STRI65|S6|DS6|CP[SE]6|CPEG6|M3D6|SFM3D6|CAX6)(M|H|MH|T)*$", "triangle6", 6),
    (r"(S4|DS4|CP[SE]4|CPEG4|M3D4|SFM3D4|R3D4|CAX4|AC2D4|DC2D4)(R|RS|RSW|R5|I|H|IH|RH|P|T|RT)*$", "quad", 4),
    (r"(S8|DS8|CP[SE]8|CPEG8|M3D8|SFM3D8|CAX8)(R|R5|H|RH|T|RT)*$", "quad8", 8),
    (r"(S9R5|M3D9)(R)?$", "quad9", 9),
    (r"(C3D4|DC3D4|AC3D4)(H|T)*$", "tetra", 4),
    (r"(C3D10|DC3D10|AC3D10)(H|I|M|MH|HS|T|MT)*$", "tetra10", 10),
    (r"(C3D6|SC6|DC3D6)(H|R|T|E)*$", "wedge", 6),
    (r"(C3D15|DC3D15)(H|V|VH|E)*$", "wedge15", 15),
    (r"(C3D5)(H)?$", "pyramid", 5),
    (r"(C3D8|SC8|CSS8|DC3D8|COH3D8)(R|I|H|IH|RH|RI|T|RT|E)*$", "hexahedron", 8),
    (r"(C3D20|DC3D20)(R|H|RH|RI|RBR|L|T|RT|RB|RL|E)*$", "hexahedron20", 20),
]
WRITTEN_TYPES = {
    "line": "B31",
    "line3": "B32",
    "triangle": "S3",
    "triangle6": "STRI65",
    "quad": "S4",
    "quad8": "S8R",
    "quad9": "S9R5",
    "tetra": "C3D4",
    "tetra10": "C3D10",
    "wedge": "C3D6",
    "wedge15": "C3D15",
    "pyramid": "C3D5",
    "hexahedron": "C3D8",
    "hexahedron20": "C3D20",
}
END_MIDDLE_END = [0, 2, 1]  # line elements of three nodes name the middle one second


@cache
def cell_of(kind: str) -> tuple[str, int]:
    """Cell and number of nodes of an element type in capitals; ("", 0) if the type is no mesh cell."""
    return next(((cell, count) for pattern, cell, count in ELEMENTS if re.match(pattern, kind)), ("", 0))
