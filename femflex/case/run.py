"""[run], [pictures] and [study]: duration and accuracy, pictures, and the quantity of convergence studies."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.measures.measure import OF_CAMPBELL, MeasureTable
from femflex.noun.table import Table, exactly_one, refuse
from femflex.noun.values import Count, Direction, Duration, Quantity, Time, ValueProblem, Whole, _Readable

if TYPE_CHECKING:
    from femflex.arrays import Array


class RunTable(Table):
    """Duration, output and integrator of a run."""

    duration: Duration | None = None
    """Length of the run."""
    orbits: Annotated[float | None, Quantity("", above=0.0)] = None
    """Length of the run in orbital periods, in place of duration."""
    output_step: Duration | None = None
    """Time between rows of the result file."""
    samples: Annotated[int | None, Count(2)] = None
    """Number of rows, first and last included, in place of output_step. Default of both: 1001."""
    reactions: StrictBool = False
    """Report the force and torque that every joint transmits."""
    momenta: StrictBool = False
    """Report canonical momenta and the Hamiltonian."""
    rtol: Annotated[float, Quantity("", above=0.0, most=0.1)] | None = None
    """Relative error tolerance of a step. Default: 1e-11 (dop853) or 1e-9 (esdirk4)."""
    atol: Annotated[float, Quantity("", above=0.0)] | None = None
    """Absolute error tolerance. Default: a tenth of rtol times the size of each kind of coordinate: 1, of joint rates a
    typical rate, and less where the energy of the motion does not allow a hundredth of that."""
    integrator: Literal["auto", "dop853", "esdirk4"] = "auto"
    """Integrator: auto; dop853, explicit, order 8; esdirk4, implicit, order 4, which damps high modes."""
    band: Annotated[float, Quantity("Hz", above=0.0)] | None = None
    """Highest frequency of interest, for the automatic choices. Default: the highest that the output rows can show."""
    max_step: Duration | None = None
    """Largest step of the integrator. Default: no limit."""
    step: Duration | None = None
    """Constant step of esdirk4, in place of error control."""

    @model_validator(mode="after")
    def _keys_are_unique(self) -> RunTable:
        exactly_one(self, ("duration", "orbits"))
        exactly_one(self, ("output_step", "samples"), required=False)
        if self.step is not None and self.integrator != "esdirk4":
            refuse(
                f"found step with integrator = {self.integrator!r}; it is a setting of esdirk4 alone, so select this "
                "integrator, or leave it out"
            )
        if self.duration is not None and self.output_step is not None and self.output_step > self.duration:
            refuse(
                f"found an output step of {self.output_step:g} s, longer than the duration of {self.duration:g} s; "
                f"give a shorter step"
            )
        return self

    def length(self, period: float | None) -> float:
        """Duration [s], for an orbit of that period [s] if there is one."""
        if self.duration is not None:
            return self.duration
        assert self.orbits is not None and period is not None
        return self.orbits * period

    def rows(self, duration: float) -> int:
        """Number of output rows of a run of that duration [s], the first at t = 0 and the last at its end."""
        if self.output_step is None:
            return self.samples or 1001
        return math.ceil(duration / self.output_step * (1 - 1e-9)) + 1

    def times(self, duration: float) -> Array:
        """Output times (n_t,) [s] of a run of that duration [s]."""
        import numpy as np

        n = self.rows(duration)
        if self.output_step is None:
            return np.linspace(0.0, duration, n)
        return np.append(np.arange(n - 1) * self.output_step, duration)


Pixels = Annotated[int, Count(64)]


class _Scale(_Readable):
    """A factor, or "auto"."""

    factor = Quantity("", above=0.0)

    def read_value(self, value: Any) -> float | str:
        """The factor, or "auto"."""
        if isinstance(value, str) and value != "auto":
            raise ValueProblem(f"found {value!r}; expected a factor such as 10, or 'auto'")
        return value if value == "auto" else self.factor.read_value(value)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both."""
        return {"anyOf": [self.factor.json_schema(), {"const": "auto"}]}


