"""Which strain a body of a case gets, and what is said of stiffening that linear strain leaves out."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.advised_bodies import noted_body

import femflex
from femflex.advice.strain import hardened_bend
from femflex.case import read_case
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, foreshortening_of
from femflex.warning import PhysicsWarning

SMALL = ('displacement = [0, "10 mm", 0]', 'displacement = [0, "1 mm", 0]')
FAST = ('rates = ["2 deg/s", 0, 0.01]', 'rates = [0, 0, "20 rad/s"]')
DAMPING = 'damping = { ratio = "0.5 %" }'


def built(write_case, craft, *changes):
    for old, new in changes:
        assert old in craft
        craft = craft.replace(old, new)
    return noted_body(read_case(write_case(craft)), "boom")


def test_a_slow_body_stays_linear_and_a_fast_one_is_condensed(write_case, craft):
    slow, fast = built(write_case, craft), built(write_case, craft, FAST)
    some = built(write_case, craft, (FAST[0], FAST[1].replace("20", "2")), SMALL)
    swinging = built(write_case, craft, (FAST[0], FAST[1].replace("20", "2")))
    assert slow.strain.is_linear and "rad/s changes its first frequency by less than 0.005%" in slow.note
    assert some.strain.is_linear and some.note.startswith("strain is linear: turning at 2.013 rad/s raises")
    assert len(swinging.slaves) and "out of phase by" in swinging.note
    assert (
        len(fast.slaves)
        and "strain is condensed: turning at 20.01 rad/s may raise the first frequency by 16.0%" in fast.note
    )
    assert fast.n_modes == slow.n_modes == 4 and set(fast.kinds[4:]) == {"derivative", "section"}


def test_a_body_that_starts_bent_is_condensed(write_case, craft):
    bend = ('displacement = [0, "10 mm", 0]', "relative = [0, 0.08, 0]")
    assert "its initial deflection is 8" in built(write_case, craft, bend).note


def test_a_body_keeps_the_strain_it_asks_for(write_case, craft):
    linear = built(write_case, craft, FAST, (DAMPING, DAMPING + '\nstrain = "linear"'))
    assert linear.strain.is_linear and linear.note == "" and linear.foreshortening is not None
    condensed = built(write_case, craft, (DAMPING, DAMPING + '\nstrain = "condensed"'))
    assert len(condensed.slaves) and condensed.note == ""


def test_foreshortening_of_a_mesh_is_that_of_the_beam_itself(write_case, craft):
    body = built(write_case, craft, (DAMPING, DAMPING + '\nstrain = "linear"'))
    area = np.pi * (0.03**2 - 0.028**2)
    I = np.pi / 4 * (0.03**4 - 0.028**4)
    beam = UniformBeam(3.0, 70e9 * area, 70e9 * I, 70e9 * I, 1e4, 2700 * area)
    own = foreshortening_of(beam_body(beam, BeamFunctions(y=6, family="polynomial"), strain="condensed"))
    assert body.foreshortening.mass == pytest.approx(own.mass, abs=5e-3 * np.abs(own.mass).max())  # it shears too
    # flap stiffening of a cantilever, mu^2 = 12.36 + 1.193 gamma^2 (one term of Rayleigh's quotient)
    scale = np.sqrt(70e9 * I / (2700 * area * 3.0**4))
    assert body.foreshortening.at["tip"] == pytest.approx(own.at["tip"], abs=5e-3 * np.abs(own.at["tip"]).max())
    assert -own.mass[1, 0] * 12.362 * scale**2 == pytest.approx(1.193, abs=2e-3)


def test_ignored_stiffening_is_told_with_both_numbers(write_case, craft, tmp_path):
    text = craft.replace(*FAST).replace(DAMPING, DAMPING + '\nstrain = "linear"').replace('"10 s"', '"0.2 s"')
    with pytest.warns(PhysicsWarning, match=r"'boom' turned at up to 20.01 rad/s: a stiffening of 16% of its"):
        femflex.run(write_case(text), tmp_path / "fast.h5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        femflex.run(write_case(text.replace('strain = "linear"', 'strain = "condensed"')), tmp_path / "good.h5")


STILL = ('rates = ["2 deg/s", 0, 0.01]', "rates = [0, 0, 0]")


def test_a_body_at_rest_is_told_that_nothing_turns_or_bends_it(write_case, craft):
    rest = craft[: craft.index("[[loads]]")].replace('initial = { marker = "tip", displacement = [0, "10 mm", 0] }', "")
    assert built(write_case, rest, STILL).note == "strain is linear: it does not turn; no load bends it"


def warned(path, output):
    """The physics warnings of a run."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        femflex.run(path, output, force=True)
    return [str(w.message) for w in caught if "turned at" in str(w.message)]


