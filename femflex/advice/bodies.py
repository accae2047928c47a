"""What the origin of a body tells beyond its arrays: how it buckles, softens, hardens, and what its set leaves out."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from femflex.advice.buckling.applied_load import BucklingModel
from femflex.advice.buckling.beam import BeamBuckling
from femflex.advice.buckling.buckling_analysis import BucklingAnalysis
from femflex.advice.buckling.structure import StructureBuckling
from femflex.advice.enriched_bodies import BeamEnrichment, DeployedEnrichment, EnrichedBody, MeshedEnrichment
from femflex.body import FlexibleBody
from femflex.fem.deflected import tension_blocks
from femflex.reduction.large_deflection.curvature import hardening, least_stiffness_ratio, mesh_rise
from femflex.reduction.origin import Analytic, Deployed, LeftOpen, Meshed, Origin
from femflex.reduction.preload.equilibrium import is_preloaded
from femflex.reduction.reduce import MOST_COORDINATES


@dataclass(frozen=True, eq=False)
class KnownBody:
    """A body of which it is known what it was reduced from; each question is answered when it is first asked."""

    origin: Origin

    @cached_property
    def buckling_model(self) -> BucklingModel | None:
        """Its linear buckling analysis; None where nothing is clamped, or where it is a tether or membrane."""
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

    def softening(self, most: float) -> tuple[float, float] | None:
        """How soft a low shape becomes as the body bends one way, over its stiffness at rest, and the body's rise [m].

        The first is 1 where it rises by more than `most` [m]. None where that is not known.
        """
        source = self.origin.source
        if not isinstance(source, Meshed) or not (source.modes.held.size and source.modes.n_modes):
            return None
        high = mesh_rise(source.structure)
        return (least_stiffness_ratio(source.structure, source.modes) if 0.0 < high <= most else 1.0), high

    @cached_property
    def hardening(self) -> float:
        """What stretch adds to the force on the lowest shape bent by 1 m, over its linear one [1/m^2]; 0 if unknown."""
        source = self.origin.source
        if not isinstance(source, Meshed) or not 0 < source.modes.n_modes <= MOST_COORDINATES:
            return 0.0
        return hardening(source.structure, source.modes)

    @property
    def is_preloaded(self) -> bool:
        """Whether its shapes are those about an equilibrium under loads, which small motions about rest lack."""
        source = self.origin.source
        return isinstance(source, Meshed) and is_preloaded(source.structure, source.modes.held)

    def enriched(self, body: FlexibleBody, markers: Collection[str]) -> EnrichedBody | None:
        """The body in a richer set, with joints at the markers of these names; None where that cannot be made."""
        source = self.origin.source
        if isinstance(source, Analytic):
            return BeamEnrichment(source.beam, source.functions)(body, markers)
        if isinstance(source, Deployed):
            return DeployedEnrichment(source)(body, markers)
        if (
            not isinstance(source, Meshed)
            or "nodal" in source.modes.kinds
            or not 0 < source.modes.n_modes <= MOST_COORDINATES
        ):
            return None
        if self.is_preloaded:
            return None
        return MeshedEnrichment(source.structure, source.modes, source.places)(body, markers)


class KnownBodies(Mapping[str, KnownBody]):
    """The bodies of a system whose origins are known; those of one origin are one."""

    def __init__(self, origins: Mapping[str, Origin]) -> None:
        made: dict[int, KnownBody] = {}
        self._bodies = {name: made.setdefault(id(origin), KnownBody(origin)) for name, origin in origins.items()}

    def __getitem__(self, name: str) -> KnownBody:
        return self._bodies[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._bodies)

    def __len__(self) -> int:
        return len(self._bodies)

    def open(self, name: str) -> LeftOpen:
        """What is left open of a body; nothing of one whose origin is not known."""
        return self._bodies[name].origin.open if name in self._bodies else LeftOpen()

    def remedy(self, name: str) -> str:
        """What to do for a strain that knows what pulls along a body."""
        return (self._bodies[name].origin if name in self._bodies else Origin()).remedy
