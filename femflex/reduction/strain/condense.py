"""The condensed form of a body (quadratic manifold): shapes that depend statically on bending are no coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody, MassMoments, StrainTensors
from femflex.body.symmetric import packed, packed_size, selected, unpacked
from femflex.fem.eigen.shift_invert import dense_modes
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.inertia.accelerations import loads_of_linear_accelerations
from femflex.reduction.modes.vibration import ModeSet, static_response
from femflex.reduction.strain.tensors import packed_quartic

DEPENDENT = 1e-12  # of the largest eigenvalue of V1 over the slaved shapes; below it a combination carries no strain
CARRIED = 1.0  # frequency of a coordinate over the sum of a pair's, above which the pair carries it along
LOCKING = 0.05  # share of a coordinate's quartic energy that this releases, below which nothing is carried along
NONE = 1e-8  # of the largest amplitude, by energy: smaller amplitudes carried along are rounding
UNCOUPLED = 1e-12  # of the two shapes' stiffness: smaller coupling is rounding
BALANCED = 1e-9  # initial force on a slaved shape, against its stiffness times a unit amplitude


def condense(
    body: FlexibleBody,
    slaved: Sequence[int] | IntArray,
    quartic: Callable[[IntArray], Array] | None = None,
    first: Array | None = None,
    carried: Array | None = None,
    balanced: bool = False,
) -> FlexibleBody:
    """The body with the shapes `slaved` (k,), numbers from 0, slaved to the others: y = 1/2 delta.A delta.

    The slaved shapes are first made K-orthogonal to the others, V1_fs = 0, which stay as they are: the static responses
    in these, such as those to end moments of a member, are kept. The slaved amplitudes minimise the strain energy to
    second order in delta, A_s = -6 V1_ss^-1 V2_s. The remaining V is exact to fourth order, with V3 - 1/4 A V1_ss A
    instead of V3; it has no stiffness of the slaved shapes, but their inertia is kept (dynamics.slaves). Sections that
    are dependent already stay so.
    quartic: a function that returns the packed V3 over the coordinates of given numbers, for a body without V3.
    first (n, n): the part of these coordinates that is of first order (`first_order_part`), by default all of it; the
    slaved shapes depend on this part only, and energy beyond fourth order is dropped.
    carried (n, n, n): the part of V2 over these coordinates (`membrane_cubic`) by which pairs of coordinates carry
    faster ones along (`carried_along`). The faster ones are then measured from this position, if the body would lock
    otherwise (`locked`); additional slaved shapes of kind "carried" represent it.
    balanced: loads of the system balance the initial force f0 of the slaved shapes (`static_equilibrium`). Since these
    loads act on the slaved shapes, they provide the stiffening; f0 removes it from V1, V1 + f0 A.

    Raises ValueError if the body has linear strain or slaved shapes already, if no coordinate or no slaved shape is
    left, if shapes are linearly dependent, or if an unbalanced initial stress loads a slaved shape.
    """
    slaved = np.unique(np.asarray(slaved, np.int64))
    _check(body, slaved)
    n = body.n_modes
    free = np.setdiff1d(np.arange(n), slaved)
    V1 = (body.strain.V1 + body.strain.V1.T) / 2
    stiffness, V1_sf = V1[np.ix_(slaved, slaved)], V1[np.ix_(slaved, free)]
    _check_stiffness(body, slaved, stiffness, balanced)
    X = np.zeros((n, n))
    X[free, np.arange(len(free))] = 1.0
    X[slaved, len(free) + np.arange(len(slaved))] = 1.0
    size = np.sqrt(np.outer(np.diag(stiffness), np.diag(V1)[free]))
    if np.any(np.abs(V1_sf) > UNCOUPLED * size):
        X[free, len(free) :] = -np.linalg.lstsq(V1[np.ix_(free, free)], V1_sf.T, rcond=None)[0]
    first = np.eye(len(free)) if first is None else first
    moved = np.zeros((len(free),) * 3)
    if carried is not None:
        Me = body.moments.elastic_mass()[np.ix_(free, free)]
        moved = carried_along(V1[np.ix_(free, free)], Me, first.T @ carried @ first)
    strain, A = _condensed_strain(body.strain, X, free, quartic, first, moved)
    combined, slaves = _columns(np.diag(strain.V1), A[: len(free)])
    X, slaves = np.column_stack([X, X[:, : len(free)] @ combined]), np.concatenate([A[len(free) :], slaves])
    more, m = combined.shape[1], len(body.slaves)
    whole = np.block([[X, np.zeros((n, m))], [np.zeros((m, n + more)), np.eye(m)]])
    order, sections = np.concatenate([free, slaved]), np.arange(n, body.n_shapes)
    slaves = np.concatenate([slaves, body.slaves[:, free][:, :, free]]) if m else slaves
    return replace(
        body,
        **recombined(body, whole, first),
        strain=strain,
        damping=body.damping[np.ix_(free, free)],
        kinds=tuple(body.kinds[k] if k >= 0 else "carried" for k in [*order, *[-1] * more, *sections] if body.kinds),
        omega=np.concatenate([body.omega[order], np.full(more, np.nan), body.omega[sections]])
        if body.omega.size
        else body.omega,
        slaves=slaves,
    )


def recombined(body: FlexibleBody, X: Array, first: Array) -> dict[str, Any]:
    """Moments, markers, skin and strain field over the shapes phi X, X (n, m).

    first (k, k): the part of the first k of them that is of first order; the others are of second (StrainPart).
    """
    m, k = X.shape[1], len(first)
    first = np.pad(first, (0, m - k))
    Z = np.zeros((1 + X.shape[0], 1 + m))
    Z[0, 0], Z[1:, 1:] = 1.0, X
    moments, skin = body.moments, body.skin
    second = np.einsum("AaBb,AC,BD->CaDb", moments.second, Z, Z, optimize=True)
    return {
        "moments": MassMoments(moments.mass, Z.T @ moments.first, second),
        "markers": {key: replace(m, phi=m.phi @ X, psi=m.psi @ X) for key, m in body.markers.items()},
        "skin": None if skin is None else replace(skin, shapes=np.einsum("kpa,kl->lpa", skin.shapes, X, optimize=True)),
        "strain_field": tuple(part.transformed(X, first) for part in body.strain_field),
        "mass_points": None if body.mass_points is None else body.mass_points.transformed(X),
    }


def _condensed_strain(
    strain: StrainTensors,
    X: Array,
    free: IntArray,
    quartic: Callable[[IntArray], Array] | None,
    first: Array,
    moved: Array,
) -> tuple[StrainTensors, Array]:
    """Strain tensors over the free shapes, and A (size, n, n) of all shapes phi X: they are at (delta, 0) + 1/2 d.A d.

    moved (n, n, n): A of the free ones.
    """
    size, n = len(X), len(free)
    V2 = unpacked(strain.V2, size, 3)[:, free][:, :, free] if strain.V2.size else np.zeros((size, n, n))
    V2 = np.tensordot(X.T, V2, axes=1)
    V1, driven = X.T @ ((strain.V1 + strain.V1.T) / 2) @ X, first.T @ V2 @ first
    followers = np.asarray(
        -6.0 * np.linalg.solve(V1[n:, n:], driven[n:].reshape(size - n, -1)).reshape(-1, n, n), np.float64
    )
    unit = np.sqrt(np.maximum(np.abs(np.diag(V1)), DEPENDENT * np.abs(np.diag(V1)).max()))
    if quartic is not None:
        V3 = quartic(free)
    else:
        V3 = selected(strain.V3, size, free, 4) if strain.V3.size else np.zeros(packed_size(n, 4))
    V3 = with_first_order(V3, first) + _followed(V1[n:, n:], driven[n:], followers)
    A = np.concatenate([moved if locked(V1[:n, :n], V3, moved) else np.zeros_like(moved), followers])
    sizes = np.abs(A * unit[:, None, None] / np.outer(unit[:n], unit[:n])).max(axis=(1, 2))
    A[:n][sizes[:n] <= NONE * sizes.max()] = 0.0
    V3 = V3 + _followed(V1[:n, :n], driven[:n], A[:n])
    V2 = to_fourth_order(V2[:n], first) + 0.5 * np.tensordot(V1[:n, :n], A[:n], axes=1)
    stiffness = strain.V1[np.ix_(free, free)] + np.tensordot(X[:, n:].T @ strain.f0, followers, axes=1)
    return StrainTensors(stiffness, strain.f0[free], packed(V2), V3), A


def _followed(V1: Array, driven: Array, A: Array) -> Array:
    """The packed change of V3 by shapes of stiffness V1, excited by V2 (k, n, n), with amplitudes d.A d / 2."""
    i, j = np.triu_indices(A.shape[1])
    pairs = (0.25 * np.tensordot(V1, A, axes=1) + 3.0 * driven)[:, i, j].T @ A[:, i, j]
    return packed_quartic((pairs + pairs.T) / 2, A.shape[1])


def locked(V1: Array, V3: Array, moved: Array) -> bool:
    """Whether slaved coordinates, A = moved (n, n, n), relax a share LOCKING [1] of the quartic energy V3 of any other.

    In a folded member this is most of the energy: its legs move each other without stretch. In a shallow arch, which
    stretches as it bends, it is very little; there the omitted fifth order would be larger (0.6 % in the amplitude of
    an internal resonance).
    """
    n = len(V1)
    every = np.arange(n)
    moves = moved[:, every, every]
    back = np.einsum("ki,kl,li->i", moves, V1, moves) / 4
    held = np.array([selected(V3, n, every[i : i + 1], 4)[0] for i in every])
    return bool(np.any(back > LOCKING * np.abs(held)))


def carried_along(V1: Array, Me: Array, driven: Array) -> Array:
    """A (n, n, n) of coordinates that slower pairs of others carry along: -6 V2 / omega^2 in their modes.

    A bent leg of a folded member pulls the next one along by its foreshortening. Otherwise a fast mode of the next leg
    and the derivatives would have to bend in opposite directions: rotations that cancel, while their products remain.
    """
    square, Q = dense_modes(V1, Me)
    omega, back = np.sqrt(np.maximum(square, np.finfo(float).tiny)), Q.T @ Me
    A = -6.0 * np.einsum("kij,ka,ib,jc->abc", driven, Q, Q, Q, optimize=True) / (omega**2)[:, None, None]
    A *= omega[:, None, None] >= CARRIED * np.add.outer(omega, omega)
    return np.asarray(np.einsum("abc,ka,bi,cj->kij", A, Q, back, back, optimize=True))


def _columns(stiffness: Array, A: Array) -> tuple[Array, Array]:
    """Combinations (n, k) of shapes of that stiffness, and their A (k, n, n), that represent A (n, n, n)."""
    unit = np.sqrt(np.maximum(np.abs(stiffness), DEPENDENT * np.abs(stiffness).max(initial=0.0)))
    scaled = A * unit[:, None, None] / np.outer(unit, unit)
    U, part, V = np.linalg.svd(scaled.reshape(len(A), -1), full_matrices=False)
    kept = part > NONE * part.max(initial=0.0)
    slaves = (part[kept, None] * V[kept]).reshape(-1, *A.shape[1:]) * np.outer(unit, unit)
    return U[:, kept] / unit[:, None], slaves


def to_fourth_order(V2: Array, first: Array) -> Array:
    """V2 (n, n, n) without its terms that have more than one index of second order.

    first (n, n): the part of first order. Only the mean of the result over permutations of its indices is symmetric.
    """
    with_two = first.T @ V2 @ first  # one index as it is
    of_first = np.tensordot(first.T, with_two, axes=1)
    return np.asarray(3.0 * with_two - 2.0 * of_first)


def with_first_order(V3: Array, first: Array) -> Array:
    """Packed V3 (k,) with all of its indices of first order."""
    n = len(first)
    if np.array_equal(first, np.eye(n)):
        return V3
    full = unpacked(V3, n, 4)
    for _ in range(4):  # the last index goes to the front each time
        full = np.moveaxis(full @ first, -1, 0)
    return packed(full)


def _check(body: FlexibleBody, slaved: IntArray) -> None:
    n = body.n_modes
    if body.condensed:
        raise ValueError("the body is condensed already; condense the one it was made from.")
    if body.strain.is_linear:
        raise ValueError(
            "a body with linear strain has nothing that couples bending to stretch; give it V2 and V3 "
            "(strain = 'nonlinear') before it is condensed."
        )
    if not len(slaved) or len(slaved) >= n or slaved[0] < 0 or slaved[-1] >= n:
        raise ValueError(
            f"{len(slaved)} of {n} shapes were requested as dependent, numbers {slaved.tolist()}; "
            f"name at least one from 0 to {n - 1}, and leave at least one coordinate."
        )


def _check_stiffness(body: FlexibleBody, slaved: IntArray, stiffness: Array, balanced: bool) -> None:
    eigenvalues = np.linalg.eigvalsh(stiffness)
    if not eigenvalues[0] > DEPENDENT * eigenvalues[-1]:
        raise ValueError(
            f"the dependent shapes are linearly dependent, or carry no strain: the eigenvalues of their stiffness run "
            f"from {eigenvalues[0]:.3g} to {eigenvalues[-1]:.3g}; leave out shapes that others represent."
        )
    push = np.abs(body.strain.f0[slaved]).max()
    if not balanced and push > BALANCED * eigenvalues[0]:
        raise ValueError(
            f"the initial stress loads the dependent shapes by up to {push:.3g} (stiffness from {eigenvalues[0]:.3g}); "
            "the condensed form needs an initial stress in equilibrium. Keep these shapes as coordinates."
        )


# Selection of the dependent (statically condensed) derivatives: those faster than their excitation.
#
# A dependent coordinate is at its static value, y = -3 V2_s delta delta / V1_ss. That holds while its excitation is
# slow compared with its own frequency, and while the stiffness that others add to it, 6 V2_ss delta, is small compared
# with its own: the condensed form leaves it out. The stretch due to bending is such a shape. The bending that a
# stretching or twisting coordinate causes in a body already bent is not. It is slower than the stretch, and a tension
# of a third of its buckling load changes its stiffness by a third. Frequencies tell the two apart.


FASTER = 2.0  # frequency of a shape over that of its excitation, above which it is dependent


def dependent_derivatives(body: FlexibleBody, shapes: IntArray) -> IntArray:
    """Numbers (k,) of the shapes that are dependent on the others: FASTER than their excitation.

    The others, in their own modes of frequency omega_i, have the amplitudes 1 / omega_i^2 of equal static loads. The
    product i j of them excites shape s by V2_sij / (omega_i omega_j)^2, with a frequency omega_i + omega_j. The shape
    is compared with the root mean square of these sums, weighted by the squares of the excitations.
    """
    n, Me = body.n_modes, body.moments.elastic_mass()
    others = np.setdiff1d(np.arange(n), shapes)
    square, Q = dense_modes(body.strain.V1[np.ix_(others, others)], Me[np.ix_(others, others)])
    omega = np.sqrt(np.maximum(square, np.finfo(float).tiny))
    V2 = unpacked(body.strain.V2, n, 3)[np.ix_(shapes, others, others)]
    static = Q * (omega[0] / omega) ** 2
    drive = np.einsum("sij,ia,jb->sab", V2, static, static, optimize=True) ** 2
    drive_squares = np.einsum("sab,ab->s", drive, np.add.outer(omega, omega) ** 2)
    squares = np.diag(body.strain.V1)[shapes] / np.diag(Me)[shapes]
    return np.asarray(shapes[squares * drive.sum(axis=(1, 2)) >= FASTER**2 * drive_squares])


# Static stretch of condensed bodies under accelerations, at markers: the part that no coordinate represents.
#
# Stretch is not a coordinate of a condensed body. The stretch by bending is a dependent one; that by spin, acceleration
# and weight is not, though a boom of length L that spins at Om about its root grows by m Om^2 L^3 / 3 EA. Far below the
# frequencies of stretch it is static, and linear in the field of acceleration of the body's own mass (mode acceleration
# method, R. L. Bisplinghoff, H. Ashley and R. L. Halfman, Aeroelasticity, 1955).
#
# The whole response beyond the shapes is included, also the bending of sheets in their own planes: when a plate at an
# angle of 60 degrees is spun up, this cancels three quarters of the stretch at its corner.


REPRESENTED = 1e-8  # residual share of a response's strain energy, below which the coordinates represent it


def with_static_stretch(
    structure: Structure, modes: ModeSet, body: FlexibleBody, free: IntArray, groups: dict[str, str]
) -> FlexibleBody:
    """The body with the static stretch of its markers. free (n,): numbers of its coordinates among the set.

    groups: marker -> mesh group. The field is that of the undeformed positions: for a plate bent by four thicknesses
    the remaining effect of spin is 0.1 % of the foreshortening at its corner.
    """
    x = static_stretch(structure, modes, modes.phi[:, free])
    if not x.any():
        return body
    displacements = {name: marker_rows(structure, group).translation @ x for name, group in groups.items()}
    stretch = {name: rows.reshape(3, 4, 3) for name, rows in displacements.items()}
    return replace(
        body, markers={key: replace(m, stretch=stretch.get(key, m.stretch)) for key, m in body.markers.items()}
    )


def with_stretch_of_slaved(body: FlexibleBody, full_body: FlexibleBody, n: int) -> FlexibleBody:
    """A condensed straight beam on functions with the static stretch of its markers.

    full_body: the body before condensation, with dependent shapes from n on
    """
    V1, m = full_body.strain.V1, full_body.n_modes
    uniform, linear = full_body.moments.first[1 : 1 + m], full_body.moments.second[0][:, 1 : 1 + m]
    work = np.concatenate([uniform[:, None], linear.swapaxes(0, 1)], axis=1).reshape(m, 12)
    x = np.linalg.solve(V1, work)
    x[:n] -= np.linalg.solve(V1[:n, :n], work[:n])
    stretch = {key: (marker.phi[:, :m] @ x).reshape(3, 4, 3) for key, marker in full_body.markers.items()}
    return replace(body, markers={key: replace(marker, stretch=stretch[key]) for key, marker in body.markers.items()})


def static_stretch(structure: Structure, modes: ModeSet, phi: Array) -> Array:
    """Static displacements (n_dof, 12) [m, rad] in 12 fields z_a e_b of force per mass, outside the shapes phi."""
    load = loads_of_linear_accelerations(structure)
    response = static_response(structure, modes, load)
    x = response - phi @ np.linalg.solve(phi.T @ (structure.K @ phi), phi.T @ load)
    energy, size = (np.einsum("in,in->n", part, structure.K @ part) for part in (x, response))
    x[:, energy <= REPRESENTED * size] = 0.0
    return np.asarray(x)