def test_a_body_from_a_file_is_warned_of_like_the_one_it_was_made_from(write_case, craft, tmp_path):
    body = built(write_case, craft, FAST, (DAMPING, DAMPING + '\nstrain = "linear"'))
    femflex.save_body(tmp_path / "boom.h5", body)
    again = femflex.load_body(tmp_path / "boom.h5")
    assert again.foreshortening is not None and np.array_equal(again.foreshortening.mass, body.foreshortening.mass)
    assert {name: at.tolist() for name, at in again.foreshortening.at.items()} == {
        name: at.tolist() for name, at in body.foreshortening.at.items()
    }
    first, last = craft.index('kind = "flexible"'), craft.index("markers.tip")
    text = craft.replace('"10 s"', '"0.2 s"')
    text = text.replace(craft[first:last], 'kind = "file"\nfile = "boom.h5"\n').replace(', "10 mm", 0', ', "1 mm", 0')
    (said,) = warned(write_case(text.replace(*FAST)), tmp_path / "fast.h5")
    assert "'boom' turned at up to 20" in said and "a stiffening of 16% of its first frequency (" in said
    assert not warned(write_case(text), tmp_path / "slow.h5")


def test_unit_displacements_are_warned_of_too(write_case, craft):
    nodal = ('{ method = "cantilever", clamp = "ROOT", modes = 4 }', '{ method = "nodal", clamp = "ROOT" }')
    modes = built(write_case, craft, (DAMPING, DAMPING + '\nstrain = "linear"'))
    body = built(write_case, craft, nodal, (DAMPING, ""))
    assert body.strain.is_linear and body.foreshortening.mass == pytest.approx(modes.foreshortening.mass, abs=1e-6)


PUSH = "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]"
RIGIDITY = 70e9 * np.pi / 4 * (0.03**4 - 0.028**4)


def pressed(write_case, craft, tmp_path, body, force):
    """What a run of the resting craft with a force on a body says of the boom being pressed."""
    text = craft.replace(*STILL).replace(DAMPING, DAMPING + '\nstrain = "linear"').replace('"10 s"', '"0.1 s"')
    text = text.replace('body = "hub"', f'body = "{body}"' + ('\nmarker = "tip"' if body == "boom" else ""))
    path = write_case(text.replace(PUSH, f"force = [{force}, 0, 0]"))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        femflex.run(path, tmp_path / "pressed.h5", force=True).close()
    return [str(w.message) for w in caught if "pressed" in str(w.message)]


def test_a_load_along_a_body_that_softens_it_is_told_with_both_frequencies(write_case, craft, tmp_path):
    """A column under half its Euler load, pi^2 EI / 4 L^2. By Rayleigh's quotient of its first mode the load takes

    P L^2 / EI (int phi'^2 / int phi''^2) = pi^2 / 8 (4.6478 / 12.3624) of the stiffness, 46 % (50 % as it buckles).
    """
    euler = np.pi**2 * RIGIDITY / (4 * 3.0**2)
    (said,) = pressed(write_case, craft, tmp_path, "boom", -0.5 * euler)
    assert "'boom' was compressed, by loads or inertia, so that its first frequency (" in said
    found = float(said.split("falls by ")[1].split("%")[0])
    assert found == pytest.approx(100 * (1 - np.sqrt(1 - np.pi**2 / 8 * 4.6478 / 12.3624)), abs=1.0)
    low, lower = (float(part.split(" Hz")[0].split("(")[-1].split("not ")[-1]) for part in said.split(", not "))
    assert lower / low == pytest.approx(1 - found / 100, abs=0.01)
    (said,) = pressed(write_case, craft, tmp_path, "boom", -2 * euler)
    assert "of its first buckling load" in said
    assert not pressed(write_case, craft, tmp_path, "boom", 0.5 * euler)


def test_thrust_that_presses_a_boom_by_its_own_inertia_is_told(write_case, craft, tmp_path):
    """A clamped column buckles under its own weight q L at q L^3 = 7.837 EI (Greenhill, 1881)."""
    line = 2700 * np.pi * (0.03**2 - 0.028**2)
    acceleration = 0.5 * 7.837 * RIGIDITY / 3.0**3 / line
    (said,) = pressed(write_case, craft, tmp_path, "hub", acceleration * (200 + 3 * line))
    assert float(said.split("falls by ")[1].split("%")[0]) == pytest.approx(100 * (1 - np.sqrt(0.5)), abs=2.0)
    assert not pressed(write_case, craft, tmp_path, "hub", -acceleration * (200 + 3 * line))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("count", [1, 2, 8])
