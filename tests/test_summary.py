"""Systems, bodies, models and drawings show a summary: text in a terminal, HTML or a picture in a notebook."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex import fem, read_case, read_mesh
from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.system import Load, System, free
from femflex.view.window import Drawing

CASES = Path(__file__).parents[1] / "cases"


def craft() -> System:
    push = Load("push", "hub", "origin", force=np.array([1.0, 0.0, 0.0]))
    return System({"hub": rigid_body(12.5, np.eye(3))}, (free("hub"),), loads=(push,))


def test_a_body_and_a_model_are_short():
    system = craft()
    assert repr(system.bodies["hub"]).startswith("Rigid body\n  mass ")
    text = repr(compile_system(system))
    assert "13: 7 coordinates, 6 velocities, 0 of effectors" in text and len(text) < 600


def test_cases_and_structures_say_what_they_are():
    case = read_case(CASES / "panel_slew.toml")
    lines = str(case).splitlines()
    assert lines[0].startswith("Case: Hub with two solar panels") and "weld of panel_east" in repr(case)
    assert "<td style='text-align:left'>3: hub (rigid)" in case._repr_html_()
    tube = fem.Member("boom", "beam", fem.sections.Tube(0.05, 0.001), fem.Material(70e9, 0.33, 2700.0))
    structure = fem.build_structure(read_mesh(CASES.parent / "meshes" / "boom.msh"), [tube])
    mass = 2700.0 * np.pi * (0.05**2 - 0.049**2) * 33.0  # density, area and length
    assert f"mass                {mass:.6g} kg" in repr(structure) and len(repr(structure)) < 300


def test_a_drawing_is_a_path_that_shows_its_file(tmp_path):
    path = Drawing(tmp_path / "a.png")
    assert path._repr_png_() is None
    path.write_bytes(b"\x89PNG")
    assert path._repr_png_() == b"\x89PNG" and path.parent == tmp_path and path._repr_svg_() is None
    movie = Drawing(tmp_path / "a.mp4")
    movie.write_bytes(b"1234")
    assert "data:video/mp4;base64,MTIzNA==" in (movie._repr_html_() or "")
    page = Drawing(tmp_path / "a.html")
    page.write_text("<p>&amp;</p>", encoding="utf-8")
    assert 'srcdoc="&lt;p&gt;&amp;amp;&lt;/p&gt;"' in (page._repr_html_() or "")
