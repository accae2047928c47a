"""Elements of older Nastran (NASTRAN-95) in the form of those that took their place.

CQUAD1, CQUAD2, CQDMEM, CQDMEM1, CQDMEM2   CQUAD4      PQUAD1, PQUAD2, PQDMEM ...   PSHELL
CTRIA1, CTRIA2, CTRMEM                     CTRIA3      PTRIA1, PTRIA2, PTRMEM       PSHELL
CHEXA1, CHEXA2, CIHEX1; CWEDGE; CTETRA     CHEXA; CPENTA; CTETRA on a PSOLID of the material they name
CRIGD1, CRIGD2                             RBE2
CNGRNT (elements that are alike)           nothing to do
"""

from __future__ import annotations

from collections.abc import Callable

from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card

Fields = list[str]

APART = 90_000_000  # added to a material's number for its PSOLID where a property has that number already
SHELLS = {
    **dict.fromkeys(("CQUAD1", "CQUAD2", "CQDMEM", "CQDMEM1", "CQDMEM2"), "CQUAD4"),
    **dict.fromkeys(("CTRIA1", "CTRIA2", "CTRMEM"), "CTRIA3"),
}
SOLIDS = {"CHEXA1": "CHEXA", "CHEXA2": "CHEXA", "CWEDGE": "CPENTA"}


def renew(bulk: Bulk) -> None:
    """Put the present forms of older cards in their place, and note how many."""
    for old, new in SHELLS.items():
        _replace(bulk, old, new, lambda card: [card.fields[:7]])
    for old in ("PQUAD2", "PTRIA2"):
        _replace(bulk, old, "PSHELL", lambda card: [_shell(card, 0, 1, 2, 1, "", "", "", 3)])
    for old in ("PQDMEM", "PQDMEM1", "PQDMEM2", "PTRMEM"):
        _replace(bulk, old, "PSHELL", lambda card: [_shell(card, 0, 1, 2, "", "", "", "", 3)])
    for old in ("PQUAD1", "PTRIA1"):
        _replace(bulk, old, "PSHELL", _layered)
    _replace(bulk, "PIHEX", "PSOLID", lambda card: [[_field(card, 0), _field(card, 1), _field(card, 2)]])
    _replace(bulk, "CIHEX1", "CHEXA", lambda card: [card.fields[:10]])
    _solids(bulk)
    _replace(bulk, "CRIGD1", "RBE2", lambda card: [[*card.fields[:2], "123456", *card.fields[2:]]])
    _replace(bulk, "CRIGD2", "RBE2", _by_grid)
    bulk.cards.pop("CNGRNT", None)


def _replace(bulk: Bulk, old: str, new: str, make: Callable[[Card], list[Fields]]) -> None:
    cards = bulk.cards.pop(old, [])
    if not cards:
        return
    bulk.found.note(f"{len(cards)} {old} are read as {new if new != old else new + ' on a PSOLID of its material'}")
    renewed: list[Card] = []
    for card in cards:
        bulk.attempt(card, lambda card=card: renewed.extend(Card(new, own, card.place) for own in make(card)))  # type: ignore[misc]
    if renewed:
        bulk.cards.setdefault(new, []).extend(renewed)


def _field(card: Card, k: int) -> str:
    return card.fields[k] if k < len(card.fields) else ""


def _shell(card: Card, *fields: int | str) -> Fields:
    """Fields of a PSHELL: those of the card by number, or as given."""
    return [_field(card, k) if isinstance(k, int) else k for k in fields]


def _layered(card: Card) -> list[Fields]:
    """PSHELL of PID, MID1, T1, MID2, I, MID3, T3, NSM: I is the second moment of the section per width."""
    t, inertia, shear = card.real(2, 0.0), card.real(4, 0.0), card.real(6, 0.0)
    if not t > 0:
        raise ValueError(f"{card} has no membrane thickness T1; give a PSHELL in its place")
    bends = card.has(3) and inertia > 0
    ratio = f"{12 * inertia / t**3:.12g}" if bends else ""
    shears = bends and card.has(5) and shear > 0
    return [
        [
            *(_field(card, k) for k in range(3)),
            _field(card, 3) if bends else "",
            ratio,
            _field(card, 5) if shears else "",
            f"{shear / t:.12g}" if shears else "",
            _field(card, 7),
        ]
    ]


def _solids(bulk: Bulk) -> None:
    """Solids that name their material: a PSOLID of that material for each."""
    taken = {card.word(0) for name, cards in bulk.cards.items() if name.startswith("P") for card in cards}
    made: dict[str, str] = {}

    def with_property(card: Card) -> list[Fields]:
        mid = card.integer(1)
        pid = str(mid if str(mid) not in taken else APART + mid)
        if pid not in made:
            made[pid] = str(mid)
            bulk.cards.setdefault("PSOLID", []).append(Card("PSOLID", [pid, str(mid)], card.place))
        return [[_field(card, 0), pid, *card.fields[2:10]]]

    for old, new in SOLIDS.items():
        _replace(bulk, old, new, with_property)
    older = [card for card in bulk.cards.get("CTETRA", []) if card.word(1) not in taken and not card.has(6)]
    if older and not taken & {card.word(1) for card in bulk.cards["CTETRA"]}:
        materials = {card.word(0) for name in ("MAT1", "MAT9") for card in bulk.cards.get(name, [])}
        if {card.word(1) for card in older} <= materials:
            _replace(bulk, "CTETRA", "CTETRA", with_property)


def _by_grid(card: Card) -> list[Fields]:
    """RBE2 of EID, IG, then grids with the components of each."""
    by: dict[str, Fields] = {}
    for k in range(2, len(card.fields) - 1, 2):
        if card.has(k):
            by.setdefault(card.word(k + 1), []).append(card.fields[k])
    return [[_field(card, 0), _field(card, 1), components, *grids] for components, grids in by.items()]
