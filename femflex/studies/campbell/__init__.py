"""Campbell diagrams: the frequencies of a craft over the speed of a steady spin, or over any value of its case."""

from __future__ import annotations

from femflex.studies.campbell.crossings import Crossing
from femflex.studies.campbell.diagram import Branch, Campbell, assembled_diagram, campbell
from femflex.studies.campbell.of_case import axis_of, case_campbell, case_spins, diagram_of, resolve_campbell_case
from femflex.studies.campbell.over_value import value_diagram, value_motions, with_value_axis
from femflex.studies.campbell.sweep import Spin, spins

__all__ = [
    "Branch",
    "Campbell",
    "Crossing",
    "Spin",
    "assembled_diagram",
    "axis_of",
    "campbell",
    "case_campbell",
    "case_spins",
    "diagram_of",
    "resolve_campbell_case",
    "spins",
    "value_diagram",
    "value_motions",
    "with_value_axis",
]
