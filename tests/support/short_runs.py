"""Short runs of every compiled method, for the comparison of compiled kernels with plain Python."""

from __future__ import annotations

import numpy as np

from femflex.integrate import Dop853, Esdirk4
from support.integrate_models import chain, rigid_body


def short_runs() -> dict[str, np.ndarray]:
    """States by method and model: a damped chain and a turning body, over rows and steps."""
    chained = chain(np.linspace(1, 2, 3), np.linspace(3, 1, 4), np.full(4, 0.02), cubic=0.4, force=0.7, w=1.3)
    body, start = rigid_body(spring=2.0), np.array([1.0, 0, 0, 0, 0.3, 1.0, 0.2])
    out = {}
    for method in (Dop853(rtol=1e-6, atol=1e-10), Esdirk4(rtol=1e-4)):
        times = np.linspace(0, 1.5, 6)
        out[f"{method.name}_chain"] = method.solve(chained, times, np.sin(np.arange(6.0))).states
        out[f"{method.name}_body"] = method.solve(body, times, start).states
    return out
