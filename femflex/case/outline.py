"""What can be known of a case file that has mistakes: the valid parts, and the names of the others.

Checks across the file (names, tree, files) work on this outline, so that they report together with mistakes inside
single tables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from femflex.case.body import Body, BodyTable
from femflex.case.campbell import CampbellTable
from femflex.case.case import Case
from femflex.case.constraint import BetweenTable, Constraint, SpringTable
from femflex.case.environment import EnvironmentTable
from femflex.case.initial import StartTable
from femflex.case.joint import Joint
from femflex.case.joint_base import JointTable
from femflex.case.load import LoadTable
from femflex.case.measure import ExpectationsTable
from femflex.case.orbit import AttitudeTable, OrbitTable
from femflex.case.problems import item_label
from femflex.case.run import PicturesTable, RunTable, StudyTable
from femflex.case.sensor import SensorTable
from femflex.case.sight import SightTable
from femflex.case.thruster import TankTable, ThrusterTable
from femflex.case.wheel import CableTable, GyroTable, MountedTable, SeparationTable, WheelTable

T = TypeVar("T")

MOUNTED = {
    "wheels": WheelTable,
    "gyros": GyroTable,
    "thrusters": ThrusterTable,
    "tanks": TankTable,
    "separations": SeparationTable,
    "cables": CableTable,
    "sensors": SensorTable,
}


ADAPTERS: dict[int, tuple[Any, TypeAdapter[Any]]] = {}  # by the identity of the type, which stays alive here


@dataclass(frozen=True)
class Outline:
    """The parts of a case file; None stands for a part that is missing or has mistakes of its own.

    bodies  by name; joints, loads, loops, constraints, springs and sights by their label in key paths, such as
            "joints[panel]"
    mounted wheels, gyros, thrusters, tanks, separation springs, cables and sensors by their label, as "wheels.w1"
    names   of the entries of materials and sections, valid or not
    """

    run: RunTable | None
    orbit: OrbitTable | None
    environment: EnvironmentTable | None
    attitude: AttitudeTable | None
    bodies: Mapping[str, BodyTable | None]
    joints: Mapping[str, JointTable | None]
    loads: Mapping[str, LoadTable | None]
    loops: Mapping[str, JointTable | None]
    between: Mapping[str, BetweenTable | None]
    sights: Mapping[str, SightTable | None]
    mounted: Mapping[str, MountedTable | SensorTable | None]
    pictures: PicturesTable | None
    study: StudyTable | None
    campbell: CampbellTable | None
    expect: ExpectationsTable | None
    initial: StartTable | None
    names: Mapping[str, frozenset[str]]
    whole: bool


def outline_of(case: Case, raw: Mapping[str, Any]) -> Outline:
    """The outline of a valid case; raw: its tables as TOML gives them, by which its parts are labelled."""
    parts = {label: part for key in MOUNTED for label, part in _labelled(key, getattr(case, key)).items()}
    return Outline(
        run=case.run,
        orbit=case.orbit,
        environment=case.environment,
        attitude=case.attitude,
        bodies=dict(case.bodies),
        joints=_numbered(raw, "joints", case.joints),
        loads=_numbered(raw, "loads", case.loads),
        loops=_numbered(raw, "loops", case.loops),
        between=_numbered(raw, "constraints", case.constraints) | _numbered(raw, "springs", case.springs),
        sights=_numbered(raw, "sights", case.sights),
        mounted=parts,
        pictures=case.pictures,
        study=case.study,
        campbell=case.campbell,
        expect=case.expect if "expect" in raw else None,
        initial=case.initial,
        names={key: frozenset(map(str, _table(raw, key))) for key in ("materials", "sections")},
        whole=True,
    )


def outline(raw: Mapping[str, Any]) -> Outline:
    """The outline of a case with mistakes, as TOML gives it."""
    return Outline(
        run=_part(RunTable, raw.get("run")),
        orbit=_part(OrbitTable, raw.get("orbit", {"kind": "none"})),
        environment=_part(EnvironmentTable, raw.get("environment", {})),
        attitude=_part(AttitudeTable, raw.get("attitude", {})),
        bodies={str(name): _part(Body, table) for name, table in _table(raw, "bodies").items()},
        joints=_listed(raw, "joints", Joint),
        loads=_listed(raw, "loads", LoadTable),
        loops=_listed(raw, "loops", Joint),
        between=_listed(raw, "constraints", Constraint) | _listed(raw, "springs", SpringTable),
        sights=_listed(raw, "sights", SightTable),
        mounted={label: table for key, kind in MOUNTED.items() for label, table in _named(raw, key, kind).items()},
        pictures=_part(PicturesTable, raw.get("pictures")),
        study=_part(StudyTable, raw.get("study")),
        campbell=_part(CampbellTable, raw.get("campbell")),
        expect=_part(ExpectationsTable, raw.get("expect")),
        initial=_part(StartTable, raw.get("initial")),
        names={key: frozenset(map(str, _table(raw, key))) for key in ("materials", "sections")},
        whole=False,
    )


def _part(kind: Any, value: Any) -> Any:
    """The value as that type, or None when it is missing or has mistakes."""
    if value is None:
        return None
    try:
        return _adapter(kind).validate_python(value)
    except ValidationError:
        return None


def _adapter(kind: Any) -> TypeAdapter[Any]:
    """The reader of a type, made once: a case is read many times in a sweep."""
    if id(kind) not in ADAPTERS:
        ADAPTERS[id(kind)] = kind, TypeAdapter(kind)
    return ADAPTERS[id(kind)][1]


def _table(raw: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = raw.get(key, {})
    return found if isinstance(found, Mapping) else {}


def _labelled(key: str, parts: Mapping[str, Any]) -> dict[str, Any]:
    return {f"{key}.{name}": part for name, part in parts.items()}


def _numbered(raw: Mapping[str, Any], key: str, parts: Sequence[Any]) -> dict[str, Any]:
    return {f"{key}[{item_label(raw[key], k)}]": part for k, part in enumerate(parts)}


def _named(raw: Mapping[str, Any], key: str, kind: Any) -> dict[str, Any]:
    return {f"{key}.{name}": _part(kind, item) for name, item in _table(raw, key).items()}


def _listed(raw: Mapping[str, Any], key: str, kind: Any) -> dict[str, Any]:
    found = raw.get(key, [])
    items = found if isinstance(found, list) else []
    return {f"{key}[{item_label(items, k)}]": _part(kind, item) for k, item in enumerate(items)}
