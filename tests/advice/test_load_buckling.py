"""Loads that buckle a structure and a set of its shapes: closed forms, and where the set has no stiffness left."""

from dataclasses import dataclass

import numpy as np
import pytest
from support.lateral_buckling import EI, END_LOAD, GJ, LENGTH
from support.strips import SLIM, STRIPS, derived, strip, under_end_load

from femflex.advice.buckling.applied_load import AppliedLoad
from femflex.advice.buckling.beam import BeamBuckling
from femflex.advice.buckling.buckling_analysis import BucklingAnalysis
from femflex.advice.buckling.structure import StructureBuckling
from femflex.fem import Material, Member, build_structure
from femflex.mesh import rectangle
from femflex.reduction import BeamFunctions, UniformBeam, cantilever_modes

PRANDTL = END_LOAD * np.sqrt(EI * GJ) / LENGTH**2


@dataclass
class Found:
    """Multiples of a load at which a structure buckles, and the shapes kept."""

    structure: float
    shapes: float


def judged(elastic, force):
    bearing, wrench = BucklingAnalysis(elastic), np.concatenate([force, np.zeros(3)])[None]
    load = AppliedLoad("load", "tip", wrench, wrench)
    parts = bearing.nearest([load]).part, bearing.kept([load], 0)
    return Found(*(1 / part if part > 1e-9 else np.inf for part in parts))


def slim(n, loads=None, keep="auto", direction=2, size=PRANDTL):
    structure = strip(*STRIPS["slim"])
    modes = cantilever_modes(structure, "start", 12)
    shapes = modes.picked(range(n)) if keep == "none" else derived(structure, modes, n, keep, loads=loads)
    return judged(StructureBuckling(structure, shapes, {"tip": "end"}), size * np.eye(3)[direction])


def test_a_strip_and_a_set_with_the_loads_shape_buckle_at_prandtls_load():
    """The bend before is left out."""
    found = slim(6, {"end": ["z"]})
    assert found.structure == pytest.approx(1, rel=1e-3)
    assert found.shapes == pytest.approx(found.structure, rel=2e-3)


def test_a_set_without_the_loads_shape_buckles_late_and_one_without_twist_never():
    few = slim(4)
    assert few.shapes / few.structure == pytest.approx(under_end_load("slim", 4), rel=5e-3) and few.shapes > 1.15
    assert slim(6, keep="none").shapes == np.inf
    assert slim(6, keep="none").structure < 1.01


def test_a_pressed_strip_bows_at_eulers_load_and_a_pulled_one_does_not():
    euler = np.pi**2 * EI / (4 * LENGTH**2)
    pressed, pulled = (slim(6, direction=0, size=sign * euler) for sign in (-1, 1))
    assert pressed.structure == pytest.approx(1, rel=1e-4) and pressed.shapes == pytest.approx(1, rel=5e-3)
    assert pulled.structure == np.inf


def test_large_meshes_buckle_at_eulers_load_too():
    """Sparse: Lanczos' method to a thousandth."""
    metal = Material(7e10, 0.3, 2700.0)
    structure = build_structure(rectangle(1.0, 0.05, 12, 2, "quad"), [Member("surface", "plate_bfs", 0.002, metal)])
    assert structure.n_dof > 400
    shapes = derived(structure, cantilever_modes(structure, "left", 12), 4, "auto")
    euler = np.pi**2 / 4 * 7e10 * 0.05 * 0.002**3 / 12
    pressed, pulled = (
        judged(StructureBuckling(structure, shapes, {"tip": "right"}), np.array([sign * euler, 0, 0]))
        for sign in (-1, 1)
    )
    assert pressed.structure == pytest.approx(1, rel=1e-2)  # a plate held against contraction at its root
    assert pulled.structure > 1000  # what it presses together crosswise


def test_a_beam_on_functions_without_torsion_never_tips_over():
    beam = UniformBeam(LENGTH, 2.8e9, SLIM * EI, EI, GJ, 1.2, ry=0.005, rz=0.005, orientation=(0, 1, 0))
    load = np.array([0.0, 0.0, -PRANDTL])
    exact = 1 / (1 - 1 / SLIM)  # linear buckling, which knows the bend before by its first power alone
    for torsion, shapes in ((0, np.inf), (4, exact)):
        functions = BeamFunctions(y=4, z=4, torsion=torsion, family="polynomial")
        found = judged(BeamBuckling(beam, functions, {"tip": "tip"}), load)
        assert found.structure == pytest.approx(exact, rel=2e-3)
        assert found.shapes == pytest.approx(shapes, rel=5e-3)
