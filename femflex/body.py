"""A flexible body as plain arrays: the seam between finite elements and dynamics.

Whatever the discretisation (finite elements, admissible functions, lumped masses), a reduced body is its mass
moments, strain tensors, damping, markers and a skin to draw. A rigid body is one with no shapes, n = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from femflex.strain_field import StrainPart
from femflex.symmetric import form, gradient, hessian, packed_size, truncated

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MassMoments:
    """Mass moments of a flexible body over its shapes z = (rho, phi_1, ..., phi_n), body frame (THEORY section 3).

    mass    ()                     int dm       [kg]
    first   (1 + n, 3)             int z dm     [kg m | kg^1/2]
    second  (1 + n, 3, 1 + n, 3)   int z z^T dm [kg m^2 | kg^1/2 m | 1]

    With y = (1, delta) a material point sits at r = z_A y_A. Units in brackets hold for mass-normalised shapes.
    """

    mass: float
    first: Array
    second: Array

    @property
    def n_modes(self) -> int:
        """Number of shapes n."""
        return self.first.shape[0] - 1

    def center_of_mass(self, delta: Array | None = None) -> Array:
        """Centre of mass s y / mass in the body frame, (3,) [m]."""
        return self._extended(delta) @ self.first / self.mass

    def inertia(self, delta: Array | None = None) -> Array:
        """Inertia about the body frame's origin, J = tr(Q) 1 - Q, (3, 3) [kg m^2]."""
        y = self._extended(delta)
        Q = np.einsum("AaBb,A,B->ab", self.second, y, y)
        return np.trace(Q) * np.eye(3) - Q

    def elastic_mass(self) -> Array:
        """Elastic mass Me[k, l] = P[k, a, l, a], (n, n)."""
        return np.einsum("kala->kl", self.second[1:, :, 1:, :])

    def _extended(self, delta: Array | None) -> Array:
        return np.concatenate([[1.0], np.zeros(self.n_modes) if delta is None else np.asarray(delta, float)])


@dataclass(frozen=True, eq=False)
class StrainTensors:
    """Strain tensors of eq. (7), with the factor 1/2: V = f0.d + 1/2 [V1 dd + 2 V2 ddd + V3 dddd].

    V1  (n, n)          int B0^T C B0 + 2 int sigma0.B        [1/s^2 for mass-normalised shapes]
    f0  (n,)            int sigma0.B0                         [kg^1/2 m / s^2]
    V2  (C(n+2, 3),)    symmetric part of int B0^T C B        [kg^-1/2 m^-1 / s^2]
    V3  (C(n+3, 4),)    symmetric part of int B^T C B         [kg^-1 m^-2 / s^2]

    V2 and V3 are packed over i <= j <= k (<= l) in lexicographic order (`femflex.symmetric`); both are empty for
    linear strain.
    """

    V1: Array
    f0: Array
    V2: Array = field(default_factory=lambda: np.zeros(0))
    V3: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        n = self.V1.shape[0]
        sizes = {"V2": (self.V2.shape, packed_size(n, 3)), "V3": (self.V3.shape, packed_size(n, 4))}
        for name, (shape, size) in sizes.items():
            if shape not in ((0,), (size,)):
                raise ValueError(
                    f"strain tensor {name} of {n} coordinates has {size} packed values, or none where strain is "
                    f"linear; found shape {shape}"
                )

    @classmethod
    def linear(cls, V1: Array) -> StrainTensors:
        """Strain tensors of an unstressed body with stiffness V1 (n, n)."""
        V1 = np.asarray(V1, float)
        return cls(V1, np.zeros(V1.shape[0]))

    @property
    def is_linear(self) -> bool:
        """Whether the elastic force is linear in the coordinates: V2 and V3 are empty or zero."""
        return not (self.V2.any() or self.V3.any())

    def energy(self, d: Array) -> float:
        """Strain energy V at d (n,) [J], zero at d = 0."""
        d = np.asarray(d, float)
        cubic = form(self.V2, d, 3) if self.V2.size else 0.0
        quartic = form(self.V3, d, 4) if self.V3.size else 0.0
        return float(self.f0 @ d + (d @ self.V1 @ d + 2 * cubic + quartic) / 2)

    def force(self, d: Array) -> Array:
        """Elastic force dV/dd = f0 + V1 d + 3 V2 dd + 2 V3 ddd at d (n,): (n,)."""
        d = np.asarray(d, float)
        out = self.f0 + (self.V1 + self.V1.T) @ d / 2
        if self.V2.size:
            out = out + gradient(self.V2, d, 3)
        return out + gradient(self.V3, d, 4) / 2 if self.V3.size else out

    def tangent(self, d: Array) -> Array:
        """Tangent stiffness V1 + 6 V2 d + 6 V3 dd at d (n,): (n, n)."""
        d = np.asarray(d, float)
        out = (self.V1 + self.V1.T) / 2
        if self.V2.size:
            out = out + hessian(self.V2, d, 3)
        return out + hessian(self.V3, d, 4) / 2 if self.V3.size else out

    def truncated(self, n: int) -> StrainTensors:
        """The tensors of the first n coordinates alone."""
        have = self.V1.shape[0]
        V2 = truncated(self.V2, have, n, 3) if self.V2.size else self.V2
        V3 = truncated(self.V3, have, n, 4) if self.V3.size else self.V3
        return StrainTensors(self.V1[:n, :n], self.f0[:n], V2, V3)


