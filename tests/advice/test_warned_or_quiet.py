"""Crafts whose margins are known in closed form: a doubtful one is warned of by name, a right one stays quiet.

A clamped column buckles under a load at its tip at P L^2 = pi^2 / 4 EI (Euler), under its own weight q per length at
q L^3 = 7.837 EI (Greenhill, 1881). A thin strip buckles sideways under a load at its tip at
P L^2 = 4.0126 sqrt(EI GJ) (Prandtl, 1899); a round boom, and one bent about its weak axis, do not.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import femflex
from femflex.warning import PhysicsWarning

L, EI, GJ, LINE = 3.0, 1.0e4, 1.2e3, 1.0
EULER, WEIGHT = np.pi**2 / 4 * EI / L**2, 7.837 * EI / L**2  # N
PRANDTL = 4.0126 * np.sqrt(EI * GJ) / L**2
BOOM = f"""
[bodies.boom]
kind = "analytic"
length = {L}
mass_per_length = {LINE}
EA = 1e8
EIy = {{EIy}}
EIz = {EI}
GJ = {{GJ}}
ry = 0.01
rz = 0.01
functions = {{{{ y = 4, z = 4{{more}} }}}}
strain = "{{strain}}"
"""
HELD = '[[joints]]\nkind = "weld"\nchild = "boom"\n'


def rigid(name, mass, joint, at=0.0, **where):
    keys = "".join(f'{key} = "{value}"\n' for key, value in where.items())
    return (
        f'[bodies.{name}]\nkind = "rigid"\nmass = {mass}\ninertia = [500, 500, 500]\ncenter_of_mass = [{at}, 0, 0]\n'
        f'markers.rim = {{ position = [-3000, 0, 0] }}\n[[joints]]\nkind = "{joint}"\nchild = "{name}"\n{keys}'
    )


HUB = rigid("hub", 1000.0, "free") + HELD + 'parent = "hub"\n'
TIP = rigid("tip", 500.0, "weld", parent="boom", parent_marker="tip")
HIGH = rigid("tip", 500.0, "weld", at=L, parent="boom", parent_marker="tip")
RIM = rigid("hub", 1000.0, "weld") + HELD + 'parent = "hub"\nparent_marker = "rim"\n'


def load(x, z=0.0, body="boom", marker="tip", frame="body", name="push"):
    where = f'[[loads]]\nname = "{name}"\nbody = "{body}"\nmarker = "{marker}"\nframe = "{frame}"\n'
    return f"{where}force = [{x}, 0, {z}]\n"


def gravity(x, z=0.0):
    return f"[environment]\ngravity = [{x}, 0, {z}]\n"


def thrust(part):
    return HUB + load(part * WEIGHT / (L * LINE) * (1000 + L * LINE), body="hub", marker="origin")


def spinning(x, z):
    return f'[attitude]\nframe = "spinning"\nspin = [{x}, 0, {z}]\n'


def spring(stiffness):
    return f'[[springs]]\nname = "rope"\nbody = "boom"\nmarker = "tip"\nstiffness = {stiffness}\nlength = {L / 2}\n'


G, TALL = WEIGHT / L / LINE, 0.8603**2 * EI / L**2 / 500  # k h tan(k L) = 1 at the height h = L: k L = 0.8603
STRAIGHT, ROUND, FLAT = {}, {"EIy": EI, "GJ": EI / 1.3}, {"EIy": 400 * EI}
LINEAR, CONDENSED = {"strain": "linear"}, {"strain": "condensed"}
ROWS = {  # what acts, the boom, key words of a warning that must be there, or a word that none may have
    "weight, half of Greenhill's": (gravity(-0.5 * G) + HELD, LINEAR, ["boom", "weight", "0.5", "buckling load"]),
    "weight, a tenth": (gravity(-0.1 * G) + HELD, LINEAR, "buckling"),
    "hanging": (gravity(0.5 * G) + HELD, LINEAR, "buckling"),
    "thrust": (thrust(0.5), LINEAR, ["boom", "inertia", "0.5", "buckling load"]),
    "thrust the other way": (thrust(-0.5), LINEAR, "buckling"),
    "tip mass": (gravity(-0.4 * EULER / 500) + HELD + TIP, LINEAR, ["boom", "tip", "0.4", "buckling load"]),
    "tip mass high above": (gravity(-0.5 * TALL) + HELD + HIGH, LINEAR, ["boom", "tip", "0.5", "buckling load"]),
    "spin pulls": (spinning(0, 2) + HELD, LINEAR, "buckling"),
    "spin about its length": (spinning(20, 0) + HELD, LINEAR, "buckling"),
    "spin presses": (spinning(0, np.sqrt(0.5 * G / 3000)) + RIM, LINEAR, ["boom", "0.5", "buckling load"]),
    "two loads": (HELD + load(-0.2 * EULER, name="a") + load(-0.15 * EULER, name="b"), LINEAR,
                  ["boom", "0.35", "'a'", "'b'"]),
    "one of them": (HELD + load(-0.2 * EULER, name="a"), LINEAR, "buckling"),
    "loads that cancel": (HELD + load(-0.8 * EULER) + load(0.8 * EULER, name="pull"), LINEAR, "buckling"),
    "round boom across": (HELD + load(0, 4 * EI / L**2, frame="inertial"), LINEAR | ROUND, "buckling"),
    "stiff in torsion": (HELD + load(0, 0.5 * EI / L**2), LINEAR | ROUND | {"GJ": 3000 * EI}, "buckling"),
    "about its weak axis": (HELD + load(0, EI / L**2), LINEAR | {"EIy": EI / 400}, "buckling"),
    "stretched spring": (HELD + spring(EULER / L), LINEAR, ["boom", "rope", "0.5", "buckling load"]),
    "strip, near Prandtl's load": (HELD + load(0, -0.77 * PRANDTL), LINEAR | FLAT, ["boom", "push", "buckling load"]),
    "strip that cannot twist": (HELD + load(0, -0.77 * PRANDTL), CONDENSED | FLAT, ["boom", "push", "torsion"]),
    "strip that can": (HELD + load(0, -0.77 * PRANDTL), CONDENSED | FLAT | {"more": ", torsion = 4"}, "buckling"),
    "strip, a sixth of it": (HELD + load(0, -0.16 * PRANDTL), CONDENSED | FLAT, "buckling"),
    "condensed, past Euler's load": (HELD + load(-1.02 * EULER), CONDENSED, ["boom", "1.02", "buckling load"]),
    "condensed, at 0.7 of it": (HELD + load(-0.7 * EULER), CONDENSED, "buckling"),
}  # fmt: skip


@pytest.mark.sampled(5)
@pytest.mark.sampled(10)
@pytest.mark.parametrize("name", ROWS)
def test_buckling_warnings_of_linear_and_condensed_booms(name, tmp_path):
    acting, boom, expected = ROWS[name]
    values = {"EIy": 2 * EI, "GJ": GJ, "more": "", "strain": "linear"} | boom
    (tmp_path / "case.toml").write_text("[run]\nduration = 1\nsamples = 11\n" + acting + BOOM.format(**values))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        femflex.build_system(femflex.read_case(tmp_path / "case.toml"))
    texts = [str(warning.message) for warning in caught if issubclass(warning.category, PhysicsWarning)]
    if isinstance(expected, str):
        assert not [text for text in texts if expected in text]
    else:
        assert [text for text in texts if all(word in text for word in expected)], texts


SPUN = {  # rate [rad/s], strain, warned: Southwell's omega^2 = omega_0^2 + 1.193 Omega^2
    "slow": (1.0, "linear", False),
    "fast": (20.0, "linear", True),
    "fast, condensed": (20.0, "condensed", False),
}


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", SPUN)
def test_stiffening_warnings_of_linear_booms(name, tmp_path):
    rate, strain, warned = SPUN[name]
    first = 1.8751**4 * EI / (LINE * L**4)
    assert warned == (strain == "linear" and np.sqrt(1 + 1.193 * rate**2 / first) > 1.02)
    text = "[run]\nduration = 0.1\nsamples = 11\n" + spinning(0, rate) + HELD
    text += BOOM.format(EIy=EI, GJ=GJ, more="", strain=strain)
    (tmp_path / "case.toml").write_text(text)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        femflex.run(tmp_path / "case.toml", tmp_path / "run.h5").close()
    texts = [str(warning.message) for warning in caught if issubclass(warning.category, PhysicsWarning)]
    assert any("boom" in text and "stiffening" in text for text in texts) == warned, texts
