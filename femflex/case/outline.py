"""Outline of a case file that may have mistakes: its valid parts, and the names of the others.

Checks across the file (names, tree, files) use this outline, so that their problems are reported together with those
inside single tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

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


def outline_of_tables(raw: Mapping[str, Any], case: Case | None = None) -> Outline:
    """The outline of a case with mistakes from its TOML tables, or of a valid case, labelled from its tables."""

    def single_table(key: str, kind: Any, default: Any = None) -> Any:
        return _valid_or_none(kind, raw.get(key, default)) if case is None else getattr(case, key)

    def named_tables(key: str, kind: Any, tables: Any = raw, source: Any = case) -> dict[str, Any]:
        if case is None:
            return {str(name): _valid_or_none(kind, item) for name, item in _table(tables, key).items()}
        return dict(getattr(source, key, {}))

    def listed_tables(key: str, kind: Any) -> dict[str, Any]:
        items = raw[key] if isinstance(raw.get(key), list) else []
        values = [_valid_or_none(kind, item) for item in items] if case is None else getattr(case, key)
        return {f"{key}[{item_label(items, k)}]": item for k, item in enumerate(values)}

    mounted: dict[str, Any] = {}
    for key, kind in mounted_kinds().items():
        mounted |= _label(key, named_tables(key, kind))
    outputs = named_tables("outputs", JitterOutput, _table(raw, "jitter"), case and case.jitter)
    return Outline(
        run=single_table("run", RunTable),
        orbit=single_table("orbit", Orbit, {"kind": "none"}),
        environment=single_table("environment", Environment, {}),
        attitude=single_table("attitude", AttitudeTable, {}),
        bodies=named_tables("bodies", Body),
        joints=listed_tables("joints", AnyJoint),
        loads=listed_tables("loads", Load),
        loops=listed_tables("loops", AnyJoint),
        between=listed_tables("constraints", Constraint) | listed_tables("springs", Spring),
        sights=listed_tables("sights", Sight),
        mounted=mounted | _label("jitter.outputs", outputs),
        surroundings=_label(SURROUNDINGS, named_tables(SURROUNDINGS, table_of(nouns()[SURROUNDINGS]))),
        pictures=single_table("pictures", PicturesTable),
        study=single_table("study", StudyTable),
        campbell=single_table("campbell", CampbellTable),
        expect=single_table("expect", ExpectationsTable) if "expect" in raw else None,
        initial=single_table("initial", StartTable),
        names={key: frozenset(map(str, _table(raw, key))) for key in ("materials", "sections")},
        is_valid=case is not None,
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


def _label(key: str, tables: Mapping[str, Any]) -> dict[str, Any]:
    return {f"{key}.{name}": table for name, table in tables.items()}
