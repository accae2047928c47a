"""Each structure of a case is assembled once and factorised once, whatever a verb asks of it."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from support.work_counts import CLAMPED, FREE, HELD, count_work, write_case

from femflex.assembly import build_mesh, build_structure_of
from femflex.case import read_case
from femflex.cli.check import examine_case
from femflex.mesh import box, rectangle
from femflex.mesh.generators import line
from femflex.pipeline.balanced import balanced
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.prepared import prepare
from femflex.studies import convergence
from femflex.warning import PhysicsWarning


def meshed(family):
    """A mesh of a body with more dofs than are solved densely, "left" and "right" its ends."""
    if family == "solid":
        return box(2.0, 1.0, 0.1, 6, 3, 1, "hexahedron27")
    if family == "beam":
        return line([[0, 0, 0], [2.0, 0, 0]], 120).with_groups(points={"left": [0], "right": [120]})
    return rectangle(2.0, 1.0, 12, 6, "quad" if family == "plate_bfs" else "triangle")


@pytest.fixture
def work(tmp_path, monkeypatch):
    """Writes a case of a family, and gives its path and the counts of what is done from then on."""

    def start(family, reduction, **said):
        path = write_case(tmp_path, meshed(family), family, reduction, **said)
        case = read_case(path)
        table = case.bodies["body"]
        n_dof = build_structure_of(case, "body", table, build_mesh(case, "body", table)).n_dof
        assert n_dof > 550
        return path, count_work(monkeypatch, n_dof)

    return start


def body_of(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        return build_body(read_case(path), "body")


def run_of(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        return prepare(path, Path(path).with_name("run.h5"))


@pytest.mark.sampled(6)
@pytest.mark.parametrize("family", ["plate", "plate_bfs", "solid", "beam"])
@pytest.mark.parametrize("reduction", [CLAMPED, FREE], ids=["clamped", "free"])
@pytest.mark.parametrize("strain", ["", "linear", "condensed"])
def test_modes_take_one_assembly_and_one_factorisation(work, family, reduction, strain):
    path, counts = work(family, reduction, strain=strain)
    assert body_of(path).n_modes >= 6
    assert counts["structures"] == 1
    assert counts["factorisations"] == 1
    assert counts["Lanczos"] <= 3  # modes, that none is missed, and whether what it bears buckles it


@pytest.mark.sampled(2)
@pytest.mark.parametrize("family", ["plate", "plate_bfs", "solid"])
@pytest.mark.parametrize("reduction", [HELD, FREE], ids=["held", "free"])
def test_initial_stress_takes_one_factorisation_more(work, family, reduction):
    """Of the stiffness without it, for what the supports let go."""
    path, counts = work(family, reduction, options="thermal_strain = -1e-5")
    body_of(path)
    assert counts["structures"] == 1
    assert counts["factorisations"] == 2
    assert counts["Lanczos"] <= 4  # the same, and whether the initial stress buckles it


@pytest.mark.sampled(2)
@pytest.mark.parametrize("family", ["plate", "solid", "beam"])
@pytest.mark.parametrize("reduction", [CLAMPED, FREE], ids=["clamped", "free"])
def test_a_run_starts_with_one_assembly_and_one_factorisation(work, family, reduction):
    path, counts = work(family, reduction)
    run_of(path)
    assert counts["structures"] == 1
    assert counts["factorisations"] == 1


PUSH = '[[loads]]\nname = "push"\nbody = "body"\nmarker = "right"\nforce = ["0 N", "0 N", "0.01 N"]'


@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain", ["", "linear"], ids=["chosen", "linear"])
@pytest.mark.parametrize("verb", ["check", "equilibrium"])
def test_check_and_equilibrium_take_one_assembly_and_one_factorisation(work, verb, strain):
    path, counts = work("plate", CLAMPED, strain=strain, more=PUSH)
    path.write_text(path.read_text().replace('frame = "inertial"', "held = true"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        system = examine_case(path)[0].system if verb == "check" else balanced(read_case(path)).model.system
    assert system.bodies["body"].n_modes >= 6
    assert counts["structures"] == 1
    assert counts["factorisations"] == 1
    assert counts["Lanczos"] <= 3


STUDY = '[study]\nquantity = { of = "mode_frequency", body = "body", mode = 1 }\n'


def test_each_mesh_of_a_study_is_assembled_and_factorised_once(work):
    """And the case's own mesh once more, for what the case leaves open."""
    path, counts = work("plate", CLAMPED, strain="linear", more=STUDY)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        found = convergence(read_case(path), "mesh", [0, 1])
    assert found.values[1] < found.values[0]
    assert counts["structures"] == 3
    assert counts["factorisations"] == 3


def test_all_numbers_of_modes_of_a_study_are_cut_from_one_set(work):
    path, counts = work("plate", CLAMPED, strain="linear", more=STUDY)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        found = convergence(read_case(path), "modes", [2, 4, 6])
    assert found.values == pytest.approx(found.values[0], rel=1e-9)
    assert counts["structures"] == 1
    assert counts["factorisations"] == 1


@pytest.mark.sampled(1)
@pytest.mark.parametrize("push", ["1 N", "100 N"])
def test_a_load_near_buckling_takes_no_factorisation_more(work, push):
    """The strain is chosen by it, and the body then built with other strain."""
    more = f'[[loads]]\nname = "push"\nbody = "body"\nmarker = "right"\nforce = ["-{push}", "0 N", "0 N"]'
    path, counts = work("plate", CLAMPED, more=more)
    form = run_of(path).system.bodies["body"].strain_form
    assert form == ("linear" if push == "1 N" else "condensed")
    assert counts["structures"] == 1
    assert counts["factorisations"] == 1


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    "reduction", [CLAMPED + ', attachment = ["x", "z"], loads = { right = ["z"] }', CLAMPED], ids=["attached", "modes"]
)
def test_static_shapes_and_derivatives_take_no_factorisation_more(work, reduction):
    path, counts = work("plate", reduction + ', derivatives = "auto"', strain="nonlinear")
    body_of(path)
    assert counts["structures"] == 1
    assert counts["factorisations"] == 1


def test_a_craig_bampton_set_takes_one_factorisation_with_its_interfaces_fixed(work):
    path, counts = work("plate", 'method = "craig_bampton", clamp = "left", interfaces = ["right"], modes = 6')
    assert "craig-bampton" in body_of(path).kinds
    assert counts["structures"] == 1
    assert counts["factorisations"] <= 2  # for static answers the interfaces are free again


def test_two_bodies_of_one_member_share_their_structure(work):
    """A second body that is reduced otherwise is assembled and factorised no more."""
    path, counts = work("plate", CLAMPED, strain="linear")
    text = path.read_text()
    body = text[text.index("[bodies.body]") : text.index("[[joints]]")]
    other = body.replace("bodies.body", "bodies.other").replace("modes = 6", "modes = 4")
    joint = '[[joints]]\nkind = "weld"\nparent = "hub"\nchild = "other"\nchild_marker = "left"\n'
    path.write_text(text + other + joint)
    bodies = run_of(path).system.bodies
    assert bodies["other"].n_modes == 4
    np.testing.assert_allclose(bodies["other"].omega, bodies["body"].omega[:4], rtol=1e-9)
    assert counts["structures"] == 1
    assert counts["factorisations"] == 1
