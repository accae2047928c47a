"""The motion of a System in memory, with the integrator, the guards and the warnings of a run of a case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.advice.advice import warn_of
from femflex.advice.advise import advise
from femflex.advice.bodies import BodyOrigins
from femflex.advice.watches import Watches
from femflex.arrays import Array
from femflex.dynamics import Model, compile_system
from femflex.integrate import Block, Solution
from femflex.integrate.driver import collected
from femflex.pipeline.guard import MotionGuard, first_fault
from femflex.pipeline.integrator import chosen_integrator
from femflex.summary import Rows, Summarised, listed
from femflex.system import System

SAMPLES = 1001  # output times by default, as of a case


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Summarised, Mapping[str, Array]):
    """A motion: its channels by path, such as simulation["markers/boom.tip/position"], (n_t, ...) in SI.

    model     the compiled system, by which terms, energies and linear models follow
    motion    times (n_t,) [s], states (n_t, n_x) and statistics
    channels  path -> values (n_t, ...)
    reason    why this integrator was chosen
    """

    model: Model
    motion: Solution
    channels: Mapping[str, Array]
    reason: str

    @property
    def times(self) -> Array:
        """Output times (n_t,) [s]."""
        return self.motion.times

    def __getitem__(self, path: str) -> Array:
        return self.channels[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __len__(self) -> int:
        return len(self.channels)

    def summary(self) -> tuple[str, Rows]:
        """Its times, integrator and channels."""
        rows = [("times", f"{len(self.times)} from {self.times[0]:g} to {self.times[-1]:g} s")]
        rows += [("integrator", self.reason), ("channels", listed(sorted(self.channels)))]
        return "Simulation", rows


def simulate(
    system: System,
    duration: float,
    *,
    output_step: float | None = None,
    integrator: str = "auto",
    band: float | None = None,
    **settings: Any,
) -> Simulation:
    """The motion of a system over a duration [s] from its initial state.

    output_step  between output times [s]; by default a thousandth of the duration
    integrator   "auto", or the name of one (`integrate.INTEGRATORS`), chosen as for a case
    band         highest frequency to resolve [Hz]; by default half the output frequency
    settings     of the integrator: rtol, atol, max_step [s], step [s]

    Issues the warnings of `advise`, and warns of bends beyond the range of a body's strain. Raises ValueError for
    settings that the integrator does not have, and IntegrationError where the motion diverges or the integration fails;
    the error carries the motion up to there. To write a result file, describe the craft in a case (`femflex.run`).
    """
    if not duration > 0.0:
        raise ValueError(f"duration is {duration} s; a simulation needs a positive duration")
    count = SAMPLES if output_step is None else max(2, 1 + int(np.ceil(duration / output_step - 1e-9)))
    step = duration / (count - 1) if output_step is None else output_step
    times: Array = np.minimum(np.arange(count) * step, duration)
    advise(system, duration)
    model = compile_system(system)
    method, reason = chosen_integrator(model, times, integrator, band, settings)
    guard = MotionGuard(model)

    def blocks() -> Iterator[Block]:
        for block in method.blocks(model, times, model.x0, None):
            if (error := guard.divergence(block)) is not None:
                raise error
            yield block

    motion = collected(blocks(), None, model.n_x)
    channels = model.observe(motion.times, motion.states)
    last = Block(motion.times, motion.states, motion.resume)
    if (overflow := first_fault(model, channels, last)) is not None:
        raise overflow
    watches = Watches(model, BodyOrigins({}))
    watches.watch(motion.times, motion.states, channels)
    warn_of(entry for entry in watches.doubts() if entry.decision == "bend")  # `advise` has judged the stretch
    return Simulation(model, motion, channels, reason)
