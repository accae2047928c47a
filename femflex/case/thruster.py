"""[thrusters.<name>] and [tanks.<name>]."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import StrictBool, model_validator

from femflex.case.wheel import MountedTable
from femflex.noun.table import Table, refuse
from femflex.noun.values import Direction, Duration, Mass, Quantity, Time, Whole


class PulseTrainTable(Table):
    """Equal pulses at equal intervals."""

    start: Time = 0.0
    """Start of the first pulse."""
    period: Duration
    """Time from the start of a pulse to that of the next."""
    width: Duration
    """Duration of each pulse."""
    count: Whole
    """Number of pulses."""


class ProfileTable(Table):
    """Level of a thruster over time."""

    times: Annotated[tuple[float, ...], Quantity("s", (None,))]
    """Times, rising; each level holds until the next time. Before the first the thruster is off."""
    levels: tuple[Annotated[float, Quantity(least=0.0, most=1.0)], ...]
    """Level from each time on, from 0 to 1."""


class ThrusterTable(MountedTable):
    """A thruster that turns with its marker."""

    thrust: Annotated[float, Quantity("N", above=0.0)]
    """Thrust at full level."""
    axis: Direction = (1.0, 0.0, 0.0)
    """Direction of the force on the body, in the marker's axes."""
    misalignment: Annotated[tuple[float, float, float], Quantity("rad", (3,))] = (0.0, 0.0, 0.0)
    """Rotation vector that turns the axis."""
    pulses: Annotated[tuple[tuple[float, float], ...] | None, Quantity("s", (None, 2))] = None
    """Start and duration of each pulse at full thrust."""
    train: PulseTrainTable | None = None
    """Equal pulses, in place of pulses."""
    profile: ProfileTable | None = None
    """Levels over time, in place of pulses."""
    command: str | None = None
    """Signal of the level from 0 to 1, in place of pulses."""
    switched: StrictBool = False
    """On-off: full thrust while the command is above 0.5, else none."""
    lag: Annotated[float, Quantity("s", least=0.0)] = 0.0
    """Time constant with which the thrust follows its level."""
    minimum_on: Annotated[float, Quantity("s", least=0.0)] = 0.0
    """Shortest pulse; shorter ones give an error. Of commanded thrusters the controller of kind "pulses" keeps it."""
    specific_impulse: Duration | None = None
    """Specific impulse; mass leaves at thrust / (9.80665 m/s^2 specific_impulse). Default: no mass leaves."""
    tank: str | None = None
    """Tank that the mass is taken from. Default: the craft's mass stays."""

    @model_validator(mode="after")
    def _one_command(self) -> ThrusterTable:
        keys = ("pulses", "train", "profile", "command")
        present = [key for key in keys if getattr(self, key) is not None]
        if len(present) != 1:
            keys_text = ", ".join(keys)
            refuse(f"found {' and '.join(present) or f'none of {keys_text}'}; give one of {keys_text}")
        if self.tank is not None and self.specific_impulse is None:
            refuse(f"found tank {self.tank!r} without specific_impulse; give it")
        if self.switched and self.command is None:
            refuse("found switched without command; pulses are on-off already, so drop it")
        return self


class TankTable(MountedTable):
    """Propellant at a marker; when it is spent the thrust ends."""

    propellant: Mass
    """Mass of propellant at t = 0."""
    mass_in_body: Literal["contained", "added"]
    """contained: the body's mass holds the full tank; added: the propellant is added to it at the marker. `run` prints
    what was done."""
    gyration: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Radius of gyration of the propellant about its own centre, for every axis."""
