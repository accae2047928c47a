"""What a run is guarded against: motion that has run away, angles near a singularity."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.rotations import dcm_from_quaternion
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.dynamics import Model
    from femflex.integrate import Block, IntegrationError

Array = NDArray[np.float64]

BENT = {"linear": 0.1, "fourth-order": 0.3}  # elastic displacement over the body's size up to which strain holds
STIFFENED = 0.02  # of the first frequency: stiffening by spin from which its lack is told
CLOSE = 0.05  # rad; angle left to the singularity of a rotation set below which a run warns of it
FAR = 100.0  # elastic displacement over the body's size beyond which the motion has run away


class Runaway:
    """Watches elastic displacements: stops a run that takes them far beyond the size of the body, warns of large ones.

    An unstable motion grows for long before its numbers overflow, with ever smaller steps; linear strain has lost its
    meaning long before.
    """

    def __init__(self, model: Model) -> None:
        self._worst: dict[str, float] = {}
        self._reach: list[tuple[str, int, Array, float]] = []
        self._strain: dict[str, str] = {}
        at = 0
        for name in model.system.order:
            body = model.system.bodies[name]
            at += model.system.joint_of(name).n_q
            if body.n_modes:
                self._reach.append((name, at, *_reach(body)))
                self._strain[name] = "linear" if body.strain.is_linear and not len(body.slaves) else "fourth-order"
            at += body.n_modes

    def found(self, block: Block) -> IntegrationError | None:
        """The error that tells of the first row of a block that has run away, if there is one."""
        from femflex.integrate import IntegrationError

        for name, first, largest, size in self._reach:
            moved = np.abs(block.states[:, first : first + len(largest)]) * largest
            self._worst[name] = max(self._worst.get(name, 0.0), float(moved.max(initial=0.0)))
            far = np.flatnonzero(moved.max(axis=1) > FAR * size)
            if len(far):
                row = slice(far[0], far[0] + 1)
                k = int(np.argmax(moved[far[0]]))
                text = (
                    f"the motion has run away, body {name!r} is displaced by {moved[far[0], k]:.3g} m, over "
                    f"{FAR:g} times its "
                    f"size of {size:.3g} m. Look for a spin faster than the body's lowest frequencies, or an "
                    f"unstable attitude."
                )
                return IntegrationError(text, block.times[row], block.states[row], first + k, block.steps)
        return None

    def warn(self) -> None:
        """Warn of bodies that were bent by more than their strain is good for, with both numbers."""
        for name, _, _, size in self._reach:
            strain = self._strain[name]
            if self._worst.get(name, 0.0) > BENT[strain] * size:
                warnings.warn(
                    f"body {name!r} was displaced by {self._worst[name]:.3g} m in one of its shapes, "
                    f"{self._worst[name] / size:.0%} of its size of {size:.3g} m; {strain} strain holds up to about "
                    f"{BENT[strain]:.0%}. Check stiffness, loads and units, or read the run as an indication.",
                    PhysicsWarning,
                    stacklevel=2,
                )


class Stiffening:
    """Watches how far spin would stiffen bodies with linear strain, row by row, and warns of it."""

    def __init__(self, model: Model) -> None:
        system = model.system
        self._bodies = {name: body for name, body in system.bodies.items() if body.ignored is not None}
        root = system.joint_of(system.root)
        self._free = system.orbit is not None or len(root.translations) == 3
        self._worst: dict[str, tuple[float, float]] = {}

    def watch(self, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows."""
        for name, body in self._bodies.items():
            assert body.ignored is not None
            omega, place = channels[f"bodies/{name}/rate"], channels[f"bodies/{name}/position"]
            arm = place - channels["monitors/center_of_mass"] if self._free else place
            C = np.swapaxes(dcm_from_quaternion(channels[f"bodies/{name}/attitude"]), 1, 2)
            W = omega[:, :, None] * omega[:, None, :] - np.einsum("ta,ta,bc->tbc", omega, omega, np.eye(3))
            gain = np.einsum("tab,tb,a->t", W, np.einsum("tab,tb->ta", C, arm), body.ignored[0])
            gain += np.einsum("tab,ab->t", W, body.ignored[1:])
            k = int(np.argmax(gain))
            seen = float(gain[k]), float(np.linalg.norm(omega[k]))
            self._worst[name] = max(self._worst.get(name, (0.0, 0.0)), seen)

    def warn(self) -> None:
        """Warn of bodies whose first frequency spin would have raised by more than STIFFENED, with both numbers."""
        for name, (gain, spin) in self._worst.items():
            raised = np.sqrt(1.0 + max(gain, 0.0)) - 1.0
            if raised > STIFFENED:
                first = np.nanmin(self._bodies[name].omega) / (2 * np.pi)
                warnings.warn(
                    f"body {name!r} turned at up to {spin:.4g} rad/s: a stiffening of {raised:.0%} of its first "
                    f"frequency ({first:.4g} Hz, not {first * (1 + raised):.4g} Hz) is ignored by linear strain. Give "
                    f"it strain = 'condensed'.",
                    PhysicsWarning,
                    stacklevel=2,
                )


class Singularities:
    """Watches how near the rotation sets of joints come to their singularities, row by row, and warns of it."""

    def __init__(self, model: Model) -> None:
        self._paths = [path for path in model.channels if path.startswith("joints/") and path.endswith("/singularity")]
        self._least: dict[str, tuple[float, float]] = {}

    def watch(self, times: Array, channels: Mapping[str, Array]) -> None:
        """Take note of a block of rows."""
        for path in self._paths:
            k = int(np.argmin(channels[path]))
            self._least[path] = min(self._least.get(path, (np.inf, 0.0)), (float(channels[path][k]), float(times[k])))

    def warn(self) -> None:
        """Warn of joints that came closer to their singularity than CLOSE, with both numbers."""
        for path, (least, t) in self._least.items():
            if least < CLOSE:
                name = path.removeprefix("joints/").removesuffix("/singularity")
                warnings.warn(
                    f"joint {name!r} came within {least:.3g} rad of the singularity of its rotation set at t = {t:.6g} "
                    f"s (below {CLOSE:g} rad coordinates turn fast, and steps are short for them alone). Ask for "
                    f"rebase, or for Euler parameters.",
                    PhysicsWarning,
                    stacklevel=2,
                )


def _reach(body: FlexibleBody) -> tuple[Array, float]:
    """Largest displacement of any place per unit of each elastic coordinate (n,), and the body's size [m]."""
    body = body.without_slaves()
    if body.skin is not None and len(body.skin.points):
        largest = np.linalg.norm(body.skin.shapes, axis=2).max(axis=1)
        return largest, float(np.linalg.norm(np.ptp(body.skin.points, axis=0)))
    places = np.stack([marker.position for marker in body.markers.values()])
    largest = np.max([np.linalg.norm(marker.phi, axis=0) for marker in body.markers.values()], axis=0)
    return largest, max(float(np.linalg.norm(np.ptp(places, axis=0))), 1.0)
