"""[bodies.<name>] of kind "deploying": beams, tethers and blankets that are drawn out of a drum."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.case.body_base import BodyTable
from femflex.case.shape import MarkerTable
from femflex.deployment import DeployingLine, DeployingStrip, Reel
from femflex.deployment.tapered import Taper
from femflex.noun.table import Name, Orientation, Table, exactly_one, refuse
from femflex.noun.values import MOST_FUNCTIONS, Count, Mass, PositiveLength, Quantity
from femflex.reduction.modes.damping import Ratio
from femflex.system.motion import Motion, MotionOf

LINES, SHEETS = ("beam", "tether"), ("plate", "membrane")


class DeployingMarkerTable(MarkerTable):
    """A section of a deploying member that keeps its place relative to the length."""

    fraction: Annotated[float | None, Quantity()] = None
    """Distance of the section from the exit, as a fraction of the deployed length: 0 at the exit, 1 at the tip."""
    orientation: Orientation | None = None
    """Axes of the marker in the body, written as for other markers. Default: those of the member, x from exit to
    tip."""


class DeployingFunctionsTable(Table):
    """Admissible functions of a deploying member, over the distance from the exit relative to the length."""

    y: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for bending along the section's y axis. Only for beams and tethers."""
    z: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions along the member for bending along the section's z axis; of plates and membranes out of their
    plane."""
    axial: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for stretch. Only for beams and tethers."""
    torsion: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for the twist angle. Only for beams."""
    across: Annotated[int, Count(1, MOST_FUNCTIONS)] = 1
    """Number of functions across the width, Legendre polynomials: 1, 2 with twist. Only for plates and membranes."""
    family: Literal["characteristic", "polynomial", "elements"] | None = None
    """Functions: "characteristic", the vibration modes of a uniform member; "polynomial"; "elements", the vibration
    modes of finite elements over the scaled length, with the member's own taper and tension. Default: characteristic
    of beams and plates, polynomial of tethers and membranes."""
    elements: Annotated[int | None, Count(1)] = None
    """Number of finite elements of equal length, for family = "elements". Default: twice the largest number of modes,
    at least 8."""
    static: StrictBool = False
    """The last functions are the static shapes of an accelerated root. Only for beams."""
    tip: StrictBool = False
    """The last functions are the static shapes of a force and a moment at the tip. Only for beams."""
    joints: list[Literal["root", "tip"]] | None = None
    """Static shapes of an accelerated root and of a tip force and moment in addition to the functions: two more along y
    and z for each, one of axial displacement and one of torsion. Only for characteristic functions of beams. Left out:
    those that change one of the craft's first three elastic frequencies, one that the run excites, or one below `band`,
    by 0.05 % at the first or the last length of the run, unless `static` or `tip` is given."""
    loads: StrictBool | None = None
    """Static shapes of a force and a moment at the tip in addition to the functions, as those of `joints`: for loads at
    the tip. Only for characteristic functions of beams. Left out: where the functions answer such a load by less
    than 99 % of its static work, as one function answers a force (97 %), and many a moment or a torque."""
    straight: StrictBool = True
    """The straight rotation about the exit is one of the functions. Set it false where a joint rotates the member. Only
    for tethers and membranes whose tip is free."""


class DeployingTable(DeployingLine, DeployingStrip, BodyTable):
    """A straight uniform member that grows out of its parent along a given length, with markers root and tip."""

    kind: Literal["deploying"]
    """Selects this body: a member whose length is a function of time."""
    family: Literal["beam", "tether", "plate", "membrane"]
    """Kind of the member: beam; tether (no bending stiffness); plate or membrane (rectangular, rolled out along one
    axis)."""
    length: Annotated[Motion | None, MotionOf("m")] = None
    """Deployed length: a value, or a profile over time such as { kind = "smooth_step", from = "5 m", to = "33 m", start
    = 0, end = "500 s" }. It must stay above zero and below `stock`. Default: it is free, and `reel` acts on it."""
    reel: Reel | None = None
    """Drum that acts on a free length. Its tension and the state of its length are reported as effector
    <body>_reel."""
    stock: PositiveLength | None = None
    """Length of the whole member, deployed and stowed; its mass is constant. Default: the largest length of the
    run."""
    drum: Literal["root", "tip"] = "root"
    """Where the stowed part is: at the root (the member is pushed or drawn out of its parent), or at the tip (it is
    left behind)."""
    drum_radius: PositiveLength | None = None
    """Radius on which the member is wound, for the torque of the drum. Default: no torque is reported."""
    mass: Mass | None = None
    """Mass of the whole stock, in place of mass_per_length."""
    tip: Literal["free", "held"] = "free"
    """Support of the tip of a tether or membrane: free, or held on the member's line."""
    taper: Taper | None = None
    """Section and density that vary along the material. Only for beams and tethers with a given length. Default:
    uniform."""
    functions: DeployingFunctionsTable | None = None
    """Number and kind of admissible functions. Default: the member stays straight."""
    strain: Literal["condensed", "linear"] = "condensed"
    """Strain energy. condensed: bending shortens the member, so that axial forces and inertia change its bending
    stiffness to second order. linear: they do not; femflex warns where this matters."""
    damping: Annotated[float | tuple[float, ...], Ratio()] = 0.0
    """Fraction of critical damping of the coordinates at every length: one number, or one for each."""
    rest: Literal["place", "material", "coordinates"] = "place"
    """What is at rest at t = 0 in a bent member that moves out: the deflection at a fixed place; that of a material
    point; or the coordinates, so that the shape grows with the length."""
    markers: dict[Name, DeployingMarkerTable] = Field(default_factory=dict)  # type: ignore[assignment]
    """Markers by name, in addition to root and tip."""

    def built_in_markers(self) -> tuple[str, ...]:
        """The member's two ends."""
        return ("origin", "root", "tip")

    @model_validator(mode="after")
    def _keys_fit(self) -> DeployingTable:
        exactly_one(self, ("mass_per_length", "mass"))
        if self.length is not None and self.length.profile is None:
            refuse("found length = 'locked'; give a value or a profile over time")
        if (self.length is None) == (self.reel is None):
            refuse(
                "found neither length nor reel, or both; give length as a function of time, or reel where the length "
                "is a degree of freedom"
            )
        if self.reel is not None and (self.stock is None or self.reel.length > self.stock):
            refuse(
                "found a reel without stock, or with a stock below the initial length; give stock, the total length of "
                "the member, stowed and deployed"
            )
        if self.mass is not None and self.stock is None:
            refuse(
                "found mass without stock; mass is that of the whole member, so give stock, its total length, stowed "
                "and deployed"
            )
        if self.mass is not None and self.stock is not None:
            vars(self)["mass_per_length"] = self.mass / self.stock
        is_sheet = self.family in SHEETS
        if is_sheet and self.width is None:
            refuse(f"found a {self.family} without width; give width")
        if self.family == "beam" and not (self.EIy or self.EIz) and self.functions is not None:
            refuse("found a beam without bending stiffness; give EIy and EIz, or take family = 'tether'")
        if self.family == "plate" and not self.bending_stiffness:
            refuse("found a plate without bending_stiffness; give it, or take family = 'membrane'")
        if self.family == "membrane" and not self.tension:
            refuse("found a membrane without tension; it has no stiffness then: give tension")
        f = self.functions
        if f is not None and (
            unused := [key for key in UNUSED[self.family] if getattr(f, key) != type(f).model_fields[key].default]
        ):
            refuse(f"found functions.{unused[0]}, which a {self.family} does not use; leave it out")
        if f is not None and f.elements is not None and f.family != "elements":
            refuse('found functions.elements without family = "elements"; give both, or leave elements out')
        if f is not None and f.family == "elements" and (f.static or f.tip or not f.straight):
            refuse("found functions.static, tip or straight with finite elements, which do not have them; leave it out")
        if f is not None and (f.joints or f.loads) and (f.family or "characteristic") != "characteristic":
            refuse(
                f"found functions.{'joints' if f.joints else 'loads'} with family = {f.family!r}; these static shapes "
                "go with characteristic functions: leave one of them out"
            )
        if self.taper is not None and (is_sheet or self.reel is not None):
            description = f"a {self.family}" if is_sheet else "a free length"
            refuse(f"found taper with {description}; it is for beams and tethers with a given length")
        for key, stiffness in (("axial", "EA"), ("torsion", "GJ")):
            if f is not None and getattr(f, key) and not getattr(self, stiffness):
                refuse(f"found {key} functions without {stiffness}; give {stiffness}")
        for name, marker in self.markers.items():
            if marker.position is not None or marker.group is not None:
                refuse(f"found position or group in marker {name!r} of a deploying member; give fraction")
            if marker.fraction is None and name not in ("root", "tip"):
                refuse(
                    f"found marker {name!r} of a deploying member without fraction; give it, from 0 (exit) to 1 (tip)"
                )
            if marker.fraction is not None and not 0.0 <= marker.fraction <= 1.0:
                refuse(
                    f"found fraction {marker.fraction:g} of marker {name!r}, a point that is still stowed or beyond "
                    "the tip; give a number from 0 (exit) to 1 (tip)"
                )
        return self


UNUSED = {
    "beam": ("across", "straight"),
    "tether": ("torsion", "across", "static", "tip", "joints", "loads"),
    "plate": ("y", "axial", "torsion", "static", "tip", "joints", "loads", "straight"),
    "membrane": ("y", "axial", "torsion", "static", "tip", "joints", "loads"),
}
