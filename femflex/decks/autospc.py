"""AUTOSPC: supports of the components of nodes without stiffness: free rotations, and what nothing is connected to."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.arrays import BoolArray, IntArray
from femflex.decks.deck import AUTOSPC, Deck
from femflex.decks.findings import BY_MATRICES
from femflex.fem import Structure, Support
from femflex.fem.support import COMPONENTS, GLOBAL

MAX_SHOWN = 6  # maximum number of nodes of one kind, and of kinds, listed in a note
# Stiffness of a component, relative to the largest of its node, below which it is singular (Nastran's EPZERO). The
# largest is limited to the median of all nodes, since bushings and springs may represent rigid links.
RATIO = 1e-8
ROUNDING = 1e-13  # stiffness, relative to the largest of a node, that may be rounding
MOTION_TOLERANCE = 1e-9  # difference between the motion of a node and that of an independent dof


def with_autospc(deck: Deck) -> Deck:
    """The deck with an active set of supports "autospc" for the components of nodes without stiffness.

    Components are those along the axes of the deck; a note names nodes without stiffness in others, which stay free.
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
    held = np.zeros((structure.translation.shape[0] // 3, 6), bool)
    for group, support in active.items():
        if support.axes == GLOBAL:
            for component in support.components:
                held[deck.mesh.group_points(group), COMPONENTS.index(component)] = True
    points = np.array(sorted(deck.points_of_ids.values()), np.int64)
    free, askew = _without_stiffness(structure, points, held)
    nodes_by_components: dict[tuple[str, ...], list[int]] = {}
    for node in points[(free & ~held)[points].any(axis=1)].tolist():
        words = tuple(word for word, flag in zip(COMPONENTS, free[node], strict=True) if flag)
        nodes_by_components.setdefault(words, []).append(node)
    notes = list(deck.notes)
    if nodes_by_components:
        numbers = {row: number for number, row in deck.points_of_ids.items()}
        texts = [
            f"{', '.join(words)} at node{'s' if len(nodes) > 1 else ''} "
            f"{_first_texts([str(number) for number in sorted(numbers[node] for node in nodes)])}"
            for words, nodes in nodes_by_components.items()
        ]
        count = sum(len(words) * len(nodes) for words, nodes in nodes_by_components.items())
        notes.append(
            f"{count} components of nodes have no stiffness and are fixed (as by AUTOSPC; set of supports "
            f"{AUTOSPC!r}): {_first_texts(texts, '; ', ' groups')}; if they shall move, connect these nodes by "
            "elements that resist there"
        )
    if names := [name for point, name in deck.point_names().items() if askew[point]]:
        notes.append(
            f"no stiffness at {_first_texts(names)} in a direction askew to the axes of the deck; it is not fixed as "
            f"by AUTOSPC. Support it, or {BY_MATRICES}"
        )
    if not nodes_by_components:
        return replace(deck, notes=tuple(notes))
    groups = {f"{AUTOSPC}-{k}": np.array(nodes) for k, nodes in enumerate(nodes_by_components.values(), 1)}
    supports = {f"{AUTOSPC}-{k}": Support(words) for k, words in enumerate(nodes_by_components, 1)}
    return replace(
        deck, mesh=deck.mesh.with_groups(points=groups), supports={**deck.supports, AUTOSPC: supports},
        default_supports=(*deck.default_supports, AUTOSPC), notes=tuple(notes),
    )  # fmt: skip


def _first_texts(texts: list[str], separator: str = ", ", what: str = "") -> str:
    """The first MAX_SHOWN texts, and the count of the others."""
    more = f"{separator.rstrip() if what else ''} and {len(texts) - MAX_SHOWN} more{what}"
    return separator.join(texts[:MAX_SHOWN]) + (more if len(texts) > MAX_SHOWN else "")


def _without_stiffness(structure: Structure, points: IntArray, held: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Masks (n, 6) of the components that nothing resists, and (n,) of nodes free in a direction askew to the axes.

    Nodes are examined one by one, as in Nastran, by the 3 x 3 stiffness of their displacement and of their rotation.
    Components that depend on other nodes through connections, and those that are held, count as stiff.
    """
    free, askew = np.zeros(held.shape, bool), np.zeros(len(held), bool)
    for kind, rows in enumerate((structure.translation, structure.rotation)):
        part, forces = slice(3 * kind, 3 * kind + 3), (rows @ structure.K).tocsr()
        block, motion = np.zeros((len(held), 3, 3)), np.zeros((len(held), 3, 3))
        for a, b in np.ndindex(3, 3):
            block[:, a, b] = np.asarray(forces[a::3].multiply(rows[b::3]).sum(axis=1)).ravel()
            motion[:, a, b] = np.asarray(rows[a::3].multiply(rows[b::3]).sum(axis=1)).ravel()
        block = (block + block.swapaxes(1, 2)) / 2
        independent = np.abs(motion - np.eye(3)).max(axis=2) < MOTION_TOLERANCE
        stiffness = np.abs(block).max(axis=2)
        largest = stiffness.max(axis=1)
        median = float(np.median(largest[points][largest[points] > 0])) if largest[points].any() else 0.0
        # so that a rigid link makes no other node singular
        threshold = np.maximum(RATIO * np.minimum(largest, median), ROUNDING * largest)
        threshold = np.maximum(threshold, 1e-14 * largest.max(initial=0.0))
        free[:, part] = independent & (stiffness <= threshold[:, None])
        moving = (motion.diagonal(axis1=1, axis2=2) > MOTION_TOLERANCE) & ~free[:, part] & ~held[:, part]
        rest = block * moving[:, None, :] * moving[:, :, None]
        rest[:, range(3), range(3)] += ~moving * (1.0 + largest)[:, None]
        askew |= moving.any(axis=1) & (np.linalg.eigvalsh(rest)[:, 0] <= threshold)
    return free, askew
