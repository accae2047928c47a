"""Row B: flap and lag frequencies of rotating cantilevers, condensed bodies against exact eigenvalues."""

import numpy as np
import pytest
from support.rotating_beams import Rotating

from femflex import fem
from femflex.dynamics import compile_system
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import equilibrium
from femflex.mesh import box, line
from femflex.reduction import cantilever_modes, reduce_structure, with_attachment, with_derivatives
from femflex.system import Frame, System, weld

N = 12  # coordinates along each direction of bending: eight frequencies within 1e-5


def halved(x):
    """Mass of a beam half as deep at the tip."""
    return 1 - 0.5 * x


def eighth(x):
    """Its bending stiffness."""
    return (1 - 0.5 * x) ** 3


BEAMS = {
    "still": Rotating(0.0, lag=1.9),
    "slow": Rotating(2.0, lag=1.9),
    "fast, on a hub": Rotating(12.0, hub=1.0),
    "tapered": Rotating(6.0, lag=1.9, mass=halved, bending=eighth),
    "at a setting angle": Rotating(6.0, lag=3.0, setting=0.5),
    "fast": Rotating(12.0),
    "tapered, set, fast, on a hub": Rotating(12.0, 1.0, 1.0, 2.5, halved, eighth, 0.4),
}
SHORT = ("slow", "tapered", "at a setting angle")


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", [pytest.param(k, marks=() if k in SHORT else pytest.mark.slow) for k in BEAMS])
def test_rotating_beams_have_exact_frequencies(name):
    beam = BEAMS[name]
    found = beam.frequencies(N, 8)  # flap and lag, the first four of each
    assert found == pytest.approx(beam.exact(found), rel=1e-5)


@pytest.mark.slow
def test_exact_equations_vanish_at_published_frequencies():
    still = np.array([1.875104068711961, 4.694091132974175]) ** 2
    assert Rotating(0.0, lag=1.9).exact(still * (1 + 3e-5)) == pytest.approx(still, rel=1e-8)
    flap = Rotating(2.0, lag=1.9).exact(np.array([4.1373]))  # Wright et al. 1982
    assert flap == pytest.approx([4.1373], abs=5e-5)


HEIGHT, WIDTH = 0.005, 0.005 * np.sqrt(1.9)  # of a section of stiffness 1 out of the plane, 1.9 in it


def in_steady_spin(structure, clamp, modes, gamma, shapes=("y", "z", "ry", "rz")):
    """Frequencies of the condensed body of a structure in its steady spin about z."""
    found = with_attachment(structure, cantilever_modes(structure, clamp, modes), shapes)
    body = reduce_structure(structure, with_derivatives(structure, found), {"root": clamp}, strain="condensed")
    frame = Frame("spinning", np.array([0.0, 0.0, gamma]))
    system = System({"blade": body}, (weld("blade", child_marker="root"),), frame=frame)
    still = equilibrium(system)
    model = compile_system(system)
    values = linearised(model, 0.0, np.concatenate([still.q, np.zeros(model.n_u)])).eigenvalues().imag
    return np.sort(values[values > 0])


def tapered():
    """A blade half as deep at the tip: stiffness out of the plane falls to an eighth, in the plane to a half."""
    E = 12 / (WIDTH * HEIGHT**3)
    section = fem.sections.Rectangle(WIDTH, f"{HEIGHT} * (1 - 0.5*s/L)")
    options = {"order": 5, "orientation": (0, 1, 0), "rotary_inertia": False}
    member = fem.Member("line", "beam", section, fem.Material(E, 0.0, 1 / (WIDTH * HEIGHT)), options)
    return fem.build_structure(line([[0, 0, 0], [1, 0, 0]], 8), [member])


@pytest.mark.parametrize("gamma", [6.0, pytest.param(12.0, marks=pytest.mark.slow)])
def test_tapered_meshed_blade_has_exact_frequencies(gamma):
    """Four modes and four static shapes: two frequencies of each, lag with the taper of its own stiffness."""
    found = in_steady_spin(tapered(), "start", 4, gamma)[:4]
    beam = Rotating(gamma, lag=1.9, mass=halved, bending=lambda x: np.stack([halved(x), eighth(x)]))
    assert found == pytest.approx(beam.exact(found, within=5e-3), rel=1.5e-3)


@pytest.mark.slow
def test_blade_of_solids_has_exact_frequencies():
    """27-node hexahedra, 69 heights long; at 12 lag is a small difference of flap's stiffening and the spin."""
    height = 0.0145
    width = height * np.sqrt(1.9)
    E = 12 / (width * height**3)
    mesh = box(1.0, width, height, 16, 1, 1, cell="hexahedron27").translated([0, -width / 2, -height / 2])
    member = fem.Member("volume", "solid", None, fem.Material(E, 0.0, 1 / (width * height)))
    structure = fem.build_structure(mesh, [member])
    for gamma in (0.0, 6.0, 12.0):
        found = in_steady_spin(structure, "left", 4, gamma)[:4]
        exact = Rotating(gamma, lag=1.9).exact(found, within=1e-2)
        assert found[:2] == pytest.approx(exact[:2], rel=1e-3 if gamma < 10 else 2e-3)
        assert found == pytest.approx(exact, rel=5e-3)
