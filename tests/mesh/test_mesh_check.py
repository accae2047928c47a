import numpy as np
import pytest

from femflex.mesh import line
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import sizes


@pytest.mark.parametrize("name", CELL_TYPES)
def test_shape_functions_are_one_at_their_node_and_differentiate_rightly(name):
    kind = CELL_TYPES[name]
    assert kind.interpolation(kind.nodes) == pytest.approx(np.eye(len(kind.nodes)), abs=1e-12)
    rng = np.random.default_rng(2)
    at = rng.uniform(0.1, 0.3, (5, kind.dimension))
    h = 1e-6
    for axis in range(kind.dimension):
        step = h * np.eye(kind.dimension)[axis]
        slope = (kind.interpolation(at + step) - kind.interpolation(at - step)) / (2 * h)
        assert kind.gradients(at)[..., axis] == pytest.approx(slope, abs=1e-8)


def test_sizes_of_curved_cells_come_from_their_shape_functions():
    arc = line(lambda s: [np.cos(s), np.sin(s), 0], 4, "line3")
    assert sizes(arc.points, "line3", arc.cells["line3"]).sum() == pytest.approx(1, rel=1e-5)  # chords: 3e-3