class PicturesTable(Table):
    """Pictures that `run` writes next to the result file, drawn off screen. Looks are those of `femflex render`."""

    times: Annotated[tuple[float, ...], Quantity("s", (None,), least=0.0)] = ()
    """Times at which the deformed craft is drawn."""
    picture: StrictBool = False
    """Draw the craft at its largest elastic displacement."""
    movie: StrictBool = False
    """Make a movie of the run."""
    start: Time | None = None
    """First time of the movie. Default: the start of the run."""
    end: Time | None = None
    """Last time of the movie. Default: when nothing moves visibly any more, or the end of the run."""
    speed: Annotated[float | None, Quantity("", above=0.0)] = None
    """Seconds of the run per second of the movie. Default: 1 for short runs, else so that the movie takes 12 s."""
    fps: Annotated[float, Quantity("", above=0.0, most=240.0)] = 25.0
    """Frames of the movie per second."""
    modes: list[str] = Field(default_factory=list)
    """Bodies whose modes are drawn as a montage."""
    plots: list[str] = Field(default_factory=list)
    """Channels drawn over time, such as "attitude/angles"; "A over B" is one divided by another."""
    spectra: list[str] = Field(default_factory=list)
    """Channels whose amplitude spectra are drawn."""
    spectrograms: list[str] = Field(default_factory=list)
    """Channels whose spectrograms are drawn: amplitude over time and frequency."""
    highest: Annotated[float | None, Quantity("Hz", above=0.0)] = None
    """Highest frequency of spectra and spectrograms [Hz]. Default: a little above the last peak."""
    without: list[str] = Field(default_factory=list)
    """Terms that a second run omits, as in `run --without`, such as "nonlinear_strain". Its curves are dashed in the
    same plots; its result file has "_without" in its name."""
    linearised: StrictBool = False
    """Solve the linear equations too, as `run --linearised`. Its curves are dashed in the same plots; its result file
    has "_linearised" in its name."""
    traces: list[str] = Field(default_factory=list)
    """Markers ("body.marker") and contact points ("constraints/NAME") whose paths are drawn."""
    scale: Annotated[float | str, _Scale()] = "auto"
    """Factor on deformations: 1 is true, "auto" magnifies small ones until they are visible; the picture states it."""
    colour: str = "displacement"
    """Quantity that colours bodies: displacement, energy, strain:NAME such as strain:axial, stress:NAME such as
    stress:von_mises, peak:NAME, the largest stress over the run, or light, the sunlight that surfaces receive."""
    theme: Literal["light", "dark"] = "light"
    """Colours of background and text."""
    camera: str = "auto"
    """Camera: auto, fixed, follow, orbital, body or body:NAME."""
    view: Direction | None = None
    """Direction from the scene to the camera, in the camera's frame. Default: chosen automatically."""
    fit: Literal["run", "picture"] = "picture"
    """Extent that the camera frames in pictures: the whole run, or the instant of each. Movies frame the whole run."""
    triads: StrictBool = True
    """Draw the axes of frames."""
    names: StrictBool = True
    """Write the names of the bodies, where there are two to eight."""
    edges: Literal["auto", "sharp", "mesh", "none"] = "auto"
    """Edges drawn: sharp ones, all mesh edges, or none. auto: sharp ones, and faint mesh lines where they are apart."""
    size: tuple[Pixels, Pixels] = (1280, 720)
    """Width and height of pictures in pixels."""

    @model_validator(mode="after")
    def _one_comparison_run(self) -> PicturesTable:
        if self.without and self.linearised:
            refuse("found without and linearised; the plots hold one second run, so give one of them")
        if self.start is not None and self.end is not None and not self.start < self.end:
            refuse(
                f"found a movie from start = {self.start:g} s to end = {self.end:g} s; the end comes after the start"
            )
        return self


class StudyTable(Table):
    """Quantity and range of a convergence study by `femflex converge`."""

    quantity: MeasureTable
    """Quantity whose convergence is assessed."""
    modes: Annotated[list[Whole] | None, Field(min_length=3)] = None
    """Numbers of modes that are tried. Default: chosen from the case."""
    refinements: Annotated[list[Annotated[int, Count(0)]] | None, Field(min_length=2)] = None
    """Mesh refinements that are tried. Default: 0 to 4, as long as the mesh stays small."""
    segments: Annotated[list[Whole] | None, Field(min_length=3)] = None
    """Numbers of segments that are tried. Default: from a quarter of the case's own number to four times it."""
    body: str | None = None
    """Body whose modes, mesh or segments are varied. Default: all flexible bodies."""
    tolerance: Annotated[float, Quantity("", above=0.0)] = 1e-3
    """Relative change below which the quantity counts as converged."""

    @model_validator(mode="after")
    def _quantity_is_no_diagram(self) -> StudyTable:
        if self.quantity.of == OF_CAMPBELL:
            refuse(f"found quantity of = {OF_CAMPBELL!r}; a study looks at a run or a body, such as mode_frequency")
        return self
