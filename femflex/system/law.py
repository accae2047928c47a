"""Laws of joint coordinates beyond linear springs and dampers: the tables [[joints.laws]], and the objects.

Each acts on one translation or rotation of a joint. A law's force counts as it resists: against a positive stretch or
rate it is positive, and the joint feels minus it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import CoreSchema, core_schema

from femflex.arrays import Array
from femflex.noun.parametric import Parametric, offsets
from femflex.noun.problems import quoted_names, suggestion_text
from femflex.noun.sentences import schema_problems
from femflex.noun.units import UnitError
from femflex.noun.values import Quantity, ValueProblem, _as_validator, _Readable, checked_word, value_text
from femflex.system.profile import Profile

# kinds of pieces of laws (femflex.dynamics.forces.laws).
SPRING, DAMPER, CONTACT, FRICTION, LATCHED, CALLED = range(6)
Piece = tuple[int, Array]  # one of these, and its numbers
OF_ROTATION = {"m": "rad", "m/s": "rad/s", "N": "N m", "N/m": "N m/rad", "N s/m": "N m s/rad"}
GIVEN = ("force", "energy", "dissipation", "stiffness", "damping")  # what the function of a law writes
_LAWS: dict[str, type[JointLaw]] = {}  # by kind


@dataclass(frozen=True)
class ByCoordinate(Quantity):
    """A quantity with that unit along a translation; about a rotation with `rotation`, or the corresponding unit."""

    rotation: str = ""

    def read_value(self, value: Any, unit: str | None = None) -> Any:
        """The value in SI; unit: of the coordinate, "m" or "rad"; without one, texts may have either unit."""
        if unit is not None:
            return super().read_value(value) if unit == "m" else self.of_rotation.read_value(value)
        try:
            return super().read_value(value)
        except (ValueProblem, UnitError) as problem:
            try:
                return self.of_rotation.read_value(value)
            except (ValueProblem, UnitError):
                raise problem from None

    @property
    def of_rotation(self) -> Quantity:
        """The quantity about a rotation."""
        unit = self.rotation or OF_ROTATION[self.unit]
        return Quantity(unit, self.shape, self.above, self.below, self.least, self.most)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            lambda value, info: _as_validator(lambda one: self.read_value(one, info.context))(value)
        )

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the value; `unit` names both units."""
        return super().json_schema() | {"unit": f"{self.unit} or {self.of_rotation.unit}"}


def _with_kind(schema: dict[str, Any]) -> None:
    schema["required"] = ["kind", *schema.get("required", ())]
    del schema["properties"]["kind"]["default"]


def register(law: type[JointLaw]) -> None:
    """Let cases have tables of this law, by its kind. A later one of the same kind takes its place."""
    _LAWS[law.model_fields["kind"].default] = law


def forget(kind: str) -> None:
    """Take the law of this kind away from cases."""
    del _LAWS[kind]


class JointLaw(Parametric):
    """Base class of laws and latches: an element on one coordinate of a joint.

    A class whose `kind` has a default is known to cases by that name.
    """

    coordinate: str | SkipJsonSchema[int | None] = None
    """Coordinate on which the law acts, such as slide, angle or angle2. Default: the joint's only one."""
    kind: str
    """Selects the law."""

    model_config = ConfigDict(json_schema_extra=_with_kind)
    act: ClassVar[Any] = None  # its function, of a law that is not made of pieces known to the equations

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        if not cls.model_fields["kind"].is_required():
            register(cls)

    @classmethod
    def places(cls) -> tuple[Any, Any]:
        """Offsets of its function's numbers in parameters and in out: two named tuples.

        parameters  fields that are numbers, in their order, then those of `derived`
        out         force: what it resists with; energy: stored; dissipation: power lost; stiffness, damping: slopes of
                    the force by coordinate and rate, for implicit integrators. All are zero beforehand.
        """
        return cls.parameter_places(), offsets("Given", {name: k for k, name in enumerate(GIVEN)})

    @classmethod
    def kernel(cls, function: Callable[..., None]) -> Callable[..., None]:
        """Decorator of the law's function (q, u, parameters, out), which is compiled once and kept on disk."""
        cls.act = function
        return function

    @property
    def freedom(self) -> int:
        """Number of its coordinate among those of its joint, translations first."""
        assert isinstance(self.coordinate, int)
        return self.coordinate

    def with_freedom_of(self, names: Sequence[str]) -> Self:
        """The law with the number of its coordinate among these names. Raises ValueError for one that is not there."""
        if isinstance(self.coordinate, int):
            return self
        return self.model_copy(update={"coordinate": _freedom(self.coordinate, names, self.kind)})

    @property
    def stiffest(self) -> float:
        """Largest stiffness it can have."""
        return 0.0

    def pieces(self) -> list[Piece]:
        """The pieces that the compiled equations evaluate and add up; of a law with a function, its parameters."""
        if self.act is None:
            name = type(self).__name__
            raise ValueError(f"law {name} has neither pieces nor a function; give it one, with @{name}.kernel")
        return [(CALLED, self.parameters())]


