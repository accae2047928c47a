"""Loads, supports, connections, materials and environments of cases become the objects that they describe."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.assembly import structures
from femflex.assembly.acting_loads import ActingLoads, acting_loads, added_shapes_text, load_directions
from femflex.assembly.bodies import marker_groups
from femflex.assembly.deck_facts import _clamp, _ends, holds
from femflex.assembly.functions import AddedShapes, with_static
from femflex.assembly.initial import initial_shape, wanted_displacement
from femflex.assembly.joints import build_joint, nominal_axes
from femflex.assembly.matrices import _sources
from femflex.assembly.orbits import build_orbit
from femflex.assembly.sections import build_material, build_section, build_solid_material
from femflex.assembly.shared import shared_structures
from femflex.assembly.structures import (
    build_mesh,
    bushings_of,
    connections_of,
    mean_motion,
    point_masses_of,
    preload_of,
    structure_of,
)
from femflex.assembly.system import build_frame, system_of
from femflex.body import rigid_body
from femflex.case import parse_case, read_case
from femflex.case.body import FlexibleTable
from femflex.case.initial import InitialTable
from femflex.case.matrices import MatrixFilesTable
from femflex.case.orbit import AttitudeTable
from femflex.cli.info import body_text
from femflex.fem.support import Support

RUN = "[run]\nduration = 4\n"
HUB = RUN + "[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\nmarkers.m = { position = [1, 2, 3] }\n"
LOAD = "[[loads]]\nname = '{}'\nbody = 'hub'\nmarker = '{}'\n{}\n"


def test_a_load_acts_along_its_components_in_body_axes_and_along_all_in_others():
    text = HUB
    for name, keys in (
        ("a", "force = [0, 2, 0]\ntorque = [1, 0, 0]"),
        ("b", "force = [0, 2, 0]\nframe = 'inertial'"),
        ("c", "torque = [0, 0, 3]\nframe = 'marker'"),
        ("d", "force = [[0, 0, 0], [0, 0, 1], [1, 0, 0]]\ntimes = [0, 1, 2]"),
        ("e", "force = [0, 0, 0]"),
    ):
        text += LOAD.format(name, "m" if name < "c" else "origin", keys)
    found = list(load_directions(parse_case(text), "hub"))
    translations, rotations = ["x", "y", "z"], ["rx", "ry", "rz"]
    assert found == [
        ("m", ["y", "rx"]), ("m", translations), ("origin", rotations), ("origin", ["x", "z"]), ("origin", []),
    ]  # fmt: skip
    assert list(load_directions(parse_case(text), "boom")) == []


def test_a_nonlinear_boom_answers_its_loads_its_weight_and_what_it_carries(craft: str, write_case: Any):
    text = craft.replace("modes = 4 }", "modes = 4 }\nstrain = 'condensed'\nmarkers.ROOT = {}").replace(
        "initial = {", "# initial = {"
    )
    text += "[environment]\ngravity = 9.81\n[[loads]]\nname = 'tug'\nbody = 'boom'\nmarker = 'tip'\nforce = [0, 1, 0]\n"
    case = read_case(write_case(text))
    table: Any = case.bodies["boom"]
    found = acting_loads(case, "boom", table, marker_groups(table))
    assert (dict(found.loads), found.base, found.causes) == ({"TIP": ("y",)}, ("x", "y", "z"), ("weight",))
    modes: Any = SimpleNamespace(kinds=("vibration", "attachment", "attachment", "attachment"))
    assert added_shapes_text(found, modes, {"ROOT": ["rx", "x"]}) == (
        "3 static shapes of its loads (TIP y, weight) and of its joints (ROOT rx x) in addition to its modes "
        "(loads = {} and attachment = [] and joints = {} in its reduction would leave them out)"
    )
    assert added_shapes_text(ActingLoads(), modes, {}) == ""
    linear = read_case(write_case(text.replace("'condensed'", "'linear'")))
    found = acting_loads(linear, "boom", linear.bodies["boom"], {"tip": "TIP"})  # type: ignore[arg-type]
    assert (dict(found.loads), found.base, found.least) == ({"TIP": ("y",)}, (), 0.01)
    pin = "[[joints]]\nkind = 'spherical'\nparent = 'boom'\nparent_marker = 'tip'\nchild = 'ball'\n"
    ball = "[bodies.ball]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"
    carrying = read_case(write_case(text.replace("force = [0, 1, 0]", "torque = [0, 0, 2]") + ball + pin))
    found = acting_loads(carrying, "boom", carrying.bodies["boom"], {"tip": "TIP"})  # type: ignore[arg-type]
    assert dict(found.loads) == {"TIP": ("x", "y", "z", "rz")}


def test_the_note_of_a_beam_counts_two_shapes_for_bending_and_one_for_others():
    counts = {"y": 5, "z": 0, "axial": 2, "torsion": 1}
    assert with_static({"y": 3, "z": 0, "axial": 1, "torsion": 0}, 2) == {"y": 7, "z": 0, "axial": 3, "torsion": 0}
    both = AddedShapes(root=True, joined=False, loaded=True, more=2)
    assert both.tip and both.note(counts, spun=True) == (
        "8 static shapes of its loads (spin, tip) and of its joints (root) in addition to its functions "
        "(loads = false and joints = [] in its functions would leave them out)"
    )
    assert AddedShapes(False, False, False, 0).note(counts) == "" and not AddedShapes(True, False, False, 1).tip
    assert AddedShapes(False, True, False, 1).note({"axial": 3}).startswith("1 static shape of its joints (tip)")


# supports of decks


class Deck:
    """Points and groups as a deck has them."""

    def __init__(self, points: Any, **groups: list[int]) -> None:
        self.mesh = SimpleNamespace(points=np.array(points, float), group_points=lambda name: np.array(groups[name]))
        self.points_of_ids = {10 * (k + 1): k for k in range(len(points))}


CORNERS = [[0, 0, 0], [2, 0, 0], [0, 3, 0], [1, 1, 5], [2, 3, 1]]
TURNED = ((0.6, 0.0, 0.8), (0.0, 1.0, 0.0), (-0.8, 0.0, 0.6))


@pytest.mark.parametrize(
    ("held", "holding"),
    [
        ({"a": "xyz"}, False),
        ({"ab": "xyz"}, False),  # turns about the line
        ({"abc": "xyz"}, True),
        ({"abc": "xy"}, False),
        ({"a": "xyz", "b": "yz", "c": "z"}, True),  # three, two, one
        ({"a": "xyz", "b": "yz", "c": "x"}, False),  # turns about x: c moves along z alone
        ({"a": "xyz", "b": "xz", "c": "z"}, False),  # turns about z
        ({"autospc_1": "xyz", "ab": "xyz"}, False),
        ({}, False),
    ],
)
@pytest.mark.parametrize("axes", [None, TURNED])
def test_supports_hold_a_deck_where_no_rigid_motion_is_left(held: dict[str, str], holding: bool, axes: Any):
    groups = {"a": [0], "b": [1], "c": [2], "ab": [0, 1], "abc": [0, 1, 2], "autospc_1": [2, 3, 4]}
    points = np.array(CORNERS) if axes is None else np.array(CORNERS) @ np.array(axes)
    made = {name: Support(tuple(c)) if axes is None else Support(tuple(c), axes) for name, c in held.items()}
    assert holds(Deck(points, **groups), made) is holding  # type: ignore[arg-type]


def test_one_node_holds_a_deck_by_all_six_components_alone():
    deck: Any = Deck(CORNERS, a=[3])
    assert holds(deck, {"a": Support(("x", "y", "z", "rx", "ry", "rz"))})
    assert not holds(deck, {"a": Support(("x", "y", "z", "rx", "ry"))})


def test_the_root_is_the_clamped_node_nearest_the_middle_and_the_tip_the_farthest_from_it():
    points = [[0, 0, 0], [0, 2, 0], [0, 1.1, 0], [4, 1, 0], [3, -3, 0]]
    deck: Any = Deck(points, root=[0, 1, 2], autospc_1=[4])
    held = {"root": Support(("x",)), "autospc_1": Support(("x",))}
    assert _ends(deck, held, np.array([9.0, 9, 9])) == (30, 50)  # of 4.00 m and 5.08 m
    assert _ends(deck, {}, np.array([3.5, 1.0, 0])) == (40, 10)  # the node nearest to the centre of mass
    deck.supports, deck.default_supports = {"one": {}, "two": {}}, ()
    deck.held = lambda names=None: {"root": Support(("x", "y", "z") if names == ["two"] else ("x",))}
    assert _clamp(deck, ("one", "two"))[0] == ""  # three nodes on a line
    deck.mesh.points[2] = [1, 1, 0]
    assert _clamp(deck, ("one", "two"))[0] == "two"
    deck.default_supports = ("two",)
    deck.held = lambda names=None: {"root": Support(("x", "y", "z"))}
    assert _clamp(deck, ("one", "two"))[0] == "supports"


# tables of flexible bodies

TABLE = {
    "kind": "flexible",
    "mesh": "a.msh",
    "members": [{"group": "line", "family": "beam"}],
    "reduction": {"method": "free_free", "modes": 3},
    "connections": [
        {
            "kind": "rigid",
            "group": "g",
            "reference": "r",
            "components": ["y", "rz"],
            "axes": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        },
        {"kind": "rigid", "group": "h", "position": [1, 2, 3]},
        {"kind": "distributing", "group": "k", "reference": "s", "weights": [1, 2.5]},
        {"kind": "distributing", "group": "l", "position": [1, 2, 3]},
        {
            "kind": "equation",
            "terms": [{"group": "p", "component": "z", "factor": 2}, {"group": "q", "component": "rx", "factor": -0.5}],
        },
    ],
    "bushings": [
        {"group": "a", "to": "b", "stiffness": 7},
        {
            "group": "c",
            "translation": [1, 2, 3],
            "rotation": [4, 5, 6],
            "axes": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
            "at": [7, 8, 9],
        },
    ],
    "point_masses": [
        {"group": "m", "mass": 3, "inertia": [1, 2, 2.5], "offset": [0.1, 0.2, 0.3]},
        {"group": "n", "mass": 4},
    ],
}


def test_connections_bushings_and_masses_have_the_numbers_of_their_tables():
    table = FlexibleTable.model_validate(TABLE)
    one, two, three, four, five = found = connections_of(table)
    assert [type(c).__name__ for c in found] == ["Rigid", "Rigid", "Distributing", "Distributing", "Equation"]
    rigid: Any = one
    assert (rigid.group, rigid.reference, rigid.components) == ("g", "r", ("y", "rz")) and rigid.axes[0] == (0, 1, 0)
    other: Any = two
    assert (other.group, other.reference, len(other.components)) == ("h", "h reference", 6)
    assert np.array_equal(other.axes, np.eye(3))
    spread: Any = (three, four)
    assert [(c.group, c.reference, c.weights) for c in spread] == [("k", "s", (1, 2.5)), ("l", "l reference", None)]
    equation: Any = five
    assert [(t.group, t.component, t.factor) for t in equation.terms] == [("p", "z", 2), ("q", "rx", -0.5)]
    spring, bushing = bushings_of(table)
    made: Any = (spring, bushing)
    assert [(b.translation, b.rotation) for b in made] == [((7, 0, 0), (0, 0, 0)), ((1, 2, 3), (4, 5, 6))]
    assert [tuple(vars(b).values())[:2] for b in made] == [("a", "b"), ("c", None)] and made[1].axes[0] == (0, 1, 0)
    assert [b.at for b in made] == [None, (7, 8, 9)]
    heavy, light = point_masses_of(table)
    assert (heavy.group, heavy.mass, light.mass) == ("m", 3, 4)
    np.testing.assert_array_equal(heavy.inertia, np.diag([1, 2, 2.5]))
    np.testing.assert_array_equal(heavy.offset, [0.1, 0.2, 0.3])


ORBIT = "[orbit]\nsemi_major_axis = '8000 km'\neccentricity = 0.1\nradius = '6000 km'\n"


def test_orbits_by_either_size_have_the_mean_motion_of_their_half_axis():
    n = np.sqrt(3.986004418e14 / 8e6**3)
    for text in (ORBIT, ORBIT.replace("semi_major_axis = '8000 km'", "perigee_altitude = '1200 km'")):
        case = parse_case(HUB + text)
        orbit = build_orbit(case.orbit)
        assert mean_motion(case) == pytest.approx(n) and orbit is not None
        assert orbit.mean_motion == pytest.approx(n) and not orbit.free
    assert mean_motion(parse_case(HUB)) is None


def test_a_preload_is_the_field_of_its_acceleration_spin_or_orbit():
    def field(text: str, more: str = ORBIT) -> Any:
        case = parse_case(HUB + more)
        found = preload_of(case, "b", FlexibleTable.model_validate(TABLE | {"preload": text}))
        assert found is not None
        return found

    spun = field({"spin": [0.1, 0, 0.2], "origin": [1, 2, 3]})  # type: ignore[arg-type]
    w = np.array([0.1, 0, 0.2])
    np.testing.assert_allclose(spun.gradient, (w @ w) * np.eye(3) - np.outer(w, w), atol=1e-15)  # a = -w x (w x r)
    np.testing.assert_array_equal(spun.origin, [1, 2, 3])
    n = mean_motion(parse_case(HUB + ORBIT))
    for rate in (None, 0.003):
        table = {"orbit": {"vertical": [0, 0, 1], "normal": [1, 0, 0]} | ({} if rate is None else {"rate": rate})}
        gradient = np.asarray(field(table).gradient) / (rate or n) ** 2  # type: ignore[arg-type]
        np.testing.assert_allclose(gradient, np.diag([-1.0, 0.0, 3.0]), atol=1e-12)  # the tide and the spin together


def test_a_system_has_the_environment_and_the_frame_of_its_case():
    text = HUB + ORBIT + "[environment]\noblateness = 1e-3\nattraction = 'gradient'\n[attitude]\nsequence = 'zyx'\n"
    system = system_of(parse_case(text), None)
    environment: Any = system.environment
    assert (environment.radius, environment.oblateness, environment.attraction) == (6e6, 1e-3, "gradient")
    assert system.libration_sequence == "zyx" and system.frame.kind == "orbital"
    assert build_frame(parse_case(HUB)).kind == "inertial"
    spun = build_frame(parse_case(HUB + "[attitude]\nframe = 'spinning'\nspin = [1, 2, 3]\n"))
    assert spun.kind == "spinning" and list(spun.rate) == [1, 2, 3]
    weighed: Any = system_of(parse_case(HUB + "[environment]\ngravity = [1, 2, 3]\n"), None).environment
    np.testing.assert_array_equal(weighed.gravity, [1, 2, 3])


# joints, markers, initial states


def test_nominal_axes_are_columns_of_signed_unit_vectors():
    found = nominal_axes(AttitudeTable.model_validate({"nominal_axes": ["y", "-z", "-x"]}))
    np.testing.assert_array_equal(found, [[0, 0, -1], [1, 0, 0], [0, -1, 0]])


def test_every_number_of_a_joint_reaches_its_coordinate():
    text = (
        HUB + "[bodies.arm]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"
        "[[joints]]\nparent = 'hub'\nparent_marker = 'm'\nchild = 'arm'\n"
    )
    numbers: dict[str, tuple[str, Any]] = {
        "cylindrical": (
            "position = 1\nvelocity = 2\nangle = 0.3\nrate = 4\n"
            "slide_stiffness = 5\nslide_damping = 6\nslide_rest = 7\n"
            "stiffness = 8\ndamping = 9\nrest = 0.1\n",
            ([1, 0.3], [2, 4], [5, 8], [6, 9], [7, 0.1]),
        ),
        "universal": (
            "angles = [1, 2]\nrates = [3, 4]\nstiffness = [5, 6]\ndamping = [7, 8]\nrest = [0.1, 0.2]\n",
            ([1, 2], [3, 4], [5, 6], [7, 8], [0.1, 0.2]),
        ),
        "general": (
            "slides = ['x', 'z']\nturns = ['y']\nposition = [1, 2]\nangles = [0.3]\nvelocity = [4, 5]\nrates = [6]\n"
            "slide_stiffness = [7, 8]\nstiffness = [9]\nslide_damping = [10, 11]\ndamping = [12]\n"
            "slide_rest = [13, 14]\nrest = [0.2]\n",
            ([1, 2, 0.3], [4, 5, 6], [7, 8, 9], [10, 11, 12], [13, 14, 0.2]),
        ),
        "prismatic": (
            "axis = [0, 3, 4]\nposition = 1\nvelocity = 2\nstiffness = 3\ndamping = 4\nrest = 5\n",
            ([1], [2], [3], [4], [5]),
        ),
    }  # fmt: skip
    for kind, (keys, expected) in numbers.items():
        joint = build_joint(parse_case(f"{text}kind = '{kind}'\n{keys}").joints[0], Path())
        for name, values in zip(("q0", "u0", "stiffness", "damping", "rest"), expected, strict=True):
            np.testing.assert_allclose(getattr(joint, name), values, err_msg=f"{kind} {name}")
        assert (joint.child, joint.parent, joint.parent_marker, joint.child_marker) == ("arm", "hub", "m", "origin")


def test_an_initial_displacement_is_relative_to_the_distance_of_its_joint(craft: str, write_case: Any):
    from dataclasses import replace

    from femflex.assembly import build_part

    body: Any = build_part(read_case(write_case(craft)), "boom")
    C = np.array([[0.6, -0.8, 0.0], [0.0, 0.0, -1.0], [0.8, 0.6, 0.0]])
    body = replace(body, markers=body.markers | {"tip": replace(body.marker("tip"), orientation=C)})
    table = InitialTable.model_validate({"marker": "tip", "relative": [0.01, 0.02, 0.03]})
    at = np.array([0.5, 0.4, 0.3])
    wanted, length = wanted_displacement(table, body, at)
    assert length == pytest.approx(np.sqrt(2.5**2 + 0.4**2 + 0.3**2))
    np.testing.assert_allclose(wanted, C @ [0.01, 0.02, 0.03] * length)
    table = InitialTable.model_validate({"marker": "tip", "relative": [0.01, 0.02, 0.03], "length": 7})
    np.testing.assert_allclose(wanted_displacement(table, body, at)[0], C @ [0.07, 0.14, 0.21])
    delta, rates = initial_shape(InitialTable.model_validate({"amplitudes": [1, 2], "rates": [0, 3]}), body, at)
    assert delta.tolist() == [1, 2, 0, 0] and rates.tolist() == [0, 3, 0, 0]
    with pytest.raises(ValueError, match="found 5 rates; the body has 4 elastic coordinates"):
        initial_shape(InitialTable.model_validate({"rates": [0] * 4 + [1]}), body, at)


# materials


MATERIALS = """
[materials.iso]
E = 7
nu = 0.25
density = 3
[materials.ply]
kind = "orthotropic"
E1 = 10
E2 = 5
G12 = 2
nu12 = 0.3
density = 4
E3 = 6
nu13 = 0.1
nu23 = 0.2
G23 = 1.5
[materials.flat]
kind = "orthotropic"
E1 = 10
E2 = 5
G12 = 2
nu12 = 0.3
density = 4
[materials.foam]
kind = "core"
density = 0
G13 = 9
G23 = 8
[sections.wall]
kind = "sandwich"
face = { material = "flat", thickness = 0.25, angle = "30 deg" }
core = { material = "foam", thickness = 2 }
extra_mass = 0.5
[sections.lost]
kind = "layup"
plies = [{ material = "none", thickness = 1 }]
[sections.plain]
kind = "plate"
thickness = 0.5
"""


@pytest.fixture
def stuff():
    with pytest.warns(UserWarning):  # numbers that no material has
        return parse_case(HUB + MATERIALS)


def test_materials_of_solids_have_all_three_directions(stuff: Any):
    found: Any = build_solid_material(stuff.materials["ply"])
    values = vars(found)
    assert [values[key] for key in values][:6] == [10, 5, 6, 2, 2, 1.5]  # E1 E2 E3 G12 G13 G23; G13 is that of G12
    assert (found.nu12, found.nu13, found.nu23, found.density) == (0.3, 0.1, 0.2, 4)
    with pytest.raises(ValueError, match="an orthotropic material without E3, nu13, nu23, which solids need"):
        build_solid_material(stuff.materials["flat"])
    with pytest.raises(ValueError, match="found a core; solids take"):
        build_solid_material(stuff.materials["foam"])
    assert build_solid_material(stuff.materials["iso"]).E == 7  # type: ignore[union-attr]


def test_sections_of_layers_have_their_mass_and_missing_materials_are_told(stuff: Any):
    wall, material = build_section(stuff.sections["wall"], None, stuff.materials)
    assert material is None and wall.mass == pytest.approx(2 * 0.25 * 4 + 0.5)
    with pytest.raises(
        ValueError, match=r"found material = 'none' of a layer, which is not in \[materials\]; known are"
    ):
        build_section(stuff.sections["lost"], None, stuff.materials)
    with pytest.raises(ValueError, match="takes the member's material"):
        build_section(stuff.sections["plain"], None, stuff.materials)
    plain, _ = build_section(stuff.sections["plain"], build_material(stuff.materials["iso"]), stuff.materials)
    assert plain.mass == pytest.approx(1.5)


def test_the_text_of_a_body_has_its_centre_of_mass():
    body = rigid_body(4.0, np.diag([3.0, 4, 5]), np.array([0.25, -0.5, 0.75]))
    text = body_text(Path("a.h5"), body)
    assert text.startswith("a.h5: reduced body, 4 kg\ncentre of mass (0.25, -0.5, 0.75) m\nshapes  none")


@pytest.mark.parametrize(("own", "more"), [(0, 0), (0, 2), (1, 0), (1, 1), (2, 1)])
def test_a_level_of_a_study_refines_on_top_of_what_the_case_refines(craft: str, write_case: Any, own: int, more: int):
    case = read_case(write_case(craft.replace("damping =", f"refine = {own}\ndamping =")))
    table: Any = case.bodies["boom"]
    assert len(build_mesh(case, "boom", table, more).cells["line"]) == 3 * 2 ** (own + more)
    alone = structure_of(case, "boom", table, more)
    with shared_structures():
        of_both = [structure_of(case, "boom", table, times) for times in (more, more + 1)]
    elements = 3 * 2 ** (own + more)
    assert [one.n_dof for one in (alone, *of_both)] == [6 + 11 * n for n in (elements, elements, 2 * elements)]


def test_files_of_matrices_keep_their_keys():
    keys = ("file", "mass", "stiffness", "damping", "geometric", "nodes", "dofs")
    table = MatrixFilesTable.model_validate({**{key: f"{key}.npz" for key in keys}, "names": {"stiffness": "KGG"}})
    found = _sources(table)
    assert {key: getattr(found, key) for key in keys} == {key: f"{key}.npz" for key in keys}
    assert found.names == {"stiffness": "KGG"}


def test_bodies_that_bend_far_have_a_structure_of_their_own(craft: str, write_case: Any):
    plain, far = (
        read_case(write_case(craft.replace("damping =", f"strain = '{strain}'\ndamping =")))
        for strain in ("linear", "nonlinear")
    )
    with shared_structures():
        one, other, again = (structure_of(case, "boom", case.bodies["boom"]) for case in (plain, far, plain))  # type: ignore[arg-type]
    assert one is again and other is not one


@pytest.mark.parametrize(
    ("keys", "strain", "steps"),
    [
        ("", "linear", []),
        ("derivatives = 3", "linear", [("with_static_derivatives", 3, None, "bodies.boom")]),
        ("derivatives = 0", "nonlinear", []),
        ("derivatives = 'none'", "nonlinear", []),
        ("derivatives = 'all'", "nonlinear",
         [("with_own_bends", None, None), ("with_static_derivatives", "all", None, "bodies.boom")]),
        ("derivatives = 3, deflection = 0.2", "condensed",
         [("with_own_bends", None, 0.2), ("with_static_derivatives", 3, 0.2, "bodies.boom")]),
        ("derivatives = 'none', third_derivatives = 1", "nonlinear", [("with_own_bends", 1, None)]),
        ("derivatives = 'none', responses = 2, deflection = 0.2", "nonlinear", [("with_responses", 2, 0.2, [], {})]),
        ("derivatives = 2, responses = 2, deflection = 0.2, attachment = ['y', 'rx'], loads = { TIP = ['z', 'rx'] }",
         "nonlinear",
         [("with_own_bends", None, 0.2), ("with_static_derivatives", 2, None, "bodies.boom"),
          ("with_responses", 2, 0.2, ["y"], {"TIP": ["z", "rx"]})]),
    ],
)  # fmt: skip
def test_a_set_gets_its_shapes_in_order_and_each_as_the_table_says(
    craft: str, write_case: Any, monkeypatch: pytest.MonkeyPatch, keys: str, strain: str, steps: list[Any]
):
    reduction = 'clamp = "ROOT", modes = 4' + (f", {keys}" if keys else "")
    text = craft.replace('clamp = "ROOT", modes = 4', reduction).replace("damping =", f"strain = '{strain}'\ndamping =")
    case = read_case(write_case(text))
    table: Any = case.bodies["boom"]
    done: list[Any] = []

    def noted(name: str) -> None:
        def step(structure: Any, modes: Any, *about: Any) -> Any:
            assert structure == "relaxed" and modes == (done[-1] if done else "vibrating")
            done.append((name, *about))
            return done[-1]

        monkeypatch.setattr(structures, name, step)

    for name in ("with_own_bends", "with_static_derivatives", "with_responses"):
        noted(name)
    monkeypatch.setattr(structures, "relaxed", lambda structure, clamp: "relaxed")
    monkeypatch.setattr(structures, "warn_of_initial_stress", lambda *about: None)
    monkeypatch.setattr(structures, "vibrating", lambda structure, r, modes, acting: "vibrating")
    given: Any = "given"
    assert structures.build_modes(given, table, name="boom") == ("relaxed", steps[-1] if steps else "vibrating")
    assert done == steps
