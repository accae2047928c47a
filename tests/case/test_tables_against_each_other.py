"""Tables that do not go together are told with their names and numbers, and those that just do are accepted."""

from __future__ import annotations

from pathlib import Path

import pytest

from femflex.case import Case, CaseError, parse_case, read_case
from femflex.case.named_files import check_no_input, input_files

HUB = """
[run]
duration = 4
[bodies.hub]
kind = "rigid"
mass = 2
inertia = [3, 4, 5]
markers.side = { position = [1, 0, 0] }
[bodies.arm]
kind = "analytic"
length = 1
mass = 1
EA = 1
EIy = 1
EIz = 1
GJ = 1
functions = { y = 1 }
"""
WELD = "[[joints]]\nkind = 'weld'\nparent = 'hub'\nchild = 'arm'\n"
ROOT = "[[joints]]\nkind = '{}'\nchild = 'hub'\n{}\n"
ORBIT = "[orbit]\nperigee_altitude = '400 km'\nkind = '{}'\n"
SPIN = "[attitude]\nframe = 'spinning'\nspin = [0, 0, 2]\n"
SPEEDS = "[campbell]\nspeeds = '0:40 rpm:5'\n"
EXPECT = "[expect.a]\nof = 'campbell_frequency'\nbranch = 'b'\nspeed = '{}'\nabove = 1\n"
SECOND = "[bodies.second]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"
STUDY = "[study]\nquantity = {{ of = 'mode_frequency', body = '{}' }}\nbody = '{}'\n"
LOOP = "[[loops]]\nkind = 'spherical'\nparent = '{}'\nchild = '{}'\nname = 'l'\n"

