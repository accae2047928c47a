"""Natural modes of a whole craft about its equilibrium: frequencies, damping, names, shapes, and stability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, BoolArray, ComplexArray, IntArray
from femflex.body import FlexibleBody, Skin
from femflex.effectors.constant_commands import stands_for_controller, with_held_commands
from femflex.linear.character import motion_character, numbered_names
from femflex.linear.equilibrium import Equilibrium, rest_equilibrium
from femflex.linear.rigid_motions import BodyMotion
from femflex.summary import Rows, Summarised
from femflex.system import Effector, System

SAME = 1e-9  # damping ratio that is rounding of the eigenvalues


@dataclass(frozen=True, eq=False, repr=False)
class SystemModes(Summarised):
    """Modes of a craft about an equilibrium, rigid-body modes first, the others by rising frequency.

    eigenvalues (n,)     [1/s], of a conjugate pair the one above the real axis
    names       (n,)     such as "translation x", "wobble", "bending 1"
    directions  (n,)     of bending, in axes of the root body ("z"); of a joint's motion its coordinate; else empty
    known       (n,)     whether the mode is a known motion that neither grows nor decays (drift, tilt of the spin axis)
    energy      body -> (n,) share of the kinetic energy
    shapes      (n_u, n) increments of the coordinates
    about       the equilibrium
    left_out    loads that are left out, prescribed motions that stay at their initial values
    """

    eigenvalues: ComplexArray
    names: tuple[str, ...]
    directions: tuple[str, ...]
    known: BoolArray
    growing: BoolArray
    energy: dict[str, Array]
    shapes: ComplexArray
    about: Equilibrium
    left_out: tuple[str, ...] = ()

    def summary(self) -> tuple[str, Rows]:
        """Name, frequency and damping ratio of each mode."""
        numbers = zip(self.frequencies, self.damping_ratios, strict=True)
        rows = [
            (f"{k} {self.label(k)}", f"{f:.6g} Hz, damping ratio {ratio:.4g}")
            for k, (f, ratio) in enumerate(numbers, 1)
        ]
        return f"{len(self.names)} modes about an equilibrium, {'stable' if self.stable else 'unstable'}", rows

    def label(self, mode: int) -> str:
        """Name and direction of a mode, counted from 1, such as "bending 1, z"."""
        return ", ".join(filter(None, (self.names[mode - 1], self.directions[mode - 1])))

    @property
    def frequencies(self) -> Array:
        """(n,) [Hz] in the base frame; 0 where it does not oscillate."""
        return np.asarray(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Ratio to critical damping (n,); below 0 grows, 1 and -1 do not oscillate; 0 for known motions."""
        size = np.abs(self.eigenvalues)
        ratios = -self.eigenvalues.real / np.where(size > 0, size, 1.0)
        return np.where(np.abs(ratios) < SAME, 0.0, ratios)

    @property
    def stable(self) -> bool:
        """Whether no mode grows."""
        return self.about.stable

    @property
    def held_controllers(self) -> list[str]:
        """Return the sampled controllers whose commands are constant: the modes are those of the craft without them."""
        return [
            effector.name
            for effector in self.about.model.system.effectors
            if isinstance(effector, Effector) and stands_for_controller(effector)
        ]

    def frequency(self, mode: int | str) -> float:
        """Frequency [Hz] of a mode by its name or its number from 1, rigid-body modes counted.

        Raises KeyError for one that is not there.
        """
        if isinstance(mode, str):
            if mode not in self.names:
                raise KeyError(f"the craft has no mode {mode!r}; it has {', '.join(self.names[:20])}")
            return float(self.frequencies[self.names.index(mode)])
        if not 1 <= mode <= len(self.names):
            raise KeyError(f"the craft has no mode {mode}; its modes are 1 to {len(self.names)}")
        return float(self.frequencies[mode - 1])

    def skin(self, modes: Sequence[int]) -> Skin:
        """The craft in its equilibrium, with the real and then the imaginary parts of these modes, counted from 1."""
        chosen = self.shapes[:, [mode - 1 for mode in modes]]
        return craft_skin(self.about.model.system, self.about.motions.bodies, chosen)


def system_modes(system: System, at: float | None = None) -> SystemModes:
    """The modes of a system about the equilibrium nearest to its initial coordinates, with damping.

    at: time [s] at which loads and prescribed motions are taken, as in `rest_equilibrium`. Sampled controllers hold
    their commands as they are before the first sample, and what follows the motion is that of the equilibrium. Raises
    as `equilibrium`.
    """
    return modes_about(*rest_equilibrium(with_held_commands(system, followers=False), at))


def modes_about(about: Equilibrium, left_out: tuple[str, ...] = ()) -> SystemModes:
    """The modes about an equilibrium found already."""
    model, motions = about.model, about.motions
    spinning = model.system.frame.kind == "spinning" and bool(np.any(model.system.frame.rate))
    character = motion_character(model, motions, model.system.frame.rate if spinning else None)
    rigid = np.array([motion.shape for motion in motions.known], complex).reshape(-1, model.n_u).T
    kinetic = {name: motions.bodies[name].kinetic(model.system.bodies[name], rigid) for name in model.system.order}
    total = np.maximum(np.sum(list(kinetic.values()), axis=0), 1e-300)
    count = len(motions.known)
    return SystemModes(
        eigenvalues=np.concatenate([[motion.eigenvalue for motion in motions.known], motions.eigenvalues]),
        names=tuple(motion.name for motion in motions.known) + numbered_names(character.words),
        directions=("",) * count + character.directions,
        known=np.arange(count + len(character.words)) < count,
        growing=np.concatenate([np.zeros(count, bool), motions.growing]),
        energy={name: np.concatenate([kinetic[name] / total, character.energy[name]]) for name in model.system.order},
        shapes=np.hstack([rigid, motions.shapes]),
        about=about,
        left_out=left_out,
    )


DOT = {"vertex": np.zeros((1, 1), np.int64)}  # of a body that has no skin


def craft_skin(system: System, bodies: dict[str, BodyMotion], motions: ComplexArray) -> Skin:
    """The skin of the craft in the base frame, with 2 k shapes for motions (n_u, k): their real, then imaginary parts.

    Every motion is turned in phase so that its real part is as large as can be. Bodies without a skin are drawn as a
    point at their centre of mass.
    """
    points, shapes, count = [], [], 0
    cells: dict[str, list[IntArray]] = {}
    for name in system.order:
        skin = system.bodies[name].skin or _dot(system.bodies[name])
        moved, displacement = bodies[name].points(skin.points, skin.shapes, motions)
        points.append(moved)
        shapes.append(displacement)
        for kind, numbers in skin.cells.items():
            cells.setdefault(kind, []).append(numbers + count)
        count += len(skin.points)
    displacement = np.concatenate(shapes, axis=1)
    square = np.sum(displacement**2, axis=(1, 2))
    displacement = displacement * np.exp(-0.5j * np.angle(square))[:, None, None]
    return Skin(
        np.concatenate(points),
        {kind: np.concatenate(numbers) for kind, numbers in cells.items()},
        np.concatenate([displacement.real, displacement.imag]),
    )


def _dot(body: FlexibleBody) -> Skin:
    centre, first = body.moments.center_of_mass(), body.moments.first[1:]
    return Skin(centre[None], DOT, (first / body.moments.mass)[:, None, :])
