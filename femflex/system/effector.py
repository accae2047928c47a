"""Effectors: forces at markers and along joints that a function computes, with states of their own.

THE SOCKET. An Effector names markers, slides or turns of joints, states, channels and constants, and holds a function

    act(seen, out)

that the compiled model calls at every evaluation. It reads `seen`, writes into the arrays of `out` (zero beforehand),
and returns nothing:

    seen.time        time [s]
    seen.position    (n_markers, 3) place of each marker from the inertial origin, or from O in orbit [m]
    seen.attitude    (n_markers, 3, 3) C_NM, marker components to inertial ones
    seen.velocity    (n_markers, 3) its velocity [m/s]         seen.rate  (n_markers, 3) its angular rate [rad/s]
    seen.coordinate  (n_freedoms,) coordinate of each slide or turn [m, rad]      seen.speed  (n_freedoms,) its rate
    seen.input       (n_inputs,) states and channels of others
    seen.z           (n_states,) its own states                seen.parameters  (n_parameters,) its constants
    out.force        (n_markers, 3) force on the marker's body [N]     out.torque  (n_markers, 3) torque [N m]
    out.effort       (n_freedoms,) force or torque along each slide or turn [N, N m]
    out.zdot         (n_states,) rates of its states           out.channel  (n_channels,) what it reports
    out.energy, out.dissipation, out.supplied, out.mass_flow   (1,) each: stored energy [J]; power lost for good [W];
                     power brought in from outside the model [W]; mass that leaves the craft [kg/s]

Vectors are in inertial components. The function is one that Numba can compile, or has compiled. An exception and a
value that is not finite stop the run, which then names the effector. Compiled code does not check indices; so the
function is also called once as plain Python at the initial state, and an index outside its arrays is refused there. It
is smooth between `breaks` and events. What it gives to the motion,
F.v + T.omega + effort speed, should be supplied - dissipation - d(energy)/dt; then the balance of energies closes.

In place of a function `act` may be one of compiled code (femflex.kernels.entries.Entry), as the effectors of femflex
have it: femflex.effectors.

Order of evaluation: an effector whose input is a channel of another is evaluated after that one, the others in the
order given. Inputs that are states need no order. Effectors that wait for each other's channels give an error.

An effector with the channels momentum_x, momentum_y, momentum_z holds angular momentum (inertial components); it counts
to the craft's.

Mass that leaves is reported. The moments of the body that it leaves follow from a Variation of the body by the state
that holds the mass, where it matters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from femflex.arrays import Array

Act = Callable[[Any, Any], None]


class CompiledAct(Protocol):
    """A function of compiled code, called by its address."""

    @property
    def address(self) -> int:
        """Return its address in this process."""


ACCOUNTS = {  # what an effector may report of energy and mass
    "energy": ("J", "stored energy"),
    "dissipation": ("W", "power lost for good"),
    "supplied": ("W", "power brought in from outside the model"),
    "mass_flow": ("kg/s", "mass that leaves the craft"),
}

EXERTED = ("force", "torque", "effort")  # what it may do at markers, and along translations and rotations


@dataclass(frozen=True, eq=False)
class StateEvent:
    """An instant at which an effector's states jump.

    value   (t, z) -> number, positive before the event, zero when it happens, positive again once it has happened
    apply   (t, z) -> new states z (n_states,)
    """

    name: str
    value: Callable[[float, Array], float]
    apply: Callable[[float, Array], Array]


@dataclass(frozen=True, eq=False)
class Effector:
    """Element that acts at markers and along joints (see this module).

    markers     (body, marker) of each
    freedoms    names of translations and rotations, as in "hinge.angle"
    states      name -> unit; the full name of a state is "<effector>.<state>"
    z0          (n_states,) their initial values
    sizes       (n_states,) their usual sizes, in which the integrator's absolute tolerance counts
    inputs      full names of states of other effectors and controllers, or of channels of other effectors
    channels    name -> unit of what it reports in addition to forces and states
    accounts    which of energy, dissipation, supplied and mass_flow it writes
    exerts      which of force, torque and effort it may write; the others are zero, and are not reported
    zeros       channels that stay zero with these parameters, and are not reported
    strained    (body, group) in which it induces strain (`femflex.body.InducedStrain`), of n_strains amplitudes: the
    n_strains   first channels are these, patch by patch, then come their rates; neither is reported. The model adds the
                energy of this strain, and the power that its change supplies, to what the function accounts for
    parameters  (n,) constants
    jacobian    (seen, J) -> None: J (n_states, n_states) = d zdot / d z for implicit integrators; None: by differences
    events      instants at which its states jump
    breaks      (n,) times at which it is not smooth [s]
    starts      channel -> (state, value): the state starts so that the channel has this value, unless System.z0 says
                where it starts; channels are linear in these states
    kind        its name in messages, such as "wheel"
    settles     whether its states start where they do not change, unless System.z0 says where they start
    conserves   whether what it exerts leaves the momentum of the whole craft as it is
    apart       distance that its two markers keep at least at the start, as its force needs a direction [m]
    coasting    (name, states (n_states,)) -> the same with constant momentum, for steady states
    added_mass  function of compiled code with the arguments of `act` that writes a symmetric matrix (n_markers, 6, 6),
                inertial components: the wrench -M (a, alpha) at each marker resists its acceleration and joins the mass
                matrix. It reads positions, attitudes, velocities and parameters alone
    body_mass   (6 + n, 6 + n) constant mass of the body of its first marker, which does not bend: over accelerations of
                this marker along its axes, translations before rotations, and of the body's n coordinates
    linear      (effector) -> the same as linear models and states of rest have it: steady, linear in velocities
    linear_note what these leave out of it; "" for nothing
    silent      () -> the same without its command or output
    """

    name: str
    act: Act | CompiledAct
    markers: tuple[tuple[str, str], ...] = ()
    freedoms: tuple[str, ...] = ()
    states: Mapping[str, str] = field(default_factory=dict)
    z0: Array = field(default_factory=lambda: np.zeros(0))
    sizes: Array = field(default_factory=lambda: np.zeros(0))
    inputs: tuple[str, ...] = ()
    channels: Mapping[str, str] = field(default_factory=dict)
    accounts: tuple[str, ...] = ()
    exerts: tuple[str, ...] = EXERTED
    zeros: tuple[str, ...] = ()
    strained: tuple[str, str] | None = None
    n_strains: int = 0
    parameters: Array = field(default_factory=lambda: np.zeros(0))
    jacobian: Act | CompiledAct | None = None
    events: tuple[StateEvent, ...] = ()
    breaks: Array = field(default_factory=lambda: np.zeros(0))
    starts: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    kind: str = "effector"
    settles: bool = False
    conserves: bool = False
    apart: float = 0.0
    coasting: Callable[[str, Array], Effector] | None = None
    silent: Callable[[], Effector] | None = None
    added_mass: CompiledAct | None = None
    body_mass: Array | None = None
    linear: Callable[[Effector], Effector] | None = None
    linear_note: str = ""

    def __post_init__(self) -> None:
        if not (callable(self.act) or hasattr(type(self.act), "address")):
            raise ValueError(
                f"act of effector {self.name!r} is {self.act!r}; give a function (seen, out), or use an effector of "
                "femflex.effectors"
            )
        n = len(self.states)
        for key, default in (("z0", 0.0), ("sizes", 1.0)):
            value = np.asarray(getattr(self, key), float)
            object.__setattr__(
                self, key, _checked(self.name, key, np.full(n, default) if value.size == 0 else value, n)
            )
        for key in ("parameters", "breaks"):
            value = np.atleast_1d(np.asarray(getattr(self, key), float))
            object.__setattr__(self, key, _checked(self.name, key, value, value.size))
        if not np.all(self.sizes > 0.0):
            raise ValueError(f"sizes of effector {self.name!r} are {self.sizes.tolist()}; they must be positive")
        if unknown := [key for key in self.accounts if key not in ACCOUNTS]:
            raise ValueError(f"effector {self.name!r} accounts for {unknown[0]!r}; known are {list(ACCOUNTS)}")
        if unknown := [key for key in self.exerts if key not in EXERTED]:
            raise ValueError(f"effector {self.name!r} exerts {unknown[0]!r}; known are {list(EXERTED)}")
        for channel, (state, _) in self.starts.items():
            if channel not in self.channels or state not in self.states:
                raise ValueError(
                    f"effector {self.name!r} is to start with channel {channel!r} by its state {state!r}; it has the "
                    f"channels {list(self.channels)} and the states {list(self.states)}"
                )
        for key in ("states", "channels"):
            if clash := [name for name in getattr(self, key) if name in reserved_names(self, key)]:
                raise ValueError(f"effector {self.name!r} has two outputs named {clash[0]!r}; rename one")

    @property
    def adds_mass(self) -> bool:
        """Whether it adds to the mass matrix of bodies."""
        return self.added_mass is not None or self.body_mass is not None

    @property
    def acts(self) -> bool:
        """Whether it can do work on the motion."""
        at_markers = bool(self.markers) and ("force" in self.exerts or "torque" in self.exerts)
        return at_markers or (bool(self.freedoms) and "effort" in self.exerts) or self.strained is not None

    def state_names(self) -> list[tuple[str, str]]:
        """Full name and unit of each state."""
        return [(f"{self.name}.{state}", unit) for state, unit in self.states.items()]

    def initial_states(self) -> Array:
        """Initial values of its states (n_states,)."""
        return self.z0


def reserved_names(effector: Effector, key: str) -> set[str]:
    """Names under which an effector reports other things than its states, or than its channels."""
    reserved = {"power", *ACCOUNTS}
    reserved |= {"force", "torque"} if effector.markers else set()
    reserved |= {"effort"} if effector.freedoms else set()
    return reserved if key == "states" else reserved | set(effector.states)


def _checked(name: str, key: str, value: Array, n: int) -> Array:
    if value.shape != (n,) or not np.all(np.isfinite(value)):
        shown = np.array2string(value, threshold=12, edgeitems=3, separator=", ")
        raise ValueError(f"{key} of effector {name!r} is {shown}; expected {n} finite numbers, one per state")
    return value