class Law(JointLaw):
    """A law by its own name."""

    name: str = ""
    """Name in channels and terms. Default: the kind of the law."""


class Elastic(Law):
    """A law with a potential V(q), a piecewise polynomial."""

    @property
    def potential(self) -> Profile:
        """V, V' and V'' of the coordinate."""
        raise NotImplementedError

    @property
    def stiffest(self) -> float:
        """Largest V'' at the knots and between them."""
        knots = self.potential.knots
        return float(np.max(self.potential(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))[2]))

    def pieces(self) -> list[Piece]:
        """Its potential."""
        return [(SPRING, self.potential.numbers)]


class Friction(Law):
    """Dry friction, regularised: force times tanh(rate / velocity)."""

    kind: Literal["friction"] = "friction"
    """Selects this law: dry friction, force times tanh(rate / velocity)."""
    force: Annotated[float, ByCoordinate("N", least=0.0)]
    """Friction force or torque at high rates."""
    velocity: Annotated[float, ByCoordinate("m/s", above=0.0)]
    """Rate at which 76 % of the friction is reached; below it the joint creeps instead of sticking."""

    def pieces(self) -> list[Piece]:
        """Force and velocity."""
        return [(FRICTION, self.parameters())]


def read_law(table: Any, units: Mapping[str, str]) -> JointLaw:
    """The law of a table of a joint whose coordinates have these units, as in {"slide": "m", "angle": "rad"}.

    Raises ValueProblem for what does not fit.
    """
    if isinstance(table, JointLaw):
        return table.with_freedom_of(list(units))
    if not isinstance(table, Mapping):
        raise ValueProblem(f"found {value_text(table)}; expected a table headed [[joints.laws]]")
    kind = checked_word(table.get("kind"), _LAWS, "kind")
    law = _LAWS[kind]
    if isinstance(name := table.get("coordinate"), int):
        checked_word(name, units, "coordinate")
    freedom = _freedom(name, list(units), kind)
    allowed = [key for key, field in law.model_fields.items() if not field.exclude]
    for key in table:
        if key not in allowed:
            raise ValueProblem(f"found key {key!r} in a {kind}; {suggestion_text(key, allowed)}")
    try:
        return law.model_validate({**table, "coordinate": freedom}, context=list(units.values())[freedom])
    except ValidationError as error:
        raise ValueProblem("; ".join(map(str, schema_problems(law, table, error)))) from None


def _freedom(name: str | int | None, names: Sequence[str], kind: str) -> int:
    """The number of the coordinate of that name. Raises ValueProblem."""
    if not names:
        raise ValueProblem(f"found a {kind} on a joint without a slide or turn of its own; it has nothing to act on")
    if name is None and len(names) > 1:
        raise ValueProblem(f"key 'coordinate' of the {kind} is missing; the joint has {quoted_names(names)}")
    return names.index(checked_word(name or names[0], names, "coordinate", ", which the joint does not have"))


class LawTables(_Readable):
    """The tables of [[joints.laws]] as TOML gives them; `read_law` reads them once the coordinates are known."""

    def read_value(self, value: Any) -> tuple[Any, ...]:
        """The tables."""
        if not isinstance(value, list | tuple):
            raise ValueProblem(f"found {value_text(value)}; expected tables headed [[joints.laws]]")
        return tuple(value)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        kinds = [handler(law.__pydantic_core_schema__) for law in _LAWS.values()]
        return {"type": "array", "items": {"anyOf": kinds}}
