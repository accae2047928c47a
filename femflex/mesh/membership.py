"""Classes of items with the same groups, for file formats that store one number per item."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import IntArray


def group_classes(groups: Mapping[str, IntArray], count: int) -> list[tuple[tuple[str, ...], IntArray]]:
    """Names of the groups and rows of every class; items 0 .. count - 1 of a class belong to exactly the same groups.

    >>> [(names, rows.tolist()) for names, rows in group_classes({"a": np.array([1, 2]), "b": np.array([2])}, 4)]
    [((), [0, 3]), (('a',), [1]), (('a', 'b'), [2])]
    """
    member = np.zeros((count, len(groups)), bool)
    for column, rows in enumerate(groups.values()):
        member[rows, column] = True
    memberships, first, inverse = np.unique(member, axis=0, return_index=True, return_inverse=True)
    names = np.array([*groups, ""], object)[:-1]
    return [(tuple(names[memberships[k]]), np.flatnonzero(inverse.ravel() == k)) for k in np.argsort(first)]
