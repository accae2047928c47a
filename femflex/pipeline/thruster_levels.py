"""Watch of the commands of thrusters during a run: levels are cut off at 0 and 1."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.limits import FULL_THRUST
from femflex.arrays import Array
from femflex.system import Effector
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics import Model


class ThrusterLevels:
    """Watches the signals that command thrusters, and warns of those above full thrust, and if none ever fired.

    Commands below zero are usual: of two opposite thrusters, one does not fire.
    """

    def __init__(self, model: Model) -> None:
        thrusters = [e for e in model.system.effectors if isinstance(e, Effector) and e.kind == "thruster"]
        signals = {e.name: e.inputs[0].split(".") for e in thrusters if e.inputs and not e.inputs[0].endswith(".feed")}
        self._paths = {name: f"effectors/{owner}/{output}" for name, (owner, output) in signals.items()}
        self._largest = {name: (-np.inf, 0.0) for name, path in self._paths.items() if path in model.channels}

    def watch(self, times: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest level of each thruster over a block of times (n_t,) [s]."""
        for name, before in self._largest.items():
            levels = channels[self._paths[name]]
            k = int(np.argmax(levels))
            self._largest[name] = max(before, (float(levels[k]), float(times[k])))

    def warn(self) -> None:
        """Warn of thrusters whose level was cut off at full thrust, and of all thrusters if none of them fired."""
        silent = all(level <= 0.0 for level, _ in self._largest.values())
        for name, (level, t) in self._largest.items():
            signal = ".".join(self._paths[name].split("/")[1:])
            if level > FULL_THRUST:
                text = f"rose to {level:.4g} at t = {t:.4g} s, above 1, where it is cut off: full thrust is 1"
            elif silent:
                text = f"was never above 0 (at most {level:.4g}), so it never fired"
            else:
                continue
            warnings.warn(PhysicsWarning(f"thruster {name!r}: its command {signal} {text}"), stacklevel=2)
