"""Writes half_panels.inp, an Abaqus deck: a laminate panel of two instances of one part, the second turned, tied at the
seam and simply supported all round. Millimetres, tonnes, seconds."""

from __future__ import annotations

from pathlib import Path

HALF, WIDTH, ALONG, ACROSS = 400.0, 600.0, 4, 6  # mm, elements
PLIES = (0, 90, 90, 0)
THICKNESS = 0.5  # mm, of a ply


def main() -> None:
    """Write the deck beside this script."""
    number = {
        (i, j): 1 + i + 100 * j for j in range(2 * ACROSS + 1) for i in range(2 * ALONG + 1) if i % 2 == 0 or j % 2 == 0
    }
    place = {(i, j): (HALF * i / (2 * ALONG), WIDTH * j / (2 * ACROSS)) for i, j in number}
    around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    cells = [(2 * i, 2 * j) for j in range(ACROSS) for i in range(ALONG)]
    rim = [number[i, j] for i, j in number if i == 0 or j in (0, 2 * ACROSS)]
    seam = [number[i, j] for i, j in number if i == 2 * ALONG]
    lines = [
        "*HEADING",
        " laminate panel of two halves, mm t s",
        "*PART, NAME=HALF",
        "*NODE",
        *(f"{n}, {place[key][0]:g}, {place[key][1]:g}, 0." for key, n in number.items()),
        "*ELEMENT, TYPE=S8R, ELSET=SKIN",
        *(f"{k}, " + ", ".join(str(number[i + a, j + b]) for a, b in around) for k, (i, j) in enumerate(cells, 1)),
        "*NSET, NSET=RIM",
        *rows(rim),
        "*NSET, NSET=SEAM",
        *rows(seam),
        "*ORIENTATION, NAME=FIBRES",
        "1., 0., 0., 0., 1., 0.",
        "3, 0.",
        "*SHELL SECTION, ELSET=SKIN, COMPOSITE, ORIENTATION=FIBRES",
        *(f"{THICKNESS}, 3, CARBON, {angle}." for angle in PLIES),
        "*END PART",
        "*ASSEMBLY, NAME=PANEL",
        "*INSTANCE, NAME=LEFT, PART=HALF",
        "*END INSTANCE",
        "*INSTANCE, NAME=RIGHT, PART=HALF",
        "0., 0., 0.",
        f"{HALF}, {WIDTH / 2}, 0., {HALF}, {WIDTH / 2}, 1., 180.",
        "*END INSTANCE",
        "*SURFACE, NAME=LEFT_SEAM, TYPE=NODE",
        "LEFT.SEAM",
        "*SURFACE, NAME=RIGHT_SEAM, TYPE=NODE",
        "RIGHT.SEAM",
        "*TIE, NAME=SEAM",
        "RIGHT_SEAM, LEFT_SEAM",
        "*END ASSEMBLY",
        "*MATERIAL, NAME=CARBON",
        "*ELASTIC, TYPE=LAMINA",
        "140000., 9000., 0.3, 5000., 5000., 3000.",
        "*DENSITY",
        "1.6E-9",
        "*BOUNDARY",
        "LEFT.RIM, 1, 3",
        "RIGHT.RIM, 1, 3",
        "*STEP",
        "*FREQUENCY",
        "5",
        "*END STEP",
    ]
    Path(__file__).with_name("half_panels.inp").write_text("\n".join([*lines, ""]), encoding="utf-8")


def rows(numbers: list[int]) -> list[str]:
    """Lines of at most twelve numbers."""
    return [", ".join(map(str, numbers[k : k + 12])) for k in range(0, len(numbers), 12)]


if __name__ == "__main__":
    main()