REFUSED = [
    # times of pictures and answers
    (WELD + "[pictures]\ntimes = [4.5]\n", "pictures.times: found 4.5 s; the run lasts from 0 to 4 s"),
    (WELD + "[pictures]\nend = 4.5\n", "pictures.end: found 4.5 s"),
    (WELD + "[pictures]\nstart = -1\n", "pictures.start: found -1 s"),
    *(
        (
            WELD + f"[expect]\nx = {{ channel = 'time', {key} = 5, above = 1 }}\n",
            f"expect.x.{key}: found 5 s; the run lasts",
        )
        for key in ("at", "start", "end")
    ),
    # bodies and names
    (WELD + STUDY.format("arm", "am"), "study.body: found 'am', which is not a body; did you mean 'arm'?"),
    (WELD + STUDY.format("am", "arm"), "study.quantity.body: found 'am', which is not a body"),
    (WELD + "[pictures]\nmodes = ['arm', 'hub']\n", "pictures.modes[1]: found 'hub', which is rigid"),
    (WELD + "[pictures]\nmodes = ['hb']\n", "pictures.modes[0]: found 'hb', which is not a body"),
    (WELD + LOOP.format("hub", "hub"), "loops[l]: found body 'hub' joined to itself; parent and child must differ"),
    (WELD + LOOP.format("hb", "arm"), "loops[l].parent: found 'hb', which is not a body"),
    (WELD + LOOP.format("hub", "am"), "loops[l].child: found 'am', which is not a body"),
    (WELD + "[[springs]]\nname = 's'\nbody = 'arm'\nparent = 'arm'\nstiffness = 1\n", "parent and body must differ"),
    (WELD + "[[springs]]\nname = 's'\nbody = 'arm'\nmarker = 'top'\nstiffness = 1\n", "springs[s].marker: found 'top'"),
    (
        WELD + "[[springs]]\nname = 's'\nbody = 'arm'\nparent = 'hub'\nparent_marker = 'tip'\nstiffness = 1\n",
        "springs[s].parent_marker: found 'tip', which is no marker of body 'hub'; known are 'origin', 'side'",
    ),
    (
        WELD.replace("parent =", "parent_marker = 'top'\nparent ="),
        "joints[arm].parent_marker: found 'top', which is no marker",
    ),
    (
        WELD + "child_marker = 'tap'\n",
        "joints[arm].child_marker: found 'tap', which is no marker of body 'arm'; did you mean 'tip'",
    ),
    (WELD + "play = 0.1\n", "joints[arm].play: found 0.1 m on a joint of the tree"),
    (
        WELD.replace("'weld'", "'weld'\nname = 'l'") + LOOP.format("hub", "arm"),
        "found the name 'l' a second time; joints[l] has it already",
    ),
    (WELD + "[attitude]\nmarker = 'tip'\n", "attitude.marker: found 'tip', which is no marker of body 'hub'"),
    (
        WELD + "[sensors.s]\nkind = 'rate'\nbody = 'hub'\nmarker = 'tip'\n",
        "sensors.s.marker: found 'tip', which is no marker",
    ),
    (
        WELD + "[sensors.s]\nkind = 'velocity'\nbody = 'hub'\nother_body = 'arn'\n",
        "sensors.s.other_body: found 'arn', which is not a body; did you mean 'arm'?",
    ),
    (
        WELD + "[cables.c]\nbody = 'arm'\nparent = 'hup'\nlength = 1\nEA = 1\n",
        "cables.c.parent: found 'hup', which is not a body",
    ),
    # orbits, roots and frames
    (WELD + "[orbit]\nkind = 'none'\nmu = 1e14\n", "found kind = 'none' together with mu"),
    (
        WELD + ORBIT.format("free") + "[environment]\ngravity = [1, 2, 3]\n",
        "found [1.0, 2.0, 3.0] m/s^2 together with an [orbit]",
    ),
    (WELD + "[attitude]\nyaw = 0.1\nroll = 0.2\n", "attitude.yaw: found yaw and roll in the inertial frame"),
    (
        WELD + ORBIT.format("free") + "[attitude]\nframe = 'inertial'\nroll = 0.2\n",
        "attitude.roll: found roll in the inertial frame",
    ),
    (WELD + "[attitude]\nframe = 'orbital'\n", "attitude.frame: found 'orbital' without an orbit"),
    (
        WELD + ROOT.format("prismatic", "") + ORBIT.format("specified"),
        "joints[hub].kind: found 'prismatic' for the root body; on a specified orbit",
    ),
    (
        WELD + ROOT.format("general", "slides = ['x', 'y']") + ORBIT.format("free"),
        "joints[hub].kind: found 'general' for the root body; on a free orbit",
    ),
    (
        WELD + ROOT.format("spherical", "") + ORBIT.format("free"),
        "found 'spherical' for the root body; on a free orbit",
    ),
    (
        SECOND
        + WELD
        + ROOT.format("spherical", "")
        + ROOT.format("spherical", "").replace("hub", "second")
        + ORBIT.format("specified"),
        "joints[hub]: found a second body joined to the base frame",
    ),
    (
        SECOND + WELD + ROOT.format("spherical", "") + ORBIT.format("specified"),
        "joints[hub]: found a second body joined to the base frame",
    ),
    (
        WELD + ROOT.format("weld", "") + "[attitude]\nrates = [1, 0, 0]\n",
        "attitude.rates: this key sets the root body's joint",
    ),
    (SECOND + WELD, "found 'hub', 'second' without a joint"),
    (WELD + "[attitude]\nroot = 'arm'\n", "attitude.root: found 'arm', which already has a joint"),
    (SECOND + WELD + "[attitude]\nroot = 'second'\n", "found 'hub' without a joint"),
    (
        SECOND
        + WELD
        + "[[joints]]\nkind = 'weld'\nparent = 'arm'\nchild = 'second'\n"
        + "[[joints]]\nkind = 'weld'\nparent = 'second'\nchild = 'hub'\n",
        "joints: found a cycle of bodies, second -> hub -> arm -> second; one body of it must be joined to the base",
    ),
    ("", "joints: found no joints for the bodies 'hub', 'arm'"),
    # diagrams
    (WELD + SPEEDS, "campbell.axis: found no axis to spin about"),
    (WELD + SPIN + SPEEDS + ORBIT.format("free"), "campbell: found an [orbit], on which no spin speed is steady"),
    (WELD + EXPECT.format("3 rpm"), "expect.a.of: found 'campbell_frequency' in a case without a [campbell]"),
    (
        WELD + SPIN + SPEEDS + EXPECT.format("25 rpm"),
        "expect.a.speed: found 25 rpm, which is none of the diagram's 5 speeds (0, 10, 20, 30, 40)",
    ),
    (
        WELD + SPIN + SPEEDS.replace("40 rpm:5", "90 rpm:10") + EXPECT.format("25 rpm"),
        "none of the diagram's 10 speeds (0, 10, 20, 30, 40, 50, 60, 70, ...)",
    ),
    # starts
    (
        WELD.replace("kind", "kind") + "[initial]\nfrom = 'a.h5'\n" + "[bodies.arm.initial]\namplitudes = [1]\n",
        "bodies.arm.initial: found an initial state of the body together with [initial] from = 'a.h5'",
    ),
]

