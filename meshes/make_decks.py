"""Makes two Nastran decks with properties: mast.bdf (mm, t, s) and laminate.bdf (in, lbf, s).

mast.bdf      CBAR in a cylindrical system, PBAR with two bending stiffnesses, an instrument (CONM2) carried by RBE2 at
              the tip; SPC 1 holds the root. Mast of 3 m, 60 x 40 mm tube of aluminium, instrument of 4 kg.
laminate.bdf  CQUAD8 of a [0/90/90/0] PCOMP laminate with its MCID, in a plane askew (CP and CD of a CORD2R); SPC1 10
              supports all four sides simply (w and the rotation along the normal of each side). 30 x 20 in.
"""

from __future__ import annotations

from pathlib import Path

LENGTH, BARS = 3000.0, 12  # mm
A, I1, I2, J = 384.0, 1.9e5, 1.0e5, 2.05e5  # mm^2, mm^4
E, DENSITY = 70e3, 2.7e-9  # N/mm^2, t/mm^3
INSTRUMENT, INERTIA = 4e-3, 60.0  # t, t mm^2
SIDES, CELLS = (30.0, 20.0), (9, 6)  # in
PLY = 0.01  # in
E1, E2, NU12, G12, G13, RHO = 20e6, 1.5e6, 0.3, 0.75e6, 50e6, 1.45e-4  # psi, lbf s^2/in^4; G13 large: thin plates


def card(name: str, *fields: object) -> str:
    """A card in free fields, in lines of eight."""
    words = ["" if field is None else f"{field:.10g}" if isinstance(field, float) else str(field) for field in fields]
    words = [word + "." if isinstance(f, float) and "." not in word and "e" not in word else word
             for word, f in zip(words, fields, strict=True)]  # fmt: skip
    lines = [words[k : k + 8] for k in range(0, len(words), 8)]
    return "\n".join(",".join([name if k == 0 else "", *line]) for k, line in enumerate(lines))


def mast() -> str:
    """Text of mast.bdf."""
    lines = [
        "SOL 103",
        "CEND",
        "TITLE = Mast with an instrument; mm, t, s",
        "SPC = 1",
        "SET 4 = 1 THRU 6",
        "BEGIN BULK",
    ]
    lines.append(card("CORD2C", 5, 0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0))  # its z axis is the mast's
    lines += [card("GRID", k + 1, 5, 0.0, 0.0, LENGTH * k / BARS) for k in range(BARS + 1)]
    lines.append(card("GRID", 100, None, LENGTH, 0.0, 0.0))
    lines += [card("CBAR", k + 1, 3, k + 1, k + 2, 0.0, 1.0, 0.0) for k in range(BARS)]
    lines.append(card("PBAR", 3, 1, A, I1, I2, J))
    lines.append(card("MAT1", 1, E, None, 0.33, DENSITY))
    lines.append(card("RBE2", 50, BARS + 1, 123456, 100))
    lines.append(
        card("CONM2", 60, 100, 0, INSTRUMENT, None, None, None, None, INERTIA, None, INERTIA, None, None, INERTIA)
    )
    lines.append(card("SPC1", 1, 123456, 1))
    lines.append(card("GRAV", 7, 0, 9810.0, 0.0, 0.0, -1.0))
    return "\n".join([*lines, "ENDDATA", ""])


def laminate() -> str:
    """Text of laminate.bdf."""
    (a, b), (m, n) = SIDES, CELLS
    lines = ["SOL 103", "CEND", "TITLE = Laminate on simple supports; in, lbf, s", "SPC = 10", "BEGIN BULK"]
    lines.append(card("CORD2R", 7, 0, 1.0, 2.0, 3.0, 1.0, 2.6, 3.8, 2.0, 2.0, 3.0))  # z axis (0, 0.6, 0.8)
    number = {}
    for j in range(2 * n + 1):
        for i in range(2 * m + 1):
            if i % 2 and j % 2:
                continue  # no node in the centre of elements
            number[i, j] = len(number) + 1
            lines.append(card("GRID", number[i, j], 7, a * i / (2 * m), b * j / (2 * n), 0.0, 7))
    element = 0
    for j in range(0, 2 * n, 2):
        for i in range(0, 2 * m, 2):
            element += 1
            at = [
                (i, j),
                (i + 2, j),
                (i + 2, j + 2),
                (i, j + 2),
                (i + 1, j),
                (i + 2, j + 1),
                (i + 1, j + 2),
                (i, j + 1),
            ]
            nodes = [number[p] for p in at]
            lines.append(card("CQUAD8", element, 2, *nodes, None, None, None, None, 7))
    lines.append(card("PCOMP", 2, None, None, None, None, None, None, "SYM", 8, PLY, 0.0, "NO", 8, PLY, 90.0, "NO"))
    lines.append(card("MAT8", 8, E1, E2, NU12, G12, G13, G13, RHO))
    sides = {14: [p for p in number if p[0] in (0, 2 * m)], 24: [p for p in number if p[1] in (0, 2 * n)]}
    corner = number[0, 0]
    for rotation, points in sides.items():  # sides along y keep w and the rotation about x; those along x about y
        components = {14: "34", 24: "35"}[rotation]
        lines.append(card("SPC1", 1 if rotation == 14 else 2, components, *sorted(number[p] for p in points)))
    lines.append(card("SPC1", 3, 12, corner))
    lines.append(card("SPC1", 3, 2, number[2 * m, 0]))
    lines.append(card("SPCADD", 10, 1, 2, 3))
    return "\n".join([*lines, "ENDDATA", ""])


if __name__ == "__main__":
    here = Path(__file__).parent
    (here / "mast.bdf").write_text(mast(), encoding="utf-8")
    (here / "laminate.bdf").write_text(laminate(), encoding="utf-8")
