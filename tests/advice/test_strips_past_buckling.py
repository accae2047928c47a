"""Strips pressed past Euler's load with what a case leaves out chosen: their energy is bounded, and they lie by the
elastica."""

import warnings

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import ellipk
from test_buckling_warnings import BEAM, HELD, SILENT, STRIP

from femflex.assembly.structures import bends_far
from femflex.body.symmetric import form, gradient
from femflex.case import CaseError, read_case
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line, rectangle
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.decisions import build_system
from femflex.reduction import cantilever_modes, reduce_structure, with_attachment, with_derivatives
from femflex.warning import PhysicsWarning

LENGTH, EI = 3.0, 1.4e4
EULER = np.pi**2 * EI / (4 * LENGTH**2)
NONLINEAR = 'strain = "condensed"', 'strain = "nonlinear"'
DERIVED = "modes = 4", 'modes = 4, derivatives = "auto"'
SERIES = "orientation = [0, 1, 0]", "orientation = [0, 1, 0], far_bends = false"


def changed(text, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def pressed(part):
    """The load as a dead one along the strip, which requests shapes of the tip in all directions."""
    return "[0, 0, -1400]", f'[{-part * EULER}, 0, 0]\nframe = "inertial"'


def wide(ratio):
    return "5.6e6", repr(ratio * EI)


def body(write_case, text, *changes):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        return build_body(read_case(write_case(changed(text, *changes))), "boom")


def scaled(strain):
    """Sizes (n,) of the coordinates at which each alone stores half a joule."""
    return 1 / np.sqrt(np.diag(strain.V1))


def lowest_quartic(strain, tries=6):
    """The least of the quartic form on the sphere of coordinates so scaled, over the largest that random ones have."""
    size, rng = scaled(strain), np.random.default_rng(3)
    starts = rng.normal(size=(tries, len(size)))
    unit = max(abs(form(strain.V3, size * d / np.linalg.norm(d), 4)) for d in starts)

    def value(x):
        length = np.linalg.norm(x)
        d = x / length
        slope = size * gradient(strain.V3, size * d, 4)
        return form(strain.V3, size * d, 4) / unit, (slope - (slope @ d) * d) / length / unit

    return min(minimize(value, start, jac=True, method="BFGS").fun for start in starts)


def settled(found, part):
    """Displacement (3,) of the tip over the length where V - f.d is least, from a small twisted bend in both planes."""
    strain, n = found.strain, found.n_modes
    size, tip = scaled(strain), found.markers["tip"].phi[:, : found.n_modes]
    force, unit = tip[0] * -part * EULER, 1e-2 * EULER
    start = np.zeros(n)
    for row, amount in ((tip[1], 1e-2 * LENGTH), (tip[2], 1e-4 * LENGTH), (found.markers["tip"].psi[0, :n], 0.02)):
        shape = row * size**2
        start += amount * shape / (row @ shape)
    energy = minimize(
        lambda x: (strain.energy(size * x) - force @ (size * x)) / unit,
        start / size,
        jac=lambda x: size * (strain.force(size * x) - force) / unit,
        method="BFGS",
        options={"maxiter": 5000, "gtol": 1e-9},
    )
    return tip @ (size * energy.x) / LENGTH


def elastica(part):
    """w / L of the column: (2 K / pi)^2 = part, w / L = 2 sin(angle / 2) / K."""
    m = np.interp(part, [(2 * ellipk(m) / np.pi) ** 2 for m in np.linspace(0, 0.5, 20001)], np.linspace(0, 0.5, 20001))
    return 2 * np.sqrt(m) / ellipk(m)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1, 50, 400])
