"""Warnings about four-node shells that are known to be inaccurate: coarse meshes of curved shells, and trapezoids.

On the pinched cylinder (docs/howto/elements.md) such elements of length s sqrt(R h) are 1 + 0.08 s^2 times as stiff as
the shell. The first four frequencies of a clamped cylindrical panel (R / h = 400) are within 1 % at s = 2 and 2 to 20 %
too low at s = 4.

In its plane a trapezoid of aspect ratio a whose ends lean by an angle delta each is 1 + (a tan delta)^2 times as stiff
in bending as the strip: 26 for MacNeal and Harder's straight beam of trapezoids, where 19 is found
(R. H. MacNeal, Finite Elements in Analysis and Design 3 (1987) 175).
"""

from __future__ import annotations

import warnings

import numpy as np

from femflex.arrays import Array
from femflex.fem.limits import FEW_SHELLS, LONG_LINEAR_SHELL, LONG_SHELL, SHELL_STIFFNESS_ERROR, TAPERED_SHELL
from femflex.warning import PhysicsWarning


def warn_if_coarse(x: Array, V: Array, thickness: Array, where: str) -> None:
    """Warn of elements with nodes x (e, k, 3) [m], directors V (e, k, 3) and thicknesses (e,) [m] that are long against
    sqrt(R h): k = 4 above LONG_LINEAR_SHELL, nine and six nodes above LONG_SHELL."""
    sides = 3 if x.shape[1] == 6 else 4
    corners, corner_directors = x[:, :sides], V[:, :sides]
    edge, director_change = (
        np.roll(corners, -1, axis=1) - corners,
        np.roll(corner_directors, -1, axis=1) - corner_directors,
    )
    square = np.sum(edge * edge, axis=2)
    curvature = np.abs(np.sum(edge * director_change, axis=2) / square).max(axis=1)
    length = np.sqrt(square.max(axis=1))
    ratio = length * np.sqrt(curvature / thickness)
    limit = LONG_LINEAR_SHELL if x.shape[1] == 4 else LONG_SHELL
    coarse = ratio > limit
    if not coarse.any():
        return
    worst = int(np.argmax(ratio))
    long = f"{_element_text(worst, x)}, is {length[worst]:.3g} m long against {length[worst] / ratio[worst]:.3g} m"
    if limit == LONG_SHELL:
        warnings.warn(
            PhysicsWarning(
                "{body_or_joint}: {coarse} of {count} second-order elements are longer than {limit:g} sqrt(R h); the "
                "worst, {long}. Low modes of a thin dish are 5 % too high at 13 sqrt(R h) and 2.6 times too high at "
                "26.",
                body_or_joint=where,
                value=ratio[worst],
                limit=LONG_SHELL,
                remedy="Mesh finer, or give refine = 1",
                coarse=int(coarse.sum()),
                count=len(x),
                long=long,
            ),
            stacklevel=5,
        )
        return
    warnings.warn(
        PhysicsWarning(
            "{body_or_joint}: {coarse} of {count} four-node elements are longer than {limit:g} sqrt(R h), and a curved "
            "shell bends over a length sqrt(R h) at concentrated loads and edges; the worst, {long}. There the shell "
            "is up to {stiffer:.3g} times as stiff as it should be; low modes bend smoothly and are within 1 % up to 2 "
            "sqrt(R h) and 20 % off at 4 sqrt(R h).",
            body_or_joint=where,
            value=ratio[worst],
            limit=LONG_LINEAR_SHELL,
            remedy="Mesh finer there, or use eight- or nine-node elements",
            coarse=int(coarse.sum()),
            count=len(x),
            long=long,
            stiffer=1 + SHELL_STIFFNESS_ERROR * ratio[worst] ** 2,
        ),
        stacklevel=5,
    )


def tapers(x: Array) -> Array:
    """a tan(delta) (e,) [1] of quadrilaterals x (e, 4, 3) [m]: zero of parallelograms."""
    length = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
    area = np.linalg.norm(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]), axis=1) / 2
    taper = np.zeros(len(x))
    for k in (0, 1):  # sides k and k + 2 run along
        along = (length[:, k] + length[:, k + 2]) / 2
        height = area / along
        lean = np.abs(length[:, k] - length[:, k + 2]) / (2 * height)  # tan(delta)
        taper = np.maximum(taper, np.where(along > height, along / height * lean, 0.0))
    return taper


def warn_of_trapezoids(x: Array, where: str) -> None:
    """Warn of four-node elements x (e, 4, 3) [m] that taper so much that they lock in their plane."""
    taper = tapers(x)
    locked = taper > TAPERED_SHELL
    if locked.mean() <= FEW_SHELLS:
        return
    worst = int(np.argmax(taper))
    warnings.warn(
        PhysicsWarning(
            "{body_or_joint}: {locked} of {count} four-node elements are trapezoids that lock in their plane; one "
            "layer of the worst, {worst}, is up to {value:.3g} times as stiff in bending in its plane as it should be.",
            body_or_joint=where,
            value=1 + taper[worst] ** 2,
            limit=1.0,
            remedy="Use rectangles or parallelograms, or eight- or nine-node elements",
            locked=int(locked.sum()),
            count=len(x),
            worst=_element_text(worst, x),
        ),
        stacklevel=5,
    )


def _element_text(element: int, x: Array) -> str:
    return f"element {element} at ({', '.join(f'{c:.6g}' for c in x[element].mean(axis=0))}) m"
