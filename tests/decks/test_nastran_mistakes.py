"""Mistakes in Nastran decks: one sentence each, with file and line, all of a deck together."""

from __future__ import annotations

import pytest
from support.nastran_decks import STEEL, bar, frequencies, read, written

from femflex.decks import DeckError, read_deck
from femflex.decks.register import HEAD, reader_of

GRIDS = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "GRID,3,,1.,1.,0.", "GRID,4,,0.,1.,0."]
QUAD = "CQUAD4,7,2,1,2,3,4"
SHELL = "PSHELL,2,1,0.01,1,,1"


@pytest.mark.parametrize(
    ("cards", "sentence"),
    [
        ([*GRIDS, QUAD, STEEL],
         r"deck.bdf:9: CQUAD4 7: names property 2, which is not in the deck; of shells it has none"),
        ([*GRIDS, QUAD, SHELL], r"deck.bdf:10: PSHELL 2: names material 1, which is not in the deck; it has none"),
        ([*GRIDS[:3], QUAD, SHELL, STEEL], r"deck.bdf:8: CQUAD4 7 uses grid point 4, which no GRID card defines"),
        (["GRID,1,9,0.,0.,0.", *GRIDS[1:], QUAD, SHELL, STEEL], r"GRID 1: coordinate system 9 is not in the deck"),
        ([*GRIDS, QUAD, SHELL, "MAT1,1,2.E11,,.3,-7850."],
         r"deck.bdf:11: MAT1 1 has density -7850 kg/m\^3; it cannot be"),
        ([*GRIDS, QUAD, SHELL, STEEL, "CONM2,9,1,,-3."],
         r"deck.bdf:12: CONM2 9 has mass -3 kg; a mass cannot be negative"),
        ([*GRIDS, QUAD, "PSHELL,2,1,-0.01,1", STEEL], r"PSHELL 2 has thickness -0.01 m; it must be positive"),
        ([*GRIDS, "CQUAD4,7,2,1,2,x,4", SHELL, STEEL], r"CQUAD4 7 has 'X' in field 6, where a whole number is needed"),
        ([*GRIDS, QUAD, SHELL, STEEL, "GRID,2,,5.,0.,0."],
         r"deck.bdf:12: GRID 2 is given again .* at deck.bdf:6 already"),
        ([*GRIDS, "CQUADX,7,2,1,2,3,4", SHELL, STEEL], r"deck.bdf:9: 1 CQUADX, .*there is no such element here"),
        ([*GRIDS, QUAD, SHELL, STEEL, "RBE2,8,1,123,2", "RBE2,9,3,3,2"],
         r"deck.bdf:13: RBE2 9 makes component 3 of grid 2 dependent, which RBE2 8 \(deck.bdf:12\) does already"),
        ([*GRIDS, QUAD, SHELL, STEEL, "RBE2,8,1,123,2", "SPC1,1,3,2"],
         r"deck.bdf:13: SPC1 1 fixes component 3 of grid 2, which is dependent in RBE2 8 \(deck.bdf:12\); fix"),
        ([*GRIDS, QUAD, SHELL, STEEL, "RBE1,8,1,123,2,23", ",UM,3,123"], r"RBE1 8 has independent components .* six"),
        ([*GRIDS, QUAD, SHELL, STEEL, "RBE3,8,,4,123456,1.,123,1,2"],
         r"RBE3 8: .* \(they lie on a line or at one point\)"),
        (["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CBAR,1,3,1,2,1.,0.,0.", "PBAR,3,1,1.,1.,1.,1.", STEEL],
         r"CBAR 1 has its orientation vector along its axis; give one across it"),
        (["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CONROD,3,1,2,1,1.-4,,,-3.", STEEL],
         r"deck.bdf:7: CONROD 3 has a mass per length below zero; correct its nonstructural mass"),
        (["CORD2R,1,2,0.,0.,0.,0.,0.,1.", ",1.,0.,0.", "CORD2R,2,1,0.,0.,0.,0.,0.,1.", ",1.,0.,0.",
          "GRID,1,1,0.,0.,0."], r"coordinate systems \[1, 2\] refer to each other in a cycle"),
        ([*GRIDS, "CHEXA,7,2,1,2,3,4,1,2", ",3,4", STEEL],
         r"CHEXA 7: names property 2, which is not in the deck; of solids"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_sentence_with_its_line(tmp_path, cards, sentence):
    control = "SPC = 1" if any(card.startswith("SPC1") for card in cards) else "ECHO = NONE"
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *cards, control=control)


def test_all_problems_come_together(tmp_path):
    with pytest.raises(DeckError) as found:
        read(tmp_path, *GRIDS[:3], QUAD, "CQUAD4,8,5,1,2,3,3", "CONM2,9,1,,-3.", SHELL, "SPC1,1,3,1", control="SPC = 4")
    assert len(found.value.problems) == 5
    assert "case control names SPC set 4, which the deck does not have" in str(found.value)


def test_cards_with_the_same_mistake_are_one_problem(tmp_path):
    with pytest.raises(DeckError, match=r"CQUAD4 7: names property 2, .* of shells it has none \(and 1 more CQUAD4\)"):
        read(tmp_path, *GRIDS, QUAD, "CQUAD4,8,2,2,3,4,1", STEEL, control="ECHO = NONE")


def test_a_deck_of_another_solver_is_refused_by_name(tmp_path):
    path = tmp_path / "frame.bdf"
    path.write_text("/PREP7\nET,1,185\nN,1,0,0,0\n")
    with pytest.raises(ValueError, match=r"frame.bdf is no deck of a known solver; known are Nastran"):
        read_deck(path)


def test_a_letter_across_the_first_block_of_a_file_does_not_hide_its_solver(tmp_path):
    path = tmp_path / "frame.bdf"
    cards = "SOL 103\nCEND\nBEGIN BULK\n"
    path.write_bytes((cards + "$".ljust(HEAD - 1 - len(cards)) + "\N{DEGREE SIGN} \nENDDATA\n").encode())
    assert reader_of(path).solver == "Nastran"


def test_superelements_in_parts_are_refused_before_anything_else(tmp_path):
    with pytest.raises(DeckError, match=r"cannot be used:\n  deck.bdf:\d+: BEGIN SUPER=1: superelements in parts"):
        read(tmp_path, *bar(), "BEGIN SUPER=1", *bar(4), "GRID,1,,9.,0.,0.")


def test_a_missing_include_is_named_with_its_line(tmp_path):
    path = written(tmp_path, "INCLUDE 'nowhere.bdf'")
    with pytest.raises(ValueError, match=r"deck.bdf:5: the file 'nowhere.bdf' that is included does not exist in"):
        read_deck(path)


def test_an_override_of_what_is_not_there_is_refused(tmp_path):
    with pytest.raises(DeckError, match=r"override of 'pid_4': the deck has no such property or material"):
        read(tmp_path, *bar(), overrides={"pid_4": {"A": 1.0}})
    with pytest.raises(DeckError, match=r"override of pid_3 names 'thickness'; it has \['A', 'I1', 'I2', 'J'"):
        read(tmp_path, *bar(), overrides={"pid_3": {"thickness": 1.0}})


BAR, ROD = "PBAR,1,1,1.-3,1.-6,1.-6,2.-6", "PROD,2,1,1.-3"
IN_LINE = [f"GRID,{k},,{k - 1}.,0.,0." for k in (1, 2, 3)]
BARS = [f"CBAR,{k},1,{a},{b},0.,0.,1." for k, a, b in ((1, 1, 2), (2, 2, 3), (3, 4, 5))]
RODS = [f"CROD,{k},2,{a},{b}" for k, a, b in ((1, 1, 2), (2, 2, 3), (3, 3, 4))]


@pytest.mark.parametrize(
    ("cards", "sentence"),
    [
        (["GRID,4,,5.,0.,0.", "GRID,5,,6.,0.,0.", *BARS, BAR],
         r"falls into 2 parts .*: 2 nodes, among them GRID 4 at \(5, 0, 0\)\)"),
        (["GRID,4,,2.,1.,0.", *RODS, ROD], r"is a mechanism \(GRID 3 at \(2, 0, 0\) moves along \(0, 1, 0\)\)"),
    ],
)  # fmt: skip
def test_loose_parts_and_mechanisms_name_their_grids(tmp_path, cards, sentence):
    deck = read(tmp_path, *IN_LINE, *cards, STEEL, "SPC1,1,123456,1", units="SI")
    with pytest.raises(ValueError, match=sentence):
        frequencies(deck, 2)


def test_a_deck_in_place_of_a_case_is_answered_with_the_way_to_a_case(tmp_path, femflex):
    written(tmp_path, *IN_LINE, name="loose.bdf")
    code, _, error = femflex("check", "loose.bdf")
    assert code == 2 and "this is not TOML" in error and "new my_craft.toml --deck loose.bdf" in " ".join(error.split())


def test_units_that_are_none_are_no_damage_of_the_deck(tmp_path):
    with pytest.raises(ValueError, match=r"^units are 'mm-kg'; give length-mass-time"):
        read(tmp_path, *IN_LINE, units="mm-kg")
