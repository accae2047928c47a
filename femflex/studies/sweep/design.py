"""Which values every member of a sweep has: a pure function of the sweep's table."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.case.sweep import SweepTable

EDGE = 1e-12  # a unit sample is kept this far from 0 and 1, where a normal scatter has no end


def designed(table: SweepTable) -> list[dict[str, Any]]:
    """Key path -> value as a case file writes it, for every member.

    A Sobol sequence is scrambled by the seed, and best taken with a power of 2. For Sobol indices the members are two
    independent samples A and B, and A with one column after the other from B.
    """
    if table.design == "grid":
        lists = [one.values or [] for one in table.vary.values()]
        return [dict(zip(table.vary, row, strict=True)) for row in product(*lists)]
    if table.design == "list":
        lists = [one.values or [] for one in table.vary.values()]
        return [dict(zip(table.vary, row, strict=True)) for row in zip(*lists, strict=True)]
    columns = []
    for unit, one in zip(unit_samples(table).T, table.vary.values(), strict=True):
        first, second, word = one.numbers()
        drawn = first + (second - first) * unit if one.between else first + second * _normal(unit)
        columns.append([f"{value!r} {word}" if word else value for value in drawn.tolist()])
    return [dict(zip(table.vary, row, strict=True)) for row in zip(*columns, strict=True)]


def unit_samples(table: SweepTable) -> Array:
    """Samples (runs, n) [1] between 0 and 1."""
    from scipy.stats import qmc

    n, k = table.members or 0, len(table.vary)
    if table.design == "random":
        found = np.random.default_rng(table.seed).random((n, k))
    elif table.design == "latin_hypercube":
        found = qmc.LatinHypercube(k, seed=np.random.default_rng(table.seed)).random(n)
    elif table.design == "sobol_indices":
        pairs = qmc.Sobol(2 * k, seed=np.random.default_rng(table.seed)).random_base2(n.bit_length() - 1)
        A, B = pairs[:, :k], pairs[:, k:]
        mixed = [np.where(np.arange(k) == j, B, A) for j in range(k)]
        found = np.concatenate([A, B, *mixed])
    else:
        sequence = qmc.Sobol(k, seed=np.random.default_rng(table.seed))
        found = sequence.random_base2(max(0, (n - 1).bit_length()))[:n]
    return np.clip(np.asarray(found, float), EDGE, 1.0 - EDGE)


def _normal(unit: Array) -> Array:
    from scipy.special import ndtri

    return np.asarray(ndtri(unit))


def indices(table: SweepTable, values: Array) -> Array:
    """First-order and total Sobol indices (n, 2) of an output (runs,) of a design for them; NaN where a run failed.

    Those of scipy.stats.sobol_indices, estimated by Saltelli's and Jansen's formulas.
    """
    from scipy.stats import sobol_indices

    n, k = table.members or 0, len(table.vary)
    if not np.isfinite(values).all() or np.ptp(values) == 0.0:
        return np.full((k, 2), np.nan)
    parts = values.reshape(k + 2, n)
    given: Any = {"f_A": parts[0][None], "f_B": parts[1][None], "f_AB": parts[2:][:, None]}
    found = sobol_indices(func=given, n=n)
    return np.column_stack([np.ravel(found.first_order), np.ravel(found.total_order)])
