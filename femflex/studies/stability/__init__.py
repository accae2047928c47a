"""Stability over values of a case: loci of poles or multipliers, charts with traced boundaries."""

from __future__ import annotations

from femflex.studies.stability.chart import Chart, stability_chart
from femflex.studies.stability.judgement import KINDS, Judgement, equilibrium_stability, motion_stability
from femflex.studies.stability.locus import Locus, stability_locus
from femflex.studies.stability.of_case import case_stability

__all__ = [
    "KINDS",
    "Chart",
    "Judgement",
    "Locus",
    "case_stability",
    "equilibrium_stability",
    "motion_stability",
    "stability_chart",
    "stability_locus",
]