def test_segments_are_warned_of_where_the_pull_stiffens_one_of_them(count, write_case, craft, tmp_path):
    """The lowest shape of a segment of length l is w = x (l - x): a pull T stiffens it by T l^2 / 12 EI."""
    cut = craft.replace('reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }\n', "markers.ROOT = {}\n")
    cut = cut.replace(DAMPING + "\n", "").replace(
        'material = "aluminium" }', f'material = "aluminium", segments = {count} }}'
    )
    cut = cut.replace('initial = { marker = "tip", displacement = [0, "10 mm", 0] }\n', "").replace(
        '"10 s"', '"0.05 s"'
    )
    cut = cut.replace(craft[craft.index("[[loads]]") :], "")
    found = warned(write_case(cut.replace(*FAST)), tmp_path / "cut.h5")
    area, I = np.pi * (0.03**2 - 0.028**2), np.pi / 4 * (0.03**4 - 0.028**4)
    l, rate = 3.0 / count, 20.0
    middle = l / 2  # of the first segment: the mean pull along it
    pull = 2700 * area * rate**2 * ((3.5**2 - (0.5 + middle) ** 2) / 2)
    raised = np.sqrt(1 + pull * l**2 / (12 * 70e9 * I)) - 1
    if raised < 0.02:
        assert not found
        return
    (said,) = found
    told = float(said.split("a stiffening of ")[1].split("%")[0])
    assert told == pytest.approx(100 * raised, rel=0.15)  # the craft turns about its centre of mass; the pull varies
    assert "of the first shape of its segment 'boom.1'" in said and f"more than {count} segments" in said


def held_twice(craft, prestress):
    """The boom with both ends clamped, under a prestress."""
    stressed = craft.replace(
        'material = "aluminium" }', f'material = "aluminium", options = {{ prestress = {prestress} }} }}'
    )
    stressed = stressed.replace('mesh = "boom.inp"', 'mesh = "boom.inp"\nrefine = 2')
    stressed = stressed.replace('clamp = "ROOT"', 'clamp = ["ROOT", "TIP"]')
    return stressed.replace('initial = { marker = "tip", displacement = [0, "10 mm", 0] }\n', "")


def told_of(write_case, text):
    """The physics warnings about the boom's initial stress."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        built(write_case, text)
    return [str(w.message) for w in caught if "stress" in str(w.message)]


@pytest.mark.slow
def test_prestress_that_clamps_do_not_hold_is_told(write_case, craft):
    loose = craft.replace('material = "aluminium" }', 'material = "aluminium", options = { prestress = 500 } }')
    (said,) = told_of(write_case, loose)
    assert "bodies.boom: its clamps sustain 0% of the energy of the initial stress (limit 50%)" in said
    assert not told_of(write_case, loose.replace("prestress = 500", "thermal_strain = 1e-4"))
    assert not told_of(write_case, held_twice(craft, 500))
    cut = loose.replace("{ prestress = 500 }", "{ prestress = 500 }, segments = 2").replace(DAMPING + "\n", "")
    cut = cut.replace('initial = { marker = "tip", displacement = [0, "10 mm", 0] }\n', "")
    with pytest.warns(PhysicsWarning, match=r"the prestress of 500 N on 'BOOM' relaxes to 0 N, because"):
        segments = femflex.build_system(read_case(write_case(cut))).bodies
    assert all(not segments[f"boom.{k}"].strain.f0.any() for k in (1, 2))


@pytest.mark.slow
def test_prestress_near_buckling_or_beyond_small_strain_is_told_with_both_numbers(write_case, craft):
    I = np.pi / 4 * (0.03**4 - 0.028**4)
    euler = 4 * np.pi**2 * 70e9 * I / 3.0**2  # both ends clamped
    assert not told_of(write_case, held_twice(craft, -0.5 * euler))
    (said,) = told_of(write_case, held_twice(craft, -0.9 * euler))
    factor = float(said.split("load factor is ")[1].split(" ")[0])
    assert factor == pytest.approx(1 / 0.9, rel=0.02) and "(limit 1.25), which leaves 10% " in said
    EA = 70e9 * np.pi * (0.03**2 - 0.028**2)
    assert not told_of(write_case, held_twice(craft, 0.005 * EA))
    (said,) = told_of(write_case, held_twice(craft, 0.02 * EA))
    assert "its initial stress strains it by up to 2.0%" in said and "below 1%" in said


def test_prestressed_bodies_are_condensed_where_they_spin(write_case, craft):
    """Heat in a frame of two ends stays in it; a spin about the boom's own end stiffens what is left."""
    loose = craft.replace('material = "aluminium" }', 'material = "aluminium", options = { thermal_strain = 1e-4 } }')
    body = built(write_case, loose, FAST)
    assert len(body.slaves) and "strain is condensed" in body.note
    assert built(write_case, held_twice(craft, 500), STILL).note


