"""Effectors by short calls, made of the nouns of femflex.effectors."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from femflex import effectors
from femflex.effectors import Cable, Gyro, Sampling, Separation, Signal, Tank, Thruster, Wheel
from femflex.effectors.tank import tank_variation as variation_of_tanks
from femflex.system import Context

WHEEL, _, _ = Wheel.places()


def plain(value):
    """Numbers of numpy as lists."""
    if isinstance(value, (tuple, list)):
        return [plain(entry) for entry in value]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def keys_of(keys):
    return {key: plain(value) for key, value in keys.items() if value is not None}


def reaction_wheel(name, body, inertia, *, torque=None, speed=None, **keys):
    """A wheel on a body whose axial inertia is not the body's."""
    if isinstance(torque, str):
        keys |= {"command": torque}
    elif isinstance(speed, str):
        keys |= {"command": speed, "commanded": "speed"}
    else:
        keys |= {"torque": torque, "speed": speed}
    return Wheel(body=body, inertia=inertia, inertia_in_body="separate", **keys_of(keys)).effector(name)


def wheel_noun(wheel, **keys):
    """The noun of a wheel, to change the body that carries it."""
    (body, marker), p = wheel.markers[0], wheel.parameters
    axis = p[WHEEL.axis : WHEEL.axis + 3].tolist()
    return Wheel(body=body, marker=marker, axis=axis, inertia=float(p[WHEEL.inertia]), **keys)


def without_axial_inertia(body, wheel):
    return wheel_noun(wheel, inertia_in_body="contained").carrier(wheel.name, body)


def with_wheel(body, wheel, mass, transverse_inertia):
    keys = {"mass": mass, "transverse_inertia": transverse_inertia}
    return wheel_noun(wheel, inertia_in_body="added", **keys).carrier(wheel.name, body)


def control_moment_gyro(name, body, momentum, **keys):
    return Gyro(body=body, momentum=momentum, **keys_of(keys)).effector(name)


class Supply(NamedTuple):
    tank: str
    body: str
    marker: str = "origin"
    gyration: float = 0.0


def tank_noun(body, marker, propellant, gyration):
    return Tank(body=body, marker=marker, propellant=propellant, gyration=gyration, mass_in_body="contained")


def thruster(name, body, thrust, *, profile=None, supply=None, **keys):
    """A thruster; profile: times and levels."""
    nouns = {}
    if profile is not None:
        keys |= {"profile": {"times": plain(profile[0]), "levels": plain(profile[1])}}
    if supply is not None:
        keys |= {"tank": supply.tank}
        nouns = {supply.tank: tank_noun(supply.body, supply.marker, 1.0, supply.gyration)}
    return Thruster(body=body, thrust=thrust, **keys_of(keys)).effector(name, Context(nouns))


def tank(name, propellant, thrusters):
    jet = Thruster(body="hub", thrust=1.0, pulses=[[0.0, 1.0]], specific_impulse=1.0, tank=name)
    return tank_noun("hub", "origin", propellant, 0.0).effector(name, Context(dict.fromkeys(thrusters, jet)))


def tank_variation(body, tanks):
    """tanks: name -> (marker, propellant, gyration)."""
    return variation_of_tanks(body, {name: tank_noun("body", *numbers) for name, numbers in tanks.items()})


def marker_pair(ends):
    (parent, parent_marker), (body, marker) = ends
    return {"parent": parent, "parent_marker": parent_marker, "body": body, "marker": marker}


def cable(name, ends, length, EA, damping=0.0):
    return Cable(**marker_pair(ends), length=length, EA=EA, damping=damping).effector(name)


def with_heavy_cable(system, name, ends, length, EA, mass_per_length, masses, places, *, rates=None, damping=0.0):
    keys = {"length": length, "EA": EA, "damping": damping, "mass_per_length": mass_per_length, "masses": masses}
    return effectors.with_heavy_cable(system, name, Cable(**marker_pair(ends), **keys), places, rates)


def separation_spring(name, ends, stiffness, length):
    return Separation(**marker_pair(ends), stiffness=stiffness, length=length).effector(name)


def signal(name, times, values, kind="linear", unit="1"):
    return Signal(times=plain(times), values=plain(values), kind=kind, unit=unit).effector(name)


@dataclass(frozen=True, eq=False)
class Sensor:
    """A sensor by short arguments; `effectors` are those of its noun."""

    name: str
    kind: str
    body: str | None = None
    marker: str = "origin"
    other: tuple[str, str] | None = None
    reference: object = None
    turning: tuple | None = None
    offset: object = None
    bandwidth: float | None = None
    axis: object = None
    aim: object = None
    freedom: str | None = None
    signal: str | None = None
    bias: object = None
    sampling: Sampling | None = None

    @property
    def effectors(self):
        return tuple(self.noun.effectors(self.name))

    @property
    def noun(self):
        keys = {
            key: getattr(self, key) for key in ("reference", "offset", "bandwidth", "axis", "aim", "signal", "bias")
        }
        keys |= {"coordinate": self.freedom, "body": self.body}
        if self.other is not None:
            keys |= {"other_body": self.other[0], "other_marker": self.other[1]}
        if self.turning is not None:
            keys |= {"slew_axis": self.turning[0], "slew_angle": self.turning[1]}
        if self.sampling is not None:
            keys |= {key: getattr(self.sampling, key) for key in ("period", "delay", "noise", "quantum", "seed")}
        outputs = {"pointing": 1, "value": 1, "joint": 2}.get(self.kind, 3)
        if self.bias is not None:
            keys["bias"] = np.broadcast_to(np.asarray(self.bias, float), (3,))[:outputs]
        return effectors.Sensor(kind=self.kind, marker=self.marker, **keys_of(keys))
