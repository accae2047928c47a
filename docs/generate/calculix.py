"""One deck in two programs: frequencies by femflex and by CalculiX, side by side.

`python docs/generate/calculix.py` writes the decks, runs both programs and writes docs/benchmarks/calculix.md. It needs
the command `ccx` (Debian: apt install calculix-ccx).
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np

TOP = Path(__file__).resolve().parents[2]
PAGE = TOP / "docs" / "benchmarks" / "calculix.md"
MODES = 6
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
TAIL = """*MATERIAL, NAME=ALUMINIUM
*ELASTIC
7E10, 0.33
*DENSITY
2700
{section}
*BOUNDARY
CLAMP, 1, {last}
*STEP
*FREQUENCY
{modes}
*END STEP
"""
HEAD = """# One deck in two programs

The same input file is given to femflex and to CalculiX {version}. The numbers are the first {modes} natural frequencies
in Hz. The bricks are the same elements: their differences are those of the printed digits. CalculiX expands a shell
into bricks, which are too stiff on coarse meshes. Both programs tend to the same frequencies, femflex from fewer
elements.

<!-- Written by docs/generate/calculix.py, which runs both programs. -->
"""
CASE = """
[run]
duration = 1
output_step = 1
[attitude]
frame = "inertial"
[bodies.hub]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[bodies.part]
kind = "flexible"
deck = "part.inp"
units = "m-kg-s"
reduction = {{ method = "cantilever", clamp = "supports", modes = {modes} }}
[[joints]]
kind = "weld"
parent = "hub"
child = "part"
"""


def bricks(cells: list[tuple[int, int, int]], size: tuple[float, float, float]) -> tuple[dict[int, str], list[str]]:
    """Nodes (number -> line) and elements (lines) of 20-node bricks at places in a grid of cells of a size [m]."""
    numbers: dict[tuple[int, ...], int] = {}
    elements = []
    for cell in cells:
        corners = [np.array(corner) + 2 * np.array(cell) for corner in CORNERS]
        places = corners + [(corners[a] + corners[b]) // 2 for a, b in EDGES]
        nodes = [numbers.setdefault(tuple(int(i) for i in place), len(numbers) + 1) for place in places]
        line = [str(len(elements) + 1), *map(str, nodes)]
        elements.append(", ".join(line[:16]) + ",\n" + ", ".join(line[16:]))  # CalculiX reads 16 numbers of a line
    half = np.array(size) / 2
    nodes_of_deck = {
        n: f"{n}, " + ", ".join(f"{x:.9g}" for x in np.array(place) * half) for place, n in numbers.items()
    }
    return nodes_of_deck, elements


def bracket(n: int) -> str:
    """Deck of an L-shaped bracket of C3D20: legs of 200 and 150 mm, 40 mm wide, 20 mm thick, clamped at an end."""
    thickness = [(i, j, 0) for i, j in product(range(10 * n), range(2 * n))]
    leg = [(i, j, k) for i, j, k in product(range(n), range(2 * n), range(1, 8 * n))]
    column = [(i, j, k) for (i, j, _), k in product(thickness, range(n))]
    cells = sorted({*column, *leg})
    nodes, elements = bricks(cells, (0.02 / n, 0.02 / n, 0.02 / n))
    clamped = [number for number, line in nodes.items() if abs(float(line.split(",")[1]) - 0.2) < 1e-9]
    return deck(nodes, elements, "C3D20", clamped, "*SOLID SECTION, ELSET=PART, MATERIAL=ALUMINIUM", 3)


def plate(n: int) -> str:
    """Deck of a cantilever plate of S8, 600 x 240 x 6 mm, with 5 n x 2 n elements."""
    numbers: dict[tuple[int, int], int] = {}
    elements = []
    for i, j in product(range(5 * n), range(2 * n)):
        places = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        nodes = [numbers.setdefault((2 * i + a, 2 * j + b), len(numbers) + 1) for a, b in places]
        elements.append(", ".join(map(str, [len(elements) + 1, *nodes])))
    lines = {k: f"{k}, {0.06 * i / n:.9g}, {0.06 * j / n:.9g}, 0" for (i, j), k in numbers.items()}
    clamped = [k for (i, _), k in numbers.items() if i == 0]
    return deck(lines, elements, "S8", clamped, "*SHELL SECTION, ELSET=PART, MATERIAL=ALUMINIUM\n0.006", 6)


def deck(nodes: dict[int, str], elements: list[str], kind: str, clamped: list[int], section: str, last: int) -> str:
    """The input file of one part; last: number of the last component that the clamp fixes."""
    sets = "\n".join(", ".join(map(str, clamped[k : k + 12])) for k in range(0, len(clamped), 12))
    parts = [
        "*NODE, NSET=ALL",
        *nodes.values(),
        f"*ELEMENT, TYPE={kind}, ELSET=PART",
        *elements,
        "*NSET, NSET=CLAMP",
        sets,
    ]
    return "\n".join(parts) + "\n" + TAIL.format(section=section, last=last, modes=MODES)


DECKS: dict[str, tuple[Callable[[int], str], str, tuple[int, ...], int]] = {  # kind, levels, lines of an element
    "Bracket of 20-node bricks": (bracket, "C3D20", (1, 2), 2),
    "Plate of 8-node shells, which CalculiX expands into bricks": (plate, "S8", (1, 2, 4), 1),
}


def femflex_frequencies(text: str) -> np.ndarray:
    """Frequencies [Hz] (MODES,) of a deck by femflex."""
    from femflex import build_body
    from femflex.case import read_case

    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "part.inp").write_text(text, encoding="utf-8")
        path = Path(folder, "case.toml")
        path.write_text(CASE.format(modes=MODES), encoding="utf-8")
        body = build_body(read_case(path), "part")
    return np.asarray(body.omega[:MODES]) / (2 * np.pi)


def calculix_frequencies(text: str) -> np.ndarray:
    """Frequencies [Hz] (MODES,) of a deck by CalculiX. Raises FileNotFoundError without ccx."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "part.inp").write_text(text, encoding="utf-8")
        subprocess.run(["ccx", "-i", "part"], cwd=folder, check=True, capture_output=True)
        results = Path(folder, "part.dat").read_text(encoding="utf-8")
    rows = re.findall(r"^\s+\d+\s+(\S+E\S+)\s+(\S+E\S+)\s+(\S+E\S+)\s+\S+E\S+\s*$", results, re.MULTILINE)
    return np.array([float(row[2]) for row in rows[:MODES]])


