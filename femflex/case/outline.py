"""Outline of a case file that may have mistakes: its valid parts, and the names of the others.

Checks across the file (names, tree, files) use this outline, so that their problems are reported together with those
inside single tables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from femflex.case.attitude import AttitudeTable
from femflex.case.body import Body, BodyTable
from femflex.case.campbell import CampbellTable
from femflex.case.case import Case, table_of
from femflex.case.initial import StartTable
from femflex.case.run import PicturesTable, RunTable, StudyTable
from femflex.disturbances import Disturbance, JitterOutput
from femflex.effectors.registry import nouns
from femflex.measures.measure import ExpectationsTable
from femflex.noun.problems import item_label
from femflex.system.constraint import Constraint
from femflex.system.environment import Environment
from femflex.system.joints import AnyJoint
from femflex.system.joints.noun import JointNoun
from femflex.system.load import Load
from femflex.system.orbit import Orbit
from femflex.system.sight import Sight
from femflex.system.spring import MarkerLink, Spring

T = TypeVar("T")


def mounted_kinds() -> dict[str, Any]:
    """Heading -> type of the tables of every effector that acts on a body, and of disturbances."""
    kinds = {heading: table_of(kinds) for heading, kinds in nouns().items() if "body" in kinds[0].model_fields}
    return kinds | {"disturbances": Disturbance}


SURROUNDINGS = "surroundings"  # their heading
ADAPTERS: dict[int, tuple[Any, TypeAdapter[Any]]] = {}  # by the identity of the type, which is kept alive here


@dataclass(frozen=True)
class Outline:
    """The parts of a case file; None stands for a part that is missing or has mistakes.

    bodies  by name; joints, loads, loops, constraints, springs and sights by their label in key paths, such as
            "joints[panel]"
    mounted wheels, gyros, thrusters, tanks, separation springs, cables, sensors, disturbances and outputs of
            [jitter] by their label, as "wheels.w1"
    surroundings by their label, as "surroundings.sun"
    names   of the entries of materials and sections, valid or not
    """

    run: RunTable | None
    orbit: Orbit | None
    environment: Environment | None
    attitude: AttitudeTable | None
    bodies: Mapping[str, BodyTable | None]
    joints: Mapping[str, JointNoun | None]
    loads: Mapping[str, Load | None]
    loops: Mapping[str, JointNoun | None]
    between: Mapping[str, MarkerLink | None]
    sights: Mapping[str, Sight | None]
    mounted: Mapping[str, Any]
    surroundings: Mapping[str, Any]
    pictures: PicturesTable | None
    study: StudyTable | None
    campbell: CampbellTable | None
    expect: ExpectationsTable | None
    initial: StartTable | None
    names: Mapping[str, frozenset[str]]
    is_valid: bool


def outline_of_case(case: Case, raw: Mapping[str, Any]) -> Outline:
    """The outline of a valid case; raw: its TOML tables, from which the labels are taken."""
    mounted: dict[str, Any] = {}
    for key in mounted_kinds():
        mounted |= _label_named(key, getattr(case, key))
    mounted |= _label_named("jitter.outputs", case.jitter.outputs if case.jitter else {})
    return Outline(
        run=case.run,
        orbit=case.orbit,
        environment=case.environment,
        attitude=case.attitude,
        bodies=dict(case.bodies),
        joints=_label_list(raw, "joints", case.joints),
        loads=_label_list(raw, "loads", case.loads),
        loops=_label_list(raw, "loops", case.loops),
        between=_label_list(raw, "constraints", case.constraints) | _label_list(raw, "springs", case.springs),
        sights=_label_list(raw, "sights", case.sights),
        mounted=mounted,
        surroundings=_label_named(SURROUNDINGS, getattr(case, SURROUNDINGS)),
        pictures=case.pictures,
        study=case.study,
        campbell=case.campbell,
        expect=case.expect if "expect" in raw else None,
        initial=case.initial,
        names={key: frozenset(map(str, _table(raw, key))) for key in ("materials", "sections")},
        is_valid=True,
    )


def outline_of_tables(raw: Mapping[str, Any]) -> Outline:
    """The outline of a case with mistakes, from its TOML tables."""
    mounted: dict[str, Any] = {}
    for key, kind in mounted_kinds().items():
        mounted |= _read_named(raw, key, kind)
    outputs = _read_named(_table(raw, "jitter"), "outputs", JitterOutput)
    mounted |= {f"jitter.{key}": item for key, item in outputs.items()}
    return Outline(
        run=_valid_or_none(RunTable, raw.get("run")),
        orbit=_valid_or_none(Orbit, raw.get("orbit", {"kind": "none"})),
        environment=_valid_or_none(Environment, raw.get("environment", {})),
        attitude=_valid_or_none(AttitudeTable, raw.get("attitude", {})),
        bodies={str(name): _valid_or_none(Body, table) for name, table in _table(raw, "bodies").items()},
        joints=_read_list(raw, "joints", AnyJoint),
        loads=_read_list(raw, "loads", Load),
        loops=_read_list(raw, "loops", AnyJoint),
        between=_read_list(raw, "constraints", Constraint) | _read_list(raw, "springs", Spring),
        sights=_read_list(raw, "sights", Sight),
        mounted=mounted,
        surroundings=_read_named(raw, SURROUNDINGS, table_of(nouns()[SURROUNDINGS])),
        pictures=_valid_or_none(PicturesTable, raw.get("pictures")),
        study=_valid_or_none(StudyTable, raw.get("study")),
        campbell=_valid_or_none(CampbellTable, raw.get("campbell")),
        expect=_valid_or_none(ExpectationsTable, raw.get("expect")),
        initial=_valid_or_none(StartTable, raw.get("initial")),
        names={key: frozenset(map(str, _table(raw, key))) for key in ("materials", "sections")},
        is_valid=False,
    )


def _valid_or_none(kind: Any, value: Any) -> Any:
    """The value as that type, or None when it is missing or has mistakes."""
    if value is None:
        return None
    try:
        return _adapter(kind).validate_python(value)
    except ValidationError:
        return None


def _adapter(kind: Any) -> TypeAdapter[Any]:
    """The validator of a type, made once, because a sweep reads a case many times."""
    if id(kind) not in ADAPTERS:
        ADAPTERS[id(kind)] = kind, TypeAdapter(kind)
    return ADAPTERS[id(kind)][1]


def _table(raw: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = raw.get(key, {})
    return value if isinstance(value, Mapping) else {}


def _label_named(key: str, tables: Mapping[str, Any]) -> dict[str, Any]:
    return {f"{key}.{name}": table for name, table in tables.items()}


def _label_list(raw: Mapping[str, Any], key: str, tables: Sequence[Any]) -> dict[str, Any]:
    return {f"{key}[{item_label(raw[key], k)}]": table for k, table in enumerate(tables)}


def _read_named(raw: Mapping[str, Any], key: str, kind: Any) -> dict[str, Any]:
    return {f"{key}.{name}": _valid_or_none(kind, item) for name, item in _table(raw, key).items()}


def _read_list(raw: Mapping[str, Any], key: str, kind: Any) -> dict[str, Any]:
    value = raw.get(key, [])
    items = value if isinstance(value, list) else []
    return {f"{key}[{item_label(items, k)}]": _valid_or_none(kind, item) for k, item in enumerate(items)}
