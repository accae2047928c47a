"""Warnings that `femflex run` prints if the attitude comes near the singularity of its angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femflex.arrays import Array
    from femflex.results import Run

SWINGING = 0.1  # rad left to the singularity: nearer than this two of the angles move ten times as far as the craft


def angle_lines(run: Run, sequence: str) -> list[str]:
    """A line if the craft turns and its angles come near their singularity, with a sequence that stays clear."""
    import numpy as np

    from femflex.rotations import dcm_from_angles, is_symmetric, singularity_distance, vector_from_dcm

    if "attitude/angles" not in run:
        return []
    angles, names = run["attitude/angles"], run.names("attitude/angles")
    distance = float(singularity_distance(angles, sequence).min(initial=np.inf))
    if distance > SWINGING:
        return []
    C = dcm_from_angles(angles, sequence)
    travel = np.abs(vector_from_dcm(C[:-1].swapaxes(1, 2) @ C[1:])).sum(axis=0) if len(C) > 1 else np.zeros(3)
    if travel.max() < SWINGING:
        return []
    best, clear = clearest_sequence(C, "xyz"[int(travel.argmax())])
    advice_text = (
        f'Set sequence = "{best}" in [attitude]; its second angle stays {np.degrees(clear):.3g} deg away from that.'
        if clear > SWINGING
        else "Every sequence comes near its singularity in this run; read the Euler parameters bodies/NAME/attitude."
    )
    return [
        f"attitude    angle {names[1]} came within {np.degrees(distance):.2f} deg of "
        f"{'0 or 180' if is_symmetric(sequence) else '90'} deg, where {names[0]} and {names[2]} are not unique (nearer "
        f"than {np.degrees(SWINGING):.1f} deg they swing). {advice_text}"
    ]


def clearest_sequence(C: Array, axis: str) -> tuple[str, float]:
    """The sequence of three axes that stays clear of its singularity in C_PQ (n_t, 3, 3), and by how much [rad].

    One that begins with this axis goes before the others that are clear.
    """
    from femflex.rotations import ANGLE_SEQUENCES, angles_from_dcm, is_symmetric, singularity_distance

    distances = {
        sequence: float(singularity_distance(angles_from_dcm(C, sequence), sequence).min())
        for sequence in ANGLE_SEQUENCES
        if not is_symmetric(sequence)
    }
    best = max(
        distances,
        key=lambda sequence: (distances[sequence] > SWINGING, sequence[0] == axis, round(distances[sequence], 6)),
    )
    return best, distances[best]
