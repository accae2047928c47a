"""What is advised where a body bends too far for one frame fits what the body is made of."""

from dataclasses import replace

import pytest

from femflex import fem
from femflex.advice.remedies import division_remedy
from femflex.mesh import box, line, rectangle
from femflex.reduction import UniformBeam, beam_body, cantilever_modes, reduce_structure
from femflex.reduction.beams.uniform_beam import BeamFunctions

METAL = fem.Material(70e9, 0.3, 2700.0)


def meshed(mesh, member, clamp):
    structure = fem.build_structure(mesh, [member])
    return reduce_structure(structure, cantilever_modes(structure, clamp, 2))


BODIES = {
    "line": lambda: meshed(
        line([[0, 0, 0], [1, 0, 0]], 4), fem.Member("line", "beam", fem.sections.Rectangle(0.01, 0.02), METAL), "start"
    ),
    "plate": lambda: meshed(
        rectangle(1.0, 0.3, 4, 2, "triangle"), fem.Member("surface", "plate", 0.01, METAL), ["left"]
    ),
    "solid": lambda: meshed(
        box(1.0, 0.1, 0.1, 4, 1, 1, "hexahedron27"), fem.Member("volume", "solid", None, METAL), ["left"]
    ),
    "functions": lambda: beam_body(
        UniformBeam(length=1.0, EA=1e6, EIy=1.0, EIz=1.0, GJ=1.0, mass_per_length=1.0), BeamFunctions(y=2)
    ),
}


@pytest.mark.parametrize(
    ("kind", "advice"),
    [
        ("line", "cut the member into segments"),
        ("plate", "divide its plates into several bodies, welded to each other"),
        ("solid", "divide its solids into several bodies, welded to each other"),
        ("functions", "give it a mesh instead of functions and cut its member into segments"),
    ],
)
def test_only_lines_of_meshes_are_told_to_be_cut(kind, advice):
    assert division_remedy(BODIES[kind]()) == advice


def test_a_body_whose_parts_are_not_known_is_to_be_divided():
    assert (
        division_remedy(replace(BODIES["line"](), strain_field=()))
        == "divide it into several bodies, welded to each other"
    )
