"""Single channels at one instant, as sensors of controllers read them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.channels import row_length, row_slices
from femflex.dynamics.joints.prescribed_coordinates import prescribed_states
from femflex.dynamics.reports.observe import observe

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


STATES = ("q", "u", "z")


class ChannelReader:
    """Reads channels of a model; those that stand in an observed row, and states, without all the others."""

    def __init__(self, model: Model) -> None:
        self._model, self._row = model, np.empty((1, row_length(model.system)))
        angles = "attitude/angles"  # reported in another order than it stands in the row
        self._slices = {path: columns for path, columns in row_slices(model.system).items() if path != angles}

    def values(self, t: float, x: Array, paths: Sequence[str]) -> dict[str, Array]:
        """Channels by path at the state x (n_x,)."""
        model, times, states = self._model, np.array([t]), np.ascontiguousarray(x[None], float)
        if not paths:
            return {}
        if any(path not in self._slices and path not in STATES for path in paths):
            channels = model.observe(times, states)
            return {path: channels[path][0] for path in paths}
        observe(times, states, self._row, model.table, model.pool, model.work)
        out = dict(zip(STATES, model.parts(prescribed_states(model, times, states)[0]), strict=True))
        for path in paths:
            if path in self._slices:
                out[path] = self._row[0, self._slices[path]].reshape(model.channels[path].shape)
        return {path: np.array(out[path]) for path in paths}
