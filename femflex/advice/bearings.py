"""What tells of the bodies of a case how they buckle."""

from __future__ import annotations

from collections.abc import Mapping

from femflex.advice.beam_bearing import BeamBearing
from femflex.advice.bearing import JudgedBearing
from femflex.advice.burden import Bearing
from femflex.advice.structure_bearing import StructureBearing
from femflex.case.body import AnalyticTable
from femflex.fem.structure import Structure
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.modes.modeset import ModeSet


def bearing_of_meshed(groups: Mapping[str, str], structure: Structure, modes: ModeSet) -> Bearing | None:
    """What tells how a meshed, clamped body buckles, at work when asked."""
    if not (modes.held.size and modes.n_modes):
        return None
    places = {**{group: group for group in modes.groups}, **groups}
    return JudgedBearing(StructureBearing(structure, modes, places))


def bearing_of_analytic(beam: UniformBeam, functions: BeamFunctions, table: AnalyticTable) -> Bearing | None:
    """The same of a beam on admissible functions."""
    if not (functions.y or functions.z):
        return None
    names = {name: entry.group or name for name, entry in table.markers.items()} | {"root": "root", "tip": "tip"}
    return JudgedBearing(BeamBearing(beam, functions, names))
