"""Springs: CELAS1 to 4 with PELAS, CBUSH with PBUSH, CBUSH1D with PBUSH1D, and the torsion of rods."""

from __future__ import annotations

from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.bulk import ByNumber
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.line_elements import bar_frame
from femflex.decks.nastran.model import NastranModel
from femflex.fem import Bushing, ScalarSpring
from femflex.fem.bushing import axes_along, turns_nodes


def read_springs(model: NastranModel) -> None:
    """Add the springs of a deck to the model."""
    bulk = model.bulk
    values: dict[int, float] = {}
    bulk.for_each_card(lambda card: values.update(card.pairs(0, 4)), "PELAS")
    for name in ("CELAS1", "CELAS2"):
        bulk.for_each_card(lambda card: _celas(model, card, values), name, use=False)
    _bushes(model)
    axial: ByNumber[Card] = ByNumber(bulk, "property", "of PBUSH1D it has")
    axial.read_cards("PBUSH1D", lambda card: card, use=False)
    bulk.for_each_card(lambda card: _axial_bush(model, card, axial), "CBUSH1D", use=False)


def _axial_bush(model: NastranModel, card: Card, properties: ByNumber[Card]) -> None:
    """A spring along the line between two grids, or along the x axis of CID."""
    pid, ends, findings = card.integer(1, card.integer(0)), [card.integer(2), card.integer(3, 0)], model.bulk.findings
    if (property_card := properties(pid)) is None:
        return
    if any(property_card.reals(2, 2)) or property_card.words_from(8):
        findings.unused("PBUSH1D", "K alone is used; damping, mass and tables are left out", property_card.location)
    findings.use("PBUSH1D")
    ends = [g for g in ends if g]
    k = property_card.real(1, 0.0)
    if not model.grids.require(ends, card):
        return
    if not k:
        findings.unused(card.name, "its stiffness is zero; nothing is left out", card.location)
        return
    if k < 0:
        raise ValueError(f"{card} has a stiffness below zero")
    x = [model.grids[g].position for g in ends]
    if card.has(4):
        direction = model.systems(card.integer(4)).axes_at(x[0])[0]
    elif len(ends) == 2 and np.any(x[1] != x[0]):
        direction = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
    else:
        raise ValueError(f"{card} has no line between two grids, and no CID; give CID, along whose x axis it acts")
    findings.use(card.name)
    signs = zip(ends, (1.0, -1.0), strict=False)
    terms = tuple(model.spring_term(g, False, s * direction) for g, s in signs)
    model.required.update(ends)
    model.springs.append((ScalarSpring(terms, k * model.bulk.units.spring), ends, False, card))


def _celas(model: NastranModel, card: Card, values: dict[int, float]) -> None:
    if card.name == "CELAS1":
        pid = card.integer(1, card.integer(0))
        if pid not in values:
            raise ValueError(
                f"{card} names property {pid}, which is not in the deck; of PELAS it has {sorted(values)[:12]}"
            )
        k = values[pid]
    else:
        k = card.real(1)
    ends = model.ends(card)
    if not ends or not model.grids.require([g for g, _ in ends], card):
        return
    for g, c in ends:
        if len(c) != 1:
            raise ValueError(f"{card} has components {c} at grid {g}; a scalar spring has one")
    if not k:
        model.bulk.findings.unused(card.name, "its stiffness is zero; nothing is left out", card.location)
        return
    model.bulk.findings.use(card.name)
    components = [(g, c, model.grids.axes(g)) for g, (c,) in ends]
    spring = model.scalar_spring(components, k, model.bulk.units)
    model.springs.append((spring, [g for g, _ in ends], any(c > 3 for _, c, _ in components), card))


