"""Keywords of Abaqus and CalculiX, one row each: closed forms, or the same structure in other keywords."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest
from support.abaqus_decks import LAMINA, NODE_SURFACE, NU, RHO, STEEL, TIP_MASS, E, beam, brick, clamped, deck, plate
from support.abaqus_decks import frequencies as frequencies_of

from femflex.mesh import box

brick_text, RECT = cache(brick), "10., 20.\n0., 1., 0."  # width along n1 = y, height along n2 = z


def frequencies(folder, text: str, n: int = 4, **overrides: dict) -> np.ndarray:
    return frequencies_of(deck(folder, text, **overrides), n)


# Closed forms

LOW, HIGH, AREA = 20e-3 * 10e-3**3 / 12, 10e-3 * 20e-3**3 / 12, 2e-4
NAVIER = np.pi / 0.4**2 * np.sqrt(E * 4e-3**3 / 12 / (1 - NU**2) / (RHO * 4e-3))
HELD = "*NSET, NSET=ALL, GENERATE\n1, 11\n*BEAM"
RODS = (
    "*NODE\n1, 0., 0., 0.\n2, 2000., 0., 0.\n3, 1000., 1000., 0.\n*ELEMENT, TYPE=T3D2, ELSET=RODS\n1, 1, 3\n2, 2, 3\n"
    "*MATERIAL, NAME=LIGHT\n*ELASTIC\n210000., 0.3\n*DENSITY\n1.E-15\n*SOLID SECTION, ELSET=RODS, MATERIAL=LIGHT\n{}\n"
    "*ELEMENT, TYPE=MASS, ELSET=M\n9, 3\n*MASS, ELSET=M\n0.01\n*BOUNDARY\n1, 1, 3\n2, 1, 3\n3, 3\n"
)
SPRING = (
    "*NODE\n1, 0.\n2, 10.\n*ELEMENT, TYPE=MASS, ELSET=M\n1, 2\n*MASS, ELSET=M\n5.E-4\n*ELEMENT, TYPE={}, ELSET=S\n"
    "2, {}\n*SPRING, ELSET=S\n{}\n2.\n*BOUNDARY\n1, 1, 3\n2, 2, 3\n"
)
JOINT = (
    "*NODE\n1,0,0,0\n2,1000,0,0\n*ELEMENT, TYPE=JOINTC, ELSET=J\n1,1,2\n*ELEMENT, TYPE=MASS, ELSET=W\n2,2\n"
    "*ORIENTATION, NAME=O\n0.,1.,0.,-1.,0.,0.\n*JOINT, ELSET=J, ORIENTATION=O\n*SPRING\n1,1\n0.8\n*SPRING\n2,2\n0.2\n"
    "*MASS, ELSET=W\n2.E-3\n*BOUNDARY\n1,1,3\n2,3\n"
)
TRUSS = np.sqrt(E * 1e-4 / (np.sqrt(2) * 10.0)) / (2 * np.pi)
ROUND = {"PIPE": ("20., 2.", np.pi * 76, np.pi / 4 * (20**4 - 18**4)), "CIRC": ("15.", np.pi * 225, np.pi / 4 * 15**4),
         "BOX": ("40., 30., 2., 2., 2., 2.", 264, (40 * 30**3 - 36 * 26**3) / 12),
         "I": ("20., 40., 30., 30., 3., 3., 2.", 248, (6 * 30**3 + 34 * 2**3) / 12),
         "square": ("20.", 400, 20**4 / 12)}  # fmt: skip
CLOSED = {
    "beam about its weak axis": (beam("RECT", RECT, kind="B33"), [clamped(LOW, AREA)], 1e-3),
    "beam about its strong axis": (beam("RECT", RECT, "1, ENCASTRE\nALL, 2\n", "B33").replace("*BEAM", HELD),
                                   [clamped(HIGH, AREA)], 3e-3),
    "simply supported plate": (plate("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n4., 5"), [NAVIER], 5e-3),
    "trusses": (RODS.format("100."), [TRUSS] * 2, 1e-6),
    "trusses of 1 mm^2": (RODS.format(""), [TRUSS / 10] * 2, 1e-6),
    "SPRINGA": (SPRING.format("SPRINGA", "1, 2", ""), [np.sqrt(4000.0) / (2 * np.pi)], 1e-6),
    "SPRING2": (SPRING.format("SPRING2", "1, 2", "1, 1"), [np.sqrt(4000.0) / (2 * np.pi)], 1e-6),
    "SPRING1": (SPRING.format("SPRING1", "2", "1").replace("1, 1, 3\n", ""), [np.sqrt(4000.0) / (2 * np.pi)], 1e-6),
    "JOINTC": (JOINT, np.array([10.0, 20.0]) / (2 * np.pi), 1e-6),
    **{kind: (beam("RECT" if kind == "square" else kind, f"{data}\n0., 1., 0.", kind="B33"),
              [clamped(low * 1e-12, A * 1e-6)], 3e-3) for kind, (data, A, low) in ROUND.items()},
}  # fmt: skip


@pytest.mark.parametrize("name", CLOSED)
def test_frequencies_of_closed_forms(tmp_path, name):
    text, expected, rel = CLOSED[name]
    assert frequencies(tmp_path, text, len(expected)) == pytest.approx(expected, rel=rel)


def end_face() -> str:
    """The face at the end of the last brick, as Abaqus numbers faces."""
    mesh = box(100, 10, 10, 5, 1, 1, "hexahedron20")
    last = int(np.argmax(mesh.points[mesh.cells["hexahedron20"]][:, :, 0].mean(axis=1)))
    x = mesh.points[mesh.cells["hexahedron20"][last], 0]
    faces = ["1234", "5876", "1562", "2673", "3784", "4851"]
    at_end = (k for k, face in enumerate(faces, 1) if all(abs(x[int(c) - 1] - 100) < 1e-9 for c in face))
    return f"{last + 1}, S{next(at_end)}"


FACE = f"*SURFACE, NAME=F\n{end_face()}\n"
COUPLING = "*COUPLING, CONSTRAINT NAME=C, REF NODE=9999, SURFACE=F\n"
RIGID = {
    "RIGID BODY": "*RIGID BODY, NSET=TIP, REF NODE=9999\n",
    "RIGID BODY of ties": "*RIGID BODY, TIE NSET=TIP, REF NODE=9999\n",
    "KINEMATIC": NODE_SURFACE + COUPLING + "*KINEMATIC\n1, 6\n",
    "KINEMATIC of a face": FACE + COUPLING + "*KINEMATIC\n",
    "KINEMATIC COUPLING": "*KINEMATIC COUPLING, REF NODE=9999\nTIP, 1, 6\n",
    "MPC BEAM": "*MPC\nBEAM, TIP, 9999\n",
}


@pytest.mark.parametrize("name", RIGID)
def test_rigid_connections_move_a_mass_at_the_tip(tmp_path, name):
    """f = sqrt(3 E I / (L^3 (m + 0.2427 m_beam))) / 2 pi of one kilogram at the end of a cantilever."""
    exact = np.sqrt(3 * E * 1e-8 / 12 / (1e-3 * (1.0 + 0.2427 * RHO * 1e-5))) / (2 * np.pi)
    computed = frequencies(tmp_path, brick_text() + TIP_MASS + RIGID[name])[0]
    assert computed == pytest.approx(exact, rel=0.02)
    if name == "KINEMATIC":  # a distributing coupling does not stiffen the face
        spread = frequencies(tmp_path, brick_text() + TIP_MASS + NODE_SURFACE + COUPLING + "*DISTRIBUTING\n")[0]
        assert 0.99 * computed < spread < computed


# The same structure in other keywords


def elastic(kind: str, words: list[str]) -> str:
    rows = "\n".join(", ".join(words[k : k + 8]) for k in range(0, len(words), 8))
    return f"*MATERIAL, NAME=STEEL\n*ELASTIC, TYPE={kind}\n{rows}\n*DENSITY\n7.85E-9\n"


def ortho(C: np.ndarray) -> str:
    pairs = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5)]
    return elastic("ORTHOTROPIC", [f"{C[pair]:.9g}" for pair in pairs])


def aniso(C: np.ndarray) -> str:
    return elastic("ANISOTROPIC", [f"{C[i, j]:.9g}" for j in range(6) for i in range(j + 1)])


ISOTROPIC = np.diag([210e3 / (1 + NU)] * 3 + [210e3 / (2 * (1 + NU))] * 3)  # 11, 22, 33, 12, 13, 23 [MPa]
ISOTROPIC[:3, :3] += 210e3 * NU / ((1 + NU) * (1 - 2 * NU))
NINE = ISOTROPIC.copy()
NINE[0, 0] *= 3.0
NINE[0, 1] = NINE[1, 0] = 1.3 * NINE[0, 1]
NINE[range(3, 6), range(3, 6)] = 5e4, 6e4, 9e4
SWAPPED, AROUND = (NINE[np.ix_(order, order)] for order in ([1, 0, 2, 3, 5, 4], [0, 2, 1, 4, 3, 5]))
AXES = "*ORIENTATION, NAME=O{}\n{}\n"
FAR = ", SYSTEM={}\n-1.E8, 5., 5., -1.E8, 5., 6."


def brick_in_system(material: str, system: str = "", more: str = "") -> str:
    """The brick of a material whose axes are those of a system."""
    text = brick(", ORIENTATION=O" if system else "", material, system)
    return text.replace("*NODE\n", f"*NODE\n{more}", 1)


HALVES = beam("RECT", RECT, kind="B33", n=4)
SPLIT = HALVES.replace("*ELEMENT", "9, 500., 0., 0.\n*ELEMENT").replace("\n3, 3, 4\n", "\n3, 9, 4\n")
PARTS = (
    "*PART, NAME=BOOM\n*NODE\n1, 0.\n2, 250.\n3, 500.\n*ELEMENT, TYPE=B33, ELSET=ALL\n1, 1, 2\n2, 2, 3\n"
    f"*BEAM SECTION, ELSET=ALL, SECTION=RECT, MATERIAL=STEEL\n{RECT}\n*END PART\n*ASSEMBLY, NAME=A\n"
    "*INSTANCE, NAME=B1, PART=BOOM\n*END INSTANCE\n*INSTANCE, NAME=B2, PART=BOOM\n500., 0., 0.\n*END INSTANCE\n"
    "*SURFACE, NAME=LEFT, TYPE=NODE\nB2.1\n*SURFACE, NAME=RIGHT, TYPE=NODE\nB1.3\n*TIE, NAME=T\nLEFT, RIGHT\n"
    f"*END ASSEMBLY\n{STEEL}*BOUNDARY\nB1.1, ENCASTRE\n"
)
THIRD = re.sub(r"\n(\d+), (\d+), (\d+)(?=\n)", r"\n\1, \2, \3, 99", beam("RECT", "10., 20.", kind="B33"))
THIRD = THIRD.replace("*ELEMENT", "99, 0., 500., 0.\n*ELEMENT")
SKIN = STEEL + "*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n4.\n*BOUNDARY\n1, ENCASTRE\n4, ENCASTRE\n"
STRIP = "*NODE\n1, 0., 0., 0.\n2, 100., 0., 0.\n3, 100., 50., 0.\n4, 0., 50., 0.\n12, 200., 0., 0.\n13, 200., 50., 0.\n"
QUADS = "*ELEMENT, TYPE=S4, ELSET=SKIN\n1, 1, 2, 3, 4\n"
TIED = "*SURFACE, NAME=NEAR\n1, E2\n*SURFACE, NAME=FAR\n2, E4\n*TIE, NAME=T\nFAR, NEAR\n"
PLY = "*SHELL SECTION, ELSET=SKIN, COMPOSITE{}\n4., 3, CARBON, {}\n"
TURN = "*ORIENTATION, NAME=O\n{}\n{}, 30.\n"
SPREAD = "*ELEMENT, TYPE=DCOUP3D, ELSET=D\n800, 9999\n*DISTRIBUTING COUPLING, ELSET=D\nTIP, 1.\n"
SAME = {
    "ORTHOTROPIC of isotropic numbers": (brick_in_system(ortho(ISOTROPIC)), brick(), 1e-6),
    "ANISOTROPIC of isotropic numbers": (brick_in_system(aniso(ISOTROPIC)), brick(), 1e-6),
    "ANISOTROPIC of nine numbers": (brick_in_system(aniso(NINE)), brick_in_system(ortho(NINE)), 1e-9),
    "axes turned about 3": (brick_in_system(ortho(SWAPPED), AXES.format("", "1., 0., 0., 0., 1., 0.\n3, 90.")),
                            brick_in_system(ortho(NINE)), 1e-9),
    "axes turned about 1": (brick_in_system(ortho(AROUND), AXES.format("", "1., 0., 0., 0., 1., 0.\n1, 90.")),
                            brick_in_system(ortho(NINE)), 1e-9),
    **{
        f"distant {name}": (
            brick_in_system(ortho(NINE), AXES.format(FAR.format(system), "")), brick_in_system(ortho(NINE)), 1e-5
        )
        for name, system in (("sphere", "SPHERICAL"), ("cylinder", "CYLINDRICAL"))
    },
    "axes by nodes": (brick_in_system(ortho(NINE), AXES.format(", DEFINITION=NODES", "9001, 9002"),
                            "9001, 1., 0., 0.\n9002, 0., 1., 0.\n"), brick_in_system(ortho(NINE)), 1e-5),
    "plies along an orientation": (plate(PLY.format(", ORIENTATION=O", 0),
                                         LAMINA + TURN.format("1., 0., 0., 0., 1., 0.", 3)),
                                   plate(PLY.format("", 30.0), LAMINA), 1e-6),
    "tied instances": (PARTS, HALVES, 1e-8),
    "EQUATION": (SPLIT + "*EQUATION\n" + "".join(f"2\n9, {c}, 1., 3, {c}, -1.\n" for c in range(1, 7)), HALVES, 1e-9),
    "MPC TIE": (SPLIT + "*MPC\nTIE, 9, 3\n", HALVES, 1e-9),
    "third node of a beam": (THIRD, beam("RECT", RECT, kind="B33"), 1e-6),
    "edges of shells tied": (STRIP + "11, 100., 0., 0.\n14, 100., 50., 0.\n" + QUADS + "2, 11, 12, 13, 14\n"
                             + TIED + SKIN,
                             STRIP + QUADS + "2, 2, 12, 13, 3\n" + SKIN, 1e-8),
    "quadrilateral with a node twice": (STRIP + QUADS + "2, 2, 12, 3, 3\n" + SKIN,
                                        STRIP + QUADS + "*ELEMENT, TYPE=S3, ELSET=SKIN\n2, 2, 12, 3\n" + SKIN, 1e-9),
    "DISTRIBUTING COUPLING": (brick() + TIP_MASS + SPREAD,
                              brick() + TIP_MASS + NODE_SURFACE + COUPLING + "*DISTRIBUTING\n", 1e-9),
    "RIGID BODY of pins": (brick() + TIP_MASS + "*RIGID BODY, PIN NSET=TIP, REF NODE=9999\n",
                           brick() + TIP_MASS + RIGID["RIGID BODY"], 1e-6),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")  # triangles of constant strain
@pytest.mark.parametrize("name", SAME)
def test_frequencies_of_equal_structures_by_keyword(tmp_path, name):
    text, other, rel = SAME[name]
    assert frequencies(tmp_path, text) == pytest.approx(frequencies(tmp_path, other), rel=rel)


def test_overrides_of_sections_and_materials(tmp_path):
    text = plate("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n4., 5")
    assert frequencies(tmp_path, text, 1, SKIN={"thickness": 8e-3})[0] == pytest.approx(2 * NAVIER, rel=1e-2)
    assert frequencies(tmp_path, text, 1, STEEL={"density": 4 * RHO})[0] == pytest.approx(NAVIER / 2, rel=5e-3)


@pytest.mark.parametrize("tip", [(1100.0, 20.0, 5.0), (1010.0, 90.0, -30.0), (1000.0, 0.0, 70.0)])
def test_mpc_link_keeps_the_distance_of_two_nodes(tip, tmp_path):
    """Of a mass that is linked to the tip of a beam all motions but that along the line are free."""
    mass = "*NODE\n20, {}, {}, {}\n*ELEMENT, TYPE=MASS, ELSET=LUMP\n99, 20\n*MASS, ELSET=LUMP\n1E-3\n".format(*tip)
    loose = deck(tmp_path, beam("RECT", RECT) + mass).structure()
    imported = deck(tmp_path, beam("RECT", RECT) + mass + "*MPC\nLINK, 20, 11\n")
    structure, rows = imported.structure(), [imported.points_of_ids[node] for node in (11, 20)]
    a, b = (structure.translation[3 * row : 3 * row + 3].toarray() for row in rows)
    line = structure.mesh.points[rows[1]] - structure.mesh.points[rows[0]]
    assert np.abs(line @ (b - a)).max() < 1e-12 and np.linalg.matrix_rank(np.vstack([a, b])) == 5
    assert structure.n_dof == loose.n_dof - 1


@pytest.mark.parametrize(("n", "tolerance"), [(1, 0.02), (2, 0.003)])  # a parabola is no circle
def test_beams_of_three_nodes_follow_an_arc(n, tolerance, tmp_path):
    """A quarter of a circle of 1 m; two chords of one element lack 2.5 % of its mass."""

    def arc(n: int, kind: str):
        k = n if kind == "B31" else 2 * n
        angles = np.linspace(0, np.pi / 2, k + 1)
        nodes = "".join(f"{i + 1}, {1e3 * np.cos(a):.9f}, {1e3 * np.sin(a):.9f}\n" for i, a in enumerate(angles))
        cells = "".join(f"{i + 1}, {', '.join(str(k // n * i + j + 1) for j in range(k // n + 1))}\n" for i in range(n))
        section = "*BEAM SECTION, SECTION=RECT, ELSET=BOOM, MATERIAL=STEEL\n10., 20.\n0., 0., -1.\n"
        return deck(
            tmp_path, f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=BOOM\n{cells}{STEEL}{section}*BOUNDARY\n1, 1, 6\n"
        )

    curved = arc(n, "B32")
    mass = sum(float(block.dm.sum()) for block in curved.structure().inertia)
    assert mass == pytest.approx(RHO * 2e-4 * np.pi / 2, rel=tolerance / 2)
    assert frequencies_of(curved) == pytest.approx(frequencies_of(arc(24, "B31")), rel=tolerance)


def test_data_lines_of_other_files(tmp_path):
    text = beam("RECT", RECT)
    nodes = text[len("*NODE\n") : text.index("*ELEMENT")]
    (tmp_path / "nodes.inc").write_text(f"** a comment\n\n{nodes}")
    parts = text.replace(f"*NODE\n{nodes}", "*NODE, INPUT=nodes.inc\n")
    assert frequencies(tmp_path, parts) == pytest.approx(frequencies(tmp_path, text), rel=1e-12)
