"""AUTOSPC: supports of the components of nodes that have no stiffness, as Nastran fixes them automatically."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.decks.builder import direction_key
from femflex.decks.deck import AUTOSPC, Deck
from femflex.decks.findings import BY_MATRICES
from femflex.fem import Structure, Support
from femflex.fem.support import GLOBAL

MAX_SHOWN = 6  # maximum number of nodes of one kind, and of kinds, listed in a note
# Stiffness of a component, relative to the largest of its node, below which it is singular (Nastran's EPZERO). The
# largest is limited to the median of all nodes, since bushings and springs may represent rigid links.
RATIO = 1e-8
ROUNDING = 1e-13  # stiffness, relative to the largest of a node, that may be rounding
MOTION_TOLERANCE = 1e-9  # difference between the motion of a node and that of an independent dof


def with_autospc(deck: Deck) -> Deck:
    """The deck with an active set of supports "autospc" for the components of nodes without stiffness.

    Returns the deck itself if there are none, or if it cannot become a structure (reported when it is built).
    """
    active = deck.active_supports()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            structure = deck.structure(active)
    except ValueError:
        return deck
    if not structure.K.diagonal().any():  # a rigid body
        return deck
    held = structure.constrained_dofs(active)
    supported = {
        (int(node), component)
        for group, support in active.items()
        if support.axes == GLOBAL
        for node in deck.mesh.group_points(group)
        for component in support.components
    }
    groups, supports = dict[str, IntArray](), dict[str, Support]()
    points = np.array(sorted(deck.points_of_ids.values()), np.int64)
    for k, (nodes, support) in enumerate(_singular_components(structure, points), 1):
        if support.axes == GLOBAL:
            nodes = nodes[[any((int(n), c) not in supported for c in support.components) for n in nodes]]
        if len(nodes):
            groups[f"{AUTOSPC}-{k}"], supports[f"{AUTOSPC}-{k}"] = nodes, support
    notes = _notes(deck, groups, supports) + _notes_on_loose(deck, structure, held, [*groups.values()])
    if not supports:
        return replace(deck, notes=(*deck.notes, *notes))
    return replace(
        deck, mesh=deck.mesh.with_groups(points=groups), supports={**deck.supports, AUTOSPC: supports},
        default_supports=(*deck.default_supports, AUTOSPC), notes=(*deck.notes, *notes),
    )  # fmt: skip


def _notes(deck: Deck, groups: dict[str, IntArray], supports: dict[str, Support]) -> list[str]:
    """A note, if any, on the supports, with the first MAX_SHOWN components and numbers of nodes."""
    number_of_point = {row: number for number, row in deck.points_of_ids.items()}
    texts = []
    for name, support in supports.items():
        ids = sorted(number_of_point[int(node)] for node in groups[name])
        words = ", ".join(support.components) + ("" if support.axes == GLOBAL else " of skew axes")
        texts.append(f"{words} at node{'s' if len(ids) > 1 else ''} {_first_texts(list(map(str, ids)))}")
    count = sum(len(support.components) * len(groups[name]) for name, support in supports.items())
    return [
        f"{count} components of nodes have no stiffness and are fixed (as by AUTOSPC; set of supports {AUTOSPC!r}): "
        f"{_first_texts(texts, '; ', ' groups')}; if they shall move, connect these nodes by elements that resist there"
    ] * bool(texts)


def _notes_on_loose(deck: Deck, structure: Structure, held: IntArray, fixed: list[IntArray]) -> list[str]:
    """A note, if any, on dofs without stiffness that are neither held (their numbers) nor at fixed nodes."""
    loose = np.setdiff1d(np.flatnonzero(structure.K.diagonal() == 0), held)
    motion = abs(structure.translation[:, loose]) + abs(structure.rotation[:, loose])
    nodes = np.setdiff1d(motion.tocoo().coords[0] // 3, np.concatenate([np.zeros(0, np.int64), *fixed]))
    loose_nodes = set(nodes.tolist())
    names = [name for point, name in deck.point_names().items() if point in loose_nodes]
    return [
        f"no stiffness at {_first_texts(names)} in a direction beside one that a connection ties, askew to the axes "
        f"of the deck; it is not fixed as by AUTOSPC. Support it, or {BY_MATRICES}"
    ] * bool(names)


def _first_texts(texts: list[str], separator: str = ", ", what: str = "") -> str:
    """The first MAX_SHOWN texts, and the count of the others."""
    more = f"{separator.rstrip() if what else ''} and {len(texts) - MAX_SHOWN} more{what}"
    return separator.join(texts[:MAX_SHOWN]) + (more if len(texts) > MAX_SHOWN else "")


def _singular_components(structure: Structure, points: IntArray) -> list[tuple[IntArray, Support]]:
    """Nodes (k,) among `points` (n,) with the components that have no stiffness, as supports.

    Nodes are examined one by one, as in Nastran, by the 3 x 3 stiffness of their displacement and of their rotation.
    Components along the mesh's axes that depend on other nodes through connections count as stiff.
    """
    nodes_by_key: dict[tuple[float, ...], list[int]] = {}
    supports: dict[tuple[float, ...], Support] = {}
    for kind, rows in enumerate((structure.translation, structure.rotation)):
        block, independent = _blocks(structure.K, rows)
        nodes = points[independent[points].any(axis=1)]
        if not len(nodes):
            continue
        largest_entry = float(np.abs(block[nodes]).max(initial=0.0))
        for a in range(3):
            dependent = nodes[~independent[nodes, a]]
            block[dependent, a] = block[dependent, :, a] = 0.0
            block[dependent, a, a] = np.maximum(
                np.abs(block[dependent]).max(axis=(1, 2)), max(largest_entry, 1.0) * 1e-12
            )
        value, vectors = np.linalg.eigh(block[nodes])
        largest = value[:, 2]
        median = float(np.median(largest[largest > 0])) if largest.any() else 0.0
        # so that a rigid link makes no other node singular
        threshold = np.maximum(RATIO * np.minimum(largest, median), ROUNDING * largest)
        is_singular = value <= np.maximum(threshold[:, None], RATIO * np.finfo(float).tiny)
        is_singular |= (largest <= 1e-14 * largest_entry)[:, None]
        for node, singular, axes in zip(nodes, is_singular, vectors.swapaxes(1, 2), strict=True):
            if not singular.any():
                continue
            P = axes[singular].T @ axes[singular]
            if np.abs(P - np.diag(np.round(np.diag(P)))).max() < 1e-6:  # along the mesh's axes
                axes, singular = np.eye(3), np.diag(P) > 0.5
            elif np.linalg.det(axes) < 0:
                axes = axes * np.array([[1.0], [1.0], [-1.0]])
            words = tuple(word for word, flag in zip(("x", "y", "z"), singular, strict=True) if flag)
            words = tuple("r" + word for word in words) if kind else words
            key = (float(kind), *(float(flag) for flag in singular), *direction_key(axes.ravel(), 6))
            supports[key] = Support(words, tuple(map(tuple, axes.tolist())))
            nodes_by_key.setdefault(key, []).append(int(node))
    return [(np.array(nodes), supports[key]) for key, nodes in nodes_by_key.items()]


def _blocks(K: sparse.csr_array, rows: sparse.csr_array) -> tuple[Array, BoolArray]:
    """Stiffness (n, 3, 3) of nodes in their three components, and a mask (n, 3) of those that are independent dofs."""
    n = rows.shape[0] // 3
    forces = (rows @ K).tocsr()
    block, gram = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    for a in range(3):
        for b in range(3):
            block[:, a, b] = np.asarray(forces[a::3].multiply(rows[b::3]).sum(axis=1)).ravel()
            gram[:, a, b] = np.asarray(rows[a::3].multiply(rows[b::3]).sum(axis=1)).ravel()
    return (block + block.swapaxes(1, 2)) / 2, np.abs(gram - np.eye(3)).max(axis=2) < MOTION_TOLERANCE
