"""Studies of a case: convergence of a quantity with modes, meshes, segments, strain and functions; backbone curves."""

from __future__ import annotations

from femflex.studies.backbone_curve import Backbone, BackboneError, backbone
from femflex.studies.comparison import (
    Comparison,
    Finding,
    Option,
    check_studies,
    function_kinds,
    recommendation_text,
    recommended_level,
    strain_forms,
    with_recommended_level,
)
from femflex.studies.convergence import Convergence, assess_convergence, convergence
from femflex.studies.study import Point, Study, plan_study
from femflex.studies.trend import Law, Trend, extrapolated, mesh_trend, mode_trend, observed_order

__all__ = [
    "Backbone",
    "BackboneError",
    "Comparison",
    "Convergence",
    "Finding",
    "Law",
    "Option",
    "Point",
    "Study",
    "Trend",
    "assess_convergence",
    "backbone",
    "check_studies",
    "convergence",
    "extrapolated",
    "function_kinds",
    "mesh_trend",
    "mode_trend",
    "observed_order",
    "plan_study",
    "recommendation_text",
    "recommended_level",
    "strain_forms",
    "with_recommended_level",
]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
