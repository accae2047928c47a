"""[[joints.laws]]: nonlinear springs and dampers, stops, friction and latches of single coordinates of a joint.

The unit of a value depends on the coordinate, a slide or an angle, so values are read once the coordinate is known.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from femflex.noun.problems import quoted_names, suggestion_text
from femflex.noun.units import UnitError
from femflex.noun.values import Quantity, ValueProblem, _Readable, checked_word, counted_noun, value_text
from femflex.system.latch import Latch
from femflex.system.law import Friction, Law
from femflex.system.stop import Stop
from femflex.system.tabulated import TabulatedDamper, TabulatedSpring

FORCE = {"m": "N", "rad": "N m"}
STIFFNESS = {"m": "N/m", "rad": "N m/rad"}
DAMPING = {"m": "N s/m", "rad": "N m s/rad"}
RATE = {"m": "m/s", "rad": "rad/s"}
# key -> (its unit as a function of the coordinate's, whether it is a list)
Key = tuple[Callable[[str], str], bool]
KEYS: dict[str, dict[str, Key]] = {
    "spring": {"at": (str, True), "force": (FORCE.__getitem__, True)},
    "damper": {"rate": (RATE.__getitem__, True), "force": (FORCE.__getitem__, True)},
    "stop": {
        "lower": (str, False),
        "upper": (str, False),
        "stiffness": (STIFFNESS.__getitem__, False),
        "damping": (DAMPING.__getitem__, False),
        "width": (str, False),
    },
    "friction": {"force": (FORCE.__getitem__, False), "velocity": (RATE.__getitem__, False)},
    "latch": {
        "at": (str, False),
        "stiffness": (STIFFNESS.__getitem__, False),
        "damping": (DAMPING.__getitem__, False),
    },
}
NEEDED = {
    "spring": ("at", "force"),
    "damper": ("rate", "force"),
    "stop": ("stiffness",),
    "friction": ("force", "velocity"),
    "latch": ("at",),
}
MEANINGS = {
    "spring": {
        "kind": "Selects this law: a spring by a table.",
        "at": "Values of the coordinate, rising [m or rad].",
        "force": "Resisting force or torque at each value [N or N m].",
    },
    "damper": {
        "kind": "Selects this law: a damper by a table.",
        "rate": "Rates of the coordinate, rising [m/s or rad/s].",
        "force": "Resisting force or torque at each rate [N or N m].",
    },
    "stop": {
        "kind": "Selects this law: a stop at a lower limit, an upper limit, or both.",
        "lower": "Lower limit of the coordinate [m or rad]. Default: none.",
        "upper": "Upper limit of the coordinate [m or rad]. Default: none.",
        "stiffness": "Stiffness beyond the limit [N/m or N m/rad].",
        "damping": "Damping coefficient beyond the limit [N s/m or N m s/rad]. Default: 0.",
        "width": "Depth over which stiffness and damping rise [m or rad]. Default: 0.01.",
    },
    "friction": {
        "kind": "Selects this law: dry friction, force times tanh(rate / velocity).",
        "force": "Friction force or torque at high rates [N or N m].",
        "velocity": "Rate at which 76 % of the friction is reached [m/s or rad/s].",
    },
    "latch": {
        "kind": "Selects this law: a latch that locks the coordinate.",
        "at": "Value of the coordinate at which it locks [m or rad].",
        "stiffness": "Stiffness after locking [N/m or N m/rad]. Default: the latch is rigid and locks by an impact.",
        "damping": "Damping coefficient after locking [N s/m or N m s/rad]. Default: 0.",
    },
}
COORDINATE = "Coordinate on which the law acts, such as slide, angle or angle2. Default: the joint's only one."
NAME = {"name": {"type": "string", "description": "Name in channels and terms. Default: the kind of the law."}}


class Laws(_Readable):
    """The tables of [[joints.laws]] as TOML gives them; `read_laws` reads them once the coordinates are known."""

    def read_value(self, value: Any) -> tuple[Mapping[str, Any], ...]:
        """The tables, their keys checked."""
        if not isinstance(value, list) or not all(isinstance(entry, Mapping) for entry in value):
            raise ValueProblem(f"found {value_text(value)}; expected tables headed [[joints.laws]]")
        for k, table in enumerate(value):
            try:
                kind = checked_word(table.get("kind"), KEYS, "kind")
            except ValueProblem as problem:
                raise ValueProblem(f"entry {k + 1}: {problem}") from None
            allowed = (*KEYS[kind], "kind", "coordinate", *_name_key(kind))
            for key in table:
                if key not in allowed:
                    raise ValueProblem(f"entry {k + 1}: found key {key!r} in a {kind}; {suggestion_text(key, allowed)}")
            for key in NEEDED[kind]:
                if key not in table:
                    raise ValueProblem(f"entry {k + 1}: key {key!r} of the {kind} is missing")
        return tuple(dict(table) for table in value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema: CoreSchema = super().__get_pydantic_core_schema__(source, handler)
        return core_schema.with_default_schema(schema, default=())

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of a list of laws."""
        tables = [
            {
                "type": "object",
                "properties": {
                    "kind": {"const": kind, "description": MEANINGS[kind]["kind"]},
                    "coordinate": {"type": "string", "description": COORDINATE},
                    **_name_key(kind),
                    **{key: {"description": MEANINGS[kind][key]} for key in keys},
                },
                "required": ["kind", *NEEDED[kind]],
                "additionalProperties": False,
            }
            for kind, keys in KEYS.items()
        ]
        return {"type": "array", "items": {"anyOf": tables}}


