"""Loops: joints cut out of the tree, of which only locked freedoms are used: slides, and turns as direction pairs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.system.joint import Joint

PARALLEL = 1e-9  # sine of the angle below which two axes count as one


OFFSET, COSINE = 3, 6  # columns of slides and pairs from which a residual is counted


@dataclass(frozen=True, eq=False)
class Closure:
    """Constraints of a cut joint between marker P of the parent and marker Q of the child.

    slides  (n_s, 4)  unit directions e, fixed in P, along which Q must not leave P, and the distance o it keeps
                      (0): e . r_QP_P = o
    pairs   (n_d, 7)  directions p fixed in P, s fixed in Q and their cosine c: p . C_PQ s = c
    """

    slides: Array
    pairs: Array

    @property
    def n_rows(self) -> int:
        """Number of constraints."""
        return len(self.slides) + len(self.pairs)


def closure(joint: Joint) -> Closure:
    """The constraints that close a cut joint.

    No turn: three pairs hold the axes of P and Q together; one turn about a: a stays on itself (two pairs); two turns
    about a and b: their angle stays (one pair, since a . R(a) R(b) b = a . b); a ball locks no turn.
    """
    _, _, complement = np.linalg.svd(np.vstack([joint.translations, np.zeros((3, 3))]))
    slides = np.pad(complement[len(joint.translations) :], ((0, 0), (0, 1)))
    turns = joint.rotations
    if joint.ball is not None or len(turns) == 3:
        pairs: list[tuple[Array, Array]] = []
    elif len(turns) == 2:
        pairs = [(turns[0], turns[1])]
    else:
        a = turns[0] if len(turns) else np.array([0.0, 0.0, 1.0])
        b = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        b /= np.linalg.norm(b)
        c = np.cross(a, b)
        pairs = [(b, a), (c, a)] if len(turns) else [(b, a), (c, a), (b, c)]
    rows = [np.concatenate([p, s, [p @ s]]) for p, s in pairs]
    return Closure(slides, np.array(rows).reshape(-1, 7))


def closure_problems(joint: Joint) -> list[str]:
    """Return sentences on options of a joint that a cut joint cannot have."""
    out = []
    if joint.stiffness.any() or joint.damping.any() or joint.laws or joint.latches:
        out.append(
            f"loop {joint.label!r} has a spring or a damper, a law or a latch; a cut joint has no coordinates of its "
            "own: cut the loop at another joint"
        )
    if joint.prescribed:
        out.append(
            f"loop {joint.label!r} has a locked or prescribed coordinate; a cut joint has no coordinates of its own: "
            "cut the loop at another joint"
        )
    if len(joint.rotations) == 2 and np.linalg.norm(np.cross(*joint.rotations)) < PARALLEL:
        out.append(
            f"the two axes of loop {joint.label!r} are parallel: {joint.rotations.tolist()}; use a revolute joint"
        )
    if joint.n_u == 6:
        out.append(f"loop {joint.label!r} is free in all six motions and closes nothing; leave it out")
    return out
