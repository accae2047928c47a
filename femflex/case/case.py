"""The whole case file as one typed table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, model_validator

from femflex.case.base import Name, Table, refuse
from femflex.case.body import Body
from femflex.case.campbell import CampbellTable
from femflex.case.constraint import Constraint, SpringTable
from femflex.case.environment import EnvironmentTable
from femflex.case.initial import StartTable
from femflex.case.joint import Joint
from femflex.case.load import LoadTable
from femflex.case.measure import ExpectationsTable
from femflex.case.orbit import AttitudeTable, OrbitTable
from femflex.case.run import PicturesTable, RunTable, StudyTable
from femflex.case.section import Material, Section
from femflex.case.sight import SightTable


class Case(Table):
    """All inputs of a run in SI. SI numbers, or strings with a unit, in the file; see `femflex schema`."""

    title: str = ""
    source: str = ""
    """Where the numbers come from."""
    description: str = ""
    run: RunTable
    orbit: OrbitTable = OrbitTable(kind="none")
    environment: EnvironmentTable = EnvironmentTable()
    attitude: AttitudeTable = AttitudeTable()
    materials: dict[Name, Material] = Field(default_factory=dict)
    sections: dict[Name, Section] = Field(default_factory=dict)
    bodies: Annotated[dict[Name, Body], Field(min_length=1)]
    joints: list[Joint] = Field(default_factory=list)
    loops: list[Joint] = Field(default_factory=list)
    """Joints that close loops: cut out of the tree of [[joints]] and held by constraints."""
    constraints: list[Constraint] = Field(default_factory=list)
    springs: list[SpringTable] = Field(default_factory=list)
    loads: list[LoadTable] = Field(default_factory=list)
    sights: list[SightTable] = Field(default_factory=list)
    initial: StartTable | None = None
    pictures: PicturesTable | None = None
    study: StudyTable | None = None
    campbell: CampbellTable | None = None
    expect: ExpectationsTable = Field(default_factory=lambda: ExpectationsTable.model_validate({}))

    _path: Path = PrivateAttr(default=Path("case.toml"))
    _text: str = PrivateAttr(default="")

    @model_validator(mode="after")
    def _orbits_need_an_orbit(self) -> Case:
        if self.run.orbits is not None and self.orbit.kind == "none":
            refuse("run.orbits needs an orbit; give duration, or an [orbit]")
        return self

    @property
    def path(self) -> Path:
        """Where the case was read from; file names in it are relative to its folder."""
        return self._path

    @property
    def text(self) -> str:
        """The case file as it was read."""
        return self._text

    def with_values(self, values: Mapping[str, Any]) -> Case:
        """A checked copy with other values: `case.with_values({"bodies.hub.mass": 410.0})`. See `case.read`."""
        from femflex.case.read import with_values

        return with_values(self, values)

    def beside(self, name: str) -> Path:
        """The path of a file named in the case."""
        return self._path.parent / name
