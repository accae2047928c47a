"""Rigid elements and multi-point constraints: RBE1, RBE2, RBE3, RBAR, RROD, MPC and MPCADD."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.card import Card, numbers_of
from femflex.decks.nastran.model import NastranModel
from femflex.mesh.formats.guards import check_count

EVERY = (1, 2, 3, 4, 5, 6)
SINGULAR = 1e-10  # smallest relative singular value of components that determine a rigid motion


def read_rigid_elements(model: NastranModel) -> None:
    """Add the rigid elements and the selected multi-point constraints of a deck to the model."""
    bulk = model.bulk
    bulk.for_each_card(lambda card: _rbe2(model, card), "RBE2")
    bulk.for_each_card(lambda card: _rbe3(model, card), "RBE3")
    bulk.for_each_card(lambda card: _rbar(model, card), "RBAR")
    bulk.for_each_card(lambda card: _rbe1(model, card), "RBE1")
    bulk.for_each_card(lambda card: _rrod(model, card), "RROD")
    _mpcs(model)


def _rbe2(model: NastranModel, card: Card) -> None:
    """EID, GN, CM, then grids, and ALPHA, which is not used."""
    centre, components = card.integer(1), card.components(2)
    fields = [word for word in card.fields if "." not in word and word.strip().upper() != "ALPHA"]
    grids = numbers_of(replace(card, fields=fields), 3, model.grids)
    if not model.grids.require([centre, *grids], card):
        return
    grids = [g for g in grids if g != centre]
    if not grids or not components:
        model.bulk.findings.unused("RBE2", "it has no dependent components; it has no effect", card.location)
        return
    is_isotropic = all(
        set(part) <= set(components) or not set(part) & set(components) for part in ((1, 2, 3), (4, 5, 6))
    )
    _follow(model, card, centre, grids, components, (lambda _: np.eye(3)) if is_isotropic else model.grids.axes)


def _follow(
    model: NastranModel, card: Card, lead: int, grids: list[int], components: tuple[int, ...],
    axes: Callable[[int], Array],
) -> None:  # fmt: skip
    """Let components of grids follow another grid rigidly."""
    if all([model.depend(g, components, card) for g in grids]):
        model.add_rigid(f"{card.name.lower()}_{card.integer(0)}", grids, lead, components, axes)
        model.turning.update([lead, *(g for g in grids if g not in model.moving)])
        model.moving.update([lead, *grids])


def _rigid_rows(model: NastranModel, grid: int, components: tuple[int, ...], origin: Array) -> Array:
    """Matrix (k, 6) from a rigid motion (6,) about the origin to components of a grid in its displacement system."""
    axes, r = model.grids.axes(grid), model.grids[grid].position - origin
    skew = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    rigid_map = np.block([[axes, -axes @ skew], [np.zeros((3, 3)), axes]])
    return np.asarray(rigid_map[[c - 1 for c in components]])


def _add_rigid_dependence(
    model: NastranModel, card: Card, leading: list[tuple[int, tuple[int, ...]]],
    dependent: list[tuple[int, tuple[int, ...]]],
) -> None:  # fmt: skip
    """Make components depend on six independent ones that determine a rigid motion."""
    grids = [g for g, _ in leading]
    origin = model.grids[grids[0]].position
    R = np.concatenate([_rigid_rows(model, g, c, origin) for g, c in leading])
    scale = np.linalg.norm(R, axis=0)
    size = np.linalg.svd(R / np.where(scale > 0, scale, 1.0), compute_uv=False)
    if R.shape[0] != 6 or size[-1] <= SINGULAR * size[0]:
        components_text = ", ".join(f"{g} ({''.join(map(str, c))})" for g, c in leading)
        raise ValueError(
            f"{card} has independent components {components_text}, which do not determine a rigid motion; give six "
            "that do"
        )
    inverse = np.linalg.inv(R)
    leaders, terms = list(dict.fromkeys(grids)), [(g, c) for g, components in leading for c in components]
    for g, components in dependent:
        if components and model.depend(g, components, card):
            share = _rigid_rows(model, g, components, origin) @ inverse
            _add_multi_point(model, card, g, components, leaders, _in_basic_axes(model, share, terms, leaders))


def _in_basic_axes(model: NastranModel, share: Array, terms: list[tuple[int, int]], leaders: list[int]) -> Array:
    """Matrix (k, 6 n) on the motions of leaders in basic axes, from the shares (k, m) of components along their own."""
    matrix, column = np.zeros((len(share), 6 * len(leaders))), {g: 6 * k for k, g in enumerate(leaders)}
    for k, (g, c) in enumerate(terms):
        start = column[g] + (3 if c > 3 else 0)
        matrix[:, start : start + 3] += np.outer(share[:, k], model.grids.axes(g)[(c - 1) % 3])
    return matrix


def _add_multi_point(
    model: NastranModel, card: Card, grid: int, components: tuple[int, ...], leaders: list[int], matrix: Array
) -> None:
    label = f"{card.name} {card.word(0)}"
    model.add_equations(grid, components, leaders, matrix, model.grids.axes(grid), label)
    may_rotate = grid not in model.moving or grid in model.turning  # grids of rods and solids have no rotation
    model.moving.add(grid)
    if set(components) & {4, 5, 6} and may_rotate:
        model.turning.add(grid)
        model.required_turning.add(grid)


def _rbar(model: NastranModel, card: Card) -> None:
    a, b = card.integer(1), card.integer(2)
    if not model.grids.require([a, b], card):
        return
    if a == b:
        raise ValueError(f"{card} names a grid point twice; it joins two")
    leading = [(a, card.components(3)), (b, card.components(4))]
    dependent = [(a, card.components(5)), (b, card.components(6))]
    leading = [(g, c) for g, c in leading if c]
    if not any(c for _, c in dependent):
        independent = dict(leading)
        dependent = [(g, tuple(c for c in range(1, 7) if c not in independent.get(g, ()))) for g in (a, b)]
    if len(leading) == 1 and leading[0][1] == EVERY:
        lead = leading[0][0]
        other, components = next((g, c) for g, c in dependent if g != lead)
        if components == EVERY:
            _follow(model, card, lead, [other], EVERY, lambda _: np.eye(3))
            return
    _add_rigid_dependence(model, card, leading, dependent)
    model.turning.update(g for g in (a, b) if g not in model.moving)


def _rbe1(model: NastranModel, card: Card) -> None:
    """Add an RBE1: independent grids and components, then UM and the dependent ones."""
    pairs: list[list[tuple[int, tuple[int, ...]]]] = [[], []]
    side, k = 0, 1
    while k < len(card.fields):
        if card.word(k) == "UM":
            side, k = 1, k + 1
            continue
        word = card.word(k)
        if "." in word:
            break
        if word and k % 8 != 0 and k + 1 < len(card.fields) and card.has(k + 1):
            pairs[side].append((card.integer(k), card.components(k + 1)))
            k += 2
            continue
        k += 1
    grids = [g for side in pairs for g, _ in side]
    if model.grids.require(grids, card):
        _add_rigid_dependence(model, card, *pairs)


def _rrod(model: NastranModel, card: Card) -> None:
    """Keep the distance between two grids: one component of one of them is dependent."""
    a, b = card.integer(1), card.integer(2)
    if not model.grids.require([a, b], card):
        return
    ca, cb = card.components(3), card.components(4)
    if len(ca) + len(cb) != 1:
        raise ValueError(f"{card} must name one dependent component")
    dependent, other, c = (a, b, ca[0]) if ca else (b, a, cb[0])
    t = model.grids[b].position - model.grids[a].position
    t = t / np.linalg.norm(t)
    along = model.grids.axes(dependent)[c - 1] @ t
    if abs(along) < 1e-6:
        raise ValueError(
            f"{card}: component {c} of grid {dependent} is perpendicular to the rod, so it cannot be dependent; name a "
            "component along the rod"
        )
    if not model.depend(dependent, (c,), card):
        return
    _add_multi_point(model, card, dependent, (c,), *model.link(dependent, other, c, model.grids.axes(dependent)))


def _rbe3(model: NastranModel, card: Card) -> None:
    """Make the reference grid follow the weighted least-squares fit of the motion of the other grids.

    Rotations of the other grids, if included, have the weight of displacements at the mean distance of the grids.
    """
    centre, components = card.integer(2), card.components(3)
    groups: list[tuple[float, tuple[int, ...], list[int]]] = []
    words = [word.strip().upper() for word in card.fields]
    k, end = 4, next((k for k, word in enumerate(words) if word in ("UM", "ALPHA", "TREF")), len(words))
    while k < end:
        if not words[k]:
            k += 1
        elif words[k] == "THRU" and groups:
            span = range(groups[-1][2][-1] + 1, card.integer(k + 1) + 1)
            check_count(len(span), str(card))
            groups[-1][2].extend(span)
            k += 2
        elif words[k].lstrip("+-").isdigit() and groups:
            groups[-1][2].append(int(words[k]))
            k += 1
        else:
            groups.append((card.real(k), card.components(k + 1), []))
            k += 2
    if not groups or not components:
        raise ValueError(f"{card} has no weights, grids or components")
    leaders = list(dict.fromkeys(g for _, _, grids in groups for g in grids))
    if not model.grids.require([centre, *leaders], card):
        return
    if "UM" in words:
        model.bulk.findings.unused("RBE3 UM", "UM is not used: the reference grid is the dependent one", card.location)
    if not model.depend(centre, components, card):
        return
    origin = model.grids[centre].position
    x = np.array([model.grids[g].position for g in leaders]) - origin
    mean_distance = float(np.linalg.norm(x, axis=1).mean()) or 1.0
    terms = [(weight, g, c) for weight, weighted, grids in groups for g in grids for c in weighted]
    R = np.concatenate([_rigid_rows(model, g, weighted, origin) for _, weighted, grids in groups for g in grids])
    W = np.array([weight * (mean_distance**2 if c > 3 else 1.0) for weight, _, c in terms])
    scale = np.array([1.0, 1, 1, 1 / mean_distance, 1 / mean_distance, 1 / mean_distance])
    A = scale[:, None] * (R.T * W) @ R * scale
    values = np.linalg.eigvalsh(A)
    centre_rows = _rigid_rows(model, centre, components, origin)
    inverse = np.linalg.pinv(A, rcond=1e-9, hermitian=True) if values[0] <= SINGULAR * values[-1] else np.linalg.inv(A)
    if np.abs(centre_rows * scale @ (np.eye(6) - inverse @ A)).max() > 1e-6:
        raise ValueError(
            f"{card}: its grids and components do not determine the motion of grid {centre} in components "
            f"{''.join(map(str, components))} (they lie on a line or at one point); name more"
        )
    share = centre_rows @ (scale[:, None] * inverse @ (scale[:, None] * (R.T * W)))  # of every term in the motion
    matrix = _in_basic_axes(model, share, [(g, c) for _, g, c in terms], leaders)
    _add_multi_point(model, card, centre, components, leaders, matrix)


def _mpcs(model: NastranModel) -> None:
    bulk = model.bulk
    sets = {card.integer(0): [card.integer(k) for k in range(1, len(card.fields)) if card.has(k)]
            for card in bulk.cards_named("MPCADD", use=False) if card.is_integer(0)}  # fmt: skip
    defined = {card.integer(0) for card in bulk.cards.get("MPC", ()) if card.is_integer(0)}
    selected = bulk.selected("MPC", defined)
    active = set(sets.get(selected, [selected])) if selected is not None else set()
    if selected is not None and not active & defined:
        bulk.findings.note(f"case control names MPC set {selected}, of which the deck has no card; no equation is used")
    for card in bulk.cards_named("MPC", use=False):
        if card.is_integer(0) and card.integer(0) not in active:
            bulk.findings.unused("MPC", f"of set {card.integer(0)}, which case control does not choose", card.location)
            continue
        bulk.findings.use("MPC")
        bulk.attempt(card, lambda card=card: _mpc(model, card))  # type: ignore[misc]
    if selected in sets:
        bulk.findings.use("MPCADD")


def _mpc(model: NastranModel, card: Card) -> None:
    """Add sum A u = 0, in which the first component is dependent."""
    fields = [k for start in range(1, len(card.fields), 8) for k in (start, start + 3) if card.has(k)]
    ends = model.placed_ends(card, [(card.integer(k), card.components(k + 1)) for k in fields])
    terms = [(g, c[0] if c else 0, card.real(k + 2, 0.0)) for k, (g, c) in zip(fields, ends, strict=False)]
    if not terms or not model.grids.require([g for g, _, _ in terms], card):
        return
    if any(c == 0 for _, c, _ in terms):
        raise ValueError(f"{card} names a grid point without a component")
    grid, component, first = terms[0]
    if first == 0:
        raise ValueError(f"{card} has factor 0 at its first term, which is the dependent one")
    if not model.depend(grid, (component,), card):
        return
    _add_multi_point(model, card, grid, (component,), *model.equation(terms, model.grids.axes, model.bulk.units.length))
