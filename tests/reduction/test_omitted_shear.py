"""What thin plate elements leave out by transverse shear, estimated from their modes, is what dkmt finds."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections.laminates import Lamina, Ply, isotropic, sandwich
from femflex.mesh import rectangle
from femflex.reduction import cantilever_modes, craig_bampton, free_free_modes, reduce_structure
from femflex.reduction.strain.omitted_shear import frequency_errors, warn_of_omitted_shear
from femflex.warning import PhysicsWarning

METAL = Material(70e9, 0.3, 2700.0)
SANDWICH = sandwich(Ply(Lamina.isotropic(METAL), 0.0005), 0.02, Lamina.core(50.0, 30e6))
ELEMENTS = {"dkt": ("plate", "triangle", {"element": "dkt"}), "bfs": ("plate_bfs", "quad", {})}
HARD = {"left": ("x", "y", "z", "rx"), "right": ("z", "rx"), "bottom": ("y", "z", "ry"), "top": ("z", "ry")}
ALL = ("x", "y", "z", "rx", "ry", "rz")
SUPPORTS = {
    "hard": HARD,
    "cantilever": {"left": ALL},
    "clamped": dict.fromkeys(("left", "right", "bottom", "top"), ALL),
}


def plate(section, element: str, n: int, width: float = 0.8):
    family, cell, options = ELEMENTS.get(element, ("plate", "triangle", {}))
    return build_structure(rectangle(1.0, width, n, n, cell), [Member("surface", family, section, None, options)])


@pytest.mark.parametrize(("element", "n", "within"), [("dkt", 16, 0.15), ("bfs", 12, 0.05)])
def test_simply_supported_sandwich_in_closed_form(element, n, within):
    """w^2 = D k^4 / (m (1 + D k^2 / S)), without rotary inertia: thin plates are sqrt(1 + D k^2 / S) high."""
    structure = plate(SANDWICH, element, n)
    errors, which = frequency_errors(structure, cantilever_modes(structure, HARD, 4))
    k2 = np.sort([np.pi**2 * (i**2 + (j / 0.8) ** 2) for i in (1, 2) for j in (1, 2)])[:3]
    expected = np.sqrt(1 + SANDWICH.D[0, 0] * k2 / SANDWICH.S[0, 0]) - 1
    assert which.tolist() == [0, 1, 2]
    np.testing.assert_allclose(errors, expected, rtol=within)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("element", ["dkt", "bfs"])
@pytest.mark.parametrize("supports", ["cantilever", "clamped"])
@pytest.mark.parametrize("section", [SANDWICH, isotropic(0.06, METAL)], ids=["sandwich", "thick"])
def test_estimates_are_what_dkmt_lowers_frequencies_by(section, supports, element):
    """Bending and torsion between clamped and free edges, 0.3 % to 60 % high, each within 35 % of its error."""
    true = cantilever_modes(plate(section, "dkmt", 20), SUPPORTS[supports], 3).omega[:3]
    structure = plate(section, element, 12)
    modes = cantilever_modes(structure, SUPPORTS[supports], 3)
    errors, _ = frequency_errors(structure, modes)
    np.testing.assert_allclose(errors, modes.omega[:3] / true - 1, rtol=0.35, atol=2e-3)


def test_torsion_of_a_thick_free_strip():
    """St. Venant: the torsion of a strip is softer by 0.630 h / b, its frequency of a free plate by half of that."""
    h, b = 0.02, 0.2
    structure = plate(isotropic(h, METAL), "bfs", 12, b)
    modes = free_free_modes(structure, 3)
    errors, which = frequency_errors(structure, modes)
    twists = [np.abs(structure.rotation[::3] @ modes.phi[:, k]).max() for k in which]
    ends = [np.abs(structure.rotation[1::3] @ modes.phi[:, k]).max() for k in which]
    torsion = int(np.argmax(np.array(twists) / ends))
    assert errors[torsion] == pytest.approx(1 / np.sqrt(1 - 0.63 * h / b) - 1, rel=0.2)


@pytest.mark.parametrize(("element", "remedy"), [("dkt", "choose element = 'dkmt'"), ("bfs", "choose family 'plate'")])
def test_a_body_of_thin_sandwich_elements_is_warned_of_with_the_error(element, remedy):
    structure = plate(SANDWICH, element, 8)
    modes = cantilever_modes(structure, "left", 4)
    errors, _ = frequency_errors(structure, modes)
    with pytest.warns(PhysicsWarning, match=rf"leave out transverse shear.*the limit is 1.5%.*{remedy}") as caught:
        reduce_structure(structure, modes)
    told = [float(value) / 100 for value in re.findall(r"Hz by ([\d.]+)%", str(caught[0].message))]
    np.testing.assert_allclose(told, errors, atol=6e-4)


@pytest.mark.parametrize("element", ["dkt", "bfs", "dkmt"])
def test_thin_sheets_and_plates_that_shear_are_not(element):
    section = SANDWICH if element == "dkmt" else isotropic(0.005, METAL)
    structure = plate(section, element, 6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        reduce_structure(structure, cantilever_modes(structure, "left", 4))


def test_the_warning_of_a_craig_bampton_set_names_the_frequencies_of_its_vibration_modes():
    """Its constraint modes come first and have none; the modes with both edges fixed are those of the clamped strip."""
    structure = plate(SANDWICH, "dkt", 8)
    modes = craig_bampton(structure, ["right"], 3, clamp="left", orthonormal=False)
    fixed = cantilever_modes(structure, ["left", "right"], 3).omega[:3] / (2 * np.pi)
    assert "vibration" not in modes.kinds[0] and len(modes.kinds) > 3
    with pytest.warns(PhysicsWarning, match="leave out transverse shear") as caught:
        warn_of_omitted_shear(structure, modes)
    told = [float(value) for value in re.findall(r"([\d.e+]+) Hz by", str(caught[0].message))]
    np.testing.assert_allclose(told, fixed, rtol=1e-3)
