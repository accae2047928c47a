"""Reduction of a Structure to a FlexibleBody: sets of shapes, and the body's quantities over them."""

from __future__ import annotations

from femflex.reduction.admissible import beam_body, sampled_functions
from femflex.reduction.beams.uniform_beam import BeamFunctions, Taper, TaperedBeam, UniformBeam
from femflex.reduction.inertia.effective_mass import EffectiveMass, effective_mass, mac, mac_of_bodies
from femflex.reduction.large_deflection.derivatives import with_derivatives
from femflex.reduction.large_deflection.foreshortening import (
    foreshortening,
    foreshortening_of,
    hardening,
    least_stiffness_ratio,
    mesh_rise,
)
from femflex.reduction.large_deflection.response_states import with_responses
from femflex.reduction.large_deflection.slow_loads import slow_loads
from femflex.reduction.large_deflection.stretch import Stretching, missing_stretch, require_stretch, stretching
from femflex.reduction.large_deflection.third_derivatives import with_sheet_bends, with_third_derivatives
from femflex.reduction.matrices import body_from_matrices
from femflex.reduction.modes.buckling import critical_factor
from femflex.reduction.modes.craig_bampton import craig_bampton
from femflex.reduction.modes.damping import (
    Damping,
    bending_damping,
    is_added,
    is_unanswered,
)
from femflex.reduction.modes.nodal import lumped, nodal, nodal_translations
from femflex.reduction.modes.residuals import with_attachment
from femflex.reduction.modes.vibration import ModeSet, cantilever_modes, free_free_modes, load_vectors, rigid_set
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import OrbitField, Preload
from femflex.reduction.reduce import chord_modes, reduce_segments, reduce_structure
from femflex.reduction.store import load_body, save_body
from femflex.reduction.strain.condense import condense
from femflex.reduction.strain.initial_stress import relaxed, warn_of_initial_stress
from femflex.reduction.strain.tensors import strain_tensors

__all__ = [
    "BeamFunctions",
    "Damping",
    "EffectiveMass",
    "ModeSet",
    "OrbitField",
    "Preload",
    "Stretching",
    "Taper",
    "TaperedBeam",
    "UniformBeam",
    "beam_body",
    "bending_damping",
    "body_from_matrices",
    "cantilever_modes",
    "chord_modes",
    "condense",
    "craig_bampton",
    "critical_factor",
    "effective_mass",
    "foreshortening",
    "foreshortening_of",
    "free_free_modes",
    "hardening",
    "is_added",
    "is_unanswered",
    "least_stiffness_ratio",
    "load_body",
    "load_vectors",
    "lumped",
    "mac",
    "mac_of_bodies",
    "mesh_rise",
    "missing_stretch",
    "nodal",
    "nodal_translations",
    "reduce_segments",
    "reduce_structure",
    "relaxed",
    "require_stretch",
    "rigid_set",
    "sampled_functions",
    "save_body",
    "slow_loads",
    "static_equilibrium",
    "strain_tensors",
    "stretching",
    "warn_of_initial_stress",
    "with_attachment",
    "with_derivatives",
    "with_responses",
    "with_sheet_bends",
    "with_third_derivatives",
]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
