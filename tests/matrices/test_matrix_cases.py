"""Bodies from matrices in cases: the same motion and reductions as the elements give."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from support.matrix_examples import brick
from typer.testing import CliRunner

from femflex.case import read_case
from femflex.cli.app import app
from femflex.matrices import full_model, write_matrices
from femflex.mesh import write_mesh
from femflex.mesh.generators import box
from femflex.pipeline import run
from femflex.pipeline.case_bodies import build_body

CRAFT = """
[run]
duration = "1 s"
samples = 11
rtol = 1e-11
[attitude]
frame = "inertial"
rates = [0.4, 1.5, -0.7]
[bodies.hub]
kind = "rigid"
mass = 50
inertia = [20, 30, 40]
[[joints]]
kind = "weld"
parent = "hub"
child = "bar"
child_marker = "left"
[[loads]]
name = "slew"
body = "hub"
times = ["0 s", "1 s"]
torque = [[0, 40, 10], [0, 40, 10]]
"""
ELEMENTS = """
[materials.soft]
E = 7e7
nu = 0.3
density = 270
[bodies.bar]
kind = "flexible"
mesh = "bar.msh"
strain = "linear"
markers = { right = {} }
members = [{ group = "volume", family = "solid", material = "soft" }]
reduction = { method = "cantilever", clamp = "left", modes = 3, joints = {} }
"""
MATRICES = """
[bodies.bar]
kind = "matrices"
matrices = "bar.npz"
markers = { right = {} }
reduction = { method = "cantilever", clamp = "left", modes = 3 }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("matrices")
    write_matrices(full_model(brick((2, 1, 1))), where / "bar.npz")
    write_mesh(where / "bar.msh", box(2.0, 0.3, 0.2, 2, 1, 1))
    for name, text in (("elements", ELEMENTS), ("matrices", MATRICES)):
        (where / f"{name}.toml").write_text(CRAFT + text)
    return where


def test_slewing_craft_moves_as_with_elements(folder):
    computed = [run(read_case(folder / f"{name}.toml"), folder / f"{name}.h5") for name in ("elements", "matrices")]
    for name in ("q", "u"):
        a, b = (results.read(name) for results in computed)
        assert b == pytest.approx(a, abs=1e-9 * np.abs(a).max())


def case_with(folder, text):
    path = folder / "changed.toml"
    path.write_text(CRAFT + text)
    return path


def squares(body):
    """Squared frequencies (n,) of the body held in its frame."""
    return linalg.eigvalsh(body.strain.V1, body.moments.elastic_mass()) if body.n_modes else np.zeros(0)


@pytest.mark.parametrize(
    ("method", "more"),
    [
        ('"free_free", modes = 4, joints = {}', ""),
        ('"nodal", clamp = "left"', ""),
        ('"rigid"', ""),
        ('"craig_bampton", interfaces = ["left"], modes = 2, joints = {}', ""),
        (
            '"cantilever", clamp = "left", modes = 2, loads = { right = ["z"] }, joints = {}',
            "damping = { ratio = 0.02 }",
        ),
    ],
)
def test_reductions_equal_those_of_elements(folder, method, more):
    model = full_model(brick((2, 1, 1)))
    np.savez(folder / "m.npz", A=model.M.toarray())
    np.savez(folder / "k.npz", B=model.K.toarray())
    names = "nodes = 'bar.npz', names = { mass = 'A', stiffness = 'B' }"
    files = f"{{ mass = 'm.npz', stiffness = 'k.npz', {names} }}"
    texts = []
    for text in (ELEMENTS, MATRICES, MATRICES.replace('"bar.npz"', files)):
        own = text[: text.index("reduction = {")].replace("right = {} }", "right = {}, left = {} }")
        texts.append(f"{own}{more}\nreduction = {{ method = {method} }}\n")
    body, *others = (build_body(read_case(case_with(folder, text)), "bar") for text in texts)
    for other in others:
        assert other.kinds == body.kinds and other.n_modes == body.n_modes
        assert other.moments.mass == pytest.approx(body.moments.mass)
        assert other.moments.inertia() == pytest.approx(body.moments.inertia(), rel=1e-6, abs=1e-6)
        assert squares(other) == pytest.approx(squares(body), rel=1e-6)
        assert np.trace(other.damping) == pytest.approx(np.trace(body.damping), rel=1e-6)
        assert set(other.markers) == set(body.markers)


def test_craig_bampton_model_of_one_case_in_another(folder):
    runner = CliRunner()
    two = '"craig_bampton", interfaces = ["left", "right"], modes = 2, joints = {}'
    elements = ELEMENTS.replace('"cantilever", clamp = "left", modes = 3, joints = {}', two)
    case = case_with(folder, elements)
    model = folder / "bar_cb.npz"
    ends = ["--interface", "left", "--interface", "right"]
    done = runner.invoke(app, ["body", str(case), "bar", *ends, "-o", str(model)])
    assert done.exit_code == 0, done.output
    text = MATRICES.replace("bar.npz", "bar_cb.npz").replace("reduction = {", "#")
    text = text.replace("markers = { right = {} }", "markers = { right = {}, left = {} }")
    computed = build_body(read_case(case_with(folder, text)), "bar")
    reference = build_body(read_case(case_with(folder, elements)), "bar")
    assert computed.omega == pytest.approx(reference.omega, rel=1e-8)
    assert computed.moments.inertia() == pytest.approx(reference.moments.inertia(), rel=1e-9, abs=1e-9)
