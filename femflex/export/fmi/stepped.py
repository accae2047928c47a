"""A craft that another program steps: its whole model, from one communication point to the next."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from femflex.case import Case, read_case
from femflex.dynamics import compile_system
from femflex.export.fmi.ports import with_ports
from femflex.integrate.driver import Adaptive
from femflex.pipeline.decisions import resolve_choices
from femflex.pipeline.integrator import case_integrator
from femflex.pipeline.references import duration_of
from femflex.studies.linear.inputs import default_inputs
from femflex.studies.linear.linear_model import output_entries
from femflex.system import Load, System

MARKER = re.compile(r"markers/(\w+)\.(\w+)/(force|torque)(?::([xyz]))?$")
PROBES, PROBE = "fmi-probe", 1e-6  # loads that stand for inputs where shapes are chosen, and their size [N, N m]


class SteppedCraft:
    """The craft of a case at a time, with inputs that are constant over a step.

    inputs, outputs  (name, unit) of each;  frames  name -> axes of it, where it has some
    time   [s];  state  (n_x,) as a row of a run
    step, duration  output step and duration of the case [s]
    """

    def __init__(
        self, case: Case | str | Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
    ) -> None:
        """inputs, outputs: as of `linear_model`; by default loads and signals of the case, and its usual outputs.

        Raises CaseError for a case that cannot be run, KeyError and ValueError for inputs and outputs that it has not.
        """
        case = case if isinstance(case, Case) else read_case(case)
        system = _resolved_system(case, () if inputs is None else inputs)
        system, ports, states = with_ports(system, default_inputs(system, []) if inputs is None else inputs)
        self._model = compile_system(system).for_run()
        self._entries, self.outputs = output_entries(self._model, outputs)
        self.inputs = tuple((port.path, port.unit) for port in ports)
        names = [name for name, _ in system.all_state_names()]
        self._held = [names.index(state) for state in states]
        pairs = zip(self._entries, self.outputs, strict=True)
        frames = {name: self._model.channels[path].frame for (path, _), (name, _) in pairs}
        frames |= {port.path: port.frame for port in ports}
        self.frames = {name: frame for name, frame in frames.items() if frame}
        self.duration = duration_of(case, system)
        times = case.run.times(self.duration)
        self.step = float(times[1] - times[0])
        self._integrator = case_integrator(case, self._model, times)[0]
        if isinstance(self._integrator, Adaptive):  # tolerances of the whole run, not of a step
            atol = self._integrator.absolute(self._model, times, self._model.x0)
            self._integrator = replace(self._integrator, atol=atol)
        self.time, self.state = 0.0, np.array(self._model.x0)

    def restart(self, time: float = 0.0) -> None:
        """Go back to the initial state, at this time [s]; inputs stay as they were set."""
        values = self.state[self._held]
        self.time, self.state = time, np.array(self._model.x0)
        self.state[self._held] = values

    def variables(self, references: Sequence[int]) -> list[float]:
        """Values in SI by value reference: 0 is the time, then the inputs, then the outputs."""
        channels = self._model.channel_values(self.time, self.state, dict.fromkeys(path for path, _ in self._entries))
        outputs = [np.ravel(channels[path])[k] for path, k in self._entries]
        values = np.concatenate([[self.time], self.state[self._held], outputs])
        return [float(values[reference]) for reference in references]

    def set_inputs(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs, in SI, from now on. Raises ValueError for what is no input."""
        for reference, value in zip(references, values, strict=True):
            if not 1 <= reference <= len(self.inputs):
                raise ValueError(f"variable {reference} is not an input")
            self.state[self._held[reference - 1]] = value

    def saved_state(self) -> dict[str, Any]:
        """Time and state, as numbers that JSON has."""
        return {"time": self.time, "state": self.state.tolist()}

    def restore_state(self, saved: dict[str, Any]) -> None:
        """Go back to a time and a state that were saved."""
        self.time, self.state = saved["time"], np.array(saved["state"])

    def advance(self, step: float) -> None:
        """Move on by a step [s]. Raises IntegrationError where the integration fails."""
        end = self.time + step
        rows = [block.states for block in self._integrator.blocks(self._model, np.array([self.time, end]), self.state)]
        self.time, self.state = end, np.array(np.concatenate(rows)[-1])


def _resolved_system(case: Case, inputs: Sequence[str]) -> System:
    """The system of a case, whose bodies have the static shapes of forces and torques at markers among the inputs."""
    labels = [match for path in inputs if (match := MARKER.match(path))]
    probes = []
    for k, match in enumerate(labels):
        body, marker, quantity, axis = match.groups()
        direction = PROBE * (np.ones(3) if axis is None else np.eye(3)["xyz".index(axis)])
        load: dict[str, Any] = {quantity: direction}
        probes.append(Load(name=f"{PROBES}{k + 1}", body=body, marker=marker, frame="marker", **load))
    system = resolve_choices(case.model_copy(update={"loads": [*case.loads, *probes]})).system
    return replace(system, loads=tuple(load for load in system.loads if not load.name.startswith(PROBES)))
