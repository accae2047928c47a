"""Which loads have a static shape that a set of vibration modes can take in without becoming stiff."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from femflex.fem.eigen.modes import factorised
from femflex.fem.structure import Structure
from femflex.reduction.clamps import free_dofs
from femflex.reduction.modes import ANSWERED, load_vectors
from femflex.reduction.modeset import ModeSet

FASTEST = 8.0  # frequency of a load's static shape over the highest of a set that it may join: the rest of an end load
# that one mode leaves has 6.5, and a pull along a beam 100 times its radius of gyration some 40


def slow_loads(
    structure: Structure,
    modes: ModeSet,
    directions: Sequence[str] = (),
    loads: Mapping[str, Sequence[str]] | None = None,
    fastest: float = FASTEST,
) -> tuple[list[str], dict[str, list[str]]]:
    """Those of the accelerations and loads (`with_attachment`) whose static shape is slow beside a clamped set.

    What the modes leave of the answer to one of them has a frequency of its own, sqrt(x.K x / x.M x). That of a pull
    along a slender beam is far above the modes': it would be the one stiff coordinate of the body. fastest: over the
    highest of the set.
    """
    free = free_dofs(structure, modes.held)
    solve = factorised(structure.K[free][:, free]).solve
    K, M, phi = structure.K[free][:, free], structure.M[free][:, free], modes.phi[free]
    bound = (fastest * modes.omega.max(initial=0.0)) ** 2

    def slow(base: Sequence[str], ends: Mapping[str, Sequence[str]]) -> list[bool]:
        F = load_vectors(structure, base, ends)[free]
        rest = F - M @ (phi @ (phi.T @ F))
        x = solve(np.ascontiguousarray(rest))
        size, stiffness = (np.einsum("in,in->n", x, A @ x) for A in (M, K))
        left = np.linalg.norm(rest, axis=0) > ANSWERED * np.linalg.norm(F, axis=0)
        return list(left & (stiffness < bound * size))

    found = {
        group: [d for d, ok in zip(own, slow((), {group: own}), strict=True) if ok]
        for group, own in (loads or {}).items()
    }
    base = [d for d, ok in zip(directions, slow(directions, {}), strict=True) if ok] if directions else []
    return base, {group: own for group, own in found.items() if own}
