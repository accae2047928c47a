"""Curves for plots: components of a run's channels, in readable units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_simpson, cumulative_trapezoid

from femflex.arrays import Array
from femflex.results import Run
from femflex.rotations import continued_angles
from femflex.view.segments import body_names, body_of_marker
from femflex.view.units import RPM, length_unit

DEGREES = 180.0 / np.pi
SPEED = r"effectors/[^/]+/speed"  # channels of wheels, shown in rpm
OVER = " over "  # between two channels: the first divided by the second
BALANCE = "energy minus work"  # a curve of its own, see `balance_of`
POWERS = {  # channels of power and the sign with which each feeds the energy
    "monitors/supplied": 1.0,
    "monitors/drive_power": 1.0,
    "monitors/variation_power": 1.0,
    "monitors/dissipation": -1.0,
}
STEADY = 1e-4  # of its size: a curve that changes less is shown from its first value
CONSTANT = 1e-12  # of its size: a curve that changes less is shown as a constant, not as rounding
FLAT = 0.05  # of the largest range on the same axes: angles that move by less get axes of their own
STILL = 1e-6  # of that range: an angle that does not move
APART = 0.6 * np.pi  # angle between two rows up to which the direction of the turn is known
NEGLIGIBLE = 1e-3  # less than a line's width of the largest on the same axes: a curve that is shown on request only
ROUNDED = 1e-8  # of the largest on the same axes: zero to rounding, shown only if its component is named


@dataclass(frozen=True, eq=False)
class Curve:
    """One component over time: label, values (n_t,) and unit; `quantity` is the name of the ordinate.

    time (n_t,) [s]; second: whether it belongs to the second of two runs in one plot; named: its component was
    requested; channel: of which it is a component;  magnitude: of the terms of which it is the sum, as reference of
    rounding
    """

    label: str
    values: Array
    unit: str
    quantity: str
    time: Array
    second: bool = False
    named: bool = False
    channel: str = ""
    magnitude: float = 0.0

    @property
    def source(self) -> tuple[str, bool]:
        """The channel, and whether it is the second run's."""
        return self.channel, self.second

    @property
    def axes(self) -> tuple[str, str]:
        """Key of the axes of the curve: one unit, and lengths and angles only of one quantity."""
        return (self.quantity if self.unit in ("m", "rad") else "", self.unit)


def curves_of(
    run: Run,
    channels: Sequence[str] | None = None,
    degrees: bool = True,
    second_run: Run | None = None,
    least: float = NEGLIGIBLE,
) -> list[list[Curve]]:
    """Curves of channels in readable units, those on one pair of axes together; without channels, a default selection.

    A channel is a path ("attitude/angles"), or a path and a component by name or by number from 1
    ("attitude/angles:pitch", "q:1"), or "energy minus work". "A over B" is channel A divided by channel B of one
    component, such as a deflection over a deployed length. Raises KeyError for one that the run does not have.
    The curves of a second run follow those of the first, marked `second`. Components smaller than `least` times the
    largest of their channel are left out, unless they are requested by name or number.
    """
    selected = default_channels(run) if channels is None else list(channels)
    curves = [curve for channel in selected for curve in _curves(run, channel)]
    if second_run is not None:
        for channel in selected:
            if channels is not None or channel == BALANCE or channel in second_run:
                curves += [replace(curve, second=True) for curve in _curves(second_run, channel)]
    if not curves:
        raise ValueError("the list of channels to plot is empty; name some, or give no list for the default ones")
    keys, limit = dict.fromkeys(curve.axes for curve in curves), NEGLIGIBLE if channels is None else ROUNDED
    groups = [subgroup for key in keys for subgroup in split_by_range([curve for curve in curves if curve.axes == key])]
    return [_relative_to_start(_in_readable_units(_noticeable(group, limit, least), degrees)) for group in groups]


def split_by_range(group: list[Curve]) -> list[list[Curve]]:
    """Angles of one pair of axes on several, where some vary so much less than others that they would look constant.

    Constant ones stay with the largest; curves of a second run go with those of the same name.
    """
    of_first_run = [curve for curve in group if not curve.second] or group
    ranges = {curve.label: float(np.ptp(curve.values)) if len(curve.values) else 0.0 for curve in of_first_run}
    if group[0].unit != "rad" or len(ranges) < 2:
        return [group]
    largest = max(ranges.values())
    subgroups: list[list[str]] = []
    top = np.inf
    for label in sorted(ranges, key=lambda label: -ranges[label]):
        is_constant = ranges[label] <= STILL * largest
        if not subgroups or (ranges[label] < FLAT * top and not is_constant):
            subgroups.append([])
            top = ranges[label]
        subgroups[0 if is_constant else -1].append(label)
    return [[curve for curve in group if curve.label in labels] for labels in subgroups]


