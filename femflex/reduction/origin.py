"""What a body was reduced from, so that its shapes and its loads can be assessed after the reduction."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.fem.structure import Structure
from femflex.fem.support import Support
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.modes.modeset import ModeSet


@dataclass(frozen=True, eq=False)
class Meshed:
    """A Structure and the set that reduces it.

    groups    marker -> mesh group
    supports  mesh group -> support, of the groups that the set clamps in some components alone
    answered  mesh groups whose static shapes were requested in addition to the set's modes
    deflection, third_derivatives  for which the set was made, where given
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
        """Marker -> mesh group; the groups of the set are markers under their own names."""
        return {**{group: group for group in self.modes.groups}, **self.groups}


@dataclass(frozen=True, eq=False)
class Analytic:
    """A straight beam and its admissible functions. groups: marker -> "root" or "tip", where it has another name."""

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
    """A member that deploys, at the length that it has at the start of a case, and how it is made of more functions.

    functions  its admissible functions
    fields     displacements [m] and twist (k, m, n) of its n columns at k places xi of the length; m = 4, u, v, w and
               twist, of beams and tethers
    richer     makes its body and its fields in a richer set
    """

    functions: object
    fields: Fields
    richer: Callable[[], tuple[FlexibleBody, Fields]]


@dataclass(frozen=True)
class LeftOpen:
    """What is left to advice when a body is made.

    strain     its form of strain
    joints     static shapes of joints, and of these: at_roots, elsewhere
    roots      mesh groups, or the end, where it is clamped
    """

    strain: bool = False
    joints: bool = False
    at_roots: bool = False
    elsewhere: bool = False
    roots: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Origin:
    """What a body was reduced from, what is left open of it, and how its maker would change it.

    source  None of a body from a file, whose mesh is not known
    bound   why it stays linear whatever bends it; empty where it need not
    remedy  what to do for a strain that knows what pulls along it, as in "give it strain = 'condensed'"
    """

    source: Meshed | Analytic | Deployed | None = None
    open: LeftOpen = LeftOpen()
    bound: str = ""
    remedy: str = "give it strain = 'condensed'"
