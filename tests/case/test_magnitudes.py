"""Numbers of another unit's size are suspected, with both readings; the run goes on."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

from femflex.assembly import build_bodies
from femflex.case import read_case
from femflex.case.problems import CaseError
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

ORBIT = "[orbit]\nperigee_altitude = {}\n"
PLATE = "[sections.thick]\nkind = 'sandwich'\nface = {{ material = 'aluminium', thickness = {} }}\n"
CORE = "core = { material = 'aluminium', thickness = '20 mm' }\n"

# what is swapped in the case, and what is reported; old "" appends
READ = [
    ("", ORBIT.format(400), r"perigee_altitude: found 400 m, below 80 km; if kilometres were meant, write \"400 km\""),
    ("", ORBIT.format("'3 m'"), r"found 3 m, below 80 km; drag ends an orbit there within a revolution"),
    ('"2700 kg/m^3"', "2.7", r"density: found 2.7 kg/m\^3, .* write \"2.7 g/cm\^3\" \(2700 kg/m\^3\)"),
    ('"2700 kg/m^3"', "2.7e6", r"density: found 2.7e\+06 kg/m\^3; materials have 1 to 25000 kg/m\^3$"),
    ('"70 GPa"', "70", r"aluminium.E: found 70 Pa; materials have 100000 to .* write \"70 GPa\""),
    ('"70 GPa"', "7e4", r"aluminium.E: found 70000 Pa; .* if MPa were meant, write \"70000 MPa\""),
    ('"70 GPa"', "7e13", r"aluminium.E: found 7e\+13 Pa; materials have 100000 to 1.5e\+12 Pa$"),
    ('"0.5 %"', "0.5", r"damping.ratio: found 0.5, which is 50% of critical damping; .* write \"0.5 %\""),
    ("[120, 100, 140]", "[120e6, 100e6, 140e6]", r"radius of gyration of 836.7 m, beyond 300 m"),
    ("", PLATE.format(0.2) + CORE, r"face.thickness: found faces of 0.2 m on a core of 0.02 m; .* write \"0.2 mm\""),
]


def swapped(craft: str, old: str, new: str) -> str:
    assert old in craft
    return craft.replace(old, new) if old else craft + new


@pytest.mark.parametrize(("old", "new", "told"), READ, ids=[told[:40] for _, _, told in READ])
def test_a_doubtful_number_is_told_with_both_readings(
    craft: str, write_case: Callable[..., Path], old: str, new: str, told: str
):
    with pytest.warns(PhysicsWarning) as caught:
        read_case(write_case(swapped(craft, old, new)))
    assert len(caught) == 1 and re.search(told, str(caught[0].message)), str(caught[0].message)


SLEW = Path(__file__).resolve().parents[2] / "cases" / "panel_slew.toml"


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            '"20 mm"',
            "20",
            r"core.thickness: found 20 m in a mesh that spans .* write \"20 mm\" \(0.02 m\)",
        ),
        (
            'panel.msh"',
            'panel.msh"\nmesh_unit = "mm"',
            r"spans 0.00\d+ m, read in mm; .* metres, it spans [\d.]+ m",
        ),
    ],
    ids=["thickness", "mesh unit"],
)
def test_lengths_that_do_not_fit_the_mesh_are_told(tmp_path: Path, old: str, new: str, told: str):
    text = SLEW.read_text().split("[pictures]")[0].replace("../meshes", str(SLEW.parents[1] / "meshes"))
    path = tmp_path / "case.toml"
    path.write_text(swapped(text, old, new))
    case = read_case(path)
    with pytest.warns(PhysicsWarning) as caught:
        build_body(case, "panel_east")
    assert any(re.search(told, str(warning.message)) for warning in caught), [str(w.message) for w in caught]


def test_a_body_held_away_from_its_clamp_is_told_of_with_both_places(craft: str, write_case: Callable[..., Path]):
    held = craft.replace('child_marker = "ROOT"', 'child_marker = "tip"').split("initial =")[0]
    held += craft.split("0]  }")[-1].split('displacement = [0, "10 mm", 0] }')[-1]
    case = read_case(write_case(held.replace('child_marker = "ROOT"', 'child_marker = "tip"')))
    with pytest.warns(PhysicsWarning, match=r"clamped at 'ROOT', but joint 'hub-boom' supports it at 'tip', 3 m away"):
        build_system(case)
    sound = held.replace("modes = 4", 'modes = 4, loads = { TIP = ["x", "y", "z", "rx", "ry", "rz"] }')
    case = read_case(write_case(sound.replace('child_marker = "ROOT"', 'child_marker = "tip"')))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        build_system(case)


def test_an_unknown_marker_that_is_a_group_is_to_be_declared(craft: str, write_case: Callable[..., Path]):
    path = write_case(craft.replace('body = "hub"\ntorque', 'body = "boom"\nmarker = "TIP"\ntorque'))
    with pytest.raises(ValueError, match=r"found 'TIP', which is no marker .* declare it, markers\.TIP = \{\} in \[bo"):
        read_case(path)


SOLID = Path(__file__).resolve().parents[2] / "cases" / "tumbling_panels.toml"


def test_a_sensor_may_be_blind_to_rotation_but_a_torque_may_not(tmp_path: Path):
    text = SOLID.read_text().split("[expect")[0].split("[pictures]")[0]
    text = text.replace("../meshes", str(SOLID.parents[1] / "meshes"))
    path = tmp_path / "case.toml"
    path.write_text(text)
    body = next(name for name in read_case(path).bodies if "corner" in read_case(path).bodies[name].markers)
    build_bodies(read_case(path))  # a sensor: warnings are errors here
    load = f'\n[[loads]]\nname = "twist"\nbody = "{body}"\nmarker = "corner"\n'
    path.write_text(text + load + "force = [0, 0, 1]\n")
    build_bodies(read_case(path))
    path.write_text(text + load + "torque = [0, 0, 1]\n")
    wanted = (
        r"loads\[twist\]\.torque: found 1 N m at marker 'corner' of body '\w+', which shows no rotation: .* would "
        r"deform nothing\. Name a group of several nodes"
    )
    with pytest.raises(CaseError, match=wanted):
        build_bodies(read_case(path))
