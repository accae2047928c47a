"""Elements of older Nastran (NASTRAN-95), replaced by their modern forms.

CQUAD1, CQUAD2, CQDMEM, CQDMEM1, CQDMEM2   CQUAD4      PQUAD1, PQUAD2, PQDMEM ...   PSHELL
CTRIA1, CTRIA2, CTRMEM                     CTRIA3      PTRIA1, PTRIA2, PTRMEM       PSHELL
CHEXA1, CHEXA2, CIHEX1; CWEDGE; CTETRA     CHEXA; CPENTA; CTETRA on a PSOLID of their material
CRIGD1, CRIGD2                             RBE2
CNGRNT (congruent elements)                ignored
"""

from __future__ import annotations

from collections.abc import Callable

from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card

Fields = list[str]

PSOLID_OFFSET = 90_000_000  # added to a material's number for its PSOLID if a property has that number
SHELLS = {
    **dict.fromkeys(("CQUAD1", "CQUAD2", "CQDMEM", "CQDMEM1", "CQDMEM2"), "CQUAD4"),
    **dict.fromkeys(("CTRIA1", "CTRIA2", "CTRMEM"), "CTRIA3"),
}
SOLIDS = {"CHEXA1": "CHEXA", "CHEXA2": "CHEXA", "CWEDGE": "CPENTA"}


def modernise_cards(bulk: Bulk) -> None:
    """Replace older cards by their modern forms, and note how many."""
    for old, new in SHELLS.items():
        _replace_cards(bulk, old, new, lambda card: [card.fields[:7]])
    for old in ("PQUAD2", "PTRIA2"):
        _replace_cards(bulk, old, "PSHELL", lambda card: [_selected_fields(card, 0, 1, 2, 1, "", "", "", 3)])
    for old in ("PQDMEM", "PQDMEM1", "PQDMEM2", "PTRMEM"):
        _replace_cards(bulk, old, "PSHELL", lambda card: [_selected_fields(card, 0, 1, 2, "", "", "", "", 3)])
    for old in ("PQUAD1", "PTRIA1"):
        _replace_cards(bulk, old, "PSHELL", _pshell_of_layers)
    _replace_cards(
        bulk,
        "PIHEX",
        "PSOLID",
        lambda card: [[_field_or_blank(card, 0), _field_or_blank(card, 1), _field_or_blank(card, 2)]],
    )
    _replace_cards(bulk, "CIHEX1", "CHEXA", lambda card: [card.fields[:10]])
    _replace_solids(bulk)
    _replace_cards(bulk, "CRIGD1", "RBE2", lambda card: [[*card.fields[:2], "123456", *card.fields[2:]]])
    _replace_cards(bulk, "CRIGD2", "RBE2", _rigid_by_components)
    bulk.cards.pop("CNGRNT", None)


def _replace_cards(bulk: Bulk, old: str, new: str, make: Callable[[Card], list[Fields]]) -> None:
    cards = bulk.cards.pop(old, [])
    if not cards:
        return
    bulk.findings.note(f"{len(cards)} {old} are read as {new if new != old else new + ' on a PSOLID of its material'}")
    modern: list[Card] = []
    for card in cards:
        bulk.attempt(card, lambda card=card: modern.extend(Card(new, fields, card.location) for fields in make(card)))  # type: ignore[misc]
    if modern:
        bulk.cards.setdefault(new, []).extend(modern)


def _field_or_blank(card: Card, k: int) -> str:
    return card.fields[k] if k < len(card.fields) else ""


def _selected_fields(card: Card, *fields: int | str) -> Fields:
    """Fields of a PSHELL: fields of the card by number, or literal text."""
    return [_field_or_blank(card, k) if isinstance(k, int) else k for k in fields]


def _pshell_of_layers(card: Card) -> list[Fields]:
    """PSHELL of PID, MID1, T1, MID2, I, MID3, T3, NSM: I is the second moment of the section per width."""
    t, inertia, shear = card.real(2, 0.0), card.real(4, 0.0), card.real(6, 0.0)
    if not t > 0:
        raise ValueError(f"{card} has no membrane thickness T1; give a PSHELL in its place")
    bends = card.has(3) and inertia > 0
    ratio = f"{12 * inertia / t**3:.12g}" if bends else ""
    shears = bends and card.has(5) and shear > 0
    return [
        [
            *(_field_or_blank(card, k) for k in range(3)),
            _field_or_blank(card, 3) if bends else "",
            ratio,
            _field_or_blank(card, 5) if shears else "",
            f"{shear / t:.12g}" if shears else "",
            _field_or_blank(card, 7),
        ]
    ]


def _replace_solids(bulk: Bulk) -> None:
    """Replace solids that name a material, with a new PSOLID for each material."""
    property_numbers = {card.word(0) for name, cards in bulk.cards.items() if name.startswith("P") for card in cards}
    material_of_psolid: dict[str, str] = {}

    def with_property(card: Card) -> list[Fields]:
        mid = card.integer(1)
        pid = str(mid if str(mid) not in property_numbers else PSOLID_OFFSET + mid)
        if pid not in material_of_psolid:
            material_of_psolid[pid] = str(mid)
            bulk.cards.setdefault("PSOLID", []).append(Card("PSOLID", [pid, str(mid)], card.location))
        return [[_field_or_blank(card, 0), pid, *card.fields[2:10]]]

    for old, new in SOLIDS.items():
        _replace_cards(bulk, old, new, with_property)
    old_tetrahedra = [
        card for card in bulk.cards.get("CTETRA", []) if card.word(1) not in property_numbers and not card.has(6)
    ]
    if old_tetrahedra and not property_numbers & {card.word(1) for card in bulk.cards["CTETRA"]}:
        materials = {card.word(0) for name in ("MAT1", "MAT9") for card in bulk.cards.get(name, [])}
        if {card.word(1) for card in old_tetrahedra} <= materials:
            _replace_cards(bulk, "CTETRA", "CTETRA", with_property)


def _rigid_by_components(card: Card) -> list[Fields]:
    """RBE2 of EID, IG, then grids with the components of each."""
    grids_by_components: dict[str, Fields] = {}
    for k in range(2, len(card.fields) - 1, 2):
        if card.has(k):
            grids_by_components.setdefault(card.word(k + 1), []).append(card.fields[k])
    return [
        [_field_or_blank(card, 0), _field_or_blank(card, 1), components, *grids]
        for components, grids in grids_by_components.items()
    ]
