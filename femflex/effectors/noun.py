"""Effectors as nouns: a table of a case, a constructor in Python, and the numbers that a function reads by name.

THE MODEL. An effector is one file with one class and one function:

    class Brake(Mounted, heading="brakes"):
        # its docstring describes the table, and the text behind each field that key
        damping: Annotated[float, Quantity("N m s/rad", least=0.0)]

        accounts = ("dissipation",)
        exerts = ("torque",)


    P, IN, OUT = Brake.places()


    @Brake.kernel
    def brake(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
        rate, c = load3(seen, IN.rate), parameters[P.damping]
        store3(out, OUT.torque, scale(-c, rate))
        out[OUT.dissipation] = c * dot(rate, rate)

The class gives the table [brakes.NAME], its errors, its schema and reference page, and `Brake(body="hub",
damping="3 N m s/rad")` with the same checks. `heading` registers it, so that cases may have it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.effectors.registry import register
from femflex.kernels.entries import ACT, Entry
from femflex.noun.parametric import Parametric, offsets
from femflex.noun.problems import suggestion_text
from femflex.noun.values import Quantity, _Readable
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import ACCOUNTS, EXERTED, Effector
from femflex.system.variation import Variation


class EffectorNoun(Parametric):
    """An effector as a table and as an object: see this module.

    label     its name in messages; the words of the class's name where it gives none
    act       its function
    n_markers, states, channels, accounts, exerts   as those of femflex.system.Effector; a noun whose counts depend on
              its values says so in `effector`
    writes_all  whether its function writes all its results, so that these are not set to zero beforehand
    gives_signals  whether its name alone may stand among the inputs of a controller (see `signals`)
    """

    label: ClassVar[str] = "effector"
    act: ClassVar[Any] = None
    n_markers: ClassVar[int] = 1
    states: ClassVar[Mapping[str, str]] = {}
    channels: ClassVar[Mapping[str, str]] = {}
    accounts: ClassVar[tuple[str, ...]] = ()
    exerts: ClassVar[tuple[str, ...]] = EXERTED
    writes_all: ClassVar[bool] = False
    gives_signals: ClassVar[bool] = False

    def __init_subclass__(cls, heading: str = "", **options: Any) -> None:
        super().__init_subclass__(**options)
        if "label" not in cls.__dict__:
            cls.label = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", cls.__name__).lower()
        if heading:
            register(heading, cls)

    @classmethod
    def kernel(cls, function: Callable[..., None]) -> Entry:
        """Decorator of the noun's function (t, seen, z, parameters, out), which is compiled once and kept on disk."""
        cls.act = Entry(function, ACT, cls.writes_all)
        return cls.act

    @classmethod
    def places(cls) -> tuple[Any, Any, Any]:
        """Offsets of its function's numbers in parameters, in seen, and in out: three named tuples.

        parameters  fields that are numbers or vectors, in their order, then those of `derived`
        seen        position, attitude, velocity, rate (of the first marker; the second follows each), inputs
        out         force, torque, the states (their rates), the channels, and the accounts of energy and mass
        """
        m = cls.n_markers
        seen = {"position": 0, "attitude": 3 * m, "velocity": 12 * m, "rate": 15 * m, "inputs": 18 * m}
        out = {"force": 0, "torque": 3 * m}
        out |= {name: 6 * m + k for k, name in enumerate((*cls.states, *cls.channels, *ACCOUNTS))}
        return cls.parameter_places(), offsets("Seen", seen), offsets("Out", out)

    def markers(self) -> tuple[tuple[str, str], ...]:
        """(body, marker) of each place at which it acts."""
        return ()

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for values that do not fit together."""
        return Effector(
            name,
            self.act,
            self.markers(),
            states=self.states,
            channels=self.channels,
            accounts=self.accounts,
            exerts=self.exerts,
            parameters=self.parameters(),
            kind=self.label,
        )

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """Return its effector, or several, or none, for a System. Raises ValueError."""
        return (self.effector(name, context),)

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Names of its outputs, for which its name alone stands among the inputs of a controller; none of an actuator.

        path: controllers whose number of outputs depends on this one's. Raises ValueError.
        """
        return []

    def carrier(self, name: str, body: FlexibleBody) -> FlexibleBody:
        """The body that carries it, with the mass and inertia that it adds or takes out. Raises ValueError."""
        return body

    @classmethod
    def variations(cls, bodies: Mapping[str, Any], nouns: Mapping[str, Any]) -> dict[str, Variation]:
        """Variations of the bodies that carry nouns of this class, by body. Raises ValueError."""
        return {}

    def needed_patches(self) -> tuple[tuple[str, str], ...]:
        """(body, group) of the patches that it needs (`femflex.body.Patches`); none of one that acts at markers."""
        return ()

    def strained_groups(self) -> tuple[tuple[str, str], ...]:
        """(body, group) in which it induces strain (`femflex.body.InducedStrain`); it needs their patches too."""
        return ()

    def files(self) -> tuple[tuple[str, str], ...]:
        """(key, name) of the files that it names."""
        return ()

    def load_sets(self) -> tuple[tuple[str, str], ...]:
        """(body, set of loads) of the body's deck that it needs (`femflex.body.LoadSet`)."""
        return ()

    def first_start(self) -> float | None:
        """Time at which it first acts [s]; None for one that acts from the start, or on command."""
        return None

    def note(self, name: str) -> str:
        """A sentence on what it did to the body that carries it; "" where there is nothing to say."""
        return ""


