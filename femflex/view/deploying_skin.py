"""Pictures of deploying bodies: the growth of the length is an additional shape, which is not magnified.

The skin is that at the first length L_0. Its points move by growth (L / L_0 - 1); foreshortening
shapes are scaled by L_0 / L.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.body import Skin
from femflex.results import Run


def skin_with_growth(skin: Skin) -> Skin:
    """The skin with its growth as the last shape; itself where it does not grow."""
    if skin.growth is None:
        return skin
    return Skin(skin.points, skin.cells, np.concatenate([skin.shapes, skin.growth[None]]), skin.growth)


def deploying_bodies(run: Run, names: list[str]) -> list[str]:
    """The bodies of a run that deploy."""
    return [name for name in names if f"bodies/{name}/length" in run]


def amplitudes_with_growth(run: Run, name: str, length: Array, delta: Array, scale: float) -> Array:
    """Amplitudes (n_t, n + 1) [kg^1/2 m] of the shapes of a skin with growth at lengths (n_t,), before
    magnification."""
    ratio = length / float(run[f"bodies/{name}/length"][0])
    follows = np.array([kind == "derivative" for kind in run.bodies()[name].kinds], np.bool_)
    delta = np.where(follows, delta / ratio[:, None], delta)
    return np.concatenate([delta, ((ratio - 1.0) / scale)[:, None]], axis=1)


def lengths_line(lengths: dict[str, float]) -> str:
    """The deployed lengths of bodies as a line below the clock; nothing where none deploys."""
    if not lengths:
        return ""
    shortest, longest = (f"{value:.4g}" for value in (min(lengths.values()), max(lengths.values())))
    members = ", ".join(lengths) if len(lengths) < 3 else f"{len(lengths)} members"
    return f"\n{members}: {shortest} m" if shortest == longest else f"\n{members}: {shortest} to {longest} m"