def _name_key(kind: str) -> dict[str, dict[str, str]]:
    """Key for a name with its schema; none of latches, whose channels have the name of the coordinate."""
    return {} if kind == "latch" else NAME


def read_laws(
    tables: tuple[Mapping[str, Any], ...], coordinates: Mapping[str, str]
) -> tuple[tuple[Law, ...], tuple[Latch, ...]]:
    """Laws and latches of a joint whose coordinates have these units, as in {"slide": "m", "angle": "rad"}.

    Raises ValueProblem for what does not fit.
    """
    laws: list[Law] = []
    latches: list[Latch] = []
    for k, table in enumerate(tables):
        try:
            law_or_latch = _build_law(table, coordinates)
        except (ValueError, UnitError) as problem:
            raise ValueProblem(f"laws: entry {k + 1}: {problem}") from None
        if isinstance(law_or_latch, Latch):
            latches.append(law_or_latch)
        else:
            laws.append(law_or_latch)
    return tuple(laws), tuple(latches)


def _build_law(table: Mapping[str, Any], coordinates: Mapping[str, str]) -> Law | Latch:
    kind, names = table["kind"], list(coordinates)
    if not names:
        raise ValueProblem(f"found a {kind} on a joint without a slide or turn of its own; it has nothing to act on")
    name = table.get("coordinate", names[0] if len(names) == 1 else None)
    if name is None:
        raise ValueProblem(f"key 'coordinate' of the {kind} is missing; the joint has {quoted_names(names)}")
    name = checked_word(name, names, "coordinate", ", which the joint does not have")
    unit, freedom = coordinates[name], names.index(name)
    values: dict[str, Any] = {}
    for key, (unit_of, several) in KEYS[kind].items():
        if key in table:
            try:
                values[key] = Quantity(unit_of(unit), (None,) if several else ()).read_value(table[key])
            except (ValueProblem, UnitError) as problem:
                raise ValueProblem(f"{key}: {problem}") from None
    common: dict[str, Any] = {"freedom": freedom, "name": str(table.get("name", ""))}
    if kind in ("spring", "damper"):
        points = values["at" if kind == "spring" else "rate"]
        if len(points) != len(values["force"]):
            raise ValueProblem(
                f"found {counted_noun(len(points), 'place', 'places')} and "
                f"{counted_noun(len(values['force']), 'force', 'forces')} in "
                f"a {kind}; give as many of both"
            )
        law: Law = (
            TabulatedSpring(stretch=points, resisting=values["force"], **common)
            if kind == "spring"
            else TabulatedDamper(rate=points, resisting=values["force"], **common)
        )
        law.kernel_pieces()
        return law
    if kind == "stop":
        return Stop(**values, **common)
    if kind == "friction":
        return Friction(limit=values["force"], velocity=values["velocity"], **common)
    return Latch(freedom, **values)
