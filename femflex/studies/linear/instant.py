"""The state of a run at an instant."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.results import open_run
from femflex.system import System


def state_of_run(path: str | Path, system: System, time: float) -> tuple[float, Array]:
    """Time and state (n_x,) of the row of a run nearest to a time [s].

    Raises ValueError when the run is of another craft, or does not reach that time.
    """
    with open_run(path) as run:
        names = tuple(name for key in ("q", "u", "z") if key in run for name in run.names(key))
        expected = tuple(name for name, _ in system.all_state_names())
        if names != expected:
            raise ValueError(
                f"{path} is of another craft: its state has {len(names)} numbers and that of the case {len(expected)}; "
                "take the run of this case"
            )
        times = run.time
        if not len(times) or not times[0] <= time <= times[-1]:
            reach = f"it goes from {times[0]:.6g} s to {times[-1]:.6g} s" if len(times) else "it holds no instants"
            raise ValueError(f"there is no state at {time:.6g} s in {path}; {reach}")
        k = int(np.argmin(np.abs(times - time)))
        return float(times[k]), run.states(slice(k, k + 1))[0]
