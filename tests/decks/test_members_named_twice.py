"""Nodes and elements that sets of an Abaqus deck list twice count once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from test_deck_abaqus import beam, deck

from femflex.decks.report import mass_and_centre

BEAM = beam("RECT", "10., 20.\n0., 1., 0.")
PARTS = """\
*ELEMENT, TYPE=MASS, ELSET=LUMP
901, 11
*ELEMENT, TYPE=MASS, ELSET=LUMP1
902, 6
*ELEMENT, TYPE=ROTARYI, ELSET=FLY
903, 11
*ELEMENT, TYPE=SPRING1, ELSET=COIL
904, 11
*MASS, ELSET=LUMP
3.E-3
*MASS, ELSET=LUMP1
2.E-3
*ROTARY INERTIA, ELSET=FLY
1., 2., 3.
*SPRING, ELSET=COIL
2
5.
*COUPLING, CONSTRAINT NAME=C, REF NODE=TIP, SURFACE=FACE
*KINEMATIC
*NODE
900, 1100., 0., 0.
*SURFACE, NAME=FACE, TYPE=NODE
LAST,
*NSET, NSET=TIP
900
*NSET, NSET=LAST
11
"""
AGAIN = """\
*ELSET, ELSET=LUMP
901, 901
*ELSET, ELSET=LUMP1
902
*ELSET, ELSET=FLY
903
*ELSET, ELSET=COIL
904
*NSET, NSET=TIP
900
*NSET, NSET=LAST
11, 11
"""


def test_what_a_set_lists_twice_counts_once(tmp_path: Path):
    once, twice = deck(tmp_path, BEAM + PARTS), deck(tmp_path, BEAM + PARTS + AGAIN)
    assert [one.mass for one in twice.point_masses] == [3.0, 2.0]
    assert np.asarray(twice.point_masses[0].inertia).tolist() == np.asarray(once.point_masses[0].inertia).tolist()
    assert twice.bushings == once.bushings
    assert twice.connections == once.connections
    assert mass_and_centre(twice.structure())[0] == mass_and_centre(once.structure())[0]
