"""What is said of curved bodies and wide sheets, word by word, and the reduction that a curved body is advised."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from femflex.advice.bodies import KnownBodies, KnownBody
from femflex.advice.buckling.margin import BucklingMargin
from femflex.advice.curved import curvature_note, response_advice, response_note, shape_notes, snap_through_advice
from femflex.body import Marker, rigid_body
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh.generators import line, rectangle
from femflex.reduction import (
    cantilever_modes,
    free_free_modes,
    least_stiffness_ratio,
    nodal,
    reduce_structure,
    with_derivatives,
)
from femflex.reduction.origin import Analytic, Meshed, Origin
from femflex.reduction.strain.tensors import strain_tensors
from femflex.reduction.wide_sheets import of_sheet, sheet_of, with_own_bends
from femflex.system import Environment, Load, System, free, weld

METAL = Material(7e10, 0.3, 2700.0)
CHORD = np.array([0.8, 0.6, 0.0])  # of an arch 1 m long


def arch(rise: float):
    """A clamped arch of four straight legs on a skew chord, off the origin."""
    at = [(0, 0), (0.25, 0.75), (0.5, 1), (0.75, 0.75), (1, 0)]
    path = [np.array([1.0, 2.0, 3.0]) + s * CHORD + [0, 0, h * rise] for s, h in at]
    mesh = line([p.tolist() for p in path], 4).with_groups(points={"crown": [2], "haunch": [1]})
    member = Member("line", "beam", Rectangle(0.02, 0.005), METAL, {"orientation": (0, 0, 1)})
    return build_structure(mesh, [member])


@pytest.fixture(scope="module")
def steep():
    structure = arch(0.03)
    return structure, cantilever_modes(structure, ["start", "end"], 2)


@pytest.fixture(scope="module")
def shallow():
    structure = arch(0.0141)
    return structure, cantilever_modes(structure, ["start", "end"], 2)


def known(structure, modes, **more) -> KnownBody:
    return KnownBody(Origin(Meshed(structure, modes, **more)))


ADVISED = (
    "modal derivatives at rest represent this only in part. For such deflections set strain = 'nonlinear' with "
    "responses = 8, deflection = '{} m' and the load in `loads` or `attachment`"
)


def test_a_curved_body_is_noted_with_its_rise_and_what_is_left_of_its_stiffness(steep, shallow):
    assert curvature_note(*steep) == (
        "it is curved (rise 0.03 m). Deflected in one direction, the tangent stiffness of a low mode falls below zero "
        "(snap-through); " + ADVISED.format("0.09")
    )
    left = least_stiffness_ratio(*shallow)
    assert 0.05 < left < 0.45
    assert curvature_note(*shallow) == (
        f"it is curved (rise 0.0141 m). Deflected in one direction, the tangent stiffness of a low mode falls to "
        f"{100 * left:.0f}% of that at rest; " + ADVISED.format("0.042")
    )
    flat = arch(0.0)
    assert curvature_note(flat, cantilever_modes(flat, ["start", "end"], 2)) == ""


def test_notes_on_shapes_are_of_meshed_elastic_bodies_that_are_neither_linear_nor_made_for_a_deflection(steep):
    structure, modes = steep
    linear = reduce_structure(structure, modes)
    bent = reduce_structure(structure, with_derivatives(structure, modes), strain="condensed")
    own = Origin(Meshed(structure, modes))
    origins = {
        "one": own,
        "linear": Origin(Meshed(structure, modes)),
        "made": Origin(Meshed(structure, modes, deflection=0.1)),
        "nodal": Origin(Meshed(structure, nodal(structure, ["start", "end"]))),
        "file": Origin(None),
        "rigid": own,
        "two": own,
    }
    system = {"one": bent, "linear": linear, "made": bent, "nodal": bent, "file": bent, "unknown": bent, "two": bent}
    system["rigid"] = rigid_body(1.0, np.eye(3))
    found = shape_notes(system, KnownBodies(origins))
    assert [(one.body, one.decision, one.choice) for one in found] == [("one", "shapes", None), ("two", "shapes", None)]
    assert {one.reason for one in found} == {curvature_note(structure, modes)} and not any(one.doubt for one in found)


def test_responses_that_cannot_stretch_under_other_loads_are_noted_with_both_energies():
    """One shape of a clamped straight beam stores k q^2 / 2 + e q^4 where ends are apart: e by quadrature of w'^4."""
    structure = arch(0.0)
    modes = cantilever_modes(structure, ["start", "end"], 1)
    tensors = strain_tensors(structure, modes.phi)
    phi = modes.phi[:, 0]
    q = 0.01 / np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max()  # the chord is 1 m
    alone = 1 + structure.internal_force.quartic_energy(phi[:, None])[0] * q**4 / (modes.omega[0] ** 2 * q**2 / 2)
    text = response_note(structure, modes, tensors)
    head, _, tail = text.partition(f"its strain energy is {alone:.3g} times the linear one, and ")
    assert head == (
        "its static responses represent their own loads. For other loads it is too stiff: with its lowest mode "
        "deflected by 0.01 m, "
    )
    relaxed, _, rest = tail.partition(" times it in the full structure. ")
    assert 1.0 < float(relaxed) < alone - 0.1
    assert rest == "Set derivatives = 'auto' for other loads; it adds coordinates"
    enough = with_derivatives(structure, modes, "all")
    assert response_note(structure, enough, strain_tensors(structure, enough.phi)) == ""


