"""What a run is guarded against: motion that has run away, angles near a singularity."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.dynamics import Model
    from femflex.integrate import Block, IntegrationError

Array = NDArray[np.float64]

BENT = 0.1  # elastic displacement over the body's size up to which linear strain is taken to hold
SWUNG = 0.2  # the same for nonlinear strain: curvature is linear still, 3 % off in the tip of a cantilever there
CLOSE = 0.05  # rad; angle left to the singularity of a rotation set below which a run warns of it
FAR = 100.0  # elastic displacement over the body's size beyond which the motion has run away


class Runaway:
    """Watches elastic displacements: stops a run that takes them far beyond the size of the body, warns of large ones.

    An unstable motion grows for long before its numbers overflow, with ever smaller steps; linear strain has lost its
    meaning long before.
    """

    def __init__(self, model: Model) -> None:
        self._worst: dict[str, float] = {}
        self._nonlinear: set[str] = set()
        self._reach: list[tuple[str, int, Array, float]] = []
        at = 0
        for name in model.system.order:
            body = model.system.bodies[name]
            at += model.system.joint_of(name).n_q
            if body.n_modes:
                self._reach.append((name, at, *_reach(body)))
                if not body.strain.is_linear:
                    self._nonlinear.add(name)
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
            strain, bound, way = ("linear", BENT, "choose strain = 'nonlinear', ")
            if name in self._nonlinear:
                strain, bound, way = ("nonlinear", SWUNG, "cut the member into segments, ")
            if self._worst.get(name, 0.0) > bound * size:
                warnings.warn(
                    f"body {name!r} was displaced by {self._worst[name]:.3g} m in one of its shapes, "
                    f"{self._worst[name] / size:.0%} of its size of {size:.3g} m; {strain} strain holds up to about "
                    f"{bound:.0%}. Check stiffness, loads and units, {way}or read the run as an indication.",
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
