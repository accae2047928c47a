"""Watching what linear strain leaves out: how far spin would stiffen a body."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.rotations import dcm_from_quaternion
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.body import Foreshortening
    from femflex.dynamics import Model
    from femflex.system import System

Array = NDArray[np.float64]

STIFFENED = 0.02  # of the first frequency: stiffening by spin from which its lack is told


@dataclass(frozen=True)
class Pull:
    """What pulls at a place of a body whose foreshortening there is theta (3,): a body and all that hangs on it.

    sign: 1, or -1 where it is the joint that holds them against it.
    """

    theta: Array
    body: str
    sign: float


class Stiffening:
    """Watches how far spin would stiffen bodies with linear strain, row by row, and warns of it.

    Counted is the centripetal inertia of each body and of all that hangs on it, at the body's rate.
    """

    def __init__(self, model: Model) -> None:
        self._system = system = model.system
        self._bodies = {name: body.ignored for name, body in system.bodies.items() if body.ignored is not None}
        self._pulls = {name: pulls(system, name, ignored) for name, ignored in self._bodies.items()}
        root = system.joint_of(system.root)
        self._free = system.orbit is not None or len(root.translations) == 3
        self._worst: dict[str, tuple[float, float]] = {}

    def watch(self, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows."""
        if not self._bodies:
            return
        turned = {name: dcm_from_quaternion(channels[f"bodies/{name}/attitude"]) for name in self._system.order}
        places = {name: channels[f"bodies/{name}/position"] for name in self._system.order}
        origin = channels["monitors/center_of_mass"] if self._free else np.zeros(3)
        pushed = {  # m times the way from the centre of the turn to the centre of mass
            name: body.moments.mass * (places[name] + turned[name] @ body.moments.center_of_mass() - origin)
            for name, body in self._system.bodies.items()
        }
        for name in reversed(self._system.order):  # and of all that hangs on each
            if (parent := self._system.joint_of(name).parent) is not None:
                pushed[parent] = pushed[parent] + pushed[name]
        for name, ignored in self._bodies.items():
            omega, C = channels[f"bodies/{name}/rate"], np.swapaxes(turned[name], 1, 2)
            W = omega[:, :, None] * omega[:, None, :] - np.einsum("ta,ta,bc->tbc", omega, omega, np.eye(3))
            arm = np.einsum("tab,tb->ta", C, places[name] - origin)
            gain = np.einsum("tab,tb,a->t", W, arm, ignored.mass[0]) + np.einsum("tab,ab->t", W, ignored.mass[1:])
            for pull in self._pulls[name]:
                force = -np.einsum("tab,tbc,tc->ta", W, C, pushed[pull.body])
                gain -= pull.sign * force @ pull.theta
            k = int(np.argmax(gain))
            seen = float(gain[k]), float(np.linalg.norm(omega[k]))
            self._worst[name] = max(self._worst.get(name, (0.0, 0.0)), seen)

    def warn(self) -> None:
        """Warn of bodies whose first frequency spin would have raised by more than STIFFENED, with both numbers."""
        cut = {piece: whole for whole, pieces in self._system.segments.items() for piece in pieces}
        worst: dict[str, tuple[float, float, str]] = {}
        for name, (gain, spin) in self._worst.items():
            whole = cut.get(name, name)
            worst[whole] = max(worst.get(whole, (0.0, 0.0, "")), (gain, spin, name))
        for whole, (gain, spin, name) in worst.items():
            raised = float(np.sqrt(1.0 + max(gain, 0.0)) - 1.0)
            if raised > STIFFENED:
                text = self._of_segment(whole, name) if whole in self._system.segments else self._of_body(name, raised)
                warnings.warn(
                    f"body {whole!r} turned at up to {spin:.4g} rad/s: a stiffening of {raised:.0%} of {text}",
                    PhysicsWarning,
                    stacklevel=2,
                )

    def _of_body(self, name: str, raised: float) -> str:
        omega = self._system.bodies[name].omega
        known = omega[np.isfinite(omega)] / (2 * np.pi)
        told = f" ({known.min():.4g} Hz, not {known.min() * (1 + raised):.4g} Hz)" if len(known) else ""
        return f"its first frequency{told} is ignored by linear strain. Give it strain = 'condensed'."

    def _of_segment(self, whole: str, name: str) -> str:
        count = len(self._system.segments[whole])
        return (
            f"the first shape of its segment {name!r} is ignored by linear strain within segments, over "
            f"{STIFFENED:.0%}. Cut it into more than {count} segments, or give it strain = 'condensed'."
        )


def pulls(system: System, name: str, ignored: Foreshortening) -> list[Pull]:
    """What pulls at a body where its foreshortening is known: what hangs on it, and the joint it hangs by."""
    hung = [(joint.parent_marker, joint.child, 1.0) for joint in system.joints if joint.parent == name]
    hung.append((system.joint_of(name).child_marker, name, -1.0))
    return [Pull(ignored.at[marker], body, sign) for marker, body, sign in hung if marker in ignored.at]