@pytest.mark.slow
@pytest.mark.parametrize("none", ['"none"', "0"])
def test_a_set_without_derivatives_says_that_it_is_linear_and_the_advice_works(write_case, craft, femflex, none):
    text = craft.replace(*FAST).replace("modes = 4", f"modes = 4, derivatives = {none}")
    code, said, wrong = femflex("run", write_case(text), "-o", "none.h5", "--no-pictures")
    told, value = " ".join(said.split()), none.replace('"', "'")
    assert (
        code == 0
        and f"boom: strain is linear: with derivatives = {value} its shapes cannot bend without stretching" in told
    )
    assert f"Drop derivatives = {value} and give it strain = 'condensed'." in wrong
    advised = text.replace(f", derivatives = {none}", "").replace(DAMPING, DAMPING + "\nstrain = 'condensed'")
    assert advised.count("condensed") == 1 and "derivatives" not in advised
    code, _, wrong = femflex("run", write_case(advised), "-o", "advised.h5", "--no-pictures")
    assert code == 0 and "linear strain" not in wrong


def test_a_body_file_with_linear_strain_is_advised_to_be_made_anew(write_case, craft, femflex):
    linear = craft.replace(DAMPING, DAMPING + "\nstrain = 'linear'")
    assert femflex("body", write_case(linear), "boom", "-o", "boom.h5")[0] == 0
    head, rest = craft.replace(*FAST).split("[bodies.boom]")
    joint = rest[rest.index("[[joints]]") :]
    text = head + "[bodies.boom]\nkind = 'file'\nfile = 'boom.h5'\n" + joint
    code, _, wrong = femflex("run", write_case(text), "-o", "file.h5", "--no-pictures")
    assert code == 0
    assert "Make boom.h5 anew (femflex body) from a case that gives it strain = 'condensed'." in wrong


def test_the_frequency_told_is_that_with_what_hangs_on_the_body(write_case, craft, femflex):
    """A clamped beam with a tip mass of ten times its own: omega^2 = 3 EI / (L^3 (M + 33/140 m)), to a thousandth."""
    mass, I = 2700 * np.pi * (0.03**2 - 0.028**2) * 3.0, np.pi / 4 * (0.03**4 - 0.028**4)
    tip = 10 * mass
    text = craft.replace(*FAST).replace(DAMPING, DAMPING + "\nstrain = 'linear'")
    text += f"[bodies.tip]\nkind = 'rigid'\nmass = {tip}\ninertia = [1e-3, 1e-3, 1e-3]\n"
    text += "[[joints]]\nkind = 'weld'\nparent = 'boom'\nparent_marker = 'tip'\nchild = 'tip'\n"
    code, _, wrong = femflex("run", write_case(text), "-o", "tip.h5", "--no-pictures")
    told = re.search(
        r"first frequency \(([\d.]+) Hz, not ([\d.]+) Hz, clamped, with the ([\d.]+) kg that it carries\)", wrong
    )
    assert code == 0 and told and float(told[3]) == pytest.approx(tip, rel=1e-3)
    exact = np.sqrt(3 * 70e9 * I / (27.0 * (tip + 33 / 140 * mass))) / (2 * np.pi)
    assert float(told[1]) == pytest.approx(exact, rel=2e-3) and float(told[2]) > float(told[1])


@pytest.mark.parametrize("linear", [1e-12, 0.3, 1e18])
@pytest.mark.parametrize("hardening", [0.0, 1e-9, 2.0, 1e9])
def test_the_bend_that_stretch_holds_back_solves_its_cubic(linear, hardening):
    w = hardened_bend(linear, hardening)
    assert w + hardening * w**3 == pytest.approx(linear, rel=1e-12)
