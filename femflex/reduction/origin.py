"""The structure and shapes that a body was reduced from, by which they are assessed; bodies resolved finer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

import numpy as np
from scipy import sparse

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.fem.structure import Structure
from femflex.fem.support import Support
from femflex.reduction.admissible import beam_fields, small_motion_beam
from femflex.reduction.beams.beam_functions import gauss, points_for
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.inertia.accelerations import loads_of_rigid_accelerations
from femflex.reduction.modes.vibration import ModeSet, static_response


@dataclass(frozen=True, eq=False)
class Meshed:
    """A Structure and the set that reduces it.

    groups    marker -> mesh group
    supports  mesh group -> support, of the groups that the set clamps only in some components
    answered  mesh groups whose static shapes were requested in addition to the modes of the set
    deflection, third_derivatives  with which the set was made, if requested
    """

    structure: Structure
    modes: ModeSet
    groups: Mapping[str, str] = field(default_factory=dict)
    supports: Mapping[str, Support] = field(default_factory=dict)
    answered: tuple[str, ...] = ()
    deflection: float | None = None
    third_derivatives: int | None = None

    @property
    def places(self) -> dict[str, str]:
        """Marker -> mesh group; the groups of the set are markers with the names of these groups."""
        return {**{group: group for group in self.modes.groups}, **self.groups}


@dataclass(frozen=True, eq=False)
class Analytic:
    """A straight beam and its admissible functions. groups: marker -> "root" or "tip", for markers with other names."""

    beam: UniformBeam
    functions: BeamFunctions
    groups: Mapping[str, str] = field(default_factory=dict)

    @property
    def places(self) -> dict[str, str]:
        """Marker -> "root" or "tip"."""
        return {**self.groups, "root": "root", "tip": "tip"}


Fields = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Deployed:
    """A deploying member at its initial length, and a function that resolves it by polynomials.

    requested  (n, k) coordinates of its functions without added static shapes
    fields     displacements [m] and twist (k, m, n) of its n columns at k positions xi along the length; m = 4 (u, v, w
               and twist) for beams and tethers
    resolved   builds the member and its fields with many polynomials, by which its functions are judged
    """

    requested: Array
    fields: Fields
    resolved: Callable[[], tuple[FlexibleBody, Fields]]


@dataclass(frozen=True, eq=False)
class Origin:
    """The source of a body, and the remedies that messages suggest for it.

    source  None for a body from a file, whose mesh is not known
    bound   the reason why its strain can only be linear; empty if it can be another
    remedy  the remedy for linear strain under axial loads, as in "give it strain = 'condensed'"
    """

    source: Meshed | Analytic | Deployed | None = None
    bound: str = ""
    remedy: str = "give it strain = 'condensed'"


# Bodies resolved beyond their sets of shapes: the residual of a motion, and the frequency error that it causes.
#
# In a mode of its craft a body of shapes phi vibrates at omega, its root accelerates by -omega^2 a, and loads f act at
# its joints. The full equations of the body then leave the residual
#
#     r = K phi delta - omega^2 M (phi delta + R a) - F f.
#
# It is orthogonal to the shapes. Where it is not, as on an orbit, forces act that are not among these terms; they are
# taken in the span of M phi. The static displacement x = K^-1 r is what the shapes lack, in statics as in effective
# mass. With x as one more shape, omega^2 of the mode, which has mass 1, falls by the root d of
#
#     m d^2 + c d = g^2,    g = x.K x,    m = x.M x,    c = |g - omega^2 m|,
#
# which is g far below the resonances of the body (a step of inverse iteration: B. N. Parlett, The Symmetric Eigenvalue
# Problem, SIAM 1998, section 4.6). No set is made richer: x combines the shapes and the static displacements under the
# inertia of the shapes, under accelerations of the root, and under loads at the joints.


Matrix: TypeAlias = Array | sparse.csr_array

DEPENDENT_KINDS = ("derivative",)  # kinds of second order in other shapes: zero in a small motion about rest
ADDED_POLYNOMIALS = 8  # polynomials of each field by which a beam is resolved, beyond the functions that it has


@dataclass(frozen=True, eq=False)
class ResolvedBody:
    """Stiffness and mass (p, p) of a body over its n shapes and the static displacements under p - n loads.

    The loads are the inertia of each shape, of six accelerations of the root, and six unit loads at each marker.
    """

    stiffness: Array
    mass: Array
    markers: tuple[str, ...]

    def stiffness_error(self, shapes: Array, squares: Array, roots: Array, loads: Mapping[str, Array]) -> Array:
        """Error (m,) [1/s^2] of omega^2 in m modes of the craft, each of mass 1.

        shapes (n, m): elastic coordinates; squares (m,): omega^2; roots (6, m): displacement and turn of the body
        frame; loads: marker -> force and moment (6, m), body axes
        """
        forces = [loads.get(name, np.zeros_like(roots)) for name in self.markers]
        x, n = np.vstack([shapes, -squares * shapes, -squares * roots, *(-force for force in forces)]), len(shapes)
        x[n : 2 * n] -= np.linalg.solve(self.mass[:n, :n], self.stiffness[:n] @ x)
        g, m = (np.maximum((x * (A @ x)).sum(axis=0), 0.0) for A in (self.stiffness, self.mass))
        c = np.abs(g - squares * m)
        root = c + np.sqrt(c**2 + 4.0 * m * g**2)
        return np.asarray(2.0 * g**2 / np.where(root > 0.0, root, 1.0))


def resolved_body(source: object, body: FlexibleBody, markers: Sequence[str]) -> ResolvedBody | None:
    """The body of that source resolved beyond its shapes, with joints at these markers; None without such a source."""
    if isinstance(source, Meshed):
        return _resolved_mesh(source, body, markers)
    if isinstance(source, Analytic):
        return _resolved_beam(source, body, markers)
    return _resolved_member(source, body, markers) if isinstance(source, Deployed) else None


def _resolved(
    K: Matrix, M: Matrix, response: Callable[[Array], Array], phi: Array, loads: Sequence[Array], markers: Sequence[str]
) -> ResolvedBody:
    columns = np.column_stack([phi, response(np.column_stack([M @ phi, *loads]))])
    return ResolvedBody(columns.T @ (K @ columns), columns.T @ (M @ columns), tuple(markers))


def _resolved_mesh(source: Meshed, body: FlexibleBody, markers: Sequence[str]) -> ResolvedBody:
    structure, modes = source.structure, source.modes
    columns = [k for k, kind in enumerate(modes.kinds) if kind not in DEPENDENT_KINDS]
    phi = modes.phi if body.n_modes == modes.n_modes else modes.phi[:, columns]
    markers, loads = [name for name in markers if name in source.places], [loads_of_rigid_accelerations(structure)]
    for name in markers:
        rows = marker_rows(structure, source.places[name])
        loads.append(np.concatenate([rows.translation.toarray(), rows.rotation.toarray()]).T)

    return _resolved(structure.K, structure.M, partial(static_response, structure, modes), phi, loads, markers)


def _resolved_beam(source: Analytic, body: FlexibleBody, markers: Sequence[str]) -> ResolvedBody:
    functions = source.functions
    counts = {key: getattr(functions, key) for key in ("y", "z", "axial", "torsion")}
    more = {key: count and count + ADDED_POLYNOMIALS for key, count in counts.items()}
    polynomials = BeamFunctions(**more, family="polynomial", ends=functions.ends)
    xi = gauss(points_for(polynomials.max_count))[0]
    full = small_motion_beam(source.beam, polynomials)
    basis, fields = beam_fields(source.beam, polynomials, xi, False), beam_fields(source.beam, functions, xi)
    return _resolved_by_functions(full, _coordinates(basis, fields), body, markers)


def _resolved_member(source: Deployed, body: FlexibleBody, markers: Sequence[str]) -> ResolvedBody:
    full, fields = source.resolved()
    xi = gauss(points_for(full.n_modes + ADDED_POLYNOMIALS))[0]
    return _resolved_by_functions(full.with_linear_strain(), _coordinates(fields(xi), source.fields(xi)), body, markers)


def _resolved_by_functions(full: FlexibleBody, phi: Array, body: FlexibleBody, markers: Sequence[str]) -> ResolvedBody:
    """A body of shapes phi (n_full, n) that another one resolves; its markers are those of the same motion there."""
    K, M = full.strain.V1, full.moments.elastic_mass()
    ends = {name: end for name in markers if (end := _end_of(full, body, name))}
    loads = [full.moments.acceleration_loads(), *(full.markers[end].loads for end in ends.values())]
    return _resolved(K, M, partial(np.linalg.solve, K), phi, loads, [*ends])


def _end_of(full: FlexibleBody, body: FlexibleBody, name: str) -> str:
    """The marker of the resolved body where the body has its marker of that name; empty where there is none."""
    position = body.markers[name].position
    return next((end for end, marker in full.markers.items() if np.allclose(marker.position, position)), "")


def _coordinates(basis: Array, shapes: Array) -> Array:
    """Coordinates (n, k) of shapes (q, m, k) in a basis (q, m, n) at q points."""
    flat = basis.reshape(-1, basis.shape[2])
    return np.asarray(np.linalg.lstsq(flat, shapes.reshape(len(flat), -1))[0], float)