@dataclass(frozen=True, eq=False)
class Marker:
    """A named place on a body: where joints, loads and sensors attach.

    position    (3,)    undeformed position, body frame [m]
    phi         (3, n)  translation of the place per shape
    psi         (3, n)  small rotation of the place per shape
    orientation (3, 3)  C_BM: turns marker components into body components, undeformed
    """

    position: Array
    phi: Array
    psi: Array
    orientation: Array = field(default_factory=lambda: np.eye(3))

    @classmethod
    def rigid(cls, position: Array, orientation: Array | None = None, n_modes: int = 0) -> Marker:
        """A marker that does not move with the elastic coordinates."""
        zero = np.zeros((3, n_modes))
        return cls(np.asarray(position, float), zero, zero, np.eye(3) if orientation is None else orientation)

    def turned(self, orientation: Array) -> Marker:
        """The same place with other undeformed axes, C_BM (3, 3)."""
        return replace(self, orientation=np.asarray(orientation, float))


@dataclass(frozen=True, eq=False)
class Skin:
    """What is drawn of a body: a surface (or line, or points) and how each shape moves its points.

    points  (n_p, 3)      undeformed, body frame [m]; already offset to the section's rim or the plate's faces
    cells   type -> (n_c, nodes)   with meshio's cell names: "triangle", "quad", "line", "vertex"
    shapes  (n, n_p, 3)   displacement of each point per shape (u + theta x offset)
    """

    points: Array
    cells: dict[str, NDArray[np.int64]]
    shapes: Array


@dataclass(frozen=True, eq=False)
class FlexibleBody:
    """A reduced body: everything the dynamics and the pictures need, in SI, in the body frame.

    moments  MassMoments over all shapes
    strain   StrainTensors over the n elastic coordinates
    damping  (n, n)  elastic damping matrix [1/s for mass-normalised shapes]
    markers  name -> Marker over all shapes; "origin" is always there
    skin     Skin over all shapes, or None for a body that cannot be drawn
    kinds    one word per shape: vibration, constraint, attachment, free-free, derivative, admissible, nodal
    omega    natural frequency of each shape where it means something, else nan [rad/s]
    slaves   (n_s, n, n)  A_s, symmetric: the last n_s shapes follow the first n, y_s = 1/2 delta.A_s delta
             (condensed form, THEORY section 3); none where every shape is a coordinate of its own
    note     what should be said of how the body was made; nothing if empty
    ignored  (4, 3) G of reduction.foreshortening where linear strain leaves it out: fields of acceleration -(b + W r)
             would stiffen the lowest shape by the part b . G[0] + W : G[1:] of its stiffness [s^2/m, s^2]; or None
    strain_field  parts over all shapes that recover strain over the body; none where it is not known
    """

    moments: MassMoments
    strain: StrainTensors
    damping: Array
    markers: dict[str, Marker]
    skin: Skin | None = None
    kinds: tuple[str, ...] = ()
    omega: Array = field(default_factory=lambda: np.zeros(0))
    slaves: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    note: str = ""
    ignored: Array | None = None
    strain_field: tuple[StrainPart, ...] = ()

    def __post_init__(self) -> None:
        n, n_shapes = self.n_modes, self.n_shapes
        if len(self.slaves) and self.slaves.shape[1:] != (n, n):
            raise ValueError(
                f"a body of {n_shapes} shapes of which {len(self.slaves)} follow the others needs `slaves` of shape "
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
            self.markers["origin"] = Marker.rigid(np.zeros(3), n_modes=n_shapes)

    @property
    def n_modes(self) -> int:
        """Number of elastic coordinates n."""
        return self.moments.n_modes - len(self.slaves)

    @property
    def n_shapes(self) -> int:
        """Number of shapes: the elastic coordinates and what follows them."""
        return self.moments.n_modes

    def truncated(self, n: int) -> FlexibleBody:
        """A copy with the first n elastic coordinates alone, and what follows them."""
        followers = np.arange(self.n_modes, self.n_shapes)
        return self._confined(np.concatenate([np.arange(n), followers]), n, self.slaves[:, :n, :n])

    def without_slaves(self) -> FlexibleBody:
        """The body to first order in its elastic coordinates: itself, without the shapes that follow others."""
        return self._confined(np.arange(self.n_modes), self.n_modes, np.zeros((0, 0, 0))) if len(self.slaves) else self

    def _confined(self, shapes: NDArray[np.int64], n: int, slaves: Array) -> FlexibleBody:
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
            strain_field=tuple(part.over(shapes) for part in self.strain_field),
        )

    def amplitudes(self, delta: Array) -> Array:
        """Amplitudes of all shapes (..., n_shapes) at elastic coordinates delta (..., n)."""
        delta = np.asarray(delta, float)
        if not len(self.slaves):
            return delta
        followed = np.einsum("sij,...i,...j->...s", self.slaves, delta, delta, optimize=True) / 2
        return np.concatenate([delta, followed], axis=-1)

    def marker(self, name: str) -> Marker:
        """The marker of that name.

        Raises KeyError with the known names when there is none.
        """
        if name not in self.markers:
            raise KeyError(f"marker {name!r} is not on the body; its markers are {sorted(self.markers)}")
        return self.markers[name]

    def damped(self, ratio: float) -> FlexibleBody:
        """A copy with modal damping ratio for every shape with a natural frequency, 2 ratio omega (diagonal)."""
        n = self.n_modes
        omega = np.nan_to_num(self.omega[:n], nan=0.0) if self.omega.size else np.zeros(n)
        return replace(self, damping=np.diag(2.0 * ratio * omega * np.diag(self.moments.elastic_mass())[:n]))


def rigid_body(
    mass: float,
    inertia: Array,
    center_of_mass: Array | None = None,
    markers: dict[str, Marker] | None = None,
    skin: Skin | None = None,
) -> FlexibleBody:
    """A body without shapes from its mass [kg] and inertia about its centre of mass (3, 3) [kg m^2].

    Raises ValueError when the inertia is not symmetric, not positive, or breaks the triangle inequality.
    """
    J = np.asarray(inertia, float)
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
