"""A strip bent in its stiff plane tips over sideways: Prandtl's load, and frequencies on the way to it."""

from functools import cache

import numpy as np
import pytest

from femflex import equilibrium, fem, reduction, system
from femflex.mesh import line

LENGTH, EI, GJ = 10.0, 1.4e4, 1.2e3  # m, N m^2 about the weak axis
PRANDTL = 4.0126 * np.sqrt(EI * GJ) / LENGTH**2


def members(ratio):
    section = fem.sections.StiffnessSection(2.8e7, ratio * EI, EI, GJ, 1.2, ry=0.0224, rz=0.0224)
    return [fem.Member("line", "beam", section, None, {"orientation": (0, 1, 0)})]


@cache
def strip(ratio, elements=8, modes=12):
    """One condensed body with a stiff plane `ratio` times as stiff as the weak one."""
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], elements), members(ratio))
    shapes = reduction.with_derivatives(structure, reduction.cantilever_modes(structure, "start", modes))
    return reduction.reduce_structure(structure, shapes, {"tip": "end", "root": "start"}, strain="condensed")


def lowest(body, share, build=system.System):
    """The square of the lowest frequency under a dead tip load, a share of Prandtl's, in the stiff plane."""
    load = system.Load("P", "beam", "tip", frame="inertial", force=np.array([0.0, 0.0, -share * PRANDTL]))
    found = equilibrium(build({"beam": body}, (system.weld("beam", None, child_marker="root"),), (load,)))
    values = found.eigenvalues
    return -float((values[np.argmin(np.abs(values))] ** 2).real)


def critical(body, near):
    """The share of Prandtl's load at which the lowest frequency is zero, by a secant over 4 % about one near it."""
    below, above = lowest(body, near - 0.02), lowest(body, near + 0.02)
    assert below > 0 > above
    return near - 0.02 + 0.04 * below / (below - above)


@pytest.mark.parametrize("ratio", [50, 500])
def test_a_strip_tips_over_at_prandtls_load(ratio):
    """4.0126 sqrt(EI GJ) / L^2, over sqrt((1 - EI/EI_y) (1 - GJ/EI_y)) for the bend it starts from (Michell)."""
    exact = 1 / np.sqrt((1 - 1 / ratio) * (1 - GJ / (ratio * EI)))
    assert critical(strip(ratio), exact) == pytest.approx(exact, rel=2e-3)


def test_frequencies_fall_on_the_way_as_those_of_segments():
    pieces = fem.cut(line([[0, 0, 0], [LENGTH, 0, 0]], 12), members(50), 12)
    segments = system.Segments(reduction.reduce_segments(pieces, {"tip": "end", "root": "start"}))
    one, many = lowest(strip(50), 0.5), lowest(segments, 0.5, system.assembled)
    assert one < 0.85 * lowest(strip(50), 0.0)
    assert np.sqrt(one) == pytest.approx(np.sqrt(many), rel=2e-3)


def test_a_mesh_of_twice_the_elements_tips_over_at_the_same_load():
    assert lowest(strip(50, 16), 0.9) == pytest.approx(lowest(strip(50), 0.9), rel=2e-3)
