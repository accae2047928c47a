"""Build the effectors of a case, and add its wheels and propellant to the bodies that carry them.

Sensors and controllers have builders here; all others are nouns of femflex.effectors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.assembly.signals import signal_problems
from femflex.body import FlexibleBody
from femflex.case import controller as tables
from femflex.case.case import Case
from femflex.case.sensor import SensorTable
from femflex.effectors import Sampling, Sensor, blocks, strain_sensor
from femflex.effectors.noun import UNLIMITED
from femflex.noun.problems import CaseError, Problem, suggestion_text
from femflex.system import Part, Variation
from femflex.system.acting import Acting, Context, acting_on, variations_of


@dataclass(frozen=True, eq=False)
class Craft:
    """The effectors and controllers of a case, its bodies with wheels and propellant, and their variable masses."""

    effectors: tuple[Acting, ...]
    parts: dict[str, Part]
    varying: dict[str, Variation]


def build_craft(case: Case, parts: Mapping[str, Part]) -> Craft:
    """The Craft of a case: its effectors, and its bodies with wheels and propellant.

    Raises CaseError with the problems of all tables together.
    """
    problems: list[Problem] = []
    headings = {name: f"{heading}.{name}" for heading, named in case.effectors.items() for name in named}
    nouns = {name: noun for named in case.effectors.values() for name, noun in named.items()}
    problems += [
        Problem(f"{heading}.{name}", f"found the name {name!r} a second time; {headings[name]} has it already")
        for heading, named in case.effectors.items()
        for name in named
        if headings[name] != f"{heading}.{name}"
    ]

    def attempt(name: str, make: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return make(*arguments)
        except (ValueError, KeyError) as error:
            problems.append(Problem(headings.get(name, name), str(error.args[0])))
            return None

    effectors: list[Acting] = []
    for name, sensor in case.sensors.items():
        effectors += attempt(f"sensors.{name}", build_sensor, name, sensor, parts) or ()
    for name, table in case.controllers.items():
        controller = attempt(f"controllers.{name}", build_controller, case, name, table)
        effectors += () if controller is None else (controller,)
    acting, bodies = acting_on(parts, nouns, Context(nouns, case.path.parent), attempt)
    built = (*effectors, *acting)
    problems += [] if problems else signal_problems(case, built)
    tanks = {name: noun for name, noun in nouns.items() if getattr(noun, "body", "") in bodies}
    varying = (attempt("tanks", variations_of, bodies, tanks) or {}) if not problems else {}
    if problems:
        raise CaseError(case.path.name, problems)
    return Craft(built, bodies, varying)


def craft_notes(case: Case) -> list[str]:
    """Sentences on the mass and inertia that effectors add to their bodies, or take out of them."""
    notes = [noun.note(name) for named in case.effectors.values() for name, noun in named.items()]
    return [note for note in notes if note]


def single_body(part: Part) -> FlexibleBody:
    """The part itself if it is a single body. Raises ValueError if it is cut into segments."""
    if not isinstance(part, FlexibleBody):
        raise ValueError(
            "found a strain sensor on a body cut into segments, whose strain is not known at one point of the whole; "
            "leave the segments out, or report the stress (`femflex stress`)"
        )
    return part


def build_sensor(name: str, table: SensorTable, bodies: Mapping[str, Part]) -> tuple[Acting, ...]:
    """The sensor of a table. Raises ValueError."""
    sampling = None
    if table.period is not None:
        sampling = Sampling(table.period, table.delay, table.noise, table.quantum, table.seed)
    bias = np.array(table.bias or (0.0,))
    if table.kind == "strain":
        assert sampling is not None and table.component is not None and table.body is not None
        point, body = np.array(table.point), single_body(bodies[table.body])
        return (strain_sensor(name, table.body, body, point, table.component, sampling, float(bias[0])),)
    turning = None if table.slew_axis is None else (table.slew_axis, str(table.slew_angle))
    return Sensor(
        name,
        table.kind,
        table.body or "",
        table.marker,
        None if table.other_body is None else (table.other_body, table.other_marker),
        np.eye(3) if table.reference is None else np.array(table.reference),
        turning,
        np.array(table.offset),
        table.bandwidth or 0.0,
        np.array(table.axis),
        np.array(table.aim),
        table.coordinate or "",
        table.signal or "",
        np.pad(bias, (0, 3 - len(bias))) if table.bias is not None else np.zeros(3),
        sampling,
    ).effectors


def build_controller(case: Case, name: str, table: Any) -> Acting:
    """The controller of a table. Raises ValueError."""
    if isinstance(table, tables.AttitudeFeedbackTable):
        for key, kind in (("error", "attitude"), ("rate", "rate")):
            sensor = case.sensors.get(getattr(table, key).partition(".")[0])
            if sensor is not None and sensor.kind != kind:
                raise ValueError(
                    f"found {key} = {getattr(table, key)!r}, a sensor of kind {sensor.kind!r}; give one of kind "
                    f"{kind!r}"
                )
        error, rate = signals_of(case, [table.error]), signals_of(case, [table.rate])
        momentum = signals_of(case, table.momentum or [])
        limits = {} if table.limit is None else {"limit": table.limit}
        inertia = None if table.inertia is None else np.array(table.inertia)
        options: dict[str, Any] = {"inertia": inertia, "momentum": momentum, "period": table.period, **limits}
        return blocks.attitude_feedback(
            name, error, rate, per_axis(table.stiffness), per_axis(table.damping), **options
        )
    inputs = signals_of(case, table.inputs)
    if isinstance(table, tables.PulsesTable):
        return blocks.pulses(
            name, inputs, table.outputs, broadcast_gains(table.full, len(inputs)), table.period, table.minimum_on
        )
    system = linear_block(table, len(inputs))
    n = len(system.D)
    outputs = table.outputs or default_outputs(n)
    limit = UNLIMITED if table.limit is None else broadcast_gains(table.limit, n)
    return blocks.block(name, system, inputs, outputs, period=table.period, limit=limit, scaled=table.scaled)


def linear_block(table: Any, n: int) -> blocks.StateSpace:
    """The matrices of a linear controller of n inputs. Raises ValueError."""
    match table:
        case tables.PdTable():
            errors = _error_count(n, table.kind)
            return blocks.pd(broadcast_gains(table.stiffness, errors), broadcast_gains(table.damping, errors))
        case tables.PidTable():
            errors = _error_count(n, table.kind)
            gains = (broadcast_gains(getattr(table, key), errors) for key in ("stiffness", "integral", "damping"))
            return blocks.pid(*gains)
        case tables.LowPassTable():
            return blocks.low_pass(table.frequency, table.order, table.damping, n)
        case tables.NotchTable():
            return blocks.notch(table.frequency, table.width, table.depth, n)
        case tables.ObserverTable():
            return blocks.observer(table.A, table.B, table.C, table.feedback, table.correction)
        case tables.GainTable():
            return blocks.gain(table.matrix)
        case tables.AllocationTable():
            return blocks.allocation(table.effect)
        case tables.MomentumTable():
            return blocks.momentum_management(table.rate, table.effect)
    D = table.D if table.D is not None else np.zeros((len(table.C), len(table.B[0])))
    return blocks.state_space(table.A, table.B, table.C, D)


def _error_count(n: int, kind: str) -> int:
    """The number of errors among n inputs; the other inputs are their rates. Raises ValueError for an odd n."""
    if n % 2:
        raise ValueError(f"kind {kind!r} takes errors, then as many rates; found {n} inputs. Give an even number.")
    return n // 2


def broadcast_gains(gains: tuple[float, ...], n: int) -> np.ndarray[Any, Any]:
    """Gains (n,): one number is used for all channels. Raises ValueError unless there are 1 or n of them."""
    if len(gains) not in (1, n):
        raise ValueError(f"found {len(gains)} numbers where {n} channels are; give one, or one for each")
    return np.broadcast_to(np.array(gains, float), (n,))


def per_axis(gains: tuple[float, ...]) -> np.ndarray[Any, Any]:
    """Gains (3,) of the three axes. Raises ValueError."""
    return broadcast_gains(gains, 3)


def default_outputs(n: int) -> list[str]:
    """Names of n outputs."""
    return ["y"] if n == 1 else list("xyz") if n == 3 else [f"y{k + 1}" for k in range(n)]


def signals_of(case: Case, names: list[str], path: tuple[str, ...] = ()) -> list[str]:
    """The signals of these names; the name of a sensor, controller or signal stands for all of its outputs.

    path: controllers whose number of outputs depends on these signals. Raises ValueError for an unknown name.
    """
    out = []
    for name in names:
        if "." in name:
            out.append(name)
        elif name in case.sensors:
            out += [f"{name}.{output}" for output in sensor_outputs(case.sensors[name])]
        elif name in case.controllers:
            out += [f"{name}.{output}" for output in controller_outputs(case, name, path)]
        elif name in case.effectors["signals"]:
            out.append(f"{name}.value")
        else:
            names_of_sources = [*case.sensors, *case.controllers, *case.effectors["signals"]]
            raise ValueError(
                f"found {name!r}, which is no sensor, controller or signal; {suggestion_text(name, names_of_sources)}"
            )
    return out


def sensor_outputs(table: SensorTable) -> list[str]:
    """Names of the outputs of a sensor."""
    names = {"pointing": ["angle"], "value": ["value"], "strain": ["strain"], "joint": ["coordinate", "rate"]}
    return names.get(table.kind, list("xyz"))


def controller_outputs(case: Case, name: str, path: tuple[str, ...] = ()) -> list[str]:
    """Names of the outputs of a controller. Raises ValueError where their number depends on itself.

    path: controllers whose number of outputs depends on this one's.
    """
    if name in path:
        raise ValueError(
            f"algebraic loop: {' -> '.join([*path[path.index(name) :], name])} take all of each other's outputs, so "
            f"that not even their number is known. Name single signals, such as '{name}.y', and take a state or a "
            "sampled number somewhere in the loop"
        )
    table = case.controllers[name]
    if table.outputs is not None:
        return list(table.outputs)
    if isinstance(table, tables.AttitudeFeedbackTable):
        return list("xyz")
    as_many = isinstance(table, tables.PdTable | tables.PidTable | tables.LowPassTable | tables.NotchTable)
    n = len(signals_of(case, table.inputs, (*path, name))) if as_many else 0
    return default_outputs(len(linear_block(table, n).D))
