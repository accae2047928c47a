"""Middle nodes of second-order elements, some of which a deck may leave out."""

from __future__ import annotations

from collections.abc import Sequence

from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel


def with_middles(
    model: NastranModel, corners: Sequence[int], middles: Sequence[int], card: Card,
    edges: Sequence[tuple[int, int]] = (),
) -> list[int]:  # fmt: skip
    """Rows of the points of middle nodes; missing ones (0) are added at the middle of their edges, once per edge.

    edges  indices in `corners` of the ends of each edge; by default the edges around a surface
    """
    n = len(corners)
    ends = edges or [(k, (k + 1) % n) for k in range(n)]
    rows, missing = [], 0
    for (a, b), grid in zip(ends, middles, strict=True):
        if grid:
            rows.append(model.row(grid))
            continue
        missing += 1
        pair = (min(corners[a], corners[b]), max(corners[a], corners[b]))
        if pair not in model.middles:
            model.middles[pair] = model.build.point((model.grids[pair[0]].position + model.grids[pair[1]].position) / 2)
        rows.append(model.middles[pair])
    if missing and card.name not in model.incomplete:
        model.incomplete.add(card.name)
        model.bulk.findings.note(
            f"{card} and other {card.name} leave out some of their middle nodes; these are put in the middle of the "
            "edges"
        )
    return rows
