"""Studies of a case: how a quantity converges with the number of modes and with finer meshes."""

from __future__ import annotations

from femflex.studies.backbone_curve import Backbone, BackboneError, backbone
from femflex.studies.chosen import choice, choice_text, with_choice
from femflex.studies.convergence import Convergence, assessed, convergence
from femflex.studies.decay import mode_trend
from femflex.studies.function_kinds import FunctionKind, FunctionStudy, function_kinds
from femflex.studies.law import Law, Trend
from femflex.studies.refusals import check_studies
from femflex.studies.richardson import extrapolated, mesh_trend, observed_order
from femflex.studies.strain_forms import StrainForm, StrainStudy, strain_forms
from femflex.studies.study import Point, Study, planned

__all__ = [
    "Backbone",
    "BackboneError",
    "Convergence",
    "FunctionKind",
    "FunctionStudy",
    "Law",
    "Point",
    "StrainForm",
    "StrainStudy",
    "Study",
    "Trend",
    "assessed",
    "backbone",
    "check_studies",
    "choice",
    "choice_text",
    "convergence",
    "extrapolated",
    "function_kinds",
    "mesh_trend",
    "mode_trend",
    "observed_order",
    "planned",
    "strain_forms",
    "with_choice",
]
