"""Loads spread over lines, surfaces and masses of bodies.

Over a group with patches A_k (`femflex.body.Patches`), each moved and turned by the elastic coordinates, a load f per
size puts the force f A_k at the mean point of every patch. One that keeps its direction in the body, or in inertial
axes, has the exact resultant, moment and generalised force of a uniform load by the mean motion of the whole group:

    F = f A,   M = (int r dA) x f,   Q_i = f . int phi_i dA

One that follows the surface turns with every patch: a pressure p gives -p n dA with the turned normal n. A set of loads
of a deck acts at a few markers with the same resultant, moment and generalised force (`femflex.body.LoadSet`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.body import FlexibleBody, LoadSet, Marker, Patches
from femflex.body.patches import patch_marker
from femflex.effectors.noun import EffectorNoun, NumberOrSignal, whole_body
from femflex.kernels.vectors import ZERO, add, dot, load3, load9, scale, store3, turn
from femflex.noun.table import exactly_one, refuse
from femflex.noun.values import Direction, Quantity, Vector
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

MASS = ".mass"  # marker of the centre of mass, which moves as the mean over the mass
KINDS = ("pressure", "force_per_area", "force_per_length", "force_per_mass", "load_set")
AXES, TAKES_SIGNAL, LEVEL, COUNT, HAS_TORQUES, TABLE = range(6)  # of its parameters; then forces and torques (k, 3)
INERTIAL, OWN, OF_FIRST = range(3)  # axes of forces and torques: inertial, those of each marker, those of the first


class DistributedLoad(EffectorNoun, heading="distributed_loads"):
    """A load spread evenly over a group of lines or surfaces of a body or over its mass, or a set of its deck's loads.

    Channels: force_x, force_y, force_z, the resultant in inertial axes.
    """

    body: str
    """Body on which it acts: one with a mesh, a beam on admissible functions, or any body for force_per_mass."""
    group: str = "all"
    """Group of lines, surfaces, or faces of solids. Of a beam on admissible functions "all"."""
    pressure: Annotated[float, Quantity("Pa")] | None = None
    """Pressure that follows the surface. It pushes to the side of the normal by the order of the nodes, on faces of
    solids inwards, or to `side`."""
    side: Direction | None = None
    """Direction in the body frame to which the pressure pushes, on surfaces whose normals have no common order."""
    force_per_area: Annotated[Vector, Quantity("Pa", (3,))] | None = None
    """Force per area."""
    force_per_length: Annotated[Vector, Quantity("N/m", (3,))] | None = None
    """Force per length of lines."""
    force_per_mass: Annotated[Vector, Quantity("m/s^2", (3,))] | None = None
    """Force per mass of the whole body, such as a weight."""
    load_set: str | None = None
    """Set of loads of the body's deck, such as "load 2" of Nastran or "step 1" of Abaqus. Its pressures keep their
    direction in the axes of `frame`, as in linear statics."""
    frame: Literal["body", "inertial", "local"] | None = None
    """Axes of the force: those of the body, inertial ones, or those of each patch, which turn with it from the body's.
    Default: "local" for a pressure, else "body"."""
    level: Annotated[float | str, NumberOrSignal("")] = 1.0
    """Factor on the load: a number, or the name of a signal, for a load that varies with time."""

    label = "distributed load"
    channels = {"force_x": "N", "force_y": "N", "force_z": "N"}
    accounts = ("supplied",)
    exerts = ("force",)

    @model_validator(mode="after")
    def _one_kind(self) -> DistributedLoad:
        exactly_one(self, KINDS)
        if self.force_per_mass is not None and (self.frame == "local" or self.group != "all"):
            refuse("found force_per_mass with a group or with frame = 'local'; it acts on the whole body")
        if self.load_set is not None and (self.frame == "local" or self.group != "all"):
            refuse("found load_set with a group or with frame = 'local'; its loads act where the deck says")
        if self.side is not None and self.pressure is None:
            refuse("found side without pressure; it says to which side a pressure pushes")
        return self

    @property
    def axes(self) -> str:
        """Axes of the force: frame, or its default."""
        return self.frame or ("body" if self.pressure is None else "local")

    def needed_patches(self) -> tuple[tuple[str, str], ...]:
        """(body, group) of the patches that it needs."""
        return () if self.force_per_mass is not None or self.load_set is not None else ((self.body, self.group),)

    def load_sets(self) -> tuple[tuple[str, str], ...]:
        """(body, set of loads) that it needs."""
        return () if self.load_set is None else ((self.body, self.load_set),)

    def carrier(self, name: str, body: FlexibleBody) -> FlexibleBody:
        """The body with a marker that moves as the mean over its mass, for a force per mass."""
        weighs = self.load_set is not None and self._set_of(body).acceleration.any()
        if self.force_per_mass is None and not weighs:
            return body
        first, n = body.moments.first / body.moments.mass, body.n_shapes
        return replace(body, markers=body.markers | {MASS: Marker(first[0], first[1:].T, np.zeros((3, n)))})

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for a body without such a group or set of loads, and for mixed
        normals."""
        body = whole_body(context, self.body)
        axes, torques = OWN, np.zeros((0, 3))
        if self.load_set is None:
            markers, forces = self._forces_at_markers(body)
        else:
            loads, axes = self._set_of(body), OF_FIRST
            markers, forces, torques = [*loads.markers], loads.forces, loads.torques
            if loads.acceleration.any():
                pull = body.moments.mass * loads.acceleration
                markers, forces = [*markers, MASS], np.vstack([forces, pull])
                torques = np.vstack([torques, np.zeros(3)])
        is_signal = isinstance(self.level, str)
        head = [
            INERTIAL if self.axes == "inertial" else axes,
            float(is_signal),
            0.0 if is_signal else float(self.level),
        ]
        head += [len(markers), float(torques.any())]
        return replace(
            super().effector(name, context),
            markers=tuple((self.body, marker) for marker in markers),
            inputs=(str(self.level),) if is_signal else (),
            exerts=("force", "torque") if torques.any() else self.exerts,
            parameters=np.concatenate([head, forces.ravel(), torques.ravel()]),
        )

    def parameters(self) -> Array:
        """None but those of `effector`, which depend on the body."""
        return np.zeros(0)

    def _set_of(self, body: FlexibleBody) -> LoadSet:
        if self.load_set not in body.load_sets:
            raise ValueError(
                f"body {self.body!r} has no set of loads {self.load_set!r}; sets of loads come with the deck of a body"
            )
        return body.load_sets[self.load_set]

    def _forces_at_markers(self, body: FlexibleBody) -> tuple[list[str], Array]:
        """Markers of the body and the force at each (k, 3) [N] at level 1."""
        if self.force_per_mass is not None:
            return [MASS], body.moments.mass * np.array([self.force_per_mass])
        if self.group not in body.patches:
            known = f"; it has {sorted(body.patches)}" if body.patches else ""
            raise ValueError(
                f"body {self.body!r} has no patches of group {self.group!r}{known}. Loads are spread over bodies with "
                "a mesh, and over beams on admissible functions (group = 'all'); give other bodies loads at their "
                "markers"
            )
        patches = body.patches[self.group]
        if (patches.dimension == 1) != (self.force_per_length is not None):
            of, key = (
                ("lines", "force_per_length") if patches.dimension == 1 else ("surfaces", "pressure or force_per_area")
            )
            raise ValueError(f"group {self.group!r} of body {self.body!r} consists of {of}; give {key}")
        if self.pressure is not None:
            forces = self.pressure * self._pushed_areas(patches)
        else:
            vector = self.force_per_area or self.force_per_length
            forces = np.outer(patches.size, np.array(vector))
        if self.axes == "local":
            return [patch_marker(self.group, k) for k in range(len(forces))], forces
        return [patch_marker(self.group)], forces.sum(axis=0)[None]

    def _pushed_areas(self, patches: Patches) -> Array:
        """Area vectors (k, 3) to the side to which a pressure pushes."""
        areas = -patches.normal if patches.solid else patches.normal
        if self.side is not None:
            return areas * np.where(areas @ np.array(self.side) < 0.0, -1.0, 1.0)[:, None]
        if not patches.aligned:
            raise ValueError(
                f"the normals of group {self.group!r} of body {self.body!r} do not lie on one side: cells with a "
                "common side have opposite orders of nodes. Give side, the direction to which the pressure pushes, or "
                "turn the cells of the mesh"
            )
        return areas


@DistributedLoad.kernel
def distributed_load(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Input: its level, where that is a signal."""
    p = parameters
    m = int(p[COUNT])
    level, total, power = p[LEVEL], ZERO, 0.0
    if p[TAKES_SIGNAL] > 0.0:
        level = seen[18 * m]
    for k in range(m):
        force = scale(level, load3(p, TABLE + 3 * k))
        frame = 3 * m if p[AXES] == OF_FIRST else 3 * m + 9 * k
        if p[AXES] > INERTIAL:
            force = turn(load9(seen, frame), force)
        store3(out, 3 * k, force)
        total, power = add(total, force), power + dot(force, load3(seen, 12 * m + 3 * k))
        if p[HAS_TORQUES] > 0.0:
            torque = scale(level, load3(p, TABLE + 3 * m + 3 * k))
            if p[AXES] > INERTIAL:
                torque = turn(load9(seen, frame), torque)
            store3(out, 3 * m + 3 * k, torque)
            power += dot(torque, load3(seen, 15 * m + 3 * k))
    store3(out, 6 * m, total)
    out[6 * m + 5] = power