def test_a_body_snaps_where_it_is_curved_and_moved_by_a_tenth_of_its_rise(steep, shallow):
    one = known(*steep)
    assert one.softening(0.0299) == (1.0, pytest.approx(0.03)) and one.softening(0.0301)[0] < 0.0
    assert snap_through_advice(one, "panel", 0.00299, None) is None
    found = snap_through_advice(one, "panel", 0.00312, None)
    assert (found.body, found.decision, found.choice, found.doubt) == ("panel", "strain", "nonlinear", False)
    assert found.reason == (
        "it is curved (rise 0.03 m), loads and motions may bend it by 0.0031 m by linear strain, and bent one way the "
        "tangent stiffness of a low mode falls below zero (possible snap-through)"
    )
    assert found.value == least_stiffness_ratio(*steep) < 0 and found.limit == 0.5
    near = BucklingMargin("load 'push' (3 N)", 0.412)
    left = least_stiffness_ratio(*shallow)
    said = snap_through_advice(known(*shallow), "panel", 0.0, near)
    assert said.value == left and said.reason == (
        "it is curved (rise 0.0141 m), load 'push' (3 N) is 0.412 of the linear buckling load, and bent one way the "
        f"tangent stiffness of a low mode falls to {100 * left:.0f}% of that at rest"
    )
    flat = arch(0.0)
    assert snap_through_advice(known(flat, cantilever_modes(flat, ["start", "end"], 2)), "panel", 9.0, None) is None
    assert snap_through_advice(known(flat, free_free_modes(flat, 2)), "panel", 9.0, near) is None
    assert snap_through_advice(KnownBody(Origin(None)), "panel", 9.0, near) is None


def test_a_curved_body_answers_to_its_loads_or_its_weight_or_what_moves_it_most(steep):
    structure, modes = steep
    body = rigid_body(1.0, np.eye(3), markers={"top": Marker.rigid([1, 0, 0]), "haunch": Marker.rigid([0, 1, 0])})
    loads = (
        Load("a", "panel", "top", "body", np.array([0.0, -3.0, 2.0])),
        Load("b", "panel", "haunch", "body", torque=np.array([4.0, 0.0, 0.0])),
        Load("c", "hub", "origin", "body", np.array([1.0, 0.0, 0.0])),
    )
    system = System(
        {"panel": body, "hub": rigid_body(1.0, np.eye(3))},
        (free("hub"), weld("panel", "hub")),
        loads=loads,
        environment=Environment(np.array([0.0, 0.0, -9.0])),
    )
    one = known(structure, modes, groups={"top": "crown"})

    def said(system, given, base):
        found = response_advice(one, system, "panel", given, base)
        assert (found.body, found.decision) == ("panel", "responses") and not found.doubt
        own = {"derivatives": "none", "responses": 8, "deflection": pytest.approx(0.09)}
        assert {key: found.choice[key] for key in own} == own and len(found.choice) == 5
        head, tail = "8 of its shapes are static responses to ", ", up to a deflection of 0.09 m"
        assert found.reason.startswith(head) and found.reason.endswith(tail)
        return found.choice["loads"], found.choice["attachment"], found.reason[len(head) : -len(tail)]

    assert said(system, {"crown": ("z", "rx"), "start": ("x",)}, ()) == (
        {"crown": ["z", "rx", "y"], "start": ["x"], "haunch": ["rx"]},
        [],
        "z, rx, y at 'crown' and x at 'start' and rx at 'haunch'",
    )
    assert said(system, {}, ["x"]) == (
        {"crown": ["y", "z"], "haunch": ["rx"]},
        ["x"],
        "y, z at 'crown' and rx at 'haunch' and acceleration along x",
    )
    at_rest = System(system.bodies, system.joints, environment=Environment(np.array([3.0, 0.0, -9.0])))
    assert said(at_rest, {}, ()) == ({}, ["x", "z"], "acceleration along x, z")
    assert said(at_rest, {}, ("y", "z")) == ({}, ["y", "z"], "acceleration along y, z")
    weightless = System(system.bodies, system.joints)
    assert said(weightless, {}, ()) == ({}, [], "the acceleration with the largest response")


