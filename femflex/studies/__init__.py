"""Studies of a case: convergence of a quantity with modes, meshes, segments, strain and functions; backbone curves."""

from __future__ import annotations

from femflex.studies.backbone_curve import Backbone, BackboneError, backbone
from femflex.studies.convergence import Convergence, assess_convergence, convergence
from femflex.studies.function_kinds import FunctionKind, FunctionStudy, function_kinds
from femflex.studies.series import (
    Finding,
    check_studies,
    recommendation_text,
    recommended_level,
    with_recommended_level,
)
from femflex.studies.strain_forms import StrainForm, StrainStudy, strain_forms
from femflex.studies.study import Point, Study, plan_study
from femflex.studies.trend import Law, Trend, extrapolated, mesh_trend, mode_trend, observed_order

__all__ = [
    "Backbone",
    "BackboneError",
    "Convergence",
    "Finding",
    "FunctionKind",
    "FunctionStudy",
    "Law",
    "Point",
    "StrainForm",
    "StrainStudy",
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
