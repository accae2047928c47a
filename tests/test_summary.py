"""Systems, bodies, models and drawings show a summary: text in a terminal, HTML or a picture in a notebook."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.mesh import read_mesh
from femflex.summary import Summarised
from femflex.system import Load, System, free
from femflex.view.drawing import Drawing


def craft() -> System:
    push = Load("push", "hub", "origin", force=np.array([1.0, 0.0, 0.0]))
    return System({"hub": rigid_body(12.5, np.eye(3))}, (free("hub"),), loads=(push,))


def test_a_system_tells_its_bodies_mass_and_freedoms():
    text = repr(craft())
    assert text.startswith("System\n") and "12.5 kg" in text and "6, 0 of them elastic" in text and "array" not in text


def test_a_model_tells_what_was_switched_off():
    model = compile_system(craft()).without("loads/push")
    assert dict(model.summary()[1])["switched off"] == "loads/push"
    assert "switched off" not in dict(compile_system(craft()).summary()[1])


def test_html_is_a_table_with_escaped_text():
    class Odd(Summarised):
        def summary(self):
            return "A < B", [("x & y", "<z>")]

    page = Odd()._repr_html_()
    assert page.startswith("<table>") and "A &lt; B" in page and "x &amp; y" in page and "<z>" not in page
    assert craft()._repr_html_().count("<tr>") == len(craft().summary()[1])


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


def test_a_mesh_prints_its_counts_and_groups_instead_of_its_arrays():
    text = repr(read_mesh(Path(__file__).parents[1] / "meshes" / "panel.msh"))
    assert text.startswith("Mesh\npoints  207") and "tip_corner" in text and "array" not in text