THIN = 2e-4  # m


@pytest.fixture(scope="module")
def sheet():
    mesh = rectangle(0.9, 0.5, 3, 2, "triangle")
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    mesh = type(mesh)(mesh.points @ turn.T + [3.0, 1.0, 2.0], mesh.cells, mesh.cell_groups, mesh.point_groups)
    return build_structure(mesh, [Member("surface", "plate", THIN, METAL)])


def test_a_wide_thin_sheet_is_known_by_its_extents_in_its_own_plane(sheet):
    found = sheet_of(sheet)
    bend = 10.0 * THIN * 0.9**2 / (2 * 0.5**2)  # where width^2 curvature / thickness is 10
    assert (found.width, found.thickness) == pytest.approx((0.5, THIN))
    assert (found.bend, found.size) == pytest.approx((bend, np.hypot(0.9, 0.5)))
    assert str(found) == "a sheet 0.5 m wide and 0.0002 m thick"
    assert sheet_of(arch(0.0)) is None


def test_what_is_said_of_a_wide_sheet_depends_on_what_its_set_has(sheet):
    clamped, loose = cantilever_modes(sheet, ["left"], 1), free_free_modes(sheet, 1)
    head = (
        "a sheet 0.5 m wide and 0.0002 m thick: bent by over 0.0032 m, it loses its transverse (anticlastic) curvature"
    )
    missing = f"{head}, and its modes are too stiff. Remove third_derivatives = 0"
    assert of_sheet(sheet, clamped, 0) == missing and of_sheet(sheet, loose, 0) == missing
    assert of_sheet(sheet, clamped, None) == ""
    assert of_sheet(sheet, loose, None) == (
        f"{head}, and its modes are too stiff. Without a clamp no shape is added for this: set third_derivatives = 2, "
        "or use method = 'cantilever', which adds the shape by itself"
    )
    third = SimpleNamespace(held=clamped.held, kinds=("vibration", "third derivative"))
    assert of_sheet(sheet, third, 1) == ""
    assert of_sheet(sheet, third, None) == (
        f"{head}. Its lowest mode in that state is added as a coordinate (third_derivatives = 0 would leave it out)"
    )
    assert of_sheet(arch(0.0), clamped, 0) == ""


def test_only_a_clamped_sheet_without_a_deflection_gets_a_shape_of_large_bends_by_itself(sheet):
    clamped, loose = cantilever_modes(sheet, ["left"], 1), free_free_modes(sheet, 1)
    assert with_own_bends(sheet, clamped, 0, None) is clamped
    assert with_own_bends(sheet, clamped, None, 0.1) is clamped
    assert with_own_bends(sheet, loose, None, None) is loose
    strip = arch(0.0)
    narrow = cantilever_modes(strip, ["start"], 1)
    assert with_own_bends(strip, narrow, None, None) is narrow
    assert with_own_bends(sheet, clamped, 1, None).kinds == ("vibration", "third derivative")


def test_analytic_origins_are_passed_over(steep):
    structure, modes = steep
    bent = reduce_structure(structure, with_derivatives(structure, modes), strain="condensed")
    assert shape_notes({"one": bent}, KnownBodies({"one": Origin(Analytic(None, None))})) == []
