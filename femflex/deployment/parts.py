"""Everything of a deploying member as series in lambda = L / L_0, whatever its family."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, TypeVar

import numpy as np

from femflex.arrays import Array
from femflex.deployment.foreshortening import slaved_shapes_of
from femflex.deployment.material import inertia_of
from femflex.deployment.series import Series, added
from femflex.deployment.shapes import MemberShapes, ShapeFunctions
from femflex.deployment.table import DeployingParts, MarkerSeries
from femflex.fem.eigen.shift_invert import canonical_modes, dense_modes

Shapes = TypeVar("Shapes", bound=MemberShapes)
Strain = Literal["linear", "condensed"]


def member_parts(
    shapes: MemberShapes,
    total: float,
    strain: Strain = "condensed",
    damping: float | Sequence[float] = 0.0,
    at_tip: bool = False,
    markers: Mapping[str, float] | None = None,
) -> tuple[DeployingParts, MemberShapes]:
    """Series of a deploying member, and its shapes with their columns and followers.

    shapes      without columns (X) and followers
    total       mass of the whole member, deployed and stowed [kg]
    strain      "condensed": bending draws the member in, so that axial loads and inertia stiffen or soften it to second
                order (THEORY section 6); "linear": they do not
    damping     fraction of critical damping of each coordinate at every length
    markers     name -> xi, in addition to "root" and "tip"
    """
    xi, weight = shapes.quadrature
    V1: Series = {0: np.zeros((0, 0))}
    if shapes.functions is not None:
        X, V1 = _columns(shapes.functions, *shapes.matrices(xi, weight))
        shapes = with_columns(shapes, X, strain == "condensed")
    drum = shapes.material_points(np.array([1.0 if at_tip else 0.0]), np.ones(1))
    n, followers = shapes.n, shapes.followers
    parts = DeployingParts(
        reference=shapes.reference,
        inertia=inertia_of(shapes.material_points(xi, weight), drum, shapes.member_mass, total, at_tip),
        V1=V1,
        V3=shapes.quartic(xi, weight) if followers is not None else {},
        damping=_damping(V1, n, damping),
        markers={
            "root": exit_marker(shapes),
            **{k: shapes.marker(xi) for k, xi in {"tip": 1.0, **(markers or {})}.items()},
        },
        slaves=np.zeros((0, n, n)) if followers is None else followers.slaves,
        kinds=("admissible",) * n + ("derivative",) * (shapes.n_shapes - n),
    )
    return parts, shapes


def exit_marker(shapes: MemberShapes) -> MarkerSeries:
    """The exit, which does not turn with the member: strings have a slope there."""
    no_rows = {0: np.zeros((3, shapes.n_shapes))}
    return MarkerSeries({0: np.asarray(shapes.axes.root, float)}, no_rows, no_rows, shapes.axes.frame.T)


def with_columns(shapes: Shapes, X: Array, condensed: bool) -> Shapes:
    """Return the shapes with their columns X (functions, n) [1], and with slaved shapes if the strain is condensed."""
    shapes = replace(shapes, X=X)
    if not condensed:
        return shapes
    xi, weight = shapes.quadrature
    return replace(shapes, followers=slaved_shapes_of(*shapes.slopes(xi), weight, shapes.knots))


def columns_of(functions: ShapeFunctions, M: Array, K: Array) -> Array:
    """Columns (n_functions, n) over the functions, orthonormal over the mass matrix M: vibration modes if K allows.

    For elements, the requested number of modes of each field is kept.

    Raises ValueError for elements of a member that has no stiffness of its own.
    """
    blocks = getattr(functions, "blocks", None)
    regular = np.linalg.matrix_rank(K) == len(K)
    if blocks is None:
        return canonical_modes(*dense_modes(K, M)) if regular else np.linalg.inv(np.linalg.cholesky(M)).T
    if not regular:
        raise ValueError(
            "elements were requested for a member without transverse stiffness; give it a tension, or use polynomial "
            "functions"
        )
    columns, omega2 = [], []
    for functions_of_field, n_modes in blocks:
        omega2_of_field, modes = dense_modes(
            K[np.ix_(functions_of_field, functions_of_field)], M[np.ix_(functions_of_field, functions_of_field)]
        )
        X = np.zeros((len(K), n_modes))
        X[functions_of_field] = canonical_modes(omega2_of_field, modes)[:, :n_modes]
        columns.append(X)
        omega2.append(omega2_of_field[:n_modes])
    return np.concatenate(columns, axis=1)[:, np.argsort(np.concatenate(omega2), kind="stable")]


def _columns(functions: ShapeFunctions, M: Array, V1: Series) -> tuple[Array, Series]:
    """Columns over the functions, and V1 over them."""
    X = columns_of(functions, M, sum(V1.values(), np.zeros_like(M)))
    zeros = np.zeros((X.shape[1], X.shape[1]))
    return X, added(*({p: X.T @ part @ X} for p, part in V1.items() if part.any())) or {0: zeros}


def _damping(V1: Series, n: int, ratio: float | Sequence[float]) -> Series:
    """2 ratio omega Me of each shape at every length, with Me as lambda: the power of lambda is half of V1's and 1."""
    ratios = np.broadcast_to(np.asarray(ratio, float), (n,)) if np.ndim(ratio) == 0 else np.asarray(ratio, float)
    if len(ratios) != n:
        raise ValueError(f"{len(ratios)} damping ratios were given for {n} coordinates; give one, or one for each")
    diagonal = {p: 2.0 * ratios * np.sqrt(np.maximum(np.diag(part), 0.0)) for p, part in V1.items()}
    return added(*({(p + 1) // 2: np.diag(part)} for p, part in diagonal.items())) or {0: np.zeros((n, n))}


def resting_rates(shapes: MemberShapes, length: float, rate: float, delta: Array, rest: str) -> Array:
    """Rates (n,) [delta/s] of coordinates delta (n,) at which the deflection is at rest; rest: as
    `DeployingBody.resting_rates`."""
    if rest == "coordinates" or not shapes.n:
        return np.zeros(shapes.n)
    xi, weight = shapes.quadrature
    points = shapes.material_points(xi, weight)
    xi_rate = points.xi if rest == "place" else points.xi - 1.0
    columns = slice(1, 1 + shapes.n)
    phi, slope = points.values[0][:, :, columns], points.slopes[0][:, :, columns]
    M = np.einsum("k,kai,kaj->ij", points.share, phi, phi)
    projected = np.einsum("k,kai,kaj,j->i", points.share * xi_rate, phi, slope, delta, optimize=True)
    return np.asarray(rate / length * np.linalg.solve(M, projected))