def default_channels(run: Run) -> list[str]:
    """Attitude angles, the largest marker deflection of each body, and energy minus work."""
    selected = [path for path in ("attitude/angles",) if path in run]
    largest: dict[str, tuple[float, str]] = {}
    bodies = body_names(run)
    for path in run:
        if path.startswith("markers/") and path.endswith("/deflection"):
            body, size = body_of_marker(path.split("/")[1], bodies), float(np.abs(run[path]).max(initial=0.0))
            if size > largest.get(body, (0.0, ""))[0]:
                largest[body] = (size, path)
    selected += [path for _, path in largest.values()]
    return selected + ([BALANCE] if has_balance(run) else []) or list(run)[:1]


def _curves(run: Run, channel: str) -> list[Curve]:
    if channel == BALANCE:
        return [balance_of(run)]
    above, _, below = channel.partition(OVER)
    if below:
        return _ratio_curves(_curves(run, above), _curves(run, below), below)
    path, _, component = channel.partition(":")
    if not len(run):
        raise ValueError(f"{run.path} holds no instants, so there is nothing to plot")
    values = run[path].reshape(len(run), -1)
    if path == "attitude/angles":
        values = continuous_angles(values, run.names(path))
    count, units, quantity = values.shape[1], run.units(path), path.split("/")[-1]
    names = run.names(path) or (("",) if count == 1 else tuple(str(k + 1) for k in range(count)))
    columns = [_component(path, names, component)] if component else list(range(count))
    if len(columns) == 3 and set(names) == {"x", "y", "z"}:  # of angles the channel has the order of their sequence
        columns.sort(key=names.__getitem__)
    owner = path.split("/")[1] if path.count("/") > 1 else ""
    summed = path == "monitors/energy" and "monitors/kinetic" in run
    magnitude = float(np.abs(run["monitors/kinetic"]).max(initial=0.0)) if summed else 0.0
    ordinate = {"angles": "attitude", "q": "coordinate", "u": "velocity"}.get(quantity, quantity)
    curves = []
    for k in columns:
        label = f"{owner} {names[k % len(names)]}".strip() or quantity
        curve = Curve(label, values[:, k], units[k % len(units)], ordinate, run.time, named=bool(component))
        curves.append(replace(curve, channel=path, magnitude=magnitude))
    return curves


def _ratio_curves(above: list[Curve], below: list[Curve], channel: str) -> list[Curve]:
    """The curves divided by that of another channel; 0 where both are 0. Raises ValueError if that has several."""
    if len(below) != 1:
        raise ValueError(f"{channel!r} has {len(below)} components; name one to divide by, such as {channel + ':1'!r}")
    (by,) = below
    return [
        replace(
            curve,
            label=f"{curve.label}{OVER}{by.label}",
            values=np.divide(curve.values, by.values, out=np.zeros(len(by.values)), where=by.values != 0),
            unit="1" if curve.unit == by.unit else f"{curve.unit}/({by.unit})",
            quantity=f"{curve.quantity}{OVER}{by.quantity}",
            channel=f"{curve.channel}{OVER}{by.channel}",
            magnitude=0.0,
        )
        for curve in above
    ]


def continuous_angles(angles: Array, names: tuple[str, ...]) -> Array:
    """Angles (n_t, 3) continued beyond half a turn, the middle one beyond a quarter [rad].

    They are unchanged where rows are too far apart to determine the direction of the turn.
    """
    symmetric = names[0][0] == names[2][0]  # x1, z2, x3
    for continued in (continued_angles(angles, symmetric), np.unwrap(angles, axis=0)):
        is_continuous = np.abs(np.diff(continued, axis=0)).max(axis=0, initial=0.0) < APART
        if is_continuous.all():
            return continued
    return np.where(is_continuous, continued, angles)


