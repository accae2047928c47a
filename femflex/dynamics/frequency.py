"""The highest natural frequency of a compiled model: what an explicit method has to follow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.dynamics.layout import body_records

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def highest_frequency(model: Model) -> float:
    """Highest natural frequency of shapes and springs at the initial configuration, at rest [rad/s].

    M^-1 K column by column: the accelerations that a unit of each elastic, sliding or turning coordinate calls up.
    """
    pairs = [pair for record in body_records(model.table)[1:] for pair in stiff_coordinates(record)]
    if not pairs:
        return 0.0
    q, u = (np.array(side) for side in zip(*pairs, strict=True))
    rest = np.concatenate([model.x0[: model.n_q], np.zeros(model.n_u)])
    base = model.state_rate(0.0, rest)[model.n_q :][u]
    columns = []
    for j in q:
        moved = rest.copy()
        moved[j] += 1e-6
        columns.append((base - model.state_rate(0.0, moved)[model.n_q :][u]) / 1e-6)
    return float(np.sqrt(max(np.linalg.eigvals(np.column_stack(columns)).real.max(), 0.0)))


def stiff_coordinates(record: np.void) -> list[tuple[int, int]]:
    """(q, u) places of a body's elastic coordinates, and of its joint's slides and turns when it has springs."""
    joint = int(record["n_slide"] + record["n_turn"]) if record["sprung"] else 0
    elastic = [(int(record["qe"]) + k, int(record["ue"]) + k) for k in range(int(record["n"]))]
    return [(int(record["q"]) + k, int(record["u"]) + k) for k in range(joint)] + elastic
