"""The structure and shapes that a body was reduced from, by which its shapes and loads are assessed later."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.fem.structure import Structure
from femflex.fem.support import Support
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.modes.vibration import ModeSet


@dataclass(frozen=True, eq=False)
class Meshed:
    """A Structure and the set that reduces it.

    groups    marker -> mesh group
    supports  mesh group -> support, of the groups that the set clamps only in some components
    answered  mesh groups whose static shapes were requested in addition to the modes of the set
    deflection, third_derivatives  with which the set was made, if requested
    """

    structure: Structure
    modes: ModeSet
    groups: Mapping[str, str] = field(default_factory=dict)
    supports: Mapping[str, Support] = field(default_factory=dict)
    answered: tuple[str, ...] = ()
    deflection: float | None = None
    third_derivatives: int | None = None

    @property
    def places(self) -> dict[str, str]:
        """Marker -> mesh group; the groups of the set are markers with the names of these groups."""
        return {**{group: group for group in self.modes.groups}, **self.groups}


@dataclass(frozen=True, eq=False)
class Analytic:
    """A straight beam and its admissible functions. groups: marker -> "root" or "tip", for markers with other names."""

    beam: UniformBeam
    functions: BeamFunctions
    groups: Mapping[str, str] = field(default_factory=dict)

    @property
    def places(self) -> dict[str, str]:
        """Marker -> "root" or "tip"."""
        return {**self.groups, "root": "root", "tip": "tip"}


Fields = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Deployed:
    """A deploying member at its initial length, and a function that resolves it by polynomials.

    requested  (n, k) coordinates of its functions without added static shapes
    fields     displacements [m] and twist (k, m, n) of its n columns at k positions xi along the length; m = 4 (u, v, w
               and twist) for beams and tethers
    resolved   builds the member and its fields with many polynomials, by which its functions are judged
    """

    requested: Array
    fields: Fields
    resolved: Callable[[], tuple[FlexibleBody, Fields]]


@dataclass(frozen=True, eq=False)
class Origin:
    """The source of a body, and the remedies that messages suggest for it.

    source  None for a body from a file, whose mesh is not known
    bound   the reason why its strain can only be linear; empty if it can be another
    remedy  the remedy for linear strain under axial loads, as in "give it strain = 'condensed'"
    """

    source: Meshed | Analytic | Deployed | None = None
    bound: str = ""
    remedy: str = "give it strain = 'condensed'"
