"""What stretching adds to the force on a bent shape: closed forms between supports, nothing where it may draw in."""

import pytest
from support.nonlinear_models import METAL

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line, rectangle
from femflex.reduction import cantilever_modes, free_free_modes, hardening
from femflex.reduction.modes.modeset import rigid_set

H = 0.01


def beam():
    options = {"order": 5, "orientation": (0, 1, 0)}
    return build_structure(
        line([[0, 0, 0], [1.0, 0, 0]], 6), [Member("line", "beam", Rectangle(0.05, H), METAL, options)]
    )


def plate():
    return build_structure(rectangle(1.0, 1.0, 8, 8, "quad"), [Member("surface", "plate_bfs", H, METAL)])


def test_a_pinned_beam_hardens_as_woinowsky_krieger_found():
    """(w / r)^2 / 4, r the radius of gyration."""
    pinned = cantilever_modes(beam(), dict.fromkeys(("start", "end"), ("x", "y", "z", "rx")), 2)
    assert hardening(beam(), pinned) == pytest.approx(3.0 / H**2, rel=2e-3)


def test_a_plate_between_immovable_edges_hardens_as_chu_and_herrmann_found():
    along_y, along_x = ("x", "z", "rx"), ("y", "z", "ry")
    edges = {"left": along_y, "right": along_y, "bottom": along_x, "top": along_x}
    exact = 3 * (2 * (3 - METAL.nu**2) + 4 * METAL.nu) / 16 / H**2
    assert hardening(plate(), cantilever_modes(plate(), edges, 3)) == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("make", [beam, plate])
def test_what_is_free_to_draw_in_hardly_hardens(make):
    structure = make()
    clamp = "start" if make is beam else "left"
    for modes in (cantilever_modes(structure, clamp, 2), free_free_modes(structure, 3)):
        assert hardening(structure, modes) * H**2 < (0.2 if make is plate else 2e-3)
    assert hardening(structure, rigid_set(structure.n_dof)) == 0.0
