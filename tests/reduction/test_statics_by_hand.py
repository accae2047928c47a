"""Loads, static answers, markers and checks of structures by short sums of their own, and what is said in numbers."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.reduction_examples import ALUMINIUM, bent_boom, frame, slender_beam

from femflex.fem import Material, Member, PointMass, build_structure
from femflex.fem.line.cut import cut
from femflex.fem.sections import CableSection, Rectangle
from femflex.mesh import Mesh, box, line, rectangle
from femflex.reduction import (
    BeamFunctions,
    ModeSet,
    Preload,
    UniformBeam,
    beam_body,
    cantilever_modes,
    craig_bampton,
    foreshortening,
    foreshortening_of,
    free_free_modes,
    least_stiffness_ratio,
    nodal,
    reduce_segments,
    reduce_structure,
    rigid_set,
    slow_loads,
    static_equilibrium,
    with_attachment,
    with_derivatives,
    with_third_derivatives,
)
from femflex.reduction.boundary.clamps import free_dofs, held_dofs
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import check_no_rigid_motion, rigid_shapes
from femflex.reduction.inertia import mass_points as of_mass_points
from femflex.reduction.large_deflection import bent_states
from femflex.reduction.modes.statics import static_response
from femflex.reduction.preload.loads import loads_on
from femflex.reduction.segments import tied
from femflex.reduction.wide_sheets import of_sheet, sheet_of, with_own_bends
from femflex.warning import PhysicsWarning


@pytest.fixture(scope="module")
def boom():
    return bent_boom(n=2, order=3)


# --- loads ------------------------------------------------------------------------------------------------------------


def test_a_field_pulls_on_every_mass_where_it_stands_and_where_it_has_moved_to(boom):
    """Total force and moment of g + A (r - origin) on the boom, on bodies at groups and of dead forces."""
    rng = np.random.default_rng(3)
    g, A, origin = rng.normal(size=3), rng.normal(size=(3, 3)), rng.normal(size=3)
    A = A + A.T
    given = Preload(g, A, origin, forces={"end": [3.0, -1.0, 2.0]}, masses={"end": 1.7, "start": 0.6})
    loads, R = loads_on(boom, given), rigid_shapes(boom)
    ends = {name: boom.mesh.points[boom.mesh.group_points(name)].mean(axis=0) for name in ("end", "start")}
    dm = np.concatenate([block.dm.ravel() for block in boom.inertia] + [[1.7, 0.6]])
    r = np.concatenate([block.rho.reshape(-1, 3) for block in boom.inertia] + [[ends["end"], ends["start"]]])
    for t in (np.zeros(3), np.array([0.4, -0.3, 0.2])):
        pull = dm[:, None] * (g + (r + t - origin) @ A.T)
        total = pull.sum(axis=0) + np.array([3.0, -1.0, 2.0])
        found = R.T @ loads.at(R[:, :3] @ t)
        np.testing.assert_allclose(found[:3], total, rtol=1e-9)
        if not t.any():
            moment = np.cross(r, pull).sum(axis=0) + np.cross(ends["end"], [3.0, -1.0, 2.0])
            np.testing.assert_allclose(found[3:], moment, rtol=1e-8)
    x, h = rng.normal(size=boom.n_dof), 1e-4
    way = rng.normal(size=boom.n_dof)
    slope = (loads.work(x + h * way) - loads.work(x - h * way)) / (2 * h)
    assert slope == pytest.approx(loads.at(x) @ way, rel=1e-7)


def test_fields_of_weight_spin_and_orbit():
    w, r = np.array([0.3, -0.5, 0.2]), np.array([1.0, 2.0, -0.7])
    np.testing.assert_allclose(Preload.spin(w).gradient @ r, -np.cross(w, np.cross(w, r)), atol=1e-12)
    np.testing.assert_array_equal(Preload.weight([0, 0, -9.8], masses={"a": 2.0}).acceleration, [0, 0, -9.8])
    v, h = np.array([0.0, 3.0, 4.0]) / 5, np.array([1.0, 0, 0])
    field = Preload.orbit(1e-3, 7 * v, 3 * h, origin=[1.0, 2.0, 3.0])
    along = np.cross(h, v)
    for axis, factor in ((v, 3.0), (along, 0.0), (h, -1.0)):
        np.testing.assert_allclose(field.gradient @ axis, factor * 1e-6 * axis, atol=1e-18)
    np.testing.assert_array_equal(field.origin, [1, 2, 3])
    with pytest.raises(
        ValueError, match=r"vertical \[0\.0, 0\.6, 0\.8\] and orbit normal \[0\.0, 1\.0, 0\.0\] are not"
    ):
        Preload.orbit(1e-3, [0, 3, 4], [0, 1, 0])
    for name, value, shape in (("acceleration", [1.0, 2.0], "(3,)"), ("gradient", np.full((3, 3), np.nan), "(3, 3)"),
                               ("origin", [0.0, np.inf, 0.0], "(3,)")):  # fmt: skip
        with pytest.raises(
            ValueError, match=rf"{name} of a preload is \[.*; give finite numbers of shape {re.escape(shape)}"
        ):
            Preload(**{name: value})


def test_tethers_under_compression_are_refused_with_how_many_motions_are_loose():
    """A chain of two halves, the lower one pressed: its free nodes in between have two negative ways each."""
    rope = build_structure(
        line([[0, 0, 0], [0, 0, -10.0]], 4),
        [Member("line", "tether", CableSection(1e5, 1.0), options={"prestress": 20.0})],
    )
    pins = {"start": ("x", "y", "z"), "end": ("x", "y", "z")}
    with pytest.warns(PhysicsWarning, match="slack over"):
        hung = static_equilibrium(rope, pins, Preload.weight([0, 0, -9.8]))
    K = hung.K[free_dofs(hung, held_dofs(hung, pins))][:, free_dofs(hung, held_dofs(hung, pins))].toarray()
    negative = int(np.sum(np.linalg.eigvalsh(K) < 0))
    assert negative
    with pytest.raises(
        ValueError, match=rf"slack tethers or wrinkled membranes leave {negative} motions of the struct"
    ):
        cantilever_modes(hung, pins, 2)


# --- static answers and frames ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("reference", ["left", "feet"])
def test_the_frame_of_a_floating_set_stays_with_its_reference_in_modes_and_in_answers(reference):
    structure = frame(n=2)
    modes = craig_bampton(structure, ("right", "left"), 2, reference=reference)
    rows = marker_rows(structure, reference)
    load = structure.translation.T @ np.random.default_rng(1).normal(size=(structure.translation.shape[0], 2))
    x = static_response(structure, modes, load)
    for shapes in (modes.phi, x):
        for own in (rows.translation, rows.rotation):
            assert np.abs(own @ shapes).max() < 1e-8 * np.abs(shapes).max()
    R = rigid_shapes(structure)
    balanced = load - structure.M @ R @ np.linalg.solve(R.T @ (structure.M @ R), R.T @ load)
    assert np.abs(structure.K @ x - balanced).max() < 1e-6 * np.abs(load).max()
    assert modes.reference == reference and craig_bampton(structure, ("right", "left"), 2).reference == "right"
    about = rigid_shapes(structure, about=np.array([0.4, -2.0, 1.0]))
    turned = (structure.translation @ about[:, 3:]).reshape(-1, 3, 3)
    d = structure.mesh.points - [0.4, -2.0, 1.0]
    np.testing.assert_allclose(turned, np.cross(np.eye(3)[None], d[:, None]).transpose(0, 2, 1), atol=1e-9)


def test_attachment_shapes_name_each_loaded_group_once():
    structure = frame(n=2)
    modes = cantilever_modes(structure, "feet", 2)
    more = with_attachment(structure, modes, ["x"], {"feet": ["x"], "top": ["z", "rx"]})
    assert more.groups == ("feet", "top")
    again = with_attachment(structure, more, [], {"top": ["y"]})
    assert again.groups == ("feet", "top")


def test_markers_of_a_condensed_beam_stretch_under_fields_of_force_along_it():
    """Field e along the axis: m' L^2 / 2 EA at the tip; field growing with the distance: m' L^3 / 3 EA."""
    way = np.array([2.0, 1.0, -2.0]) / 3
    beam = UniformBeam(
        3.0, EA=700.0, EIy=3.0, EIz=4.0, GJ=2.0, mass_per_length=0.5, direction=way, root=(0.2, 0.4, -0.1)
    )
    body = beam_body(beam, BeamFunctions(y=1, z=1), strain="condensed")
    tip, root = body.marker("tip").stretch, body.marker("root").stretch
    uniform = 0.5 * 9 / (2 * 700) * way
    for b in range(3):
        np.testing.assert_allclose(tip[:, 0, b], uniform * way[b], rtol=1e-9, atol=1e-12)
        for a in range(3):
            linear = 0.5 * (27 / (3 * 700) * way[a] + [0.2, 0.4, -0.1][a] * 9 / (2 * 700)) * way * way[b]
            np.testing.assert_allclose(tip[:, 1 + a, b], linear, rtol=1e-8, atol=1e-12)
    assert not root.any()


def test_markers_of_a_condensed_structure_stretch_as_its_elements_do_beyond_its_coordinates():
    structure = bent_boom(n=2, order=3)
    modes = with_derivatives(structure, cantilever_modes(structure, "start", 1))
    body = reduce_structure(structure, modes, {"tip": "end"}, strain="condensed")
    found = body.marker("tip").stretch
    free = free_dofs(structure, modes.held)
    K, phi = structure.K[free][:, free].toarray(), modes.phi[free][:, :1]
    rows = marker_rows(structure, "end")
    for b in range(3):  # in uniform fields, which lie in the nodes' motion exactly
        load = (structure.M @ rigid_shapes(structure)[:, b])[free]
        x = np.zeros(structure.n_dof)
        x[free] = np.linalg.solve(K, load) - phi @ np.linalg.solve(phi.T @ K @ phi, phi.T @ load)
        np.testing.assert_allclose(found[:, 0, b], rows.translation @ x, rtol=1e-4, atol=1e-12)
    assert found[:, 1:].any()


def test_a_marker_tied_to_another_place_moves_as_a_rigid_arm_does():
    body = reduce_structure(frame(n=2), cantilever_modes(frame(n=2), "feet", 3), {"top": "top"})
    given, place = body.marker("top"), np.array([0.3, -0.7, 1.9])
    arm = tied(given, place)
    np.testing.assert_array_equal(arm.position, place)
    for k in range(3):
        moved = given.phi[:, k] + np.cross(given.psi[:, k], place - given.position)
        np.testing.assert_allclose(arm.phi[:, k], moved, rtol=1e-12)
    np.testing.assert_array_equal(arm.psi, given.psi)


# --- mass -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("most", [600, 3])
def test_points_of_mass_of_long_structures_keep_mass_centre_and_first_moments(most, monkeypatch):
    monkeypatch.setattr(of_mass_points, "MOST", most)
    mesh = line([[0, 0, 0], [90.0, 20.0, 60.0], [130.0, 20.0, 0.0]], 3)
    member = Member("line", "beam", Rectangle(0.5, 0.3), ALUMINIUM)
    structure = build_structure(mesh, [member], [PointMass("end", 40.0)])
    modes = cantilever_modes(structure, "start", 2)
    points, R = of_mass_points.mass_points(structure, modes.phi), rigid_shapes(structure)
    body = reduce_structure(structure, modes)
    every = sum(block.dm.size for block in structure.inertia)
    assert len(points.dm) == (every if most == 600 else sum(len(block.dm) for block in structure.inertia))
    assert points.dm.sum() == pytest.approx(body.moments.mass)
    np.testing.assert_allclose(points.dm @ points.rho, body.moments.first[0], rtol=1e-10)
    np.testing.assert_allclose(
        np.einsum("p,pak->ka", points.dm, points.phi), body.moments.first[1:], rtol=1e-9, atol=1e-9
    )
    np.testing.assert_allclose(R[:, :3].T @ structure.M @ modes.phi, body.moments.first[1:].T, atol=1e-8)
    near = np.einsum("p,pa,pb->ab", points.dm, points.rho, points.rho)
    if most == 600:
        np.testing.assert_allclose(near, body.moments.second[0, :, 0], rtol=1e-9)
    short = build_structure(line([[0, 0, 0], [60.0, 60.0, 50.0]], 2), [member])  # 98.5 m
    assert of_mass_points.mass_points(short, np.zeros((short.n_dof, 0))) is None
    alike = build_structure(line([[0, 0, 0], [60.0, 60.0, 53.0]], 2), [member])  # 100.04 m
    rigid = reduce_structure(alike, rigid_set(alike.n_dof))  # a long body without shapes has its points too
    assert rigid.mass_points.phi.shape == (len(rigid.mass_points.dm), 3, 0)
    assert rigid.mass_points.dm.sum() == pytest.approx(rigid.moments.mass)


# --- nothing, little and too much -------------------------------------------------------------------------------------


def test_sets_without_shapes_have_no_foreshortening_no_curvature_and_no_derivative(boom):
    none = rigid_set(boom.n_dof)
    assert not foreshortening(boom, none).mass.any() and not foreshortening(boom, none).at
    assert least_stiffness_ratio(boom, none) == 1.0
    modes = cantilever_modes(boom, "start", 2)
    assert with_third_derivatives(boom, modes, 0) is modes
    with pytest.raises(ValueError, match="third derivatives of 3 shapes were requested; the set has 2"):
        with_third_derivatives(boom, modes, 3)
    body = reduce_structure(boom, modes)
    assert not foreshortening_of(body).at
    assert slow_loads(boom, none, (), {"end": ["x"]}).shape[0] == boom.n_dof


def test_nodal_sets_and_sets_without_derivatives_are_no_condensed_bodies(boom):
    with pytest.raises(ValueError, match=r"which nodal displacements do not have. Give it strain = 'nonlinear'"):
        reduce_structure(boom, nodal(boom, "start"), strain="condensed")
    with pytest.raises(ValueError, match=r"this set has none \(vibration\); add them"):
        reduce_structure(boom, cantilever_modes(boom, "start", 2), strain="condensed")


def test_more_shapes_than_dofs_and_shapes_of_nothing_are_not_independent():
    R, weight = np.zeros((2, 0)), np.ones(2)
    for phi, n in ((np.random.default_rng(0).normal(size=(2, 3)), 3), (np.array([[1.0, 0.0], [2.0, 0.0]]), 2)):
        with pytest.raises(
            ValueError, match=rf"the {n} shapes are not independent \(smallest singular value 0\.0e\+00"
        ):
            check_no_rigid_motion(R, phi, weight)
    check_no_rigid_motion(R, np.array([[1.0, 1.0], [1.0, -1.0]]), weight)
    check_no_rigid_motion(R, np.zeros((2, 0)), weight)


def test_the_energy_of_a_state_rises_by_inner_forces_less_those_of_initial_stress():
    pulled = {"order": 3, "orientation": (0, 1, 0), "prestress": 4e3}
    member = Member("line", "beam", Rectangle(0.05, 0.01), ALUMINIUM, pulled)
    beam = build_structure(line([[0, 0, 0], [1.0, 0, 0]], 2), [member])
    assert np.abs(beam.f0).max() == pytest.approx(4e3)
    x, way = 1e-4 * np.random.default_rng(6).normal(size=(2, beam.n_dof))
    ahead, back = (bent_states.state_energy(beam, x + s * way) for s in (1e-3, -1e-3))
    assert (ahead - back) / 2e-3 == pytest.approx(way @ (beam.internal_force.force(x) - beam.f0), rel=1e-6)


def test_a_state_that_is_not_found_is_said_with_its_amplitudes(boom, monkeypatch):
    modes = cantilever_modes(boom, "start", 2)
    monkeypatch.setattr(bent_states, "ITERATIONS", 1)
    with pytest.raises(
        ValueError, match=r"amplitudes \[0\.25, -0\.5\] of the 2 shapes was not found in 1 steps; derive"
    ):
        bent_states.held_at(boom, modes, np.array([0.25, -0.5]), np.zeros(boom.n_dof))


def test_segments_take_a_marker_of_the_first_one_that_holds_its_group_and_others_are_named():
    mesh = line([[0, 0, 0], [4.0, 1.0, 0]], 8).with_groups(points={"mid": [4], "both": [1, 7]})
    segments = cut(mesh, [Member("line", "beam", Rectangle(0.05, 0.03), ALUMINIUM)], 2, start="start")
    bodies = reduce_segments(segments, {"waist": "mid"})
    assert "waist" in bodies[0].markers and "waist" not in bodies[1].markers
    np.testing.assert_allclose(bodies[0].marker("waist").position, [2.0, 0.5, 0.0], atol=1e-12)
    with pytest.raises(
        ValueError, match=r"marker 'eye' needs group 'both', whose points are on several of the 2 segments"
    ):
        reduce_segments(segments, {"eye": "both"})


# --- wide sheets ------------------------------------------------------------------------------------------------------


def test_a_sheet_is_wide_where_its_crosswise_curvature_goes_within_a_twentieth_of_its_length():
    """b^2 2 w / (L^2 h) = 10 at the bend w."""
    metal = Material(70e9, 0.3, 2700.0)

    def sheet(length, width, h, turn=0.3):
        flat = rectangle(length, width, 4, 2)
        c, s = np.cos(turn), np.sin(turn)
        points = flat.points @ np.array([[c, s, 0], [0, 0, 1.0], [s, -c, 0]])
        return build_structure(flat.__class__(points, flat.cells, flat.cell_groups, flat.point_groups),
                               [Member("surface", "plate", h, metal)])  # fmt: skip

    found = sheet_of(sheet(2.0, 0.8, 1e-3))
    assert found.width == pytest.approx(0.8) and found.thickness == pytest.approx(1e-3)
    assert found.bend == pytest.approx(10 * 1e-3 * 4 / (2 * 0.64)) and found.size == pytest.approx(np.hypot(2, 0.8))
    assert str(found) == "a sheet 0.8 m wide and 0.001 m thick"
    assert sheet_of(sheet(2.0, 0.8, 3.1e-3)) is not None and sheet_of(sheet(2.0, 0.8, 3.3e-3)) is None  # 0.1 m
    assert sheet_of(bent_boom(n=2)) is None
    structure = sheet(2.0, 0.8, 1e-3)
    modes = cantilever_modes(structure, "left", 2)
    third = ModeSet(modes.phi, ("vibration", "third derivative"), modes.omega, modes.groups, modes.held)
    free = free_free_modes(structure, 2)
    begins = "a sheet 0.8 m wide and 0.001 m thick: bent by over 0.031 m"
    for own, wanted, words in (
        (modes, 0, "Remove third_derivatives = 0"),
        (third, None, "added as a coordinate (third_derivatives = 0 would leave it out)"),
        (free, None, "Without a clamp no shape is added for this: set third_derivatives = 2"),
    ):
        text = of_sheet(structure, own, wanted)
        assert text.startswith(begins) and words in text
    assert of_sheet(structure, modes, None) == "" == of_sheet(structure, third, 1)
    assert of_sheet(bent_boom(n=2), modes, 0) == ""
    assert with_own_bends(structure, free, None, None) is free
    assert with_own_bends(structure, modes, None, 0.1) is modes
    assert with_own_bends(structure, modes, 0, None) is modes


def test_stress_and_solids_far_from_warnings_say_nothing():
    block = build_structure(box(1.0, 0.2, 0.1, 2, 1, 1, "tetra10"), [Member("volume", "solid", material=ALUMINIUM)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        body = reduce_structure(block, cantilever_modes(block, "left", 2))
    assert sheet_of(block) is None and body.n_modes == 2
    straight = slender_beam(n=2, order=3)
    assert least_stiffness_ratio(straight, cantilever_modes(straight, "start", 2)) == pytest.approx(1.0)


def test_of_many_loose_parts_the_first_five_are_listed_and_the_rest_are_counted():
    """Eight bars side by side, the first of three nodes; seven hang on nothing."""
    points = [[x, y, 0.0] for y in range(8) for x in ((0.0, 1.0, 2.0) if y == 0 else (0.5, 1.5))]
    cells = [[0, 1], [1, 2], *([3 + 2 * k, 4 + 2 * k] for k in range(7))]
    mesh = Mesh(np.array(points), {"line": np.array(cells)}, {"bars": {"line": np.arange(9)}}, {"root": np.array([0])})
    structure = build_structure(mesh, [Member("bars", "beam", Rectangle(0.05, 0.03), ALUMINIUM)])
    with pytest.raises(
        ValueError, match=r"falls into 8 parts that share no node \(in addition to the largest: "
    ) as found:
        cantilever_modes(structure, "root", 1)
    text = str(found.value)
    assert text.count("2 nodes, among them the node at (0.5, ") == 5 and "and 2 more)" in text
    assert "the node at (0, 0, 0)" not in text
