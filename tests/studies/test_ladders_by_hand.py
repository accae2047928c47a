"""Ladders of a mixed case by hand: which bodies a study varies, its levels, their work, and what is built at each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.straight_beam import LENGTH, beam_mesh

from femflex.assembly import build_modes
from femflex.assembly.structures import structure_of
from femflex.case import Case, CaseError, read_case
from femflex.fem import Material, Member, build_structure
from femflex.matrices import full_model, write_matrices
from femflex.mesh import write_mesh
from femflex.mesh.generators import box
from femflex.pipeline.case_bodies import build_body
from femflex.reduction import save_body
from femflex.studies.derivative_ladder import derivative_ladder
from femflex.studies.ladder import mesh_ladder, mode_ladder, mode_names
from femflex.studies.level import with_level
from femflex.studies.segment_ladder import segment_ladder

Built = Callable[..., Case]

ROD = """
[bodies.{name}]
kind = "flexible"
mesh = "{name}.inp"
members = [{{ group = "BEAM", family = "beam", section = "rod"{more} }}]
{reduction}
[[joints]]
kind = "weld"
parent = "hub"
child = "{name}"
child_marker = "ROOT"
"""
HEAD = """
[run]
duration = 1
samples = 3
[sections.rod]
kind = "stiffness"
EA = 1e6
EIy = 50
EIz = {EIz}
GJ = 40
mass_per_length = 0.5
ry = 0.01
rz = 0.01
[bodies.hub]
kind = "rigid"
mass = 5
inertia = [3, 3, 3]
[study]
quantity = {{ of = "value", channel = "bodies/hub/rate", component = "y" }}
{study}
"""
SOLID = """
[materials.soft]
E = 7e7
nu = 0.3
density = 270
[bodies.block]
kind = "flexible"
mesh = "block.msh"
strain = "linear"
members = [{ group = "volume", family = "solid", material = "soft" }]
reduction = { method = "cantilever", clamp = "left", modes = 3, joints = {} }
[[joints]]
kind = "weld"
parent = "hub"
child = "block"
child_marker = "left"
"""
CANTILEVER = (
    'strain = "linear"\nreduction = {{ method = "cantilever", clamp = "ROOT", modes = {n}, joints = {{}}{more} }}'
)


def cantilever(n: int, more: str = "") -> str:
    return CANTILEVER.format(n=n, more=more)


def crafted(folder: Path, *rods: tuple[str, int, str, str], study: str = "", EIz: float = 80, extra: str = "") -> Case:
    """A hub with rods (name, cells of the mesh, more of the member, reduction)."""
    text = HEAD.format(study=study, EIz=EIz)
    for name, cells, more, reduction in rods:
        (folder / f"{name}.inp").write_text(beam_mesh(cells))
        marked = reduction if '"ROOT"' in reduction else f"markers.ROOT = {{}}\n{reduction}"
        text += ROD.format(name=name, more=more, reduction=marked)
    (folder / "craft.toml").write_text(text + extra)
    return read_case(folder / "craft.toml")


def levels(ladder) -> list[int]:
    return [rung.level for rung in ladder.rungs]


def test_segments_go_from_a_quarter_to_four_times_the_most_that_a_body_has(tmp_path):
    case = crafted(tmp_path, ("a", 4, ", segments = 3", ""), ("b", 2, ", segments = 5", ""))
    found = segment_ladder(case)
    assert found.varied == ("a", "b") and found.own is None and found.whole is None
    assert levels(found) == [1, 2, 5, 10, 20] and [rung.weight for rung in found.rungs] == [1, 2, 5, 10, 20]
    built = found.rungs[1].build()
    assert {name: len(part.bodies) for name, part in built.bodies.items()} == {"a": 2, "b": 2}
    assert built.count == 24  # of two bodies with two segments of six shapes
    assert (built.derivatives, built.followers, built.others) == (0, 0, {})


def test_segments_are_those_of_the_study_or_those_requested_and_one_body_has_its_own_number(tmp_path):
    case = crafted(tmp_path, ("a", 4, ", segments = 3", ""), study="segments = [6, 2, 4, 2]")
    assert levels(segment_ladder(case)) == [2, 4, 6] and segment_ladder(case).own == 3
    assert levels(segment_ladder(case, [9, 1])) == [1, 9]
    case = crafted(tmp_path, ("a", 4, ", segments = 3", ""))
    assert levels(segment_ladder(case)) == [1, 3, 6, 12]


def test_derivative_shapes_of_segments_are_counted_over_all_of_them(tmp_path):
    case = crafted(tmp_path, ("a", 4, ", segments = 2", 'strain = "nonlinear"'))
    rung = segment_ladder(case, [2, 3]).rungs[1]
    built = rung.build()
    kinds = [piece.kinds for piece in built.bodies["a"].bodies]
    assert len(kinds) == 3 and built.derivatives == sum(one.count("derivative") for one in kinds)


def test_the_level_is_set_in_the_cut_member_alone(tmp_path):
    case = crafted(tmp_path, ("a", 4, ", segments = 3", ""))
    table = case.bodies["a"]
    table = table.model_copy(
        update={"members": [table.members[0].model_copy(update={"segments": None}), *table.members]}
    )
    assert [one.segments for one in with_level(table, "segments", 7).members] == [None, 7]
    refined = table.model_copy(update={"refine": 2})
    assert with_level(refined, "mesh", 3).refine == 5 and with_level(refined, "mesh", 3).members == table.members


MATRICES = """
[bodies.box]
kind = "matrices"
matrices = "box.npz"
{reduction}
[bodies.still]
kind = "matrices"
matrices = "still.npz"
[bodies.pole]
kind = "analytic"
length = 2
mass = 1
EA = 1e7
EIy = 2000
EIz = 2000
GJ = 1500
radius = 0.02
functions = {{ y = 4, axial = 5 }}
[bodies.mast]
kind = "deploying"
family = "beam"
length = {{ kind = "smooth_step", from = 3, to = 4, start = 0, end = 20 }}
mass_per_length = 1
EIy = 20
EIz = 30
functions = {{ y = 2, z = 3 }}
strain = "linear"
"""


def test_every_kind_of_body_says_how_many_modes_it_keeps_and_gets_those_of_a_level(tmp_path):
    rods = [
        ("fixed", 2, "", cantilever(6)),
        ("loose", 2, "", 'strain = "linear"\nreduction = { method = "free_free", modes = 7 }'),
        ("lumped", 2, "", 'strain = "linear"\nreduction = { method = "lumped", clamp = "ROOT" }'),
        ("cut", 2, ", segments = 2", ""),
    ]
    for name in ("box", "still"):
        block = build_structure(
            box(2.0, 0.3, 0.2, 2, 1, 1), [Member("volume", "solid", None, Material(7e7, 0.3, 270.0))]
        )
        write_matrices(full_model(block), tmp_path / f"{name}.npz")
    kept = 'reduction = { method = "free_free", modes = 8 }'
    joints = "".join(f'[[joints]]\nkind = "weld"\nchild = "{name}"\n' for name in ("box", "still", "pole", "mast"))
    case = crafted(tmp_path, *rods, extra=MATRICES.format(reduction=kept) + joints)
    names = mode_names(case)
    assert names == ["fixed", "loose", "box", "pole", "mast"]
    changed = {name: with_level(case.bodies[name], "modes", 9) for name in names}
    assert [changed[name].reduction.modes for name in ("fixed", "loose", "box")] == [9, 9, 9]
    assert [(f.y, f.z, f.axial, f.torsion) for f in (changed["pole"].functions, changed["mast"].functions)] == [
        (9, 0, 9, 0),
        (9, 9, 0, 0),
    ]
    for name, own in (("pole", 5), ("mast", 3), ("box", 8), ("loose", 7)):
        study = case.study.model_copy(update={"body": name})
        assert mode_ladder(case.model_copy(update={"study": study}), [1, 2]).own == own
    with pytest.raises(ValueError) as caught:
        derivative_ladder(case)
    assert str(caught.value) == (
        "craft.toml: there is no nonlinear strain with derivatives to vary; its bodies are hub (rigid), fixed "
        "(flexible, cantilever), loose (flexible, free_free), lumped (flexible, lumped), cut (flexible, 2 segments), "
        "box (matrices), still (matrices), pole (analytic), mast (deploying). Vary something else (modes, mesh, "
        "derivatives, segments, strain), or another body."
    )


def test_the_body_of_the_study_that_cannot_be_varied_is_named(tmp_path):
    case = crafted(tmp_path, ("a", 2, "", cantilever(3)), ("b", 2, ", segments = 2", ""), study='body = "b"')
    words = "craft.toml: body 'b', which the study is about, has no modes to vary; its bodies are hub"
    with pytest.raises(ValueError, match=words):
        mode_ladder(case)
    assert segment_ladder(case).varied == ("b",)


def test_bodies_are_varied_together_by_the_most_modes_that_one_of_them_has(tmp_path):
    case = crafted(tmp_path, ("a", 6, "", cantilever(2)), ("b", 6, "", cantilever(5)))
    found = mode_ladder(case)
    assert found.varied == ("a", "b") and found.own is None and levels(found) == [1, 2, 3, 4, 5, 6, 8, 10]
    assert [rung.weight for rung in found.rungs] == [1, 4, 9, 16, 25, 36, 64, 100]
    built = found.rungs[2].build()
    assert built.count == 6 and [built.bodies[name].n_modes for name in "ab"] == [3, 3] and not built.others
    whole = build_body(case, "b")
    assert found.rungs[4].build().bodies["b"].omega == pytest.approx(whole.omega, rel=1e-9)
    assert levels(mode_ladder(case, [4, 1, 4])) == [1, 4]
    assert levels(mode_ladder(crafted(tmp_path, ("a", 6, "", cantilever(2)), study="modes = [5, 3, 1]"))) == [1, 3, 5]


def test_a_level_never_parts_a_pair_of_equal_frequencies(tmp_path):
    case = crafted(tmp_path, ("a", 6, "", cantilever(3)), EIz=50)
    found = mode_ladder(case, [1, 2, 3, 4])
    assert levels(found) == [2, 4] and found.own in (2, 4)  # bending along y and z is one frequency
    assert [rung.build().count for rung in found.rungs] == [2, 4]
    assert mode_ladder(case, [1, 2]).own == 3  # its own number lies beyond the levels


def test_no_more_modes_are_tried_than_a_mesh_has_but_a_request_for_more_fails(tmp_path):
    case = crafted(tmp_path, ("a", 1, "", cantilever(6)))  # one element: eleven degrees of freedom beyond the clamp
    assert levels(mode_ladder(case)) == [1, 2, 3, 4, 6]
    with pytest.raises(CaseError):
        mode_ladder(case, [2, 40])


@pytest.mark.parametrize(
    "more",
    ['attachment = ["y", "rx"]', 'loads = { TIP = ["z"] }', "derivatives = 1", "strain condensed, derivatives = 1"],
)
def test_sets_with_more_than_modes_are_made_anew_at_every_level(tmp_path, more):
    """Fewer shapes are not the first of more: static and derivative shapes are made for the modes that are kept."""
    strain, _, extra = more.rpartition("strain condensed, ")
    text = cantilever(3, f", {extra}")
    if extra.startswith("derivatives"):
        text = text.replace('"linear"', '"condensed"' if strain or "condensed" in more else '"nonlinear"')
    found = mode_ladder(crafted(tmp_path, ("a", 3, "", text)), [1, 2])
    for n, rung in zip((1, 2), found.rungs, strict=True):
        kinds = rung.build().bodies["a"].kinds
        assert kinds.count("vibration") == n and len(kinds) == n + (2 if "attachment" in more else 1)


def test_a_frequency_of_a_body_does_not_ask_for_static_shapes_of_joints(built: Built):
    quantity = (
        'of = "value", channel = "markers/beam.tip/deflection", component = "y"',
        'of = "mode_frequency", body = "beam", mode = 1',
    )
    case = built(quantity)
    assert [set(rung.build().bodies["beam"].kinds) for rung in mode_ladder(case, [1, 3]).rungs] == [{"vibration"}] * 2


def test_work_of_refinements_grows_with_the_points_of_all_meshes(tmp_path):
    case = crafted(tmp_path, ("a", 3, "", cantilever(2)), ("b", 6, "", cantilever(2)))
    found = mesh_ladder(case, [2, 0, 1, 1])
    assert found.own == 0 and levels(found) == [0, 1, 2] and [rung.weight for rung in found.rungs] == [11, 22, 44]
    solid = HEAD.format(study="", EIz=80) + SOLID
    write_mesh(tmp_path / "block.msh", box(2.0, 0.3, 0.2, 2, 1, 1))
    (tmp_path / "solid.toml").write_text(solid)
    points = 3 * 2 * 2
    weights = [rung.weight for rung in mesh_ladder(read_case(tmp_path / "solid.toml")).rungs]
    assert weights == [points, points * 8, points * 64, points * 512]  # a fourth refinement has more than 30 000
    built = found.rungs[1].build()
    assert built.count == 6 * (7 + 13) + 5 * (6 + 12) and [body.n_modes for body in built.bodies.values()] == [2, 2]


def test_segments_are_made_of_the_refined_mesh(tmp_path):
    found = mesh_ladder(crafted(tmp_path, ("a", 2, ", segments = 2", "")), [0, 1, 3])
    whole, half, eighth = (
        [sum(map(len, one.skin.cells.values())) for one in rung.build().bodies["a"].bodies] for rung in found.rungs
    )
    for one, two, eight in zip(whole, half, eighth, strict=True):  # cells of its length, and those of its ends
        assert eight - one == 7 * (two - one) > 0


def test_modes_of_a_refined_mesh_come_with_the_rounding_of_their_frequency(tmp_path):
    """Rounding of n terms of the stiffness at random over the energy of the mode: eps / (2 sqrt(n) ratio)."""
    quantity = 'quantity = { of = "value", channel = "bodies/hub/rate", component = "y" }'
    case = crafted(tmp_path, ("a", 3, "", cantilever(2)))
    text = (tmp_path / "craft.toml").read_text()
    assert quantity in text
    (tmp_path / "craft.toml").write_text(
        text.replace(quantity, 'quantity = { of = "mode_frequency", body = "a", mode = 2 }')
    )
    case = read_case(tmp_path / "craft.toml")
    coarse, fine = (rung.build() for rung in mesh_ladder(case, [0, 2]).rungs)
    for one, cells in ((coarse, 3), (fine, 12)):
        assert one.count == 6 * (cells + 1) + 5 * cells and not hasattr(one.bodies["a"], "kinds") and one.added == 0
    exact = 1.8751040687119611**2 / LENGTH**2 * np.sqrt(80.0 / 0.5)
    assert fine.bodies["a"].omega[1] == pytest.approx(exact, rel=1e-3)
    for one, r in ((coarse, 0), (fine, 2)):
        structure = structure_of(case, "a", case.bodies["a"], r)
        K = structure.K.toarray()
        phi = build_modes(structure, case.bodies["a"])[1].phi[:, 1]
        terms = np.abs(phi) @ np.abs(K) @ np.abs(phi) / (phi @ K @ phi)
        assert one.rounding == pytest.approx(2.0**-52 * terms / (2 * np.sqrt(len(K))), rel=1e-3)


def test_a_body_from_a_file_has_the_modes_that_it_holds_unless_its_table_says_fewer(tmp_path):
    case = crafted(tmp_path, ("a", 6, "", cantilever(6)))
    save_body(tmp_path / "a.h5", build_body(case, "a"))
    filed = (
        '[bodies.f]\nkind = "file"\nfile = "a.h5"\n{}[[joints]]\nkind = "weld"\nchild = "f"\nchild_marker = "ROOT"\n'
    )
    whole = crafted(tmp_path, extra=filed.format(""))
    assert levels(mode_ladder(whole)) == [1, 2, 3, 4, 6] and mode_ladder(whole).own == 6
    part = crafted(tmp_path, extra=filed.format("modes = 2\n"))
    assert levels(mode_ladder(part)) == [1, 2, 3, 4] and mode_ladder(part).own == 2
    assert mode_ladder(part, [1, 3]).rungs[1].build().bodies["f"].n_modes == 3
    assert with_level(part.bodies["f"], "modes", 5).modes == 5
