"""Reduce a straight beam with analytic admissible functions to a FlexibleBody, without a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from femflex.arrays import Array, BoolArray
from femflex.body import FlexibleBody, InducedStrain, Marker, Patches, Skin, StrainTensors
from femflex.body.induced_strain import LINES, patch_axes
from femflex.body.patches import FLAT
from femflex.fem.eigen.shift_invert import canonical_modes, dense_modes, signs
from femflex.fem.line.chain import section_points
from femflex.reduction.beams.beam_functions import ends_of, gauss, points_for
from femflex.reduction.beams.beam_strain import beam_strain
from femflex.reduction.beams.strain_points import beam_field
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.boundary.patches import CellMotion, mean_markers
from femflex.reduction.inertia.moments import point_moments
from femflex.reduction.large_deflection.foreshortening import foreshortening_of
from femflex.reduction.modes.damping import UNANSWERED, Damping, bending_damping, is_added, is_unanswered
from femflex.reduction.modes.vibration import TURN
from femflex.reduction.strain.condense import condense, with_stretch_of_slaved
from femflex.reduction.strain.turned_sections import Sections, with_turned_sections

SIDES = 16  # of the tube for drawing
RANK = (
    1e-10  # strain energy of a dependent function over the largest, below which the axial functions contain it already
)


def beam_body(
    beam: UniformBeam,
    functions: BeamFunctions,
    damping: Damping | None = None,
    orthonormal: bool = True,
    strain: Literal["linear", "nonlinear", "condensed"] = "linear",
    patches: Sequence[str] = (),
    induced: Sequence[str] = (),
) -> FlexibleBody:
    """The FlexibleBody of a straight beam on admissible functions, with markers "root" and "tip".

    Moments and stiffness are integrated by Gauss quadrature along the length, with mass at points of each section
    (section_points). orthonormal: the functions are recombined into the modes of the beam confined to them.
    strain: "nonlinear" adds the stretch by slopes and twist (beam_strain) and needs axial functions; "condensed" makes
    the stretch dependent on bending (reduction.condense), along additional axial polynomials. With nonlinear strain
    the part of the squared slopes that the axial functions cannot represent is dependent too: characteristic ones are
    sines and represent it badly (with two or three functions for each bending field, the lateral buckling load of a
    strip would be 11 to 50 % too high). Raises ValueError for torsion of a section without inertia, and for nonlinear
    strain without axial functions.
    """
    if functions.torsion and not (beam.ry or beam.rz):
        raise ValueError(
            "torsion functions were requested, but the section has no inertia (ry = rz = 0); give radii of gyration."
        )
    if strain == "nonlinear" and not functions.axial:
        raise ValueError(
            "nonlinear strain without axial functions would make bending far too stiff; give axial functions "
            "(about twice as many as for bending), or for strain = 'condensed'."
        )
    if strain == "condensed" or (strain == "nonlinear" and not functions.holds_squares):
        functions = functions.with_followers()
    body = _reduced_beam(beam, functions, damping, orthonormal, strain, patches=patches, induced=induced)
    if strain == "linear" and (functions.y or functions.z):
        bending = replace(functions, axial=0, torsion=0).with_followers()
        return replace(
            body, foreshortening=foreshortening_of(_reduced_beam(beam, bending, None, True, "condensed", lowest=True))
        )
    return body


def _reduced_beam(
    beam: UniformBeam,
    functions: BeamFunctions,
    damping: Damping | None,
    orthonormal: bool,
    strain: str,
    lowest: bool = False,
    patches: Sequence[str] = (),
    induced: Sequence[str] = (),
) -> FlexibleBody:
    """The body whose coordinates are the functions, or their modes (only the lowest one if `lowest`).

    Dependent functions are slaved to these.
    """
    xi, weight = gauss(points_for(functions.max_count))
    offsets, dm, rho, shapes = _mass_points(beam, functions, xi, weight)
    V1_functions = _stiffness(beam, functions, xi, weight)
    Me = point_moments(dm, rho, shapes).elastic_mass()
    X, omega = _independent_columns(beam, functions, V1_functions, Me, orthonormal)
    picked = [int(np.argmin(omega))] if lowest else list(range(functions.n_independent))
    n, kinds, X, omega = len(picked), _kinds(functions, X, orthonormal), X[:, picked], omega[picked]
    if functions.followers:
        followers, frequency = _dependent_columns(functions, V1_functions, Me, X)
        X, omega = np.hstack([X, followers]), np.concatenate([omega, frequency])
    has_followers = X.shape[1] > n
    kinds = tuple(kinds[k] for k in picked)
    kinds += ("derivative" if strain == "condensed" else "remainder",) * (X.shape[1] - n)
    moments = point_moments(dm, rho, shapes @ X)
    V1 = X.T @ V1_functions @ X
    V1 = (V1 + V1.T) / 2
    tensors, V3 = (
        (StrainTensors.linear(V1), np.zeros(0)) if strain == "linear" else beam_strain(beam, functions, X, V1, n)
    )
    is_damped = _damped_columns(functions, X, n, strain)
    beam_patches, patch_markers = _patches(beam, functions, X, strain != "linear", patches)
    body = FlexibleBody(
        moments=moments,
        strain=tensors,
        damping=bending_damping(
            damping or Damping(ratio=0.0), moments.elastic_mass(), V1, is_damped, is_added(kinds), is_unanswered(kinds)
        ),
        markers={name: _marker(beam, functions, end, X, strain != "linear") for end, name in enumerate(("root", "tip"))}
        | patch_markers,
        skin=_skin(beam, functions, X),
        kinds=kinds,
        omega=omega,
        strain_field=(beam_field(beam, functions, X, strain != "linear", has_followers),),
        patches=beam_patches,
    )
    strains = {group: _induced_strain(beam, functions, X[:, :n], V1[:n, :n], strain) for group in induced}
    body = replace(body, induced=strains)
    if strain == "linear":
        return body
    body = with_turned_sections(body, _sections(beam, functions, X, xi, dm, offsets), range(n))
    if not has_followers:
        return body
    return with_stretch_of_slaved(condense(body, range(n, body.n_modes), lambda free: V3), body, n)


def small_motion_beam(beam: UniformBeam, functions: BeamFunctions) -> FlexibleBody:
    """The body of a straight beam whose coordinates are the functions, for small motions about rest only."""
    return _reduced_beam(beam, functions, None, False, "linear")


def beam_fields(beam: UniformBeam, functions: BeamFunctions, xi: Array, orthonormal: bool = True) -> Array:
    """Displacements and twist (n_xi, 4, n) at xi (n_xi,) [1] per coordinate of `beam_body` with linear strain."""
    at, weight = gauss(points_for(functions.max_count))
    _, dm, rho, shapes = _mass_points(beam, functions, at, weight)
    Me = point_moments(dm, rho, shapes).elastic_mass()
    X, _ = _independent_columns(beam, functions, _stiffness(beam, functions, at, weight), Me, orthonormal)
    return np.asarray(functions.fields(xi, 1.0) @ X)


def _mass_points(
    beam: UniformBeam, functions: BeamFunctions, xi: Array, weight: Array
) -> tuple[Array, Array, Array, Array]:
    """Offsets (m, 3) of the points of a section; masses, positions and shapes of all points at xi (n_xi,)."""
    offsets, share = section_points(np.array(beam.rz**2), np.array(beam.ry**2), beam.rotary_inertia)
    dm = np.outer(weight * beam.taper.mass(xi) * beam.mass_per_length * beam.length, share).ravel()
    return offsets, dm, _section_points(beam, xi, offsets), _section_point_motion(beam, functions, xi, offsets)


def _kinds(functions: BeamFunctions, X: Array, orthonormal: bool) -> tuple[str, ...]:
    """The kinds of the coordinates with columns X (count, n_independent)."""
    n_static = int(functions.added.sum()) if orthonormal and not functions.added.all() else 0
    alone = (X[: functions.n_independent][functions.only_static] ** 2).sum(axis=0) > 0.5 * (X**2).sum(axis=0)
    answering = [UNANSWERED if is_alone else "attachment" for is_alone in alone[functions.n_independent - n_static :]]
    return ("admissible",) * (functions.n_independent - n_static) + tuple(answering)


def _damped_columns(functions: BeamFunctions, X: Array, n: int, strain: str) -> BoolArray:
    """(n_columns,): whether each column X (count, n_columns) is damped.

    Dependent columns (from n on) are not, nor with nonlinear strain those that compensate the stretch by bending.
    """
    stretch = (X[functions.y + functions.z :][: functions.axial] ** 2).sum(axis=0) > (X**2).sum(axis=0) / 2
    independent = np.arange(X.shape[1]) < n
    return independent & ~stretch if strain == "nonlinear" else independent


def _independent_columns(
    beam: UniformBeam, functions: BeamFunctions, V1: Array, Me: Array, orthonormal: bool
) -> tuple[Array, Array]:
    """Columns (count, n_independent) of the coordinates over the functions, and their frequencies if they are modes.

    Those of added static shapes come last, M-orthogonal to the others.
    """
    n, is_static = functions.n_independent, functions.added
    X = np.zeros((functions.count, n))
    if not orthonormal:
        np.fill_diagonal(X, 1 / np.sqrt(beam.mass_per_length * beam.length))
        return X, np.full(n, np.nan)
    K, M = V1[:n, :n], Me[:n, :n]
    if is_static.all():
        is_static = np.zeros(n, bool)
    plain, n_static = np.eye(n)[:, ~is_static], np.eye(n)[:, is_static]
    columns, squares = np.zeros((n, 0)), np.zeros(0)
    for candidates in (plain, n_static) if n_static.size else (plain,):
        candidates = candidates - columns @ (columns.T @ (M @ candidates))
        eigenvalues, modes = dense_modes(candidates.T @ K @ candidates, candidates.T @ M @ candidates)
        columns = np.hstack([columns, candidates @ canonical_modes(eigenvalues, modes)])
        squares = np.append(squares, eigenvalues)
    if len(squares) < n:
        raise ValueError(
            f"the stiffnesses of the beam, EA = {beam.EA:.4g} N, EIy = {beam.EIy:.4g}, EIz = {beam.EIz:.4g} and GJ = "
            f"{beam.GJ:.4g} N m^2, are so far apart that {len(squares)} of {n} modes can be computed; correct them"
        )
    X[:n] = columns
    return X * _tip_signs(beam, functions, X), np.sqrt(squares)


def _dependent_columns(functions: BeamFunctions, V1: Array, Me: Array, independent: Array) -> tuple[Array, Array]:
    """Orthonormal columns of the dependent functions, K-orthogonal to the independent columns, and their frequencies.

    There are no columns where the independent ones contain all dependent functions.
    """
    n = functions.n_independent
    F = np.eye(functions.count)[:, n:]
    largest = np.linalg.eigvalsh(F.T @ V1 @ F)[-1]
    F = F - independent @ np.linalg.solve(independent.T @ V1 @ independent, independent.T @ V1 @ F)
    energy, U = np.linalg.eigh(F.T @ V1 @ F)
    F = F @ (U / np.sqrt(np.maximum(energy, RANK * largest)))[:, energy > RANK * largest]
    if not F.shape[1]:
        return F, np.zeros(0)
    eigenvalues, modes = dense_modes(F.T @ V1 @ F, F.T @ Me @ F)
    return F @ canonical_modes(eigenvalues, modes), np.sqrt(eigenvalues)


def _stiffness(beam: UniformBeam, functions: BeamFunctions, xi: Array, weight: Array) -> Array:
    """V1 = int EA u'^2 + EIz v''^2 + EIy w''^2 + GJ theta'^2 dx over the functions."""
    slope, curvature = (functions.fields(xi, beam.length, d) for d in (1, 2))
    dx, taper = weight * beam.length, beam.taper
    bending = dx * taper.bending(xi)
    terms = (
        (dx * taper.axial(xi) * beam.EA, slope[:, 0]),
        (bending * beam.EIz, curvature[:, 1]),
        (bending * beam.EIy, curvature[:, 2]),
        (bending * beam.GJ, slope[:, 3]),
    )
    V1 = sum(((f * stiffness[:, None]).T @ f for stiffness, f in terms), np.zeros((functions.count,) * 2))
    return (V1 + V1.T) / 2


def _section_points(beam: UniformBeam, xi: Array, offsets: Array) -> Array:
    """Undeformed positions (len(xi) k, 3), body frame, of points at offsets (k, 3) from the line in section axes."""
    axis = np.asarray(beam.root, float) + np.outer(xi * beam.length, beam.frame[0])
    return (axis[:, None] + offsets @ beam.frame).reshape(-1, 3)


def _section_motion(beam: UniformBeam, functions: BeamFunctions, xi: Array) -> tuple[Array, Array]:
    """Displacement and rotation (len(xi), 3, count) of the sections, body frame."""
    value, slope = functions.fields(xi, beam.length), functions.fields(xi, beam.length, 1)
    turn = np.stack([value[:, 3], -slope[:, 2], slope[:, 1]], axis=1)
    return beam.frame.T @ value[:, :3], beam.frame.T @ turn


def _section_point_motion(beam: UniformBeam, functions: BeamFunctions, xi: Array, offsets: Array) -> Array:
    """Displacement u + (theta, -w', v') x offset of such points (len(xi) k, 3, count)."""
    value, slope = functions.fields(xi, beam.length)[:, None], functions.fields(xi, beam.length, 1)[:, None]
    x, y, z = (offsets[:, i, None] for i in range(3))
    u, v, w, theta = (value[:, :, i] for i in range(4))
    dv, dw = slope[:, :, 1], slope[:, :, 2]
    local = np.stack([u - y * dv - z * dw, v - z * theta + x * dv, w + y * theta + x * dw], axis=2)
    return (beam.frame.T @ local).reshape(-1, 3, functions.count)


def _sections(beam: UniformBeam, functions: BeamFunctions, X: Array, xi: Array, dm: Array, offsets: Array) -> Sections:
    """The sections at xi, of points dm (len(xi) k,) at offsets (k, 3), turned by the functions times X."""
    o = offsets @ beam.frame
    second = np.einsum("pk,ka,kb->pab", dm.reshape(len(xi), -1), o, o)
    turn = _section_motion(beam, functions, xi)[1] @ X
    return Sections(second, np.broadcast_to(beam.frame[0], (len(xi), 3)), turn)


def _marker(beam: UniformBeam, functions: BeamFunctions, end: int, X: Array, sines: bool) -> Marker:
    """The Marker of the section at the root (0) or the tip (1); a clamped end does not move, not even by rounding.

    sines: its slopes are sines, as in the curvature of large deflections (beam_strain).
    """
    xi = np.array([float(end)])
    position = _section_points(beam, xi, np.zeros((1, 3)))[0]
    if ends_of(functions.ends)[end] == "clamped":
        return Marker.at_position(position, n_modes=X.shape[1])
    centre, turn = _section_motion(beam, functions, xi)
    return Marker(position, centre[0] @ X, turn[0] @ X, axis=beam.frame[0] if sines else np.zeros(3))


def _patches(
    beam: UniformBeam, functions: BeamFunctions, X: Array, sines: bool, groups: Sequence[str]
) -> tuple[dict[str, Patches], dict[str, Marker]]:
    """Patches along the whole beam, if asked for, and their markers: equal lengths, integrated by Gauss quadrature."""
    if other := [group for group in groups if group != "all"]:
        raise ValueError(f"a beam on admissible functions has no group {other[0]!r}; loads are spread over 'all' of it")
    if not groups:
        return {}, {}
    x, weight = gauss(points_for(functions.max_count))
    xi = (np.arange(FLAT)[:, None] + x) / FLAT
    centre, turn = (rows.reshape(FLAT, len(x), 3, -1) for rows in _section_motion(beam, functions, xi.ravel()))
    size = np.full(FLAT, beam.length / FLAT)
    position = np.asarray(beam.root, float) + np.outer(xi @ weight * beam.length, beam.frame[0])
    phi, psi = (np.einsum("q,cqan->can", weight, rows) @ X for rows in (centre, turn))
    tangents = np.outer(size, beam.frame[0])
    ends = position[:, None] + np.array([-0.5, 0.5, 0.5, 0.5])[:, None] * tangents[:, None]
    cells = CellMotion(size, position, tangents, phi, psi, ends)
    patches, markers = mean_markers("all", cells, 1, sines=sines)
    return {"all": patches}, markers


def _induced_strain(beam: UniformBeam, functions: BeamFunctions, X: Array, V1: Array, strain: str) -> InducedStrain:
    """Forces of strain induced in each patch on the coordinates with columns X (count, n).

    Held at both ends, a heated part presses on the whole beam; the force is that of the beam's mean flexibility.
    """
    x, weight = gauss(points_for(functions.max_count))
    xi = ((np.arange(FLAT)[:, None] + x) / FLAT).ravel()
    dx, C = np.tile(weight, FLAT) * beam.length / FLAT, np.ones((3, len(xi)))
    slope, curvature = (functions.fields(xi, beam.length, d) @ X for d in (1, 2))
    C[0], C[1], C[2] = beam.EA * beam.taper.axial(xi), *np.outer([beam.EIz, beam.EIy], beam.taper.bending(xi))
    rows = np.stack([slope[:, 0], curvature[:, 1], curvature[:, 2]])  # eps = u' - y v'' - z w''
    axes = patch_axes(1, np.tile(beam.frame[0], (FLAT, 1)))
    across = axes[0, 1:] @ beam.frame[1:].T  # patch's y and z over the section's
    sign = np.block([[np.ones((1, 1)), np.zeros((1, 2))], [np.zeros((2, 1)), -across]])
    work = np.einsum("rp,rpn->rpn", C * dx, rows).reshape(3, FLAT, -1, X.shape[1]).sum(axis=2)
    f0 = -np.einsum("cr,rkn->kcn", sign, work)
    stiffness = (C * dx).reshape(3, FLAT, -1).sum(axis=2).T * (FLAT / beam.length)
    stiffness[:, 1:] = stiffness[:, 1:] @ (across.T**2)
    change = np.zeros((*f0.shape, X.shape[1]))
    if "free" not in ends_of(functions.ends):
        force = np.full((FLAT, len(xi)), -beam.length / FLAT / np.sum(dx / C[0]))
        if strain != "linear":
            force += C[0] * (slope[:, 0] @ np.linalg.solve(V1, f0[:, 0].T)).T
        steep = slope[:, 1:3]
        change[:, 0] = np.einsum("kp,psa,psb->kab", force * dx, steep, steep, optimize=True)
    return InducedStrain(LINES, axes, f0, change, stiffness)


def _tip_signs(beam: UniformBeam, functions: BeamFunctions, X: Array) -> Array:
    """Signs (n,) by the rule of modes.signed: the largest translation positive, the tip's in a tie."""
    centre, turn = _section_motion(beam, functions, np.linspace(1.0, 0.0, 201))
    return signs(np.concatenate([centre, TURN * beam.length * turn]).reshape(-1, functions.count) @ X)


def _skin(beam: UniformBeam, functions: BeamFunctions, X: Array) -> Skin:
    """The surface for drawing: a tube of the beam's radius, or a line."""
    xi = np.linspace(0.0, 1.0, 1 + 4 * max(5, functions.y, functions.z, functions.axial, functions.torsion))
    if beam.radius is None:
        offsets, cells = np.zeros((1, 3)), {"line": np.stack([np.arange(len(xi) - 1), np.arange(1, len(xi))], axis=1)}
    else:
        angle = np.arange(SIDES) * 2 * np.pi / SIDES
        offsets = beam.radius * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
        at, side = np.meshgrid(np.arange(len(xi) - 1), np.arange(SIDES), indexing="ij")
        ring = np.stack([at, at + 1, at + 1, at], axis=-1) * SIDES
        around = np.stack([side, side, (side + 1) % SIDES, (side + 1) % SIDES], axis=-1)
        cells = {"quad": (ring + around).reshape(-1, 4)}
    shapes = _section_point_motion(beam, functions, xi, offsets) @ X
    return Skin(_section_points(beam, xi, offsets), cells, np.ascontiguousarray(shapes.transpose(2, 0, 1)))
