"""SETs of case control, SET1 and SET3 as groups of the mesh: set_4."""

from __future__ import annotations

from femflex.decks.nastran.model import NastranModel
from femflex.mesh.formats.nastran_cards import read_number_list


def read_sets(model: NastranModel) -> None:
    """Add the sets of a deck as groups of points or of cells; the kind follows from a comment, SET3, or the numbers."""
    raw, build = model.bulk.raw, model.build
    kinds = {number: kind for number, (kind, _) in raw.set_names.items()}
    sets = dict(raw.sets)

    for card in model.bulk.cards_named("SET1", "SET3"):
        if not card.is_integer(0):
            continue
        try:
            if card.name == "SET1":
                sets.setdefault(card.integer(0), read_number_list([w for w in card.words_from(1) if w != "SKIN"]))
            elif card.word(1) in ("GRID", "ELEM", "ELEMENT"):
                sets[card.integer(0)] = read_number_list(card.words_from(2))
                kinds[card.integer(0)] = "1" if card.word(1) == "GRID" else "2"
        except ValueError as error:
            model.bulk.findings.note(f"{card.location}: {card} is left out: {error}")
    for number, members in sets.items():
        grids = members.among(build.row_of) if kinds.get(number) != "2" else []
        names = [f"set_{number}"] + ([raw.set_names[number][1]] if number in raw.set_names else [])
        if kinds.get(number) == "1" or (number not in kinds and members.all_in(model.grids)):
            if grids:
                for name in names:
                    build.point_groups.setdefault(name, [build.row_of[g] for g in grids])
            continue
        for element in members.among(build.cell_of):
            for kind, row in build.cell_of[element]:
                for name in names:
                    build.cell_groups.setdefault(name, {}).setdefault(kind, []).append(row)
