"""Values of every member of a sweep, as a pure function of the sweep's table."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.case.sweep import SweepTable

EDGE = 1e-12  # a unit sample is kept this far from 0 and 1, where a normal scatter has no end


def member_values(table: SweepTable) -> list[dict[str, Any]]:
    """Key path -> value in the form of a case file, for every member.

    A Sobol sequence is scrambled by the seed, and best with a power of 2 members. For Sobol indices the members are two
    independent samples A and B, and A with one column after the other from B.
    """
    if table.design == "grid":
        lists = [table_entry.values or [] for table_entry in table.vary.values()]
        return [dict(zip(table.vary, row, strict=True)) for row in product(*lists)]
    if table.design == "list":
        lists = [table_entry.values or [] for table_entry in table.vary.values()]
        return [dict(zip(table.vary, row, strict=True)) for row in zip(*lists, strict=True)]
    columns = []
    for unit, table_entry in zip(unit_samples(table).T, table.vary.values(), strict=True):
        lower, upper, word = table_entry.numbers()
        values = lower + (upper - lower) * unit if table_entry.between else lower + upper * _normal(unit)
        columns.append([f"{value!r} {word}" if word else value for value in values.tolist()])
    return [dict(zip(table.vary, row, strict=True)) for row in zip(*columns, strict=True)]


def unit_samples(table: SweepTable) -> Array:
    """Samples (runs, n) [1] between 0 and 1."""
    from scipy.stats import qmc

    n, k = table.members or 0, len(table.vary)
    if table.design == "random":
        samples = np.random.default_rng(table.seed).random((n, k))
    elif table.design == "latin_hypercube":
        samples = qmc.LatinHypercube(k, seed=np.random.default_rng(table.seed)).random(n)
    elif table.design == "sobol_indices":
        pairs = qmc.Sobol(2 * k, seed=np.random.default_rng(table.seed)).random_base2(n.bit_length() - 1)
        A, B = pairs[:, :k], pairs[:, k:]
        mixed = [np.where(np.arange(k) == j, B, A) for j in range(k)]
        samples = np.concatenate([A, B, *mixed])
    else:
        sequence = qmc.Sobol(k, seed=np.random.default_rng(table.seed))
        samples = sequence.random_base2(max(0, (n - 1).bit_length()))[:n]
    return np.clip(np.asarray(samples, float), EDGE, 1.0 - EDGE)


def _normal(unit: Array) -> Array:
    from scipy.special import ndtri

    return np.asarray(ndtri(unit))


def sobol_indices_of(table: SweepTable, values: Array) -> Array:
    """First-order and total Sobol indices (n, 2) of an output (runs,) of a design for them; NaN where a run failed.

    Those of scipy.stats.sobol_indices, estimated by Saltelli's and Jansen's formulas.
    """
    from scipy.stats import sobol_indices

    n, k = table.members or 0, len(table.vary)
    if not np.isfinite(values).all() or np.ptp(values) == 0.0:
        return np.full((k, 2), np.nan)
    blocks = values.reshape(k + 2, n)
    evaluations: Any = {"f_A": blocks[0][None], "f_B": blocks[1][None], "f_AB": blocks[2:][:, None]}
    result = sobol_indices(func=evaluations, n=n)
    return np.column_stack([np.ravel(result.first_order), np.ravel(result.total_order)])
