"""A reduced body: mass moments, strain tensors, damping, markers and a skin. A rigid one has no shapes, n = 0."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body.induced_strain import InducedStrain
from femflex.body.marker import Marker
from femflex.body.moments import MassMoments, MassPoints
from femflex.body.patches import Patches
from femflex.body.strain import StrainTensors
from femflex.body.strain_field import StrainPart
from femflex.summary import Rows, Summarised, listed


@dataclass(frozen=True, eq=False)
class Skin:
    """Surface (or line, or points) of a body that pictures show, and the displacement of its points per shape.

    points  (n_p, 3)      undeformed, body frame [m]; already offset to the section's rim or the plate's faces
    cells   type -> (n_c, nodes)   with meshio's cell names: "triangle", "quad", "line", "vertex"
    shapes  (n, n_p, 3)   displacement of each point per shape (u + theta x offset)
    growth  (n_p, 3)      of a body that deploys: displacement of each point per growth of its length, relative to the
                          length that it is drawn at; None of others
    """

    points: Array
    cells: dict[str, IntArray]
    shapes: Array
    growth: Array | None = None

    def __post_init__(self) -> None:
        for kind, nodes in self.cells.items():
            if nodes.size and not (nodes.min() >= 0 and nodes.max() < len(self.points)):
                raise ValueError(f"the cells {kind!r} of a skin name points that it does not have; expected 0 to n - 1")

    @cached_property
    def max_displacement(self) -> Array:
        """Largest displacement of a point by each shape (n,) [m per amplitude]."""
        return largest_displacements(self.shapes)


def largest_displacements(shapes: Array) -> Array:
    """Largest displacement (n,) [m per amplitude] among the points that shapes (n, p, 3) move."""
    return np.asarray(np.sqrt(np.einsum("spa,spa->sp", shapes, shapes).max(axis=1, initial=0.0)))


@dataclass(frozen=True, eq=False, repr=False)
class FlexibleBody(Summarised):
    """A reduced body: everything the dynamics and the pictures need, in SI, in the body frame.

    moments  MassMoments over all shapes
    strain   StrainTensors over the n elastic coordinates
    damping  (n, n)  elastic damping matrix [1/s for mass-normalised shapes]
    markers  name -> Marker over all shapes; "origin" is always there
    skin     Skin over all shapes, or None for a body that cannot be drawn
    kinds    one word per shape: vibration, constraint, attachment, free-free, derivative, admissible, nodal; of slaved
             shapes also carried (combinations of the coordinates' own shapes, `condense`), section (sections of beams
             that turn) and remainder (part of the stretch that the coordinates of a nonlinear beam lack)
    omega    natural frequency of each shape where it means something, else nan [rad/s]
    slaves   (n_s, n, n)  A_s, symmetric: the last n_s shapes follow the first n, y_s = 1/2 delta.A_s delta
             (condensed form, THEORY section 3; sections of beams that turn); none where all are coordinates
    foreshortening  of its lowest shape where linear strain leaves it out, or None
    strain_field  parts over all shapes that recover strain over the body; empty if unknown
    mass_points  points of mass over all shapes, of bodies so long that gravity is integrated over them; or None
    patches  group -> Patches, over which forces can be spread
    load_sets  name -> LoadSet, of the static loads of its deck
    induced  group -> InducedStrain, of groups of `patches` in which effectors induce strain

    Arrays, names and units only: it can be pickled. The source of a body is its `reduction.Origin`, and notes on
    it are advice.
    """

    moments: MassMoments
    strain: StrainTensors
    damping: Array
    markers: dict[str, Marker]
    skin: Skin | None = None
    kinds: tuple[str, ...] = ()
    omega: Array = field(default_factory=lambda: np.zeros(0))
    slaves: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    foreshortening: Foreshortening | None = None
    strain_field: tuple[StrainPart, ...] = ()
    mass_points: MassPoints | None = None
    patches: dict[str, Patches] = field(default_factory=dict)
    load_sets: dict[str, LoadSet] = field(default_factory=dict)
    induced: dict[str, InducedStrain] = field(default_factory=dict)

    def summary(self) -> tuple[str, Rows]:
        """Mass, centre of mass, coordinates, frequencies and markers."""
        centre = ", ".join(f"{x:.4g}" for x in self.moments.center_of_mass())
        rows = [("mass", f"{self.moments.mass:.6g} kg"), ("centre of mass", f"({centre}) m")]
        if self.n_modes:
            counts = [f"{self.kinds.count(kind)} {kind}" for kind in dict.fromkeys(self.kinds)]
            rows += [("coordinates", str(self.n_modes)), ("shapes", ", ".join(counts) or str(self.n_shapes))]
            rows += [("strain", self.strain_form)]
            frequencies = self.omega[np.isfinite(self.omega)] / (2.0 * np.pi)
            rows += [("frequencies", listed([f"{f:.4g}" for f in frequencies], 6) + " Hz")] if len(frequencies) else []
        rows += [("markers", listed(sorted(self.markers)))]
        return f"{'Flexible' if self.n_modes else 'Rigid'} body", rows

    def __post_init__(self) -> None:
        n, n_shapes = self.n_modes, self.n_shapes
        if len(self.slaves) and self.slaves.shape[1:] != (n, n):
            raise ValueError(
                f"a body of {n_shapes} shapes of which {len(self.slaves)} are dependent needs `slaves` of shape "
                f"({len(self.slaves)}, {n}, {n}); found {self.slaves.shape}"
            )
        if self.strain.V1.shape != (n, n) or self.damping.shape != (n, n):
            raise ValueError(
                f"a body with {n} elastic coordinates needs stiffness and damping of shape ({n}, {n}); "
                f"found {self.strain.V1.shape} and {self.damping.shape}"
            )
        for name, marker in self.markers.items():
            if marker.phi.shape != (3, n_shapes) or marker.psi.shape != (3, n_shapes):
                raise ValueError(
                    f"marker {name!r} has rows of shape {marker.phi.shape}; "
                    f"a body with {n_shapes} shapes needs (3, {n_shapes})"
                )
        if "origin" not in self.markers:
            self.markers["origin"] = Marker.at_position(np.zeros(3), n_modes=n_shapes)

    @property
    def n_modes(self) -> int:
        """Number of elastic coordinates n."""
        return self.moments.n_modes - len(self.slaves)

    @property
    def n_shapes(self) -> int:
        """Number of shapes: those of the elastic coordinates, and the dependent (slaved) ones."""
        return self.moments.n_modes

    @property
    def condensed(self) -> bool:
        """Whether its stretch is slaved to bending; dependent section turns or a remainder of stretch do not count."""
        slave_kinds = self.kinds[self.n_modes :] if self.kinds else ("",) * len(self.slaves)
        return any(kind not in ("section", "remainder") for kind in slave_kinds)

    @property
    def strain_form(self) -> Literal["linear", "nonlinear", "condensed"]:
        """The form of the body's strain."""
        if self.condensed:
            return "condensed"
        return "linear" if self.strain.is_linear else "nonlinear"

    def truncated(self, n: int) -> FlexibleBody:
        """A copy with the first n elastic coordinates alone, and their dependent shapes."""
        slaves = np.arange(self.n_modes, self.n_shapes)
        return self._with_shapes(np.concatenate([np.arange(n), slaves]), n, self.slaves[:, :n, :n])

    def without_slaves(self) -> FlexibleBody:
        """The body to first order in its elastic coordinates, without the dependent (slaved) shapes."""
        return (
            self._with_shapes(np.arange(self.n_modes), self.n_modes, np.zeros((0, 0, 0))) if len(self.slaves) else self
        )

    def with_linear_strain(self) -> FlexibleBody:
        """The body with linear strain, without the shapes that are slaved to others."""
        body = self.without_slaves()
        return replace(body, strain=StrainTensors.linear(body.strain.V1))

    def _with_shapes(self, shapes: IntArray, n: int, slaves: Array) -> FlexibleBody:
        moments, z = self.moments, np.concatenate([[0], 1 + shapes])
        return replace(
            self,
            moments=MassMoments(moments.mass, moments.first[z], moments.second[z][:, :, z]),
            strain=self.strain.truncated(n),
            damping=self.damping[:n, :n],
            markers={key: replace(m, phi=m.phi[:, shapes], psi=m.psi[:, shapes]) for key, m in self.markers.items()},
            skin=None if self.skin is None else replace(self.skin, shapes=self.skin.shapes[shapes]),
            kinds=tuple(self.kinds[k] for k in shapes) if self.kinds else (),
            omega=self.omega[shapes] if self.omega.size else self.omega,
            slaves=slaves,
            strain_field=tuple(part.with_shapes(shapes) for part in self.strain_field),
            mass_points=None if self.mass_points is None else self.mass_points.with_shapes(shapes),
            induced={group: each.with_coordinates(shapes[:n]) for group, each in self.induced.items()},
        )

    def amplitudes(self, delta: Array) -> Array:
        """Amplitudes of all shapes (..., n_shapes) at elastic coordinates delta (..., n)."""
        delta = np.asarray(delta, float)
        if not len(self.slaves):
            return delta
        products = (delta[..., :, None] * delta[..., None, :]).reshape(*delta.shape[:-1], -1, 1)
        # one product of the same size for each state, so that results do not depend on the number of states
        dependent = (self.slaves.reshape(len(self.slaves), -1) @ products)[..., 0] / 2
        return np.concatenate([delta, dependent], axis=-1)

    def marker(self, name: str) -> Marker:
        """The marker of that name.

        Raises KeyError with the known names when there is none.
        """
        if name not in self.markers:
            raise KeyError(f"marker {name!r} is not on the body; its markers are {sorted(self.markers)}")
        return self.markers[name]


