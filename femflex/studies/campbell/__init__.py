"""Campbell diagrams: the frequencies of a craft over the speed of a steady spin, or over any value of its case."""

from __future__ import annotations

from femflex.studies.campbell.diagram import Branch, Campbell, Crossing, assembled_diagram, campbell, spin_steps
from femflex.studies.campbell.of_case import (
    MODES,
    axis_of,
    case_campbell,
    case_steps,
    diagram_of,
    value_diagram,
    value_steps,
)
from femflex.studies.tracking import Step

__all__ = [
    "MODES",
    "Branch",
    "Campbell",
    "Crossing",
    "Step",
    "assembled_diagram",
    "axis_of",
    "campbell",
    "case_campbell",
    "case_steps",
    "diagram_of",
    "spin_steps",
    "value_diagram",
    "value_steps",
]
