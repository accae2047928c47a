"""CPU times of assembly: ratios in one run on one thread."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from threadpoolctl import threadpool_limits

from femflex.fem import Member
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.structure import contribution
from femflex.fem.tables import mass_and_stiffness
from femflex.mesh import Mesh

Matrices = list


def cpu_seconds(work: Callable[[], Matrices]) -> tuple[float, Matrices]:
    start = time.process_time()
    found = work()
    return time.process_time() - start, found


def median_ratio(
    ours: Callable[[], Matrices], theirs: Callable[[], Matrices], pairs: int
) -> tuple[float, Matrices, Matrices]:
    """Median of their time over ours, and the matrices of the last pair; one round of ours first, to warm up."""
    with threadpool_limits(1):
        ours()
        ratios = []
        for _ in range(pairs):
            slow, other = cpu_seconds(theirs)
            fast, own = cpu_seconds(ours)
            ratios.append(slow / fast)
    return float(np.median(ratios)), own, other


def femflex_assembly(mesh: Mesh, member: Member) -> Callable[[], Matrices]:
    def work() -> Matrices:
        numbering = Numbering(len(mesh.points))
        part = contribution(mesh, member, numbering)
        return list(mass_and_stiffness(part.inertia, part.strain, numbering.independent()))

    return work
