"""Abaqus element types: what meshio is reported when reading, and what is written for our cells."""

from __future__ import annotations

# Element type -> the type meshio is reported, and the number of nodes. First match counts.
ELEMENTS: list[tuple[str, str, int]] = [
    (r"(B21|B23|B31|B33|T2D2|T3D2|B31OS|PIPE[23]1|FRAME[23]D|F[23]D2|R[23]D2|RB[23]D2|LINE2)(H|OS|OSH|E)?$", "B31", 2),
    (r"(B22|B32|T2D3|T3D3|PIPE[23]2)(H|OS|OSH|R|E)?$", "B32", 3),
    (r"(S3|STRI3|DS3|CP[SE]3|CPEG3|M3D3|SFM3D3|R3D3|CAX3|AC2D3|DC2D3)(R|RS|H|T)*$", "S3", 3),
    (r"(STRI65|S6|DS6|CP[SE]6|CPEG6|M3D6|SFM3D6|CAX6)(M|H|MH|T)*$", "STRI65", 6),
    (r"(S4|DS4|CP[SE]4|CPEG4|M3D4|SFM3D4|R3D4|CAX4|AC2D4|DC2D4)(R|RS|RSW|R5|I|H|IH|RH|P|T|RT)*$", "S4", 4),
    (r"(S8|DS8|CP[SE]8|CPEG8|M3D8|SFM3D8|CAX8)(R|R5|H|RH|T|RT)*$", "S8R", 8),
    (r"(S9R5|M3D9)(R)?$", "S9R5", 9),
    (r"(C3D4|DC3D4|AC3D4)(H|T)*$", "C3D4", 4),
    (r"(C3D10|DC3D10|AC3D10)(H|I|M|MH|HS|T|MT)*$", "C3D10", 10),
    (r"(C3D6|SC6|DC3D6)(H|R|T)*$", "C3D6", 6),
    (r"(C3D15|DC3D15)(H|V|VH)*$", "C3D15", 15),
    (r"(C3D5)(H)?$", "C3D5", 5),
    (r"(C3D8|SC8|CSS8|DC3D8)(R|I|H|IH|RH|T|RT)*$", "C3D8", 8),
    (r"(C3D20|DC3D20)(R|H|RH|T|RT)*$", "C3D20", 20),
]
WRITTEN = {
    "line": ("B31", "B31H"),  # our type, and the odd one meshio writes
    "line3": ("B32", "B33H"),
    "triangle": ("S3", "R3D3"),
    "triangle6": ("STRI65", "CPE6"),
    "quad": ("S4", "CAX4P"),
    "quad8": ("S8R", "S8R5"),
    "quad9": ("S9R5", "S9R5"),
    "tetra": ("C3D4", "C3D4"),
    "tetra10": ("C3D10", "C3D10MH"),
    "wedge": ("C3D6", "C3D6"),
    "wedge15": ("C3D15", "C3D15"),
    "pyramid": ("C3D5", "C3D5"),
    "hexahedron": ("C3D8", "C3D8RH"),
    "hexahedron20": ("C3D20", "C3D20RH"),
}
