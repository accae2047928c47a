"""The mesh of a straight beam."""

from __future__ import annotations

LENGTH = 4.0  # m


def beam_mesh(cells: int) -> str:
    """A straight beam along x as an Abaqus deck."""
    nodes = "".join(f"{k + 1}, {LENGTH * k / cells}, 0.0, 0.0\n" for k in range(cells + 1))
    elements = "".join(f"{k + 1}, {k + 1}, {k + 2}\n" for k in range(cells))
    groups = f"*NSET, NSET=ROOT\n1\n*NSET, NSET=TIP\n{cells + 1}\n"
    return f"*NODE\n{nodes}*ELEMENT, TYPE=B31, ELSET=BEAM\n{elements}{groups}"
