"""Settings of sensors, controllers and actuators that are possible but rarely intended: warnings with both numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from femflex.case.body import RigidTable
from femflex.case.case import Case
from femflex.effectors.controllers import AttitudeFeedback, LinearSystem, LowPass, Notch, Pd, Pid
from femflex.effectors.noun import MarkerPair
from femflex.effectors.sensor import Sensor
from femflex.effectors.signal import Signal
from femflex.effectors.thruster import Thruster
from femflex.warning import warn_of_physics

FASTEST = 3000.0  # rad/s, 28600 rpm: above it the speed of a wheel is likely meant in other units
DERIVATIVES = {"attitude": 0, "pointing": 0, "displacement": 0, "rate": 1, "velocity": 1, "acceleration": 2}


def warn_of_doubtful_control(case: Case) -> None:
    """Warn of every doubtful setting of the sensors, controllers and actuators of a case."""
    for text in (
        *_time_warnings(case),
        *_filter_warnings(case),
        *_gain_warnings(case),
        *_level_warnings(case),
        *_internal_force_warnings(case),
    ):
        warn_of_physics(text)


def _time_warnings(case: Case) -> Iterator[str]:
    """Periods and delays longer than the run, and pulses and releases after its end."""
    end = case.run.length(None if case.orbit.kind == "none" else case.orbit.period)
    for kind in ("sensors", "controllers"):
        for name, table in case.effectors[kind].items():
            for key in ("period", "delay"):
                if (interval := getattr(table, key, None)) is not None and interval > end * (1.0 + 1e-9):
                    yield (
                        f"{kind}.{name}.{key}: found {interval:g} s, longer than the run of {end:g} s, so that "
                        "it knows one sample at most; shorten it, or run longer"
                    )
    for heading, tables in case.effectors.items():
        for name, table in tables.items():
            start = table.first_start()
            if start is not None and start >= end:
                yield f"{heading}.{name}: it first acts at {start:g} s, after the end of the run at {end:g} s"
            elif (train := getattr(table, "train", None)) is not None:
                late = sum(begin >= end for begin, _ in train.pulses())
                if late:
                    yield (
                        f"{heading}.{name}.train: {late} of its {train.count} pulses come after the end of the run at "
                        f"{end:g} s; run longer, or shorten its period of {train.period:g} s"
                    )
            if (speed := getattr(table, "max_speed", None)) is not None and speed > FASTEST:
                yield (
                    f"{heading}.{name}.max_speed: found {speed:g} rad/s, {speed * 30 / math.pi:.6g} rpm (limit "
                    f"{FASTEST:g} rad/s); numbers without unit are rad/s: write '{speed:g} rpm' if that was meant"
                )
    for joint in case.joints:
        if joint.release is not None and joint.release > end:
            yield (
                f"joints[{joint.name or joint.child}].release: found {joint.release:g} s, after the end of the run at "
                f"{end:g} s; the joint stays locked"
            )


def _filter_warnings(case: Case) -> Iterator[str]:
    """Filters above half the sampling frequency of their own or of their inputs."""
    for name, table in case.effectors["controllers"].items():
        if isinstance(table, LinearSystem) and table.period is not None and len(table.A):
            fastest = float(np.abs(np.linalg.eigvals(np.asarray(table.A, float)).imag).max())
            if fastest >= math.pi / table.period:
                yield (
                    f"controllers.{name}.A: found a pole of {fastest / (2 * math.pi):.4g} Hz, not below "
                    f"{0.5 / table.period:g} Hz, half the frequency of its samples (period {table.period:g} s), which "
                    "do not show it; shorten the period, or reduce the model"
                )
        if not isinstance(table, LowPass | Notch):
            continue
        sources = [_source(case, signal) for signal in table.inputs]
        period = max(
            (source_table.period or 0.0 for source_table in (table, *sources) if source_table is not None), default=0.0
        )
        if period and table.frequency >= 0.5 / period:
            yield (
                f"controllers.{name}.frequency: found {table.frequency:g} Hz, not below {0.5 / period:g} Hz, half the "
                f"frequency of its samples (period {period:g} s), which hold nothing above that; lower the frequency "
                "or shorten the period"
            )


def _gain_warnings(case: Case) -> Iterator[str]:
    """Pairs of an error and a rate of a feedback that do not match."""
    for name, table in case.effectors["controllers"].items():
        if isinstance(table, Pd | Pid):
            error_source, rate_source = (_source(case, table.inputs[k]) for k in (0, len(table.inputs) // 2))
            orders = [
                DERIVATIVES.get(sensor.kind) for sensor in (error_source, rate_source) if isinstance(sensor, Sensor)
            ]
            if len(table.inputs) > 1 and len(orders) == 2 and None not in orders and orders[0] >= orders[1]:  # type: ignore[operator]
                yield (
                    f"controllers.{name}.inputs: found the error {table.inputs[0]!r} of a sensor of kind "
                    f"{error_source.kind!r}, and the rate {table.inputs[len(table.inputs) // 2]!r} of kind "
                    f"{rate_source.kind!r}, which is not its rate; errors come first, then as many rates"
                )
        elif isinstance(table, AttitudeFeedback):
            error, rate = (_source(case, signal) for signal in (table.error, table.rate))
            if isinstance(error, Sensor) and isinstance(rate, Sensor):
                if error.body != rate.body:
                    yield (
                        f"controllers.{name}: its error is measured on body {error.body!r}, and its rate on body "
                        f"{rate.body!r}; the law takes both in the same axes"
                    )


def _level_warnings(case: Case) -> Iterator[str]:
    """Commanded levels of thrusters outside 0 to 1."""
    for name, jet in case.effectors["thrusters"].items():
        signal = case.effectors["signals"].get((getattr(jet, "command", None) or "").partition(".")[0])
        if not isinstance(jet, Thruster) or not isinstance(signal, Signal) or jet.switched:
            continue
        smallest, largest = min(signal.values), max(signal.values)
        if smallest < 0.0 or largest > 1.0:
            yield (
                f"thrusters.{name}.command: signal {jet.command!r} runs from {smallest:g} to {largest:g}; a level lies "
                "between 0 and 1 and is cut off there, so give parts of the full thrust"
            )


def _internal_force_warnings(case: Case) -> Iterator[str]:
    """Cables and separation springs between two markers of one rigid body."""
    for kind, tables in case.effectors.items():
        for name, table in tables.items():
            if (
                isinstance(table, MarkerPair)
                and table.body == table.parent
                and isinstance(case.bodies.get(table.body), RigidTable)
            ):
                yield (
                    f"{kind}.{name}: both its ends are on the rigid body {table.body!r}, whose motion it does not "
                    "change; name another parent"
                )


def _source(case: Case, signal: str) -> Any:
    """The sensor or controller that gives a signal, or None."""
    name = signal.partition(".")[0]
    return case.effectors["sensors"].get(name) or case.effectors["controllers"].get(name)
