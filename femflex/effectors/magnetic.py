"""Magnetic torques m x B: torque rods, residual dipoles, and eddy currents."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors.noun import Mounted, NumberOrSignal, unit_direction
from femflex.effectors.surroundings.magnetic_field import MagneticField
from femflex.kernels.vectors import cross, dot, load3, load9, scale, store3, turn
from femflex.noun.problems import suggestion_text
from femflex.noun.values import Direction, Quantity, Vector
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

Dipole = Annotated[float, Quantity("A m^2", above=0.0)]


class Magnetic(Mounted):
    """An element with a magnetic torque."""

    field: str = "field"
    """The magnetic field, a name in [surroundings]."""

    exerts = ("torque",)

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError where the field does not exist."""
        if not isinstance(context.nouns.get(self.field), MagneticField):
            known = [key for key, noun in context.nouns.items() if isinstance(noun, MagneticField)]
            raise ValueError(
                f"found field {self.field!r}, which is no magnetic field in [surroundings]; "
                f"{suggestion_text(self.field, known)}"
            )
        inputs = (*(f"{self.field}.{axis}" for axis in "xyz"), *self.commands())
        return replace(super().effector(name, context), inputs=inputs)

    def commands(self) -> tuple[str, ...]:
        """Inputs in addition to the field."""
        return ()


class TorqueRod(Magnetic, heading="torque_rods"):
    """A coil or rod whose magnetic moment is commanded.

    Channels: moment, within the limit of the rod.
    """

    axis: Direction = (0.0, 0.0, 1.0)
    """Direction of its moment, in the marker's axes."""
    command: Annotated[float | str, NumberOrSignal("A m^2")] = 0.0
    """Moment: a number, or the name of a signal [A m^2]."""
    max_moment: Dipole | None = None
    """Largest moment either way. Default: no limit."""

    channels = {"moment": "A m^2"}
    accounts = ("supplied",)
    derived = ("constant", "takes_signal")

    def commands(self) -> tuple[str, ...]:
        """The command, where it is a signal."""
        return (self.command,) if isinstance(self.command, str) else ()

    def numbers(self) -> dict[str, ArrayLike]:
        """Its fields, with the unit axis, and its command."""
        constant, is_signal = (0.0, 1.0) if isinstance(self.command, str) else (self.command, 0.0)
        axis = unit_direction(self.label, "axis", self.axis)
        return super().numbers() | {"axis": axis, "constant": constant, "takes_signal": is_signal}


class MagneticDipole(Magnetic, heading="dipoles"):
    """A constant magnetic moment, such as the residual moment of a craft."""

    moment: Annotated[Vector, Quantity("A m^2", (3,))]
    """Moment in the marker's axes."""

    label = "dipole"
    accounts = ("supplied",)


class EddyCurrents(Magnetic, heading="eddy_currents"):
    """Currents in a conductor that turns in the field: the torque k ((omega - omega_field) x B) x B, which damps.

    omega_field, the rate of the field along the orbit, is left out: the torque is that against inertial rates.
    """

    coefficient: Annotated[float, Quantity("N m s/(rad T^2)", above=0.0)]
    """k; of a thin spherical shell of radius r, wall h and conductivity sigma it is 2 pi/3 sigma r^4 h."""

    label = "eddy currents"
    accounts = ("dissipation",)


P, IN, OUT = TorqueRod.places()


@TorqueRod.kernel
def torque_rod(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: the field, and the command."""
    p = parameters
    moment = p[P.constant] if p[P.takes_signal] == 0.0 else seen[IN.inputs + 3]
    moment = min(max(moment, -p[P.max_moment]), p[P.max_moment])
    m = scale(moment, turn(load9(seen, IN.attitude), load3(p, P.axis)))
    torque = cross(m, load3(seen, IN.inputs))
    store3(out, OUT.torque, torque)
    out[OUT.moment], out[OUT.supplied] = moment, dot(torque, load3(seen, IN.rate))


DP, DIN, DOUT = MagneticDipole.places()


@MagneticDipole.kernel
def magnetic_dipole(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: the field."""
    m = turn(load9(seen, DIN.attitude), load3(parameters, DP.moment))
    torque = cross(m, load3(seen, DIN.inputs))
    store3(out, DOUT.torque, torque)
    out[DOUT.supplied] = dot(torque, load3(seen, DIN.rate))


EP, EIN, EOUT = EddyCurrents.places()


@EddyCurrents.kernel
def eddy_currents(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: the field."""
    B, rate = load3(seen, EIN.inputs), load3(seen, EIN.rate)
    torque = scale(parameters[EP.coefficient], cross(cross(rate, B), B))
    store3(out, EOUT.torque, torque)
    out[EOUT.dissipation] = -dot(torque, rate)