@dataclass(frozen=True, eq=False)
class Foreshortening:
    """theta, the displacement of second order that goes with the lowest shape, over that shape's stiffness.

    mass  (4, 3)   int z theta^T dm, z = (1, rho) [s^2/m, s^2]: in a field of accelerations -(b + W r) the lowest shape
                   is stiffened by the part b . mass[0] + W : mass[1:] of its own stiffness
    at    marker -> (3,)  theta there [1/N]: a force F stiffens it by -F . theta
    """

    mass: Array = field(default_factory=lambda: np.zeros((4, 3)))
    at: dict[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class LoadSet:
    """Forces and torques at markers of a body, and a force per mass of it, all along axes of the body frame.

    markers       k names; the first marker stays with the body frame
    forces        (k, 3)  [N]
    torques       (k, 3)  [N m]
    acceleration  (3,)    force per mass [m/s^2]
    """

    markers: tuple[str, ...]
    forces: Array
    torques: Array
    acceleration: Array


def rigid_body(
    mass: float,
    inertia: Array | None = None,
    center_of_mass: Array | None = None,
    markers: dict[str, Marker] | None = None,
    skin: Skin | None = None,
) -> FlexibleBody:
    """A body without shapes from its mass [kg] and inertia about its centre of mass (3, 3) [kg m^2].

    inertia: or its principal moments (3,) along the axes of the body. Without it the mass is a point, whose rotation
        other bodies or the joints must constrain

    Raises ValueError when it has another shape, is not symmetric, not positive, or breaks the triangle inequality.
    """
    J = np.zeros(3) if inertia is None else np.asarray(inertia, float)
    if J.shape not in ((3,), (3, 3)):
        raise ValueError(f"inertia has shape {J.shape}; give three principal moments, or (3, 3), in kg m^2")
    J = np.diag(J) if J.ndim == 1 else J
    c = np.zeros(3) if center_of_mass is None else np.asarray(center_of_mass, float)
    if not mass > 0:
        raise ValueError(f"mass is {mass} kg; a body needs a positive mass")
    if not np.allclose(J, J.T, rtol=1e-9, atol=0):
        raise ValueError(f"inertia is not symmetric: {J.tolist()}")
    principal = np.linalg.eigvalsh(J)
    if principal[0] < 0:
        raise ValueError(f"inertia is not positive: its principal moments are {principal.tolist()} kg m^2")
    if principal[0] + principal[1] < principal[2] * (1 - 1e-9):
        raise ValueError(
            f"inertia breaks the triangle inequality: principal moments {principal.tolist()} kg m^2, "
            f"of which the two smaller must sum to at least the largest"
        )
    Q = np.trace(J) / 2 * np.eye(3) - J + mass * np.outer(c, c)
    moments = MassMoments(float(mass), (mass * c)[None, :], Q[None, :, None, :])
    empty = np.zeros((0, 0))
    return FlexibleBody(moments, StrainTensors.linear(empty), empty, dict(markers or {}), skin)