def version() -> str:
    """Version of CalculiX."""
    text = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    return text.split("Version")[-1].strip()


def page() -> str:
    """Text of the page; runs both programs."""
    from generate.markdown import table

    text = HEAD.format(version=version(), modes=MODES)
    for title, (make, kind, levels, lines) in DECKS.items():
        rows = []
        for n in levels:
            source = make(n)
            count = len(re.findall(r"^\d+", source.split("ELSET=PART\n")[1].split("*NSET")[0], re.MULTILINE)) // lines
            pair = femflex_frequencies(source), calculix_frequencies(source)
            for name, values in zip(("femflex", "CalculiX"), pair, strict=True):
                rows.append([f"{count} {kind}", name, *(f"{f:.5g}" for f in values)])
            rows.append(["", "difference", *(f"{x:.1e}" for x in pair[0] / pair[1] - 1)])
        heads = ("elements", "program", *(str(k + 1) for k in range(MODES)))
        text += f"\n## {title}\n\n{table(heads, rows)}"
    return text


def main() -> None:
    """Write the page."""
    from generate.markdown import save

    if shutil.which("ccx") is None:
        sys.exit("ccx is not installed: the page compares with CalculiX (Debian: apt install calculix-ccx)")
    save(PAGE, page())


if __name__ == "__main__":
    sys.path[:0] = [str(TOP / "docs"), str(TOP)]
    main()
