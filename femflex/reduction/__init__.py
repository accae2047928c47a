"""Reduction of a Structure to a FlexibleBody: sets of shapes, and the body's quantities over them."""

from __future__ import annotations

from femflex.reduction.admissible import beam_body
from femflex.reduction.beams.uniform_beam import BeamFunctions, Taper, TaperedBeam, UniformBeam
from femflex.reduction.inertia.effective_mass import EffectiveMass, effective_mass, mac, mac_of_bodies
from femflex.reduction.large_deflection.derivatives import with_derivatives
from femflex.reduction.large_deflection.foreshortening import hardening
from femflex.reduction.large_deflection.response_states import with_responses
from femflex.reduction.large_deflection.third_derivatives import with_third_derivatives
from femflex.reduction.modes.buckling import critical_factor
from femflex.reduction.modes.craig_bampton import craig_bampton
from femflex.reduction.modes.damping import Damping
from femflex.reduction.modes.residuals import with_attachment
from femflex.reduction.modes.vibration import (
    ModeSet,
    cantilever_modes,
    free_free_modes,
    lumped,
    nodal,
    nodal_translations,
    rigid_set,
)
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import OrbitField, Preload
from femflex.reduction.reduce import chord_modes, reduce_segments, reduce_structure
from femflex.reduction.store import load_body, save_body
from femflex.reduction.strain.condense import condense
from femflex.reduction.strain.initial_stress import relaxed
from femflex.reduction.strain.tensors import strain_tensors

__all__ = [
    "BeamFunctions",
    "Damping",
    "EffectiveMass",
    "ModeSet",
    "OrbitField",
    "Preload",
    "Taper",
    "TaperedBeam",
    "UniformBeam",
    "beam_body",
    "cantilever_modes",
    "chord_modes",
    "condense",
    "craig_bampton",
    "critical_factor",
    "effective_mass",
    "free_free_modes",
    "hardening",
    "load_body",
    "lumped",
    "mac",
    "mac_of_bodies",
    "nodal",
    "nodal_translations",
    "reduce_segments",
    "reduce_structure",
    "relaxed",
    "rigid_set",
    "save_body",
    "static_equilibrium",
    "strain_tensors",
    "with_attachment",
    "with_derivatives",
    "with_responses",
    "with_third_derivatives",
]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
