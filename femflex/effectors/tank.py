"""Tanks of propellant, from which thrusters draw; their bodies lose the mass that leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments
from femflex.effectors.noun import Mounted
from femflex.noun.values import Mass, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.attached import attached_moments, least_second_moment, with_attached
from femflex.system.effector import Effector, StateEvent
from femflex.system.segments import body_of_part, body_with_marker
from femflex.system.variation import Block, Variation


class Tank(Mounted, heading="tanks"):
    """Propellant at a marker; when it is spent the thrust ends.

    States: mass; feed, 1 while there is propellant; emptied, the time at which it was spent (-1 before).
    """

    propellant: Mass
    """Mass of propellant at t = 0."""
    mass_in_body: Literal["contained", "added"]
    """contained: the body's mass holds the full tank; added: the propellant is added to it at the marker. `run` prints
    what was done."""
    gyration: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Radius of gyration of the propellant about its own centre, for every axis."""

    n_markers = 0
    states = {"mass": "kg", "feed": "1", "emptied": "s"}
    exerts = ()
    derived = ("thrusters",)

    def numbers(self) -> dict[str, Any]:
        """Its fields; the number of thrusters is that of its inputs."""
        return super().numbers() | {"thrusters": 0.0}

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError where no thruster draws from it."""
        users = [key for key, noun in context.nouns.items() if getattr(noun, "tank", None) == name]
        if not users:
            raise ValueError(f"no thruster draws from tank {name!r}; let one draw from it, or leave the tank out")
        own = super().effector(name, context)
        return replace(
            own,
            markers=(),
            z0=np.array([self.propellant, 1.0, -1.0]),
            sizes=np.array([self.propellant, 1.0, 1.0]),
            inputs=tuple(f"{user}.flow" for user in users),
            parameters=np.array([*own.parameters[:-1], float(len(users))]),
            events=(StateEvent("empty", _remaining_mass, _emptied_state),),
        )

    def carrier(self, name: str, body: FlexibleBody) -> FlexibleBody:
        """The body with the propellant, where it is added to it."""
        if self.mass_in_body == "contained":
            return body
        return with_attached(body, self.marker, self.propellant, self.propellant * self.gyration**2 * np.eye(3))

    @classmethod
    def variations(cls, bodies: Mapping[str, Any], nouns: Mapping[str, Any]) -> dict[str, Variation]:
        """The variable mass of every body, or segment, with tanks as these are emptied. Raises ValueError."""
        tanks_of_body: dict[str, dict[str, Tank]] = {}
        carriers: dict[str, FlexibleBody] = {}
        for name, tank in nouns.items():
            key = body_with_marker(bodies, tank.body, tank.marker)
            carriers[key] = body_of_part(bodies[tank.body], tank.marker)
            tanks_of_body.setdefault(key, {})[name] = tank
        return {key: tank_variation(carriers[key], body_tanks) for key, body_tanks in tanks_of_body.items()}

    def note(self, name: str) -> str:
        """A sentence on where the propellant counts."""
        what = "is contained in the mass of" if self.mass_in_body == "contained" else "was added to"
        return f"Propellant of tank {name}, {self.propellant:g} kg, {what} {self.body}."


def _remaining_mass(t: float, z: Array) -> float:
    return float(z[0]) if z[1] > 0.0 else 1.0


def _emptied_state(t: float, z: Array) -> Array:
    return np.array([0.0, 0.0, t])


def tank_variation(body: FlexibleBody, tanks: Mapping[str, Tank]) -> Variation:
    """The variation of a body with the masses in its tanks; the body as it stands has them full.

    Raises ValueError where the body has less mass or inertia than its propellant.
    """
    block = Block(body, ("mass",))
    units = {
        name: attached_moments(body, tank.marker, 1.0, tank.gyration**2 * np.eye(3)) for name, tank in tanks.items()
    }
    dry = body.moments
    for name, tank in tanks.items():
        mass, u = tank.propellant, units[name]
        dry = MassMoments(dry.mass - mass * u.mass, dry.first - mass * u.first, dry.second - mass * u.second)
    if not dry.mass > 0.0:
        raise ValueError(
            f"the tanks {', '.join(tanks)} hold {body.moments.mass - dry.mass:g} kg of propellant, and their body "
            f"has a mass of {body.moments.mass:g} kg; set the propellant as added, or raise the body's mass"
        )
    if (least := least_second_moment(dry)) < 0.0:
        raise ValueError(
            f"the tanks {', '.join(tanks)} leave a second moment int x^2 dm of {least:.4g} kg m^2 along an axis when "
            "they are empty; the "
            "body's inertia does not contain that of the propellant: lower its gyration radius, set the propellant as "
            "added, or raise the body's inertia"
        )
    rows = []
    for moments in (dry, *units.values()):
        row = np.zeros(block.size)
        block.put_moments(row, moments)
        rows.append(row)
    states = tuple(f"{name}.mass" for name in tanks)
    return Variation("tanks", ("mass",), np.concatenate([[-1.0, float(block.size)], *rows]), states=states)


P, IN, OUT = Tank.places()


@Tank.kernel
def tank(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: the flows of its thrusters."""
    flow = 0.0
    for k in range(int(parameters[P.thrusters])):
        flow += seen[IN.inputs + k]
    out[OUT.mass] = -flow * z[1]
