"""Functions for the module inside an FMU of a whole craft: variables by value reference, over a `SteppedCraft`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femflex.export.fmi.stepped import SteppedCraft


class CraftVariables:
    """The variables of an FMU: 0 is the time, then its inputs, then its outputs, with the calls of pythonfmu3."""

    def __init__(self, case: Path, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self.craft = SteppedCraft(case, inputs, outputs)

    def start(self, time: float) -> None:
        """Begin at this time [s]; inputs stay as they were set."""
        values = self.craft.input_values()
        self.craft.restart(time)
        for k, value in enumerate(values):
            self.craft.set_input(k, value)

    def do_step(self, step: float) -> None:
        """Move on by a step [s]. Raises IntegrationError."""
        self.craft.advance(step)

    def get(self, references: Sequence[int]) -> list[float]:
        """Values in SI by value reference."""
        values = np.concatenate([[self.craft.time], self.craft.input_values(), self.craft.output_values()])
        return [float(values[reference]) for reference in references]

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs. Raises ValueError for what is no input."""
        for reference, value in zip(references, values, strict=True):
            if not 1 <= reference <= len(self.craft.inputs):
                raise ValueError(f"variable {reference} is not an input")
            self.craft.set_input(reference - 1, value)

    def kept(self) -> dict[str, Any]:
        """Time and state, as numbers that JSON has."""
        return {"time": self.craft.time, "state": self.craft.state.tolist()}

    def take(self, kept: dict[str, Any]) -> None:
        """Go back to a time and state that were kept."""
        self.craft.time, self.craft.state = kept["time"], np.array(kept["state"])