class Mounted(EffectorNoun):
    """An element at a marker of a body."""

    body: str
    """Body that carries it."""
    marker: str = "origin"
    """Marker at which it acts; directions are in the axes of this marker."""

    def markers(self) -> tuple[tuple[str, str], ...]:
        """Its one marker."""
        return ((self.body, self.marker),)


class MarkerPair(Mounted):
    """An element between two markers."""

    n_markers = 2

    parent: str
    """The other body."""
    parent_marker: str = "origin"
    """Marker of the other body."""

    def markers(self) -> tuple[tuple[str, str], ...]:
        """The marker of the other body, and its own. Raises ValueError where they are one."""
        ends = ((self.parent, self.parent_marker), (self.body, self.marker))
        if ends[0] == ends[1]:
            raise ValueError(f"found both ends at marker {self.marker!r} of body {self.body!r}; give two markers")
        return ends


NUMBER_START, SIGNAL = re.compile(r"\s*[-+]?\.?\d"), re.compile(r"[\w-]+\.[A-Za-z_]\w*")


class NumberOrSignal(_Readable):
    """A number with that unit, or the name of a signal."""

    def __init__(self, unit: str) -> None:
        self.number = Quantity(unit)

    def read_value(self, value: Any) -> float | str:
        """The number in SI, or the name: a text that does not begin with a number, or has the form of "2nd.value"."""
        if isinstance(value, str) and not (NUMBER_START.match(value) and not SIGNAL.fullmatch(value)):
            return value
        return float(self.number.read_value(value))

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both."""
        return {"anyOf": [self.number.json_schema(), {"type": "string", "description": "name of a signal"}]}


def whole_body(context: Context, name: str) -> FlexibleBody:
    """The body of that name. Raises ValueError where there is none, and for one that is cut into segments."""
    body = context.bodies.get(name)
    if body is None:
        raise ValueError(f"found body {name!r}, which does not exist; {suggestion_text(name, context.bodies)}")
    if not isinstance(body, FlexibleBody):
        raise ValueError(
            f"body {name!r} is cut into segments, whose surface is not that of one body; give it without segments, or "
            "give loads at its markers"
        )
    return body


def unit_direction(name: str, what: str, vector: ArrayLike) -> Array:
    """The unit vector of a direction. Raises ValueError where it has none."""
    v = np.asarray(vector, float)
    length = float(np.linalg.norm(v))
    if v.shape != (3,) or not (math.isfinite(length) and length > 0.0):
        raise ValueError(f"{what} of {name!r} is {v.tolist()}; expected three numbers, not all zero")
    return v / length
