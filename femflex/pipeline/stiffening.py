"""Watching what linear strain leaves out: how far spin would stiffen a body."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.rotations import dcm_from_quaternion
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics import Model

Array = NDArray[np.float64]

STIFFENED = 0.02  # of the first frequency: stiffening by spin from which its lack is told


class Stiffening:
    """Watches how far spin would stiffen bodies with linear strain, row by row, and warns of it."""

    def __init__(self, model: Model) -> None:
        system = model.system
        self._bodies = {name: body for name, body in system.bodies.items() if body.ignored is not None}
        root = system.joint_of(system.root)
        self._free = system.orbit is not None or len(root.translations) == 3
        self._worst: dict[str, tuple[float, float]] = {}

    def watch(self, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows."""
        for name, body in self._bodies.items():
            assert body.ignored is not None
            omega, place = channels[f"bodies/{name}/rate"], channels[f"bodies/{name}/position"]
            arm = place - channels["monitors/center_of_mass"] if self._free else place
            C = np.swapaxes(dcm_from_quaternion(channels[f"bodies/{name}/attitude"]), 1, 2)
            W = omega[:, :, None] * omega[:, None, :] - np.einsum("ta,ta,bc->tbc", omega, omega, np.eye(3))
            gain = np.einsum("tab,tb,a->t", W, np.einsum("tab,tb->ta", C, arm), body.ignored[0])
            gain += np.einsum("tab,ab->t", W, body.ignored[1:])
            k = int(np.argmax(gain))
            seen = float(gain[k]), float(np.linalg.norm(omega[k]))
            self._worst[name] = max(self._worst.get(name, (0.0, 0.0)), seen)

    def warn(self) -> None:
        """Warn of bodies whose first frequency spin would have raised by more than STIFFENED, with both numbers."""
        for name, (gain, spin) in self._worst.items():
            raised = np.sqrt(1.0 + max(gain, 0.0)) - 1.0
            if raised > STIFFENED:
                first = np.nanmin(self._bodies[name].omega) / (2 * np.pi)
                warnings.warn(
                    f"body {name!r} turned at up to {spin:.4g} rad/s: a stiffening of {raised:.0%} of its first "
                    f"frequency ({first:.4g} Hz, not {first * (1 + raised):.4g} Hz) is ignored by linear strain. Give "
                    f"it strain = 'condensed'.",
                    PhysicsWarning,
                    stacklevel=2,
                )
