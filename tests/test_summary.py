"""Systems, bodies, models and drawings show a summary: text in a terminal, HTML or a picture in a notebook."""

from __future__ import annotations

import numpy as np

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.system import Load, System, free
from femflex.view.drawing import Drawing


def craft() -> System:
    push = Load("push", "hub", "origin", force=np.array([1.0, 0.0, 0.0]))
    return System({"hub": rigid_body(12.5, np.eye(3))}, (free("hub"),), loads=(push,))


def test_a_body_and_a_model_are_short():
    system = craft()
    assert repr(system.bodies["hub"]).startswith("Rigid body\n  mass ")
    text = repr(compile_system(system))
    assert "13: 7 coordinates, 6 velocities, 0 of effectors" in text and len(text) < 600


def test_a_drawing_is_a_path_that_shows_its_file(tmp_path):
    path = Drawing(tmp_path / "a.png")
    assert path._repr_png_() is None
    path.write_bytes(b"\x89PNG")
    assert path._repr_png_() == b"\x89PNG" and path.parent == tmp_path and path._repr_svg_() is None
    movie = Drawing(tmp_path / "a.mp4")
    movie.write_bytes(b"1234")
    assert "data:video/mp4;base64,MTIzNA==" in (movie._repr_html_() or "")
