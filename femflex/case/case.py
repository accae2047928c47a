"""The whole case file as one typed table."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Union

from pydantic import Field, PrivateAttr, create_model, model_validator

from femflex.case.attitude import AttitudeTable
from femflex.case.body import Body
from femflex.case.campbell import CampbellTable, StabilityTable
from femflex.case.initial import StartTable
from femflex.case.run import PicturesTable, RunTable, StudyTable
from femflex.disturbances import Disturbance, JitterTable
from femflex.effectors.noun import EffectorNoun
from femflex.effectors.registry import nouns
from femflex.fem.sections.named import NamedMaterial, NamedSection
from femflex.measures.measure import ExpectationsTable
from femflex.noun.problems import CaseError, Problem
from femflex.noun.table import Name, Table, refuse
from femflex.summary import Rows, Summarised, listed
from femflex.system.constraint import Constraint
from femflex.system.environment import EARTH_J2, Environment
from femflex.system.ephemeris_orbit import followed_orbit
from femflex.system.joints import AnyJoint
from femflex.system.load import Load
from femflex.system.orbit import Orbit
from femflex.system.sight import Sight
from femflex.system.spring import Spring


class Case(Summarised, Table):
    """All inputs of a run in SI. SI numbers, or strings with a unit, in the file; see `femflex schema`."""

    title: str = ""
    """Title of the case, printed by every verb and stored in the result file."""
    source: str = ""
    """Origin of the numbers."""
    description: str = ""
    """Purpose of the case, in words."""
    run: RunTable
    """Duration, output rows and integrator."""
    orbit: Orbit = Orbit(kind="none")
    """Orbit of the craft. Default: none."""
    environment: Environment = Field(default_factory=Environment)
    """Gravity on the ground. Default: none."""
    attitude: AttitudeTable = AttitudeTable()
    """Initial attitude of the root body and its reference frame."""
    materials: dict[Name, NamedMaterial] = Field(default_factory=dict)
    """Materials by name."""
    sections: dict[Name, NamedSection] = Field(default_factory=dict)
    """Beam and plate sections by name."""
    bodies: Annotated[dict[Name, Body], Field(min_length=1)]
    """Bodies by name."""
    joints: list[AnyJoint] = Field(default_factory=list)
    """Joints of the tree: each carries one child body."""
    loops: list[AnyJoint] = Field(default_factory=list)
    """Joints that close loops; they become constraints on the tree of [[joints]]."""
    constraints: list[Constraint] = Field(default_factory=list)
    """Rolling and knife-edge constraints."""
    springs: list[Spring] = Field(default_factory=list)
    """Springs and dampers between two markers."""
    loads: list[Load] = Field(default_factory=list)
    """Forces and torques at markers."""
    sights: list[Sight] = Field(default_factory=list)
    """Lines of sight to a ground station."""
    initial: StartTable | None = None
    """Initial state of the whole craft, in place of that of joints, bodies and [attitude]."""
    pictures: PicturesTable | None = None
    """Pictures and movies that `run` makes."""
    study: StudyTable | None = None
    """Quantity and values of `femflex converge`."""
    campbell: CampbellTable | None = None
    """Speeds of the Campbell diagram."""
    stability: StabilityTable | None = None
    """Values over which stability is charted."""
    disturbances: dict[Name, Disturbance] = Field(default_factory=dict)
    """Disturbances of pointing by name, for `femflex jitter`; a run leaves them out."""
    jitter: JitterTable | None = None
    """Outputs and frequencies of `femflex jitter`."""
    expect: ExpectationsTable = Field(default_factory=lambda: ExpectationsTable.model_validate({}))
    """Expected answers of the case, by name."""

    _path: Path = PrivateAttr(default=Path("case.toml"))
    _text: str | None = PrivateAttr(default="")
    _raw: dict[str, Any] = PrivateAttr(default_factory=dict)
    _parts: dict[str, Any] = PrivateAttr(
        default_factory=dict
    )  # the tables as they were read; those of a copy may differ

    @property
    def effectors(self) -> dict[str, dict[str, EffectorNoun]]:
        """Heading -> name -> noun of every effector that a registered noun describes."""
        return {heading: getattr(self, heading) for heading in nouns() if hasattr(self, heading)}

    @model_validator(mode="after")
    def _orbit_keys_need_an_orbit(self) -> Case:
        if self.run.orbits is not None and self.orbit.kind == "none":
            refuse("run.orbits needs an orbit; give duration, or an [orbit]")
        surrounding = self.environment.model_fields_set & {"attraction", "oblateness", "third_bodies"}
        if surrounding and self.orbit.kind == "none":
            refuse(f"environment.{min(surrounding)} needs an orbit; give an [orbit], or leave it out")
        if self.orbit.secular_rates and not self.environment.oblateness[0]:
            refuse(
                "orbit.secular_rates are those of J2, and none is given; give environment.oblateness, such as "
                f"{EARTH_J2:g}"
            )
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """Its class is that of the effectors that are registered where it is unpickled."""
        return _restored_case, (self.__getstate__(),)

    def summary(self) -> tuple[str, Rows]:
        """Title, bodies with their kinds, joints, what acts, orbit, and duration."""
        bodies = [f"{name} ({getattr(body, 'kind', 'rigid')})" for name, body in self.bodies.items()]
        joints = [f"{joint.kind} of {joint.child}" for joint in self.joints]
        rows = [("file", str(self.path)), ("bodies", f"{len(bodies)}: {listed(bodies)}"), ("joints", listed(joints))]
        parts = {name: len(getattr(self, name)) for name in ("loops", "constraints", "springs", "loads")}
        rows += [(name, str(number)) for name, number in parts.items() if number]
        rows += [(heading.replace("_", " "), listed(list(named))) for heading, named in self.effectors.items() if named]
        rows.append(("orbit", self.orbit.kind))
        length = f"{self.run.orbits:g} orbits" if self.run.orbits is not None else f"{self.run.duration:g} s"
        return f"Case: {self.title or self.path.stem}", [*rows, ("run", f"{length}, {self.run.integrator}")]

    @property
    def path(self) -> Path:
        """Path of the case file; file names in it are relative to its folder."""
        return self._path

    @property
    def text(self) -> str:
        """The case file as it was read; after a change of values, the text that contains them."""
        if self._text is None:
            from femflex.case.changed import toml_text

            self._text = toml_text(self._raw)
        return self._text

    @property
    def tables(self) -> Mapping[str, Any]:
        """The tables of the case file as TOML gives them."""
        return self._raw

    @property
    def parts(self) -> Mapping[str, Any]:
        """The checked tables of the case file by name, as they were read."""
        return self._parts

    def orbit_with_rates(self) -> Orbit | None:
        """The orbit with its secular rates, or along its ephemeris, where it has these; None without an orbit.

        Raises CaseError for an ephemeris that does not cover the run.
        """
        orbit = self.orbit
        if orbit.kind == "none":
            return None
        if orbit.ephemeris is not None and not orbit.free:
            assert self.environment.epoch is not None  # set by the reader of the case
            path, duration = self.file_path(orbit.ephemeris), self.run.length(orbit.period)
            try:
                return followed_orbit(orbit, path, self.environment.epoch, duration)
            except ValueError as error:
                raise CaseError(self.path.name, [Problem("orbit.ephemeris", str(error))]) from None
        return orbit.with_secular_rates(self.environment.oblateness[0], orbit.radius) if orbit.secular_rates else orbit

    def environment_with_radius(self) -> Environment:
        """The environment, with the radius of the orbit if it has none of its own."""
        environment, orbit = self.environment, self.orbit
        has_radius = "radius" in environment.model_fields_set
        return environment if has_radius else environment.model_copy(update={"radius": orbit.radius})

    def file_path(self, name: str) -> Path:
        """The path of a file named in the case."""
        return self._path.parent / name


def _restored_case(state: dict[Any, Any]) -> Case:
    case = case_class().__new__(case_class())
    case.__setstate__(state)
    return case


def case_class() -> type[Case]:
    """The class of cases that have tables of all effectors that are registered now."""
    return _case_class(tuple(nouns().items()))


@cache
def _case_class(kinds: tuple[tuple[str, tuple[type[EffectorNoun], ...]], ...]) -> type[Case]:
    fields: dict[str, Any] = {
        heading: (dict[Name, table_of(nouns)], Field(default_factory=dict, description=_heading_text(nouns)))  # type: ignore[misc]
        for heading, nouns in kinds
    }
    return create_model("Case", __base__=Case, **fields)


def table_of(kinds: tuple[type[EffectorNoun], ...]) -> Any:
    """The type of the tables of nouns that have one heading, told apart by their `kind` where there are several."""
    return kinds[0] if len(kinds) == 1 else Annotated[Union[kinds], Field(discriminator="kind")]  # noqa: UP007


def _heading_text(kinds: tuple[type[EffectorNoun], ...]) -> str:
    """The description of the tables of one heading: the first sentence of a single noun."""
    if len(kinds) > 1:
        return f"A {kinds[0].label} of one of {len(kinds)} kinds; by name."
    return " ".join((kinds[0].__doc__ or "").split()).partition(". ")[0].rstrip(".") + "; by name."