ACCEPTED = [
    WELD + "[pictures]\ntimes = [0, 4]\nstart = 0\nend = 4\nmodes = ['arm']\n",
    WELD + "[expect]\nx = { channel = 'time', at = 4, above = 1 }\n",
    WELD + STUDY.format("arm", "arm"),
    WELD + LOOP.format("hub", "arm"),
    WELD + "[attitude]\nmarker = 'side'\nroot = 'hub'\n",
    WELD + ROOT.format("cylindrical", ""),
    WELD + ROOT.format("general", "slides = ['x', 'y', 'z']") + ORBIT.format("free"),
    WELD + ROOT.format("free", "") + ORBIT.format("free"),
    WELD + ROOT.format("universal", "") + ORBIT.format("specified"),
    WELD + ORBIT.format("free") + "[attitude]\nroll = 0.2\n",
    SECOND + WELD + ROOT.format("weld", "") + "[attitude]\nrates = [1, 0, 0]\n",
    WELD + SPEEDS + "axis = [0, 1, 0]\n",
    WELD
    + SPIN
    + SPEEDS
    + EXPECT.format("1.0471975512 rad/s").replace("speed = '1.0471975512 rad/s'", "speed = '10 rpm'"),
    WELD + "[initial]\nfrom = 'equilibrium'\n" + "[bodies.arm.initial]\namplitudes = [1]\n",
]


@pytest.mark.parametrize(("more", "told"), REFUSED, ids=[told[:60] for _, told in REFUSED])
def test_tables_that_do_not_go_together_are_told(more: str, told: str):
    with pytest.raises(CaseError) as caught:
        parse_case(HUB + more)
    assert told in str(caught.value), str(caught.value)


@pytest.mark.parametrize("more", ACCEPTED)
def test_tables_that_just_go_together_are_read(more: str):
    assert isinstance(parse_case(HUB + more), Case)


def test_every_named_file_must_be_there_and_is_no_place_for_results(tmp_path: Path):
    text = HUB + WELD + "[[loads]]\nname = 'l'\nbody = 'hub'\ntable = 'l.csv'\n"
    text += "[bodies.saved]\nkind = 'file'\nfile = 'saved.h5'\n"
    text += "[[joints]]\nkind = 'revolute'\nparent = 'arm'\nchild = 'saved'\n"
    text += "motion = { angle = { kind = 'table', file = 'm.csv', column = 'a' } }\n"
    path = tmp_path / "a.toml"
    path.write_text(text)
    with pytest.raises(CaseError) as caught:
        read_case(path)
    told = str(caught.value)
    assert (
        "bodies.saved.file: found 'saved.h5', which does not exist" in told and f"{tmp_path} has no .h5 files" in told
    )
    assert "loads[l].table: found 'l.csv', which does not exist" in told
    for name in ("l.csv", "m.csv"):
        (tmp_path / name).write_text("time,a\n0,1\n1,2\n2,2\n4,1\n")
    (tmp_path / "saved.h5").mkdir()
    with pytest.raises(CaseError, match=r"found 'saved.h5', which is a folder; give the name of a file in it"):
        read_case(path)
    (tmp_path / "saved.h5").rmdir()
    (tmp_path / "other.h5").write_text("")
    with pytest.raises(CaseError, match=r"relative to the case file, and .* holds 'other.h5'"):
        read_case(path)
    path.write_text(text.replace("saved.h5", "gone/saved.h5"))
    with pytest.raises(CaseError, match=r"and there is no folder .*gone"):
        read_case(path)
    (tmp_path / "saved.h5").write_text("")
    path.write_text(text)
    case = read_case(path)
    assert {found.name for found in input_files(case)} == {"a.toml", "saved.h5", "l.csv", "m.csv"}
    for name in ("a.toml", "saved.h5", "l.csv", "m.csv"):
        with pytest.raises(ValueError, match=f"{name} is an input of this case and would be lost"):
            check_no_input(case, tmp_path / name)
    check_no_input(case, tmp_path / "other.h5")
    check_no_input(case, tmp_path / "new.h5")
    with pytest.raises(CaseError, match="which cannot be a file"):
        parse_case(text.replace("l.csv", "a" * 400), path)