def _component(path: str, names: tuple[str, ...], component: str) -> int:
    if component in names:
        return names.index(component)
    if component.isdigit() and 1 <= int(component) <= len(names):
        return int(component) - 1
    raise KeyError(f"{component!r} is not a component of {path!r}; its components are {list(names)}")


def has_balance(run: Run) -> bool:
    """Whether energy minus work is constant: it is not where a specified orbit supplies or absorbs energy.

    A specified orbit that is not circular does so, and the force that holds O on it against loads too.
    """
    if "monitors/jacobi" not in run:
        return "monitors/energy" in run
    radius = run["orbit/radius"]
    return "monitors/supplied" not in run and bool(np.ptp(radius) < 1e-9 * radius[0])


def balance_of(run: Run) -> Curve:
    """Change of energy since its first value, minus the work since then [J]; the remainder is error.

    The energy is that of monitors/energy, or monitors/jacobi on a specified orbit. The work is that of loads,
    effectors, specified motions and varying bodies, minus what is dissipated and what latches lose: the integral of
    their powers over the rows of the run (Simpson's rule). Rows that are far apart, or a power that jumps between
    two rows, increase the remainder.
    """
    has_jacobi = "monitors/jacobi" in run
    E = run["monitors/jacobi" if has_jacobi else "monitors/energy"]
    power = sum((sign * run[path] for path, sign in POWERS.items() if path in run), np.zeros(len(run)))
    latches = [run[path] for path in run if path.startswith("latches/") and path.endswith("/loss")]
    balance = E - E[0] - work_of(run, power) + sum(latches, np.zeros(len(run)))
    return Curve("Jacobi integral" if has_jacobi else "energy", balance, "J", BALANCE, run.time)


def work_of(run: Run, power: Array) -> Array:
    """Work (n_t,) [J] since the start of a power (n_t,) [W] at the rows of a run, by Simpson's rule."""
    if len(run) < 3:
        return np.asarray(cumulative_trapezoid(power, x=run.time, initial=0))
    return np.asarray(cumulative_simpson(power, x=run.time, initial=0.0))


def _relative_to_start(group: list[Curve]) -> list[Curve]:
    """The curves relative to their first values if they hardly change, as an energy does."""
    moves = [(np.ptp(curve.values), max(np.abs(curve.values).max(), curve.magnitude)) for curve in group]
    if not all(0 < move < STEADY * size for move, size in moves):
        return group
    if all(move < CONSTANT * size for move, size in moves):
        return [
            replace(
                curve,
                values=np.full_like(curve.values, curve.values[0] if abs(curve.values[0]) > CONSTANT * size else 0.0),
                label=f"{curve.label}\nconstant within {move:.1g} {curve.unit}",
            )
            for curve, (move, size) in zip(group, moves, strict=True)
        ]
    return [
        replace(
            curve,
            values=curve.values - curve.values[0],
            label=f"{curve.label}\nfrom {curve.values[0]:.6g}",
            quantity=f"change of {curve.quantity}",
        )
        for curve in group
    ]


def _size(group: list[Curve]) -> float:
    return max(float(np.abs(curve.values[np.isfinite(curve.values)]).max(initial=0.0)) for curve in group)


def _noticeable(group: list[Curve], limit: float, least: float) -> list[Curve]:
    """The curves above `limit` of the largest and `least` of their channel's largest, and those requested by name."""
    largest = {key: _size([curve for curve in group if curve.source == key]) for key in {c.source for c in group}}
    threshold = limit * _size(group)
    limits = {key: max(threshold, least * size) for key, size in largest.items()}
    visible = {curve.label for curve in group if curve.named or _size([curve]) >= limits[curve.source]}
    return [curve for curve in group if curve.label in visible]


def _in_readable_units(group: list[Curve], degrees: bool) -> list[Curve]:
    """The curves with lengths in one unit that suits the first run's largest; on request angles in degrees, wheel
    speeds in rpm."""
    unit, factor, largest = group[0].unit, 1.0, _size([curve for curve in group if not curve.second] or group)
    if unit == "m" and largest > 0:
        factor, unit = length_unit(largest)
    elif degrees and all(re.fullmatch(SPEED, curve.channel) for curve in group):
        factor, unit = RPM, "rpm"
    elif degrees and unit in ("rad", "rad/s"):
        factor, unit = DEGREES, unit.replace("rad", "deg")
    return [replace(curve, values=curve.values * factor, unit=unit) for curve in group]