def _bushes(model: NastranModel) -> None:
    bulk, u = model.bulk, model.bulk.units

    def pbush(card: Card) -> Array:
        K = np.zeros(6)
        for k in range(1, len(card.fields), 8):
            word = card.word(k)
            if word == "K":
                words = [card.word(k + 1 + i) for i in range(6)]
                K = np.array([1e12 if w == "RIGID" else card.real(k + 1 + i, 0.0) for i, w in enumerate(words)])
            elif word in ("B", "GE") or (word == "M" and card.real(k + 1, 0.0)):
                text = "damping and mass of bushings are left out; give damping in the case, and mass by CONM2"
                bulk.findings.unused(f"PBUSH {word}", text, card.location)
        values = {f"K{i + 1}": float(K[i] * (u.spring if i < 3 else u.moment)) for i in range(6)}
        changed = bulk.override([f"pid_{card.integer(0)}"], values, str(card))
        return np.array([changed[f"K{i + 1}"] for i in range(6)])

    stiffnesses: ByNumber[Array] = ByNumber(bulk, "property", "of PBUSH it has")
    stiffnesses.read_cards("PBUSH", pbush)
    bulk.for_each_card(lambda card: _bush(model, card, stiffnesses), "CBUSH")


def _bush(model: NastranModel, card: Card, stiffnesses: ByNumber[Array]) -> None:
    pid = card.integer(1, card.integer(0))
    if (K := stiffnesses(pid)) is None:
        return
    ends = [card.integer(2)] + ([card.integer(3)] if card.has(3) else [])
    if not model.grids.require(ends, card):
        return
    if (K < 0).any():
        raise ValueError(f"{card} has a stiffness below zero")
    if not K.any():
        model.bulk.findings.unused("CBUSH", "its stiffness is zero; nothing is left out", card.location)
        return
    points = [model.grids[g].position for g in ends]
    span = points[-1] - points[0]
    is_apart = len(ends) == 2 and float(np.linalg.norm(span)) > 1e-9 * max(1.0, float(np.abs(points[0]).max()))
    axes: Array | None
    if card.has(7):
        axes = model.systems(card.integer(7)).axes_at(points[0])
    elif is_apart and (card.has(4) or card.has(5) or card.has(6)):
        if card.is_integer(4) and not card.has(5):
            if not model.grids.require([card.integer(4)], card):
                return
            v = model.grids[card.integer(4)].position - points[0]
        else:
            v = np.array(card.reals(4, 3)) @ model.grids.axes(ends[0])
        axes = bar_frame(span, v, card)
    else:
        axes = None if is_apart else model.grids.axes(ends[0])
    location_point: Array | None = None
    if card.has(9) and card.integer(9, -1) >= 0:
        location_point = model.systems(card.integer(9)).position(card.reals(10, 3), model.bulk.units.length)
    elif is_apart and abs(card.real(8, 0.5) - 0.5) > 1e-9:
        location_point = points[0] + card.real(8) * span
    if axes is None and (K[[1, 2]] > 0).any() and not np.isclose(K[1], K[2]):
        raise ValueError(f"{card} has no orientation, and its K2 and K3 differ; give CID, G0 or X1, X2, X3")
    groups = [model.group(g) for g in ends]
    places: dict[str, Any] = {"axes": axes, "at": location_point}
    to = groups[1] if len(groups) == 2 else None
    bush = Bushing(group=groups[0], to=to, translation=tuple(K[:3]), rotation=tuple(K[3:]), **places)
    rows = axes_along(span / np.linalg.norm(span)) if axes is None else axes
    arms = (np.mean(points, axis=0) if location_point is None else location_point) - np.array(points)
    couples_rotation = (is_apart or location_point is not None) and turns_nodes(rows[K[:3] > 0], arms)
    model.springs.append((bush, ends, bool(K[3:].any()) or couples_rotation, card))
    model.required.update(ends)
    if K[3:].any() or couples_rotation:
        model.required_turning.update(ends)


def finish_springs(model: NastranModel) -> None:
    """Create the springs, once it is known which grids have rotations, and the torsion of rods between such grids."""
    for spring, grids, turns, card in model.springs:
        if turns and any(g not in model.turning for g in grids):
            model.bulk.findings.unused(
                f"{card.name} at grids without rotation", "springs against rotation of solids and rods are left out",
                card.location,
            )  # fmt: skip
            continue
        model.bushings.append(spring)
    for a, b, k, card in model.twisting:
        if a in model.turning and b in model.turning and model.row(a) != model.row(b):
            model.bushings.append(Bushing(group=model.group(a), to=model.group(b), rotation=(k, 0.0, 0.0)))
        else:
            model.bulk.findings.unused(
                f"{card.name} torsion",
                "its grids have no other rotational stiffness; its torsional stiffness is left out",
                card.location,
            )
