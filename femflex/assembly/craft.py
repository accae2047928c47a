"""Build the effectors of a case, and add its wheels and propellant to the bodies that carry them.

Effectors are wheels, gyros, thrusters, tanks, separation springs, cables, sensors and controllers.
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
from femflex.case.thruster import TankTable, ThrusterTable
from femflex.case.wheel import CableTable, GyroTable, WheelTable
from femflex.noun.problems import CaseError, Problem, suggestion_text
from femflex.system import (
    Controller,
    Effector,
    Part,
    Sampling,
    Sensor,
    Supply,
    Variation,
    blocks,
    cable,
    control_moment_gyro,
    pulse_train,
    reaction_wheel,
    separation_spring,
    signal,
    strain_sensor,
    tank,
    tank_variation,
    thruster,
    with_attached,
    with_wheel,
    without_axial_inertia,
)
from femflex.system.segments import body_of_part, body_with_marker, with_body_of_part
from femflex.system.wheel import UNLIMITED

Acting = Effector | Controller


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
    bodies = dict(parts)

    def try_build(where: str, make: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return make(*arguments)
        except (ValueError, KeyError) as error:
            problems.append(Problem(where, str(error.args[0])))
            return None

    effectors: list[Acting | None] = []
    for name, s in case.signals.items():
        effectors.append(try_build(f"signals.{name}", signal, name, s.times, s.values, s.kind, s.unit))
    for name, sensor in case.sensors.items():
        effectors += try_build(f"sensors.{name}", build_sensor, name, sensor, bodies) or ()
    for name, table in case.controllers.items():
        effectors.append(try_build(f"controllers.{name}", build_controller, case, name, table))
    for name, wheel in case.wheels.items():
        effector = try_build(f"wheels.{name}", build_wheel, name, wheel)
        effectors.append(effector)
        if effector is not None and wheel.body in bodies:
            with_wheel_added = try_build(f"wheels.{name}", with_wheel_inertia, bodies[wheel.body], wheel, effector)
            bodies[wheel.body] = with_wheel_added or bodies[wheel.body]
    for name, gyro in case.gyros.items():
        effectors.append(try_build(f"gyros.{name}", build_gyro, name, gyro))
    for name, jet in case.thrusters.items():
        effectors.append(try_build(f"thrusters.{name}", build_thruster, case, name, jet))
    for name, store in case.tanks.items():
        users = [key for key, jet in case.thrusters.items() if jet.tank == name]
        effectors.append(try_build(f"tanks.{name}", tank, name, store.propellant, users))
        if store.mass_in_body == "added" and store.body in bodies:
            bodies[store.body] = (
                try_build(f"tanks.{name}", with_propellant, bodies[store.body], store) or bodies[store.body]
            )
    for name, spring in case.separations.items():
        ends = ((spring.parent, spring.parent_marker), (spring.body, spring.marker))
        effectors.append(
            try_build(f"separations.{name}", separation_spring, name, ends, spring.stiffness, spring.length)
        )
    for name, line in case.cables.items():
        if line.mass_per_length is not None:
            continue  # its point masses are placed between its ends later (`femflex.pipeline.start`)
        effectors.append(try_build(f"cables.{name}", build_cable, case, name, line))
    built = tuple(effector for effector in effectors if effector is not None)
    problems += [] if problems else signal_problems(case, built)
    tanks = {name: store for name, store in case.tanks.items() if store.body in bodies}
    varying = (try_build("tanks", tank_variations, bodies, tanks) or {}) if not problems else {}
    if problems:
        raise CaseError(case.path.name, problems)
    return Craft(built, bodies, varying)


def single_body(part: Part) -> FlexibleBody:
    """The part itself if it is a single body. Raises ValueError if it is cut into segments."""
    if not isinstance(part, FlexibleBody):
        raise ValueError(
            "found a strain sensor on a body cut into segments, whose strain is not known at one point of the whole; "
            "leave the segments out, or report the stress (`femflex stress`)"
        )
    return part


def build_wheel(name: str, table: WheelTable) -> Effector:
    """The reaction wheel of a table. Raises ValueError."""
    command: dict[str, Any] = {}
    if table.command is not None:
        command = {table.commanded: table.command}
    elif table.speed is not None:
        command = {"speed": table.speed}
    else:
        command = {"torque": table.torque or 0.0}
    keys = ("marker", "axis", "bandwidth", "initial_speed", "viscous", "coulomb", "coulomb_speed")
    limits = {key: getattr(table, key) for key in ("max_torque", "max_speed") if getattr(table, key) is not None}
    options: dict[str, Any] = {key: getattr(table, key) for key in keys}
    return reaction_wheel(name, table.body, table.inertia, **command, **limits, **options)


def with_wheel_inertia(part: Part, table: WheelTable, wheel: Effector) -> Part:
    """The body with the mass and inertia of a wheel added, or with the wheel's axial inertia removed.

    The inertia is removed where the table says that the body contains the wheel.
    Raises ValueError, and KeyError for an unknown marker.
    """
    body = body_of_part(part, table.marker)
    if table.inertia_in_body == "contained":
        changed = without_axial_inertia(body, wheel)
    else:
        changed = with_wheel(body, wheel, table.mass or 0.0, table.transverse_inertia or 0.0)
    return with_body_of_part(part, table.marker, changed)


def with_propellant(part: Part, table: TankTable) -> Part:
    """The body with the propellant of a tank added. Raises ValueError, and KeyError for an unknown marker."""
    inertia = table.propellant * table.gyration**2 * np.eye(3)
    changed = with_attached(body_of_part(part, table.marker), table.marker, table.propellant, inertia)
    return with_body_of_part(part, table.marker, changed)


def tank_variations(parts: Mapping[str, Part], tanks: Mapping[str, TankTable]) -> dict[str, Variation]:
    """The variable mass of every body, or segment, with tanks as these are emptied. Raises ValueError."""
    tanks_of_body: dict[str, dict[str, tuple[str, float, float]]] = {}
    carriers: dict[str, FlexibleBody] = {}
    for name, table in tanks.items():
        key = body_with_marker(parts, table.body, table.marker)
        carriers[key] = body_of_part(parts[table.body], table.marker)
        tanks_of_body.setdefault(key, {})[name] = (table.marker, table.propellant, table.gyration)
    return {key: tank_variation(carriers[key], body_tanks) for key, body_tanks in tanks_of_body.items()}


def build_cable(case: Case, name: str, table: CableTable) -> Effector:
    """The cable of a table. Raises ValueError, and OSError for a file of its length that cannot be read."""
    length = table.length.profile
    if length is None:
        raise ValueError("found a length that is locked; give its value")
    ends = ((table.parent, table.parent_marker), (table.body, table.marker))
    return cable(name, ends, length(case.path.parent), table.EA, table.damping)


def build_gyro(name: str, table: GyroTable) -> Effector:
    """The control-moment gyro of a table. Raises ValueError."""
    keys = (
        "marker",
        "gimbal_axis",
        "spin_axis",
        "inner_axis",
        "rates",
        "angles",
        "gain",
        "gimbal_inertia",
        "bandwidth",
    )
    options: dict[str, Any] = {key: getattr(table, key) for key in keys}
    options["initial_angles"] = table.initial_angles or ()
    for key in ("max_rate", "max_torque"):
        options[key] = getattr(table, key) or UNLIMITED
    return control_moment_gyro(name, table.body, table.momentum, **options)


def build_thruster(case: Case, name: str, table: ThrusterTable) -> Effector:
    """The thruster of a table. Raises ValueError."""
    supply = None
    if table.tank is not None:
        if table.tank not in case.tanks:
            raise ValueError(
                f"found tank {table.tank!r}, which is not in [tanks]; {suggestion_text(table.tank, case.tanks)}"
            )
        store = case.tanks[table.tank]
        supply = Supply(table.tank, store.body, store.marker, store.gyration)
    train = table.train
    pulses = table.pulses if train is None else pulse_train(train.start, train.period, train.width, train.count)
    profile = None if table.profile is None else (table.profile.times, table.profile.levels)
    keys = ("marker", "axis", "misalignment", "command", "switched", "lag", "minimum_on", "specific_impulse")
    options: dict[str, Any] = {key: getattr(table, key) for key in keys}
    return thruster(name, table.body, table.thrust, pulses=pulses, profile=profile, supply=supply, **options)


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
        elif name in case.signals:
            out.append(f"{name}.value")
        else:
            names_of_sources = [*case.sensors, *case.controllers, *case.signals]
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


def craft_notes(case: Case) -> list[str]:
    """Sentences on the mass and inertia that wheels and tanks add to their bodies, or remove from them."""
    out = []
    for name, wheel in case.wheels.items():
        if wheel.inertia_in_body == "contained":
            out.append(
                f"Wheel {name} is contained in {wheel.body}: its axial inertia of {wheel.inertia:g} kg m^2 was taken "
                "out of the body's."
            )
        else:
            out.append(
                f"Wheel {name} was added to {wheel.body}: mass {wheel.mass:g} kg, transverse inertia "
                f"{wheel.transverse_inertia:g} kg m^2."
            )
    for name, store in case.tanks.items():
        what = "is contained in the mass of" if store.mass_in_body == "contained" else "was added to"
        out.append(f"Propellant of tank {name}, {store.propellant:g} kg, {what} {store.body}.")
    return out