@pytest.mark.parametrize("part", [1.008, 1.0127, 1.063])
def test_a_strip_left_to_choice_settles_near_the_elastica(write_case, ratio, part):
    """0.162, 0.200, 0.422 of the length. Nearest to Euler's load what the shapes lack of it counts most."""
    text = changed(STRIP, SILENT, pressed(part), wide(ratio)) + HELD + 'child_marker = "ROOT"\n'
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        found = build_system(read_case(write_case(text))).bodies["boom"]
    assert found.strain_form == "nonlinear" and "attachment" in found.kinds
    moved = settled(found, part)
    assert np.hypot(*moved[1:]) == pytest.approx(elastica(part), rel=0.1)
    assert ratio == 1 or abs(moved[2]) < 1e-3


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", [1, 400])
@pytest.mark.parametrize("loads", ["", ", loads = {}"])
def test_the_quartic_energy_of_a_meshed_beam_is_nowhere_negative(write_case, ratio, loads):
    few = "modes = 4", f'modes = 4, derivatives = "auto"{loads}'
    assert lowest_quartic(body(write_case, STRIP, NONLINEAR, few, pressed(1.0), wide(ratio)).strain) > 0


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [4, 50, 400])
@pytest.mark.parametrize("modes", [6, 8])
def test_nor_is_it_with_more_modes_where_the_series_falls_below_zero(write_case, ratio, modes):
    more = "modes = 4", f'modes = {modes}, derivatives = "auto"'
    changes = NONLINEAR, more, pressed(1.0), wide(ratio)
    assert lowest_quartic(body(write_case, STRIP, *changes).strain) > 0
    series = body(write_case, STRIP, *changes, SERIES).strain
    assert lowest_quartic(series) < 0


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1, 50, 400])
@pytest.mark.parametrize("family", ["polynomial", "characteristic"])
def test_nor_is_that_of_a_beam_on_functions(write_case, ratio, family):
    """Of characteristic ones the rest of the stretch follows."""
    functions = "z = 4,", "z = 4, torsion = 3, axial = 8,"
    kind = 'family = "polynomial"', f'family = "{family}"'
    found = {}
    for far in ("true", "false"):
        said = "orientation = [0, 1, 0]", f"orientation = [0, 1, 0]\nfar_bends = {far}"
        found[far] = lowest_quartic(body(write_case, BEAM, NONLINEAR, functions, kind, wide(ratio), said).strain)
    assert found["true"] > 0
    assert (found["false"] < 0) == (ratio > 1)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:plates turn in their own planes")  # one of its modes is a bend in the plane
@pytest.mark.parametrize(("family", "cells", "kind"), [("plate_bfs", 8, "quad"), ("plate", 16, "triangle")])
def test_that_of_plates_is_of_squares_alone(family, cells, kind):
    """Membrane strains and curvatures, each a square with all of its second order."""
    metal = Material(E=7e10, nu=0.3, density=2700.0)
    structure = build_structure(rectangle(1.0, 0.04, cells, 1, kind), [Member("surface", family, 4e-3, metal)])
    shapes = with_attachment(structure, cantilever_modes(structure, "left", 4), [], {"right": ["z"]})
    strain = reduce_structure(structure, with_derivatives(structure, shapes), strain="nonlinear").strain
    assert lowest_quartic(strain) > 0
    rng = np.random.default_rng(5)
    assert all(strain.energy(scaled(strain) * rng.normal(size=len(strain.f0)) * 10.0**k) > 0 for k in range(6))


@pytest.mark.slow
def test_a_case_with_nonlinear_strain_bends_far_unless_it_says_otherwise(write_case):
    energies = []
    for changes in ((), (SERIES,), (("orientation = [0, 1, 0]", "orientation = [0, 1, 0], far_bends = true"),)):
        strain = body(write_case, STRIP, NONLINEAR, DERIVED, *changes).strain
        energies.append(strain.energy(3 * scaled(strain)))
    assert energies[0] == energies[2] != energies[1]


@pytest.mark.parametrize(
    ("strain", "derivatives", "far"),
    [("linear", 0, False), ("nonlinear", 0, False), ("nonlinear", "none", False), ("nonlinear", 1, True),
     ("nonlinear", "auto", True), ("condensed", 1, True), ("condensed", "none", False)],
)  # fmt: skip
def test_bodies_bend_far_with_a_strain_for_it_and_any_derivatives(write_case, strain, derivatives, far):
    table = read_case(write_case(STRIP)).bodies["boom"]
    reduction = table.reduction.model_copy(update={"derivatives": derivatives})
    assert bends_far(table.model_copy(update={"strain": strain, "reduction": reduction})) is far


def test_far_bends_that_are_neither_true_nor_false_are_refused(write_case):
    with pytest.raises(CaseError, match=r"far_bends 3; give true or false"):
        body(write_case, STRIP, ("orientation = [0, 1, 0]", "orientation = [0, 1, 0], far_bends = 3"))
    member = Member("line", "beam", StiffnessSection(1e6, 1.0, 1.0, 1.0, 1.0), None, {"far_bends": "yes"})
    with pytest.raises(ValueError, match="far_bends 'yes'"):
        build_structure(line([[0, 0, 0], [1, 0, 0]], 2), [member])
