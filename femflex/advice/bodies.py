"""Properties of bodies that follow from their origins: buckling, softening, hardening and truncation."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.body import FlexibleBody
from femflex.fem.deflected import tension_blocks
from femflex.reduction.large_deflection.foreshortening import hardening, least_stiffness_ratio, mesh_rise
from femflex.reduction.origin import Analytic, Meshed, Origin, ResolvedBody, resolved_body
from femflex.reduction.preload.equilibrium import is_preloaded
from femflex.reduction.reduce import MOST_COORDINATES
from femflex.reduction.static_buckling.buckling_analysis import BucklingAnalysis
from femflex.reduction.static_buckling.elastic_structures import BeamBuckling, StructureBuckling


@dataclass(frozen=True, eq=False)
class BodyOrigin:
    """The origin of a body, and the properties that follow from it, computed on first use."""

    origin: Origin

    @cached_property
    def buckling_model(self) -> BucklingAnalysis | None:
        """Its linear buckling analysis; None for an unclamped body, a tether or a membrane."""
        source = self.origin.source
        if isinstance(source, Meshed) and tension_blocks(source.structure):
            return None
        if isinstance(source, Meshed):
            clamped = source.modes.held.size and source.modes.n_modes
            return (
                BucklingAnalysis(StructureBuckling(source.structure, source.modes, source.places)) if clamped else None
            )
        if isinstance(source, Analytic) and (source.functions.y or source.functions.z):
            return BucklingAnalysis(BeamBuckling(source.beam, source.functions, source.places))
        return None

    def softening(self, max_rise: float) -> tuple[float, float] | None:
        """Least tangent stiffness of a low shape under deflection, over that at rest, and the body's rise [m].

        The ratio is 1 where the rise is more than `max_rise` [m]. None where it is not known.
        """
        source = self.origin.source
        if not isinstance(source, Meshed) or not (source.modes.held.size and source.modes.n_modes):
            return None
        rise = mesh_rise(source.structure)
        return (least_stiffness_ratio(source.structure, source.modes) if 0.0 < rise <= max_rise else 1.0), rise

    @cached_property
    def hardening(self) -> float:
        """Force of stretching on the lowest shape deflected by 1 m, over the linear force [1/m^2]; 0 if unknown."""
        source = self.origin.source
        if not isinstance(source, Meshed) or not 0 < source.modes.n_modes <= MOST_COORDINATES:
            return 0.0
        return hardening(source.structure, source.modes)

    @property
    def root(self) -> str:
        """The place of the root: the first clamped group, or the end of a beam; empty without a clamp."""
        source = self.origin.source
        if isinstance(source, Meshed):
            return source.modes.groups[0] if source.modes.held.size else ""
        return "root"

    def place_of_marker(self, body: FlexibleBody, marker: str) -> str:
        """The mesh group, or the end, of a marker of the body; empty where static shapes have no such place."""
        source = self.origin.source
        if isinstance(source, Meshed):
            return source.places.get(marker, "")
        ends = [end for end in ("root", "tip") if end in body.markers]
        positions = {end: body.markers[end].position for end in ends}
        at = body.marker(marker).position
        return next((end for end in ends if np.array_equal(positions[end], at)), "")

    @property
    def is_preloaded(self) -> bool:
        """Whether its shapes are computed about an equilibrium under loads."""
        source = self.origin.source
        return isinstance(source, Meshed) and is_preloaded(source.structure, source.modes.held)

    @property
    def is_resolved(self) -> bool:
        """Whether its set of shapes can be judged: not one of a file, of all nodes, or computed about a preload."""
        source = self.origin.source
        if not isinstance(source, Meshed):
            return source is not None
        counted = 0 < source.modes.n_modes <= MOST_COORDINATES
        return counted and "nodal" not in source.modes.kinds and not self.is_preloaded

    def resolved(self, body: FlexibleBody, markers: Collection[str]) -> ResolvedBody | None:
        """The body resolved beyond its shapes, with joints at the markers of these names; None where it cannot be."""
        return resolved_body(self.origin.source, body, sorted(markers)) if self.is_resolved else None


class BodyOrigins(Mapping[str, BodyOrigin]):
    """Origins of the bodies of a system by name; bodies of the same origin share one entry."""

    def __init__(self, origins: Mapping[str, Origin]) -> None:
        by_id: dict[int, BodyOrigin] = {}
        self._bodies = {name: by_id.setdefault(id(origin), BodyOrigin(origin)) for name, origin in origins.items()}

    def __getitem__(self, name: str) -> BodyOrigin:
        return self._bodies[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._bodies)

    def __len__(self) -> int:
        return len(self._bodies)

    def remedy(self, name: str) -> str:
        """Text on how to give a body a strain form with stiffening by axial forces."""
        return (self._bodies[name].origin if name in self._bodies else Origin()).remedy
