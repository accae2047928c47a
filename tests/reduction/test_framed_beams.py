"""Reduced frames of beams that meet at an angle keep the load at which they tip over."""

import numpy as np
import pytest
from scipy import linalg

from femflex.body.symmetric import unpacked
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line
from femflex.reduction import cantilever_modes, strain_tensors, with_attachment, with_derivatives


@pytest.mark.parametrize("far_bends", [None, True])
def test_a_right_angled_frame_of_four_modes_and_the_loads_shape(far_bends):
    """1.088 and -0.680 N (Argyris and others 1979), by the tangent V1 + 6 V2.x of the reduced energy."""
    mesh = line([[0, 0, 0], [0.24, 0, 0], [0.24, -0.24, 0]], 6)
    options = {"orientation": [0, 0, 1.0], "far_bends": far_bends}
    strip = Member("line", "beam", Rectangle(0.0006, 0.03), Material(71.24e9, 0.31, 2700.0), options)
    structure = build_structure(mesh, [strip])
    modes = with_attachment(structure, cantilever_modes(structure, "start", 4), (), {"end": ["x"]})
    modes = with_derivatives(structure, modes, "auto")
    tensors = strain_tensors(structure, modes.phi)
    push = (structure.translation[[3 * mesh.group_points("end")[0]]] @ modes.phi)[0]
    bend = np.linalg.solve(tensors.V1, push)
    softened = -6 * np.einsum("ijk,k->ij", unpacked(tensors.V2, modes.n_modes, 3), bend)
    factors = 1 / linalg.eigvalsh(softened, tensors.V1)[[-1, 0]]
    assert factors == pytest.approx([1.088, -0.680], rel=6e-3)
