"""modelDescription.xml of FMI 3.0: variables with units, and what the FMU can do.

Value references number the variables from 1 in their order; 0 is time.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from femflex import __version__
from femflex.noun.units import UnitError, to_base

POWER = re.compile(r"([A-Za-z]+)(?:\^(-?\d+))?")
BASES = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"}  # whole powers of which FMI can state


@dataclass(frozen=True)
class Variable:
    """A number of an FMU.

    causality    "input", "output" or "local"
    description  what it means, with its axes
    start        value before the first step, of an input or a state; None for what is computed
    derivative   name of the state whose rate it is, or ""
    """

    name: str
    unit: str
    causality: str
    description: str = ""
    start: float | None = None
    derivative: str = ""


def port_variables(
    inputs: Sequence[tuple[str, str]], outputs: Sequence[tuple[str, str]], frames: Mapping[str, str]
) -> list[Variable]:
    """Variables of inputs and outputs (name, unit), with the axes of their components."""
    axes = {name: f"in {frames[name]} axes" for name in frames}
    variables = [Variable(name, unit, "input", axes.get(name, ""), start=0.0) for name, unit in inputs]
    return [*variables, *(Variable(name, unit, "output", axes.get(name, "")) for name, unit in outputs)]


@dataclass(frozen=True)
class Description:
    """An FMU: its names and variables.

    identifier  of its library, a word in C
    token       by which its library knows it
    kinds       "ModelExchange", "CoSimulation" -> further attributes of them
    step, stop  usual step and duration [s], or None
    """

    name: str
    identifier: str
    token: str
    variables: Sequence[Variable]
    kinds: Mapping[str, Mapping[str, str]]
    step: float | None = None
    stop: float | None = None

    def references(self) -> dict[str, int]:
        """Value reference of every variable by name."""
        return {"time": 0} | {variable.name: k + 1 for k, variable in enumerate(self.variables)}

    def xml(self) -> bytes:
        """The file modelDescription.xml."""
        root = Element(
            "fmiModelDescription",
            fmiVersion="3.0",
            modelName=self.name,
            instantiationToken=self.token,
            generationTool=f"femflex {__version__}",
            variableNamingConvention="flat",
        )
        for kind, attributes in self.kinds.items():
            SubElement(root, kind, {"modelIdentifier": self.identifier, **attributes})
        units = SubElement(root, "UnitDefinitions")
        for unit in dict.fromkeys(["s", *(variable.unit for variable in self.variables)]):
            element, powers = SubElement(units, "Unit", name=unit), base_units(unit)
            if powers is not None:
                SubElement(element, "BaseUnit", {base: str(power) for base, power in powers.items()})
        experiment = {"stopTime": self.stop, "stepSize": self.step}
        SubElement(root, "DefaultExperiment", {key: repr(value) for key, value in experiment.items() if value})
        variables, references = SubElement(root, "ModelVariables"), self.references()
        SubElement(
            variables, "Float64", name="time", valueReference="0", causality="independent", variability="continuous",
            unit="s",
        )  # fmt: skip
        for variable in self.variables:
            attributes = {"name": variable.name, "valueReference": str(references[variable.name])}
            attributes |= {"causality": variable.causality, "variability": "continuous", "unit": variable.unit}
            attributes |= {"description": variable.description} if variable.description else {}
            if variable.start is not None:
                attributes |= {"start": repr(variable.start)}
                attributes |= {"initial": "exact"} if variable.causality == "local" else {}
            if variable.derivative:
                attributes |= {"derivative": str(references[variable.derivative])}
            SubElement(variables, "Float64", attributes)
        structure = SubElement(root, "ModelStructure")
        outputs = [references[variable.name] for variable in self.variables if variable.causality == "output"]
        rates = [references[variable.name] for variable in self.variables if variable.derivative]
        for tag, numbers in (("Output", outputs), ("ContinuousStateDerivative", rates)):
            for number in numbers:
                SubElement(structure, tag, valueReference=str(number))
        for number in sorted(outputs + rates):
            SubElement(structure, "InitialUnknown", valueReference=str(number))
        indent(root)
        return tostring(root, encoding="utf-8", xml_declaration=True)


def base_units(unit: str) -> dict[str, int] | None:
    """Powers of SI base units and rad, or None for a unit with others, such as kg^1/2.

    >>> base_units("N m")
    {'kg': 1, 'm': 2, 's': -2}
    """
    try:
        factor, text = to_base(f"1 {unit}")
    except UnitError:
        return None
    powers = {base: int(power or 1) for base, power in POWER.findall(text)}
    whole = " ".join(base if power == 1 else f"{base}^{power}" for base, power in powers.items())
    return powers if factor == 1.0 and set(powers) <= BASES and whole == text else None
