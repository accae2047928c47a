"""Small Abaqus decks in mm-t-s for tests: a beam, a plate and a brick, read, and their frequencies."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from femflex.decks import Deck, read_deck
from femflex.mesh import box

STEEL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n*DENSITY\n7.85E-9\n"


E, NU, RHO = 210e9, 0.3, 7850.0


def deck(folder: Path, text: str, units: str = "mm-t-s", **overrides: dict) -> Deck:
    path = folder / "model.inp"
    path.write_text(text)
    return read_deck(path, units, overrides or None)


def frequencies(made: Deck, n: int = 4) -> np.ndarray:
    """Lowest natural frequencies [Hz] of a deck under its own supports."""
    structure = made.structure()
    held = structure.constrained_dofs(made.active_supports())
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    K, M = (matrix[free][:, free].toarray() for matrix in (structure.K, structure.M))
    values = eigh(M, K, eigvals_only=True, subset_by_index=[len(free) - n, len(free) - 1])  # massless dofs are zeros
    return 1 / np.sqrt(values[::-1]) / (2 * np.pi)


def beam(section: str, data: str, boundary: str = "1, ENCASTRE", kind: str = "B31", n: int = 10) -> str:
    """A cantilever 1000 mm long along x."""
    nodes = "".join(f"{k + 1}, {1000.0 * k / n}, 0., 0.\n" for k in range(n + 1))
    elements = "".join(f"{k + 1}, {k + 1}, {k + 2}\n" for k in range(n))
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=BOOM\n{elements}{STEEL}"
        f"*BEAM SECTION, SECTION={section}, ELSET=BOOM, MATERIAL=STEEL\n{data}\n*BOUNDARY\n{boundary}\n"
    )


def clamped(I: float, A: float, length: float = 1.0) -> float:
    """First frequency of a slender cantilever [Hz]."""
    return 1.875104069**2 / (2 * np.pi * length**2) * np.sqrt(E * I / (RHO * A))


def plate(section: str, more: str = "", cell: str = "S8R") -> str:
    """A square plate of 400 mm in 4 x 4 elements, simply supported."""
    n = 8
    nodes = {(i, j): 1 + i + 100 * j for i in range(n + 1) for j in range(n + 1)}
    lines = [
        "*NODE",
        *(f"{k}, {50.0 * i}, {50.0 * j}, 0." for (i, j), k in nodes.items()),
        f"*ELEMENT, TYPE={cell}, ELSET=SKIN",
    ]
    around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    for e, (i, j) in enumerate((i, j) for j in range(0, n, 2) for i in range(0, n, 2)):
        lines.append(f"{e + 1}, " + ", ".join(str(nodes[i + a, j + b]) for a, b in around))
    rim = [k for (i, j), k in nodes.items() if i in (0, n) or j in (0, n)]
    rows = [", ".join(map(str, rim[k : k + 10])) for k in range(0, len(rim), 10)]
    return "\n".join([*lines, "*NSET, NSET=RIM", *rows, STEEL + more + section, "*BOUNDARY", "RIM, 1, 3", ""])


LAMINA = "*MATERIAL, NAME=CARBON\n*ELASTIC, TYPE=LAMINA\n150000., 9000., 0.3, 5000., 5000., 3000.\n*DENSITY\n1.6E-9\n"


def brick(more: str = "", material: str = STEEL, extra: str = "") -> str:
    """A cantilever of solids along x, 100 x 10 x 10 mm, its face at x = 0 in the set ROOT, at the end in TIP."""
    mesh = box(100, 10, 10, 5, 1, 1, "hexahedron20")
    nodes = "\n".join(f"{k + 1}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(mesh.points.tolist()))
    rows = []
    for e, cell in enumerate(mesh.cells["hexahedron20"]):
        words = [str(e + 1), *(str(n + 1) for n in cell)]
        rows += [", ".join(words[:12]) + ",", ", ".join(words[12:])]
    x = mesh.points[:, 0]
    root, tip = (", ".join(map(str, np.flatnonzero(abs(x - at) < 1e-9) + 1)) for at in (0, 100))
    root, tip = (re.sub(r"((?:\d+, ){8})", r"\1\n", one) for one in (root, tip))
    return (
        f"*NODE\n{nodes}\n*ELEMENT, TYPE=C3D20R, ELSET=ALL\n" + "\n".join(rows) + f"\n*NSET, NSET=ROOT\n{root}\n"
        f"*NSET, NSET=TIP\n{tip}\n{material}{extra}*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL{more}\n*BOUNDARY\n"
        "ROOT, 1, 3\n"
    )


NODE_SURFACE = "*SURFACE, NAME=F, TYPE=NODE\nTIP, 1.\n"


TIP_MASS = "*NODE\n9999, 100., 5., 5.\n*ELEMENT, TYPE=MASS, ELSET=LUMP\n9999, 9999\n*MASS, ELSET=LUMP\n1.E-3\n"
