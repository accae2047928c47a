"""A body is arrays, names and units: it goes through pickle as it is."""

from __future__ import annotations

import pickle
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from femflex.body import FlexibleBody
from femflex.case import read_case
from femflex.fem import Member, build_structure
from femflex.fem.sections import Circle
from femflex.fem.sections.materials import Material
from femflex.mesh import line
from femflex.pipeline.decisions import build_system
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives


def leaves(value: Any):
    """All that a body holds, down to arrays, numbers and words."""
    if is_dataclass(value):
        for field in fields(value):
            yield from leaves(getattr(value, field.name))
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield from leaves(key)
            yield from leaves(entry)
    elif isinstance(value, list | tuple):
        for entry in value:
            yield from leaves(entry)
    else:
        yield value


def bodies(write_case, strain: str) -> list[FlexibleBody]:
    mesh = line([[0, 0, 0], [3, 0, 0]], 4)
    member = Member("line", "beam", Circle(0.02), Material(70e9, 0.33, 2700.0))
    structure = build_structure(mesh, [member])
    modes = cantilever_modes(structure, "start", 4)
    modes = modes if strain == "linear" else with_derivatives(structure, modes)
    return [reduce_structure(structure, modes, {"tip": "end"}, strain=strain)]


@pytest.mark.parametrize("strain", ["linear", "condensed", "nonlinear"])
def test_a_reduced_body_comes_back_from_pickle_as_it_was(write_case, strain):
    for body in bodies(write_case, strain):
        again = pickle.loads(pickle.dumps(body))
        pairs = list(zip(leaves(body), leaves(again), strict=True))
        assert len(pairs) > 30
        for one, other in pairs:
            assert np.array_equal(one, other, equal_nan=isinstance(one, np.ndarray) and one.dtype.kind == "f")


@pytest.mark.parametrize("strain", ["linear", "condensed", "nonlinear"])
def test_a_body_holds_arrays_numbers_and_words_alone(write_case, strain):
    kinds = (np.ndarray, np.generic, float, int, str, bool, type(None))
    for body in bodies(write_case, strain):
        assert all(isinstance(value, kinds) for value in leaves(body))


def test_the_bodies_of_a_case_pickle(write_case):
    for body in build_system(read_case(write_case())).bodies.values():
        assert pickle.loads(pickle.dumps(body)).n_modes == body.n_modes
