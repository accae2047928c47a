"""Bodies, members and their drawings of cases against closed forms and against Python, with no two numbers alike."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femflex.assembly import build_bodies, build_part
from femflex.assembly.bodies import built_body
from femflex.assembly.deploying import build_deploying, held_at, reel_of
from femflex.assembly.open_choices import with_responses_to, with_spin, with_strains
from femflex.assembly.system import system_of
from femflex.case import CaseError, parse_case, read_case
from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    ElementFunctions,
    Reel,
    StringFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
)
from femflex.mesh import Mesh, write_mesh
from femflex.pipeline.decisions import build_system
from femflex.reduction import BeamFunctions, save_body
from femflex.system import Profile, Segments
from femflex.warning import PhysicsWarning

RUN = "[run]\nduration = 4\n"
SIDES = np.array([0.36, -0.48, 0.8]), np.array([0.8, 0.6, 0.0])  # at right angles


def deployed(text: str, length: str = "5") -> Any:
    case = parse_case(f"{RUN}[bodies.arm]\nkind = 'deploying'\nlength = {length}\nstock = 8\n{text}")
    return build_deploying(case, "arm", case.bodies["arm"])  # type: ignore[arg-type]


def same(a: Any, b: Any) -> None:
    """Both members have the same mass moments, strain, markers and damping."""
    x, y = a.body, b.body
    assert x.n_modes == y.n_modes
    np.testing.assert_allclose(x.moments.second, y.moments.second, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(x.moments.first, y.moments.first, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(x.strain.V1, y.strain.V1, rtol=1e-9, atol=1e-12)
    assert set(x.markers) == set(y.markers)
    for name, marker in x.markers.items():
        np.testing.assert_allclose(marker.position, y.markers[name].position, atol=1e-12)
        np.testing.assert_allclose(marker.orientation, y.markers[name].orientation, atol=1e-12)


PLACE = "root = [0.1, 0.2, 0.3]\ndirection = [0.36, -0.48, 0.8]\norientation = [0.8, 0.6, 0]\n"
SHEET = PLACE + "mass = 3.2\nwidth = 1.5\n"  # 0.4 kg/m of the stock of 8 m
STRIP = {"mass_per_area": 0.4 / 1.5, "width": 1.5, "root": (0.1, 0.2, 0.3), "direction": SIDES[0], "across": SIDES[1]}
FUNCTIONS = {
    "": (BeamFunctions(z=3), StringFunctions(z=3, family="polynomial")),
    ", across = 2": (BeamFunctions(z=3), StringFunctions(z=3, family="polynomial")),
    ", family = 'elements'": (ElementFunctions(z=3, elements=8), ElementFunctions(z=3, elements=8, string=True)),
    ", family = 'elements', elements = 11": (
        ElementFunctions(z=3, elements=11),
        ElementFunctions(z=3, elements=11, string=True),
    ),
}


@pytest.mark.parametrize("more", FUNCTIONS)
@pytest.mark.parametrize("family", ["plate", "membrane"])
def test_a_sheet_of_a_case_is_that_of_python(family: str, more: str):
    own = "bending_stiffness = 7\npoisson = 0.2\n" if family == "plate" else "tension = 30\ntension_across = 4\n"
    found = deployed(f"family = '{family}'\n{SHEET}{own}functions = {{ z = 3{more} }}\nstrain = 'linear'\n")
    keys: dict[str, Any] = (
        {"bending": 7.0, "poisson": 0.2} if family == "plate" else {"tension": 30.0, "tension_across": 4.0}
    )
    along = FUNCTIONS[more][family == "membrane"]
    functions = StripFunctions(along, 2 if "across" in more else 1)
    strip = DeployingStrip(**STRIP, **keys)
    same(found, deploying_strip(strip, functions, Profile.constant(5.0), stock=8.0, until=4.0, strain="linear"))


def test_a_sheet_without_functions_is_rigid_about_its_middle():
    found = deployed(f"family = 'membrane'\n{SHEET}tension = 30\n")
    assert found.body.n_modes == 0 and found.body.moments.mass == pytest.approx(3.2)
    tip = found.body.marker("tip").position
    np.testing.assert_allclose(tip, [0.1, 0.2, 0.3] + 5.0 * SIDES[0], atol=1e-12)


@pytest.mark.parametrize(
    ("given", "functions"),
    [
        ("y = 2, z = 3, tip = true", None),
        ("y = 3, z = 2, family = 'elements'", ElementFunctions(y=3, z=2, elements=8)),
        ("y = 5, family = 'elements'", ElementFunctions(y=5, elements=10)),
        ("y = 2, z = 3, family = 'polynomial'", BeamFunctions(2, 3, family="polynomial")),
        ("y = 2, z = 3, static = true", BeamFunctions(2, 3, static=True)),
        ("y = 2, joints = ['root', 'tip']", BeamFunctions(6, static=True, tip=True)),
        ("y = 2, z = 1, loads = true", BeamFunctions(4, 3, tip=True)),
    ],
)
def test_a_beam_of_a_case_is_that_of_python(given: str, functions: Any):
    text = "family = 'beam'\nmass_per_length = 0.4\nEIy = 4\nEIz = 9\n"
    text += f"ry = 0.01\nrz = 0.02\n{PLACE}rotary_inertia = true\n"
    found = deployed(f"{text}functions = {{ {given} }}\nstrain = 'linear'\ndrum = 'tip'\ndamping = 0.03\n")
    functions = functions or BeamFunctions(2, 3, tip=True)
    line = DeployingLine(
        mass_per_length=0.4, EIy=4.0, EIz=9.0, ry=0.01, rz=0.02, rotary_inertia=True, root=(0.1, 0.2, 0.3),
        direction=SIDES[0], orientation=SIDES[1],
    )  # fmt: skip
    options: dict[str, Any] = {"stock": 8.0, "until": 4.0, "strain": "linear", "drum": "tip", "damping": 0.03}
    same(found, deploying_line(line, functions, Profile.constant(5.0), **options))


@pytest.mark.parametrize("tip", ["free", "held"])
def test_a_tether_of_a_case_is_that_of_python(tip: str):
    text = f"family = 'tether'\nmass_per_length = 0.4\nEA = 50\ntension = 6\ntip = '{tip}'\n{PLACE}"
    text += "functions = { y = 3, z = 2, axial = 1 }\nstrain = 'linear'\n"
    line = DeployingLine(
        mass_per_length=0.4,
        EA=50.0,
        tension=6.0,
        rod=False,
        root=(0.1, 0.2, 0.3),
        direction=SIDES[0],
        orientation=SIDES[1],
    )
    functions = StringFunctions(3, 2, 1, tip=tip, family="polynomial")  # type: ignore[arg-type]
    same(deployed(text), deploying_line(line, functions, Profile.constant(5.0), stock=8.0, until=4.0, strain="linear"))


def test_a_member_without_functions_has_nothing_that_could_be_richer():
    text = f"{RUN}[bodies.arm]\nkind = 'deploying'\nfamily = 'tether'\nlength = 3\nstock = 4\nmass_per_length = 1\n"
    case = parse_case(text)
    origin = built_body(case, "arm").origin
    assert origin is not None and origin.source is None and not origin.open.joints


def test_the_length_of_a_member_is_looked_at_until_the_orbits_end():
    """A quarter of an orbit of 5 470 s, in which it comes out by a metre."""
    text = "[run]\norbits = 0.25\n[orbit]\nperigee_altitude = '331 km'\n[bodies.arm]\nkind = 'deploying'\n"
    text += "family = 'tether'\nmass_per_length = 1\n"
    text += "length = { kind = 'smooth_step', from = 3, to = 4, start = 0, end = 1000 }\n"
    case = parse_case(text)
    made = build_deploying(case, "arm", case.bodies["arm"])  # type: ignore[arg-type]
    assert made.body.moments.mass == pytest.approx(4.0)  # the largest length that is reached


def test_a_reel_of_a_case_has_the_numbers_of_its_table():
    case = parse_case(
        f"{RUN}[bodies.arm]\nkind = 'deploying'\nfamily = 'tether'\nmass_per_length = 0.2\nstock = 9\n"
        "reel = { length = 2, speed = 0.3, tension = 4, damping = 5, stiffness = 6, rest = 7, inertia = 8 }\n"
    )
    table: Any = case.bodies["arm"]
    found = reel_of("arm", table.reel)
    assert found == Reel("arm_reel", 2.0, 0.3, tension=4.0, damping=5.0, stiffness=6.0, rest=7.0, mass=8.0)


def test_a_member_is_held_at_its_length_of_an_instant():
    case = parse_case(
        f"{RUN}[bodies.still]\nkind = 'deploying'\nfamily = 'tether'\nlength = 3\nstock = 4\nmass_per_length = 1\n"
        "[bodies.arm]\nkind = 'deploying'\nfamily = 'tether'\nmass_per_length = 0.2\n"
        "length = { kind = 'polynomial', coefficients = [2, 0.5, 0.25] }\n"
        "[[joints]]\nkind = 'weld'\nchild = 'arm'\nparent = 'still'\n"
    )
    held = held_at(case, 3.0)
    assert held is not None
    arm: Any = held.bodies["arm"]
    assert arm.length.profile(Path())(1.7)[0] == pytest.approx(5.75)  # 2 + 1.5 + 2.25
    assert arm.stock == pytest.approx(5.75)
    assert held.bodies["still"] is case.bodies["still"]
    assert held_at(parse_case(RUN + "[bodies.a]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"), 3.0) is None


def test_a_member_with_another_number_of_functions_varies_with_as_many():
    """Two in each field are as many in all as three, two and one."""
    functions = "y = 3, z = 2, torsion = 1"
    case = parse_case(
        f"{RUN}[bodies.arm]\nkind = 'deploying'\nfamily = 'beam'\n"
        "length = { kind = 'polynomial', coefficients = [2, 0.5] }\nry = 0.1\nrz = 0.2\n"
        f"mass_per_length = 0.2\nstock = 9\nEIy = 1\nEIz = 2\nGJ = 3\nfunctions = {{ {functions} }}\n"
    )
    fewer = build_part(case, "arm", modes=2)
    table: Any = case.bodies["arm"]
    wanted = build_deploying(case, "arm", table, 2)
    own = build_deploying(case, "arm", table)
    assert fewer.n_modes == wanted.body.n_modes
    found = system_of(case, {"arm": fewer}).varying["arm"]

    def sizes(variation: Any) -> dict[str, Any]:
        return {key: np.shape(value) for key, value in variation.write.sections.values.items()}

    assert sizes(found) == sizes(wanted.variation) != sizes(own.variation)


# what is drawn of rigid bodies

SQUARE = """*NODE
1, 0.0, 0.0, 0.0
2, 2.0, 0.0, 0.0
3, 2.0, 1.0, 0.0
4, 0.0, 1.0, 0.5
5, 3.0, 0.5, 0.0
*ELEMENT, TYPE=S4, ELSET=A
1, 1, 2, 3, 4
*ELEMENT, TYPE=S3, ELSET=B
2, 2, 5, 3
*ELEMENT, TYPE=B31, ELSET=C
3, 4, 1
"""
HULL = "[bodies.hub]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"
TURNED = np.array([[0.6, -0.8, 0.0], [0.0, 0.0, -1.0], [0.8, 0.6, 0.0]])  # C_BM of x = (0.6, 0, 0.8), z = (0, -1, 0)


def skin_of(text: str, folder: Path) -> Any:
    (folder / "a.toml").write_text(RUN + HULL + text)
    skin = build_part(read_case(folder / "a.toml"), "hub").skin  # type: ignore[union-attr]
    assert skin is not None
    return skin


def test_a_mesh_is_drawn_turned_moved_and_in_its_unit(tmp_path: Path):
    (tmp_path / "hull.inp").write_text(SQUARE)
    skin = skin_of(
        "shapes = [{ kind = 'box', size = [1, 2, 3], position = [5, 6, 7] }, { kind = 'mesh', file = 'hull.inp',"
        " mesh_unit = 'inch', position = [0.1, 0.2, 0.3], orientation = { x = [0.6, 0, 0.8], z = [0, -1, 0] } }]\n",
        tmp_path,
    )
    own = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.5], [3, 0.5, 0]]) * 0.0254
    np.testing.assert_allclose(skin.points[8:], own @ TURNED.T + [0.1, 0.2, 0.3], atol=1e-14)
    np.testing.assert_allclose(skin.points[:8].mean(axis=0), [5, 6, 7])
    np.testing.assert_allclose(np.ptp(skin.points[:8], axis=0), [1, 2, 3])
    assert {kind: rows.tolist() for kind, rows in skin.cells.items() if kind != "quad"} == {
        "triangle": [[9, 12, 10]],
        "line": [[11, 8]],
    }
    assert len(skin.cells["quad"]) == 7 and skin.cells["quad"][6].tolist() == [8, 9, 10, 11]


def test_a_mesh_of_volumes_alone_is_not_drawn(tmp_path: Path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    groups = {"all": {"tetra": np.arange(1)}}
    write_mesh(tmp_path / "v.msh", Mesh(points, {"tetra": np.array([[0, 1, 2, 3]])}, cell_groups=groups))
    with pytest.raises(CaseError, match=r"needs lines, triangles or quads; it has .*tetra"):
        skin_of("shapes = [{ kind = 'mesh', file = 'v.msh' }]\n", tmp_path)


def test_a_mesh_of_second_order_is_drawn_by_its_corners(tmp_path: Path):
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 0.5, 1.0])
    points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    groups = {"all": {"quad9": np.arange(1)}}
    mesh = Mesh(points, {"quad9": np.array([[0, 2, 8, 6, 1, 5, 7, 3, 4]])}, cell_groups=groups)
    write_mesh(tmp_path / "q.msh", mesh)
    skin = skin_of("shapes = [{ kind = 'mesh', file = 'q.msh' }]\n", tmp_path)
    np.testing.assert_allclose(skin.points[skin.cells["quad"][0]], points[[0, 2, 8, 6]])


def test_a_turned_box_and_a_skew_cylinder_have_their_sizes(tmp_path: Path):
    skin = skin_of(
        "shapes = [{ kind = 'box', size = [1, 2, 3], orientation = { x = [0.6, 0, 0.8], z = [0, -1, 0] } },"
        " { kind = 'cylinder', radius = 0.7, length = 2.5, axis = [1, 2, 2], position = [3, 1, -2] }]\n",
        tmp_path,
    )
    np.testing.assert_allclose(np.abs(skin.points[:8] @ TURNED), np.tile([0.5, 1, 1.5], (8, 1)), atol=1e-14)
    own, axis = skin.points[8:] - [3, 1, -2], np.array([1, 2, 2]) / 3
    along = own @ axis
    away = np.linalg.norm(own - np.outer(along, axis), axis=1)
    np.testing.assert_allclose(np.abs(along), 1.25, rtol=1e-12)
    np.testing.assert_allclose(away[:-2], 0.7, rtol=1e-12)
    np.testing.assert_allclose(away[-2:], 0, atol=1e-12)
    for kind, count in (("quad", 32), ("triangle", 64)):
        faces = skin.points[skin.cells[kind][-count:]] - [3, 1, -2]
        normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
        outward = np.einsum("fi,fi->f", normals, faces.mean(axis=1))
        assert (outward > 0).all()
        area = np.linalg.norm(normals, axis=1).sum() / (1 if kind == "quad" else 2)
        expected = 2.5 * 2 * np.pi * 0.7 if kind == "quad" else 2 * np.pi * 0.49
        assert area == pytest.approx(expected, rel=0.01)


def test_an_imbalance_moves_the_centre_and_adds_the_product_of_inertia_alone():
    text = RUN + HULL.replace(
        "mass = 1\ninertia = [1, 1, 1]", "mass = 4\ninertia = [3, 4, 5]\ncenter_of_mass = [0.1, 0.2, 0.3]"
    )
    moments = [
        build_part(parse_case(text + more), "hub").moments  # type: ignore[union-attr]
        for more in ("", "imbalance = { static = 0.8, dynamic = 0.05 }\n")
    ]
    for m in moments:
        assert m.mass == pytest.approx(4.0)
    np.testing.assert_allclose(moments[1].center_of_mass(), [0.3, 0.2, 0.3])
    c, d = np.array([0.1, 0.2, 0.3]), np.array([0.2, 0, 0])
    about = []  # inertia about the balanced centre
    for m in moments:
        r = m.center_of_mass() - c
        J = m.inertia() - m.mass * (
            (m.center_of_mass() @ m.center_of_mass()) * np.eye(3) - np.outer(m.center_of_mass(), m.center_of_mass())
        )
        about.append(J + m.mass * ((r @ r) * np.eye(3) - np.outer(r, r)))
    product = np.zeros((3, 3))
    product[0, 2] = product[2, 0] = -0.05
    np.testing.assert_allclose(about[1] - about[0], product, atol=1e-12)
    assert d[0] == pytest.approx(0.8 / 4)


# markers, files, choices

INITIAL = 'initial = { marker = "tip", displacement = [0, "10 mm", 0] }\n'
WELD = "[[joints]]\nkind = 'weld'\nchild = 'bar'\nparent = 'rod'\n"
BEAM = """
[bodies.rod]
kind = "analytic"
length = 3
mass = 2
EA = 1e5
EIy = 20
EIz = 30
GJ = 10
direction = [0.36, -0.48, 0.8]
functions = { y = 3, z = 2 }
"""


def test_a_marker_of_a_beam_may_stand_for_its_tip_with_axes_of_its_own(tmp_path: Path):
    turn = "orientation = { x = [0.6, 0, 0.8], z = [0, -1, 0] }"
    more = f"markers.end = {{ group = 'tip', {turn} }}\n"
    body = build_part(parse_case(RUN + BEAM + more), "rod")
    np.testing.assert_allclose(body.marker("end").position, 3 * SIDES[0])
    np.testing.assert_allclose(body.marker("end").phi, body.marker("tip").phi)
    np.testing.assert_allclose(body.marker("end").orientation, body.marker("tip").orientation @ TURNED, atol=1e-14)
    with pytest.raises(
        CaseError, match=r"marker 'end' needs marker 'top' of body 'rod', which has \['origin', 'root', 'tip'\]"
    ):
        build_part(parse_case(RUN + BEAM + more.replace("'tip'", "'top'")), "rod")
    with pytest.raises(CaseError, match="marker 'mid' cannot be put at a position of a body without a mesh"):
        build_part(parse_case(RUN + BEAM + "markers.mid = { position = [1, 0, 0] }\n"), "rod")
    save_body(tmp_path / "rod.h5", build_part(parse_case(RUN + BEAM), "rod"))  # type: ignore[arg-type]
    (tmp_path / "a.toml").write_text(f"{RUN}[bodies.rod]\nkind = 'file'\nfile = 'rod.h5'\n{more}")
    saved = build_part(read_case(tmp_path / "a.toml"), "rod")
    np.testing.assert_allclose(saved.marker("end").position, 3 * SIDES[0])


def test_a_file_is_not_shortened_below_what_its_strain_needs(craft: str, write_case: Any):
    text = craft.replace("modes = 4 }", "modes = 4, derivatives = 2 }\nstrain = 'nonlinear'")
    path = write_case(text.replace(INITIAL, ""))
    body = build_part(read_case(path), "boom")
    assert body.kinds.count("derivative") == 2 and body.n_modes == 6  # type: ignore[union-attr]
    save_body(path.with_name("boom.h5"), body)  # type: ignore[arg-type]

    def shortened(n: int) -> Any:
        path.with_name("b.toml").write_text(f"{RUN}[bodies.boom]\nkind = 'file'\nfile = 'boom.h5'\nmodes = {n}\n")
        return build_part(read_case(path.with_name("b.toml")), "boom")

    assert shortened(6).n_modes == 6
    with pytest.raises(
        CaseError, match=r"found 4, which leaves out 2 of the derivative shapes that boom.h5 needs .*keep all 6"
    ):
        shortened(4)
    with pytest.raises(CaseError, match=r"found 7; boom.h5 holds 6 elastic coordinates"):
        shortened(7)


def test_damping_given_to_a_file_damps_bending_and_not_the_derivatives(craft: str, write_case: Any):
    text = craft.replace("modes = 4 }", "modes = 4, derivatives = 2 }\nstrain = 'nonlinear'")
    path = write_case(text.replace(INITIAL, ""))
    whole: Any = build_part(read_case(path), "boom")
    save_body(path.with_name("boom.h5"), whole)
    path.with_name("b.toml").write_text(
        f"{RUN}[bodies.boom]\nkind = 'file'\nfile = 'boom.h5'\ndamping = {{ ratio = [0.02, 0.02, 0.03, 0.03] }}\n"
    )
    found: Any = build_part(read_case(path.with_name("b.toml")), "boom")
    omega = found.omega[:4]
    np.testing.assert_allclose(np.diag(found.damping)[:4], 2 * np.array([0.02, 0.02, 0.03, 0.03]) * omega, rtol=1e-6)


def test_nonlinear_strain_asks_for_the_stretch_of_twice_the_bending():
    case = parse_case(RUN + BEAM + BEAM.replace("rod]", "bar]").replace("z = 2", "z = 5, axial = 1") + WELD)
    found: Any = with_strains(case, {"rod": "nonlinear", "bar": "nonlinear"})
    assert found.bodies["rod"].strain == found.bodies["bar"].strain == "nonlinear"
    assert (found.bodies["rod"].functions.axial, found.bodies["bar"].functions.axial) == (6, 1)
    condensed: Any = with_strains(case, {"rod": "condensed"})
    assert condensed.bodies["rod"].functions.axial == 0 and condensed.bodies["bar"].strain is None
    spun: Any = with_spin(case, ["bar"])
    assert spun.bodies["bar"].functions.spin and spun.bodies["rod"].functions.spin is None


def test_nonlinear_strain_of_a_mesh_asks_for_derivatives_where_none_are_chosen(craft: str, write_case: Any):
    for given, kept in (
        ("modes = 4", "auto"),
        ("modes = 4, derivatives = 2", 2),
        ("modes = 4, derivatives = 'none'", "none"),
    ):
        case = read_case(write_case(craft.replace("modes = 4", given)))
        found: Any = with_strains(case, {"boom": "nonlinear"})
        assert found.bodies["boom"].reduction.derivatives == kept
        answered: Any = with_responses_to(case, "boom", {"responses": 3, "deflection": 0.2})
        assert answered.bodies["boom"].strain == "nonlinear" and answered.bodies["boom"].reduction.responses == 3
        assert answered.bodies["boom"].reduction.deflection == 0.2 and answered.bodies["hub"] is case.bodies["hub"]
        spun: Any = with_spin(case, ["boom"])
        assert spun.bodies["boom"].reduction.spin is True


# bodies in segments

CUT = 'reduction = {{ method = "{method}", {keys} }}\nrefine = 3\n'
EI, MASS = 70e9 * np.pi / 4 * (0.03**4 - 0.028**4), 2700 * np.pi * (0.03**2 - 0.028**2)


@pytest.fixture
def cut(craft: str) -> Any:
    def text(reduction: str, more: str = "", options: str = "") -> str:
        found = craft.replace('group = "TIP" }', 'group = "TIP" }\nmarkers.ROOT = {}')
        found = found.replace('material = "aluminium" }', f'material = "aluminium", segments = 2{options} }}')
        found = found.split("initial = {")[0] + found[found.index("\n[[joints]]") :]
        found = found.replace('damping = { ratio = "0.5 %" }\n', more)
        return found.replace('reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }\n', reduction)

    return text


@pytest.mark.parametrize(
    ("method", "keys", "n", "beta"),
    [
        ("cantilever", "clamp = 'ROOT', modes = 2", 2, 1.87510407),
        ("cantilever", "clamp = 'ROOT', modes = 2, attachment = ['x', 'ry']", 4, 1.87510407),
        ("free_free", "modes = 2", 2, 4.73004074),
        ("craig_bampton", "modes = 2, interfaces = ['ROOT', 'TIP']", 8, 4.73004074),
    ],
)
def test_a_segment_has_the_modes_of_its_reduction(
    cut: Any, write_case: Any, method: str, keys: str, n: int, beta: float
):
    part = build_bodies(read_case(write_case(cut(CUT.format(method=method, keys=keys)))))["boom"]
    assert isinstance(part, Segments) and len(part.bodies) == 2
    omega = beta**2 * np.sqrt(EI / (MASS * 1.5**4))
    for body in part.bodies:
        assert body.moments.mass == pytest.approx(1.5 * MASS, rel=1e-9)
        if method != "craig_bampton":
            assert body.n_modes == n
            found = np.sort(body.omega[np.isfinite(body.omega)])[:2]
            np.testing.assert_allclose(found, omega, rtol=1e-2)


def test_a_nodal_segment_bends_under_a_tip_force_like_the_textbook(cut: Any, write_case: Any):
    text = cut('reduction = { method = "nodal", clamp = "ROOT" }\n')
    part: Any = build_bodies(read_case(write_case(text)))["boom"]
    body = part.bodies[-1]
    phi = body.marker("tip").phi
    soft = phi @ np.linalg.solve(body.strain.V1, phi.T)
    np.testing.assert_allclose(np.diag(soft)[1:], 1.5**3 / (3 * EI), rtol=1e-2)
    assert soft[0, 0] == pytest.approx(1.5 / (70e9 * MASS / 2700), rel=1e-6)


def test_the_prestress_of_a_line_in_segments_relaxes_with_both_numbers(cut: Any, write_case: Any):
    text = cut("refine = 1\n", options=", options = { prestress = 120 }")
    with pytest.warns(PhysicsWarning, match="the prestress of 120 N on 'BOOM' relaxes to 0 N"):
        build_bodies(read_case(write_case(text)))


def test_markers_of_a_body_in_segments_turn_as_they_are_told(cut: Any, write_case: Any):
    turn = "orientation = { x = [0.6, 0, 0.8], z = [0, -1, 0] }"
    text = cut("refine = 1\n").replace('group = "TIP" }', f'group = "TIP", {turn} }}')
    part: Any = build_bodies(read_case(write_case(text)))["boom"]
    np.testing.assert_allclose(part.bodies[-1].marker("tip").orientation, TURNED, atol=1e-14)
    assert part.bodies[-1].marker("tip").position[0] == pytest.approx(3.0)


def test_mistakes_of_bodies_and_of_loads_are_told_together(craft: str, write_case: Any):
    text = craft.replace('"BOOM"', '"BOM"').replace(
        "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "table = 'push.csv'"
    )
    path = write_case(text)
    path.with_name("push.csv").write_text("time,fx\n0,1\n3,2\n2,5\n")
    with pytest.raises(CaseError) as caught:
        build_system(read_case(path))
    assert "BOM" in str(caught.value) and "line 4 of push.csv has time 2 s after 3 s" in str(caught.value)
