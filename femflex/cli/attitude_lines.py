"""A line on attitude angles near the singularity of their sequence, with a sequence that stays away from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femflex.results import Run
    from femflex.system import System

NEAR = 5.0  # deg to the singularity, below which two of the angles jump or hide in each other
AWAY = 20.0  # deg that the sequence proposed keeps
SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")


def attitude_lines(run: Run, system: System) -> list[str]:
    """That the angles of a run came near their singularity, and which `sequence` stays farthest from its own."""
    import numpy as np

    from femflex.rotations import angles_from_dcm, dcm_from_angles, is_extrinsic, letters_of, singularity_distance

    sequence = system.libration_sequence
    angles = run["attitude/angles"]
    left = np.degrees(singularity_distance(angles, sequence).min(initial=np.inf))
    if left > NEAR:
        return []
    C = dcm_from_angles(angles, sequence)
    kept = {one: np.degrees(singularity_distance(angles_from_dcm(C, one), one).min()) for one in SEQUENCES}
    best = max(kept, key=lambda one: kept[one])
    kind = "extrinsic " * is_extrinsic(sequence)
    remedy = (
        f"sequence = {best!r} in [attitude] stays {kept[best]:.0f} deg away (initial angles are in its order)"
        if kept[best] > AWAY
        else f"Euler parameters are in bodies/{system.root}/attitude"
    )
    return [
        f"angles      attitude/angles, {kind}{letters_of(sequence)}, come within {left:.2g} deg of their singularity "
        f"(limit {NEAR:g} deg), where two of them jump; {remedy}"
    ]
