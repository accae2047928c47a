"""Bodies in richer sets of shapes: with all static shapes of their joints, and the inertia corrections of these."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker
from femflex.dynamics.equilibria.rest_modes import linear_body
from femflex.fem.structure import Structure
from femflex.reduction.admissible import beam_body
from femflex.reduction.beams.beam_functions import (
    STATIC_AXIAL,
    STATIC_BENDING,
    TIP_AXIAL,
    TIP_BENDING,
    gauss,
    points_for,
)
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import DIRECTIONS
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.residuals import independent_combinations, residual_vectors
from femflex.reduction.modes.vibration import load_vectors, ritz
from femflex.reduction.origin import Deployed
from femflex.reduction.small_motions import body_of_shapes

Place = tuple[str, str]  # group or end of the body, and a direction there ("" for all directions of an end)

DEPENDENT_KINDS = ("derivative",)  # kinds of second order in other shapes: zero in a small motion about rest
ADDED_POLYNOMIALS = 8  # polynomials of each field beyond the functions that a beam has


@dataclass(frozen=True, eq=False)
class EnrichedBody:
    """A body with linear strain in a richer set, for small motions about rest only.

    body      with the markers of the original body
    retained  (n, k) the shapes of the original body, in coordinates of the richer set
    choices   by place: static shapes (n, m) that could be added to these
    """

    body: FlexibleBody
    retained: Array
    choices: Mapping[Place, Array]


@dataclass(frozen=True, eq=False)
class MeshedEnrichment:
    """Enriches a meshed body on a set of modes; places: marker -> mesh group.

    The added shapes are the static shapes of unit forces and moments at every joint and of accelerations of the clamp,
    K^-1 F, and their inertia corrections K^-1 M K^-1 F: a Krylov subspace that matches the first four moments of
    the body's dynamic flexibility at its joints (T.-J. Su and R. R. Craig, J. Guidance 14 (1991) 260).
    """

    structure: Structure
    modes: ModeSet
    places: Mapping[str, str]

    def __call__(self, body: FlexibleBody, markers: Collection[str]) -> EnrichedBody:
        """The body in the richer set; its joints are at the markers of these names."""
        structure = self.structure
        modes = self.modes.picked([k for k, kind in enumerate(self.modes.kinds) if kind not in DEPENDENT_KINDS])
        labels, F = self._loads(body, markers)
        first = residual_vectors(structure, modes, F)
        second = residual_vectors(structure, modes, structure.M @ first)
        added = ritz(structure, independent_combinations(structure, np.column_stack([first, second])))[1]
        phi = np.column_stack([modes.phi, added])
        coordinates = np.vstack([np.zeros((modes.n_modes, len(labels))), added.T @ (structure.M @ first)])
        return EnrichedBody(
            self._body_in_shapes(body, phi),
            np.eye(phi.shape[1])[:, : modes.n_modes],
            {label: coordinates[:, [k]] for k, label in enumerate(labels) if first[:, k].any()},
        )

    def _loads(self, body: FlexibleBody, markers: Collection[str]) -> tuple[list[Place], Array]:
        """Load vectors (n_dof, k) of all directions at the clamp and at the joints, and their places."""
        groups = {self.places.get(name) or self._group_of_copy(body, name) for name in markers} - {None}
        labels = [(group, way) for group in sorted(filter(None, groups)) for way in DIRECTIONS]
        F = load_vectors(self.structure, (), {group: DIRECTIONS for group, _ in labels})
        if self.modes.held.size:
            labels = [(self.modes.groups[0], way) for way in DIRECTIONS] + labels
            F = np.column_stack([load_vectors(self.structure, DIRECTIONS, {}), F])
        return labels, F

    def _body_in_shapes(self, body: FlexibleBody, phi: Array) -> FlexibleBody:
        """The body in shapes phi (n_dof, n)."""
        markers = _markers_in_shapes(body, {name: self._rows(name, phi) for name in self.places}, phi.shape[1])
        return body_of_shapes(self.structure, phi, body.moments, markers)

    def _group_of_copy(self, body: FlexibleBody, name: str) -> str | None:
        """The mesh group of the marker of which this one is a copy."""
        return next((group for original, group in self.places.items() if _are_coincident(body, name, original)), None)

    def _rows(self, name: str, phi: Array) -> tuple[Array, Array]:
        rows = marker_rows(self.structure, self.places[name])
        return rows.translation @ phi, rows.rotation @ phi


@dataclass(frozen=True, eq=False)
class BeamEnrichment:
    """Enriches a beam on admissible functions: by ADDED_POLYNOMIALS polynomials for each field that has functions."""

    beam: UniformBeam
    functions: BeamFunctions

    def __call__(self, body: FlexibleBody, markers: Collection[str]) -> EnrichedBody:
        """The body in the richer set; its joints are at the markers of these names."""
        functions, counts = (
            self.functions,
            {key: getattr(self.functions, key) for key in ("y", "z", "axial", "torsion")},
        )
        richer_functions = BeamFunctions(
            **{key: n and n + ADDED_POLYNOMIALS for key, n in counts.items()}, family="polynomial", ends=functions.ends
        )
        enriched = beam_body(self.beam, richer_functions, orthonormal=False)
        end_rows = {name: (enriched.markers[name].phi, enriched.markers[name].psi) for name in ("root", "tip")}
        enriched = replace(enriched, markers=_markers_in_shapes(body, end_rows, enriched.n_modes), skin=None)
        xi, weight = gauss(points_for(max(counts.values()) + ADDED_POLYNOMIALS))
        fields = functions.fields(xi, 1.0)[:, :, : functions.n_independent]
        basis = richer_functions.fields(xi, 1.0)
        coordinates = np.einsum("p,pai,pak->ik", weight, basis, fields)
        choices = {
            (end, ""): np.einsum("p,pai,paj->ij", weight, basis, shapes)
            for end, shapes in _static_shapes(functions, xi).items()
            if end == "root" or any(_are_coincident(body, name, end) for name in markers)
        }
        return EnrichedBody(enriched, coordinates, choices)


@dataclass(frozen=True, eq=False)
class DeployedEnrichment:
    """Enriches a member that deploys, at its length, by more polynomials."""

    source: Deployed

    def __call__(self, body: FlexibleBody, markers: Collection[str]) -> EnrichedBody:
        """The body in the richer set; its joints are at the markers of these names."""
        enriched, fields = self.source.richer()
        xi = gauss(points_for(enriched.n_modes + ADDED_POLYNOMIALS))[0]
        basis = fields(xi)
        choices = {
            (end, ""): _coordinates_in_basis(basis, shapes)
            for end, shapes in self._static_shapes(xi).items()
            if end == "root" or any(_are_coincident(body, name, end) for name in markers)
        }
        return EnrichedBody(linear_body(enriched), _coordinates_in_basis(basis, self.source.fields(xi)), choices)

    def _static_shapes(self, xi: Array) -> dict[str, Array]:
        functions = self.source.functions
        return _static_shapes(functions, xi) if isinstance(functions, BeamFunctions) else {}


def _coordinates_in_basis(basis: Array, shapes: Array) -> Array:
    """Coordinates (n, k) of shapes (q, m, k) in a basis (q, m, n) at q points."""
    flat = basis.reshape(-1, basis.shape[2])
    return np.asarray(np.linalg.lstsq(flat, shapes.reshape(len(flat), -1))[0], float)


def _static_shapes(functions: BeamFunctions, xi: Array) -> dict[str, Array]:
    """Static shapes (len(xi), 4, m) of u, v, w, theta for the joint at either end; none for other families or ends.

    root: of accelerations; tip: of forces and moments.
    """
    if (functions.family, functions.ends) != ("characteristic", "clamped-free"):
        return {}
    out = {}
    for end, bending, axial in (("root", STATIC_BENDING, STATIC_AXIAL), ("tip", TIP_BENDING, TIP_AXIAL)):
        fields = ((0, functions.axial, axial), (1, functions.y, bending), (2, functions.z, bending))
        columns = []
        for row, count, shapes in (*fields, (3, functions.torsion, axial)):
            for f in shapes if count else ():
                columns.append(np.zeros((len(xi), 4)))
                columns[-1][:, row] = f(xi)
        out[end] = np.stack(columns, axis=2)
    return out


def _are_coincident(body: FlexibleBody, name: str, other: str) -> bool:
    """Whether two markers of a body have the same position and move alike."""
    if name not in body.markers or other not in body.markers:
        return False
    a, b = body.markers[name], body.markers[other]
    return all(np.array_equal(getattr(a, key), getattr(b, key)) for key in ("position", "phi", "psi"))


def _markers_in_shapes(body: FlexibleBody, rows: Mapping[str, tuple[Array, Array]], n: int) -> dict[str, Marker]:
    """The body's markers on n other shapes; rows: of the markers that shapes move. Copies move as their original."""
    out = {}
    for name, marker in body.markers.items():
        original = name if name in rows else next((other for other in rows if _are_coincident(body, name, other)), None)
        phi, psi = (np.zeros((3, n)),) * 2 if original is None else rows[original]
        out[name] = replace(marker, phi=phi, psi=psi, axis=np.zeros(3))
    return out
