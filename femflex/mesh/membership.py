"""Items sorted by the set of groups they are in: what formats need that give every item one number."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import IntArray


def classes(groups: Mapping[str, IntArray], count: int) -> list[tuple[tuple[str, ...], IntArray]]:
    """Names of the groups and rows of every class: items 0 .. count - 1 in the very same groups, in order.

    >>> [(names, rows.tolist()) for names, rows in classes({"a": np.array([1, 2]), "b": np.array([2])}, 4)]
    [((), [0, 3]), (('a',), [1]), (('a', 'b'), [2])]
    """
    member = np.zeros((count, len(groups)), bool)
    for column, rows in enumerate(groups.values()):
        member[rows, column] = True
    kinds, first, which = np.unique(member, axis=0, return_index=True, return_inverse=True)
    names = np.array([*groups, ""], object)[:-1]
    return [(tuple(names[kinds[k]]), np.flatnonzero(which.ravel() == k)) for k in np.argsort(first)]
