"""Strain tensors of 20 shapes over 1e5 points against the bare matrix products, and the memory they take."""

from __future__ import annotations

import time
import tracemalloc

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.mesh import box, rectangle
from femflex.reduction.strain.tensors import ROOM, strain_columns, strain_tensors

pytestmark = pytest.mark.benchmark
N, POINTS = 20, 100_000
METAL = Material(70e9, 0.3, 2700.0)


def bricks():
    mesh = box(2.0, 1.0, 0.1, 44, 21, 4, "hexahedron27")
    return build_structure(mesh, [Member("volume", "solid", None, METAL)])


def triangles():
    mesh = rectangle(2.0, 1.0, 184, 92, "triangle")
    return build_structure(mesh, [Member("surface", "plate", 0.01, METAL)])


def smooth_shapes(structure):
    """Shapes (n_dof, N): sines of different lengths over the nodes."""
    x = structure.mesh.points
    rng = np.random.default_rng(0)
    waves = [np.outer(np.sin(x @ rng.normal(size=3) * 5), rng.normal(size=3)).ravel() for _ in range(N)]
    return structure.translation.T @ np.stack(waves, axis=1)


@pytest.mark.parametrize("make", [bricks, triangles])
def test_tensors_cost_at_most_twice_the_bare_products(make, capsys):
    structure = make()
    phi = smooth_shapes(structure)
    block, raw = structure.strain[0], structure.T @ phi
    points = len(block.dofs) * block.sampled(slice(0, 1)).weight.shape[1]
    m = N + N * (N + 1) // 2
    sample = np.ascontiguousarray(strain_columns(block.sampled(slice(0, 60)), raw, small=False).reshape(m, -1))
    repeat = points * sample.shape[1] / (60 * points / len(block.dofs)) / sample.shape[1]
    strain_tensors(structure, phi)
    tensors, products = [], []
    for _ in range(3):
        start = time.perf_counter()
        strain_tensors(structure, phi)
        middle = time.perf_counter()
        for _ in range(round(repeat)):
            sample @ sample.T
        tensors.append(middle - start)
        products.append(time.perf_counter() - middle)
    tracemalloc.start()
    strain_tensors(structure, phi)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    ratio = min(tensors) / min(products)
    with capsys.disabled():
        print(
            f"\n{make.__name__}: {points} points, {N} shapes: {min(tensors):.2f} s, bare products "
            f"{min(products):.2f} s, ratio {ratio:.2f}, peak {peak / 1e6:.0f} MB"
        )
    assert points > 0.95 * POINTS
    assert ratio < 2.0
    assert peak < 4 * 8 * ROOM + 2 * phi.nbytes
