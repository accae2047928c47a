"""Deploying members in case files: what they say, what is wrong with them, resuming, integrators, pictures."""

from pathlib import Path

import numpy as np
import pytest

from femflex import run
from femflex.case import Case, CaseError, parse_case, read_case
from femflex.dynamics import compile_system
from femflex.pipeline import rebuilt
from femflex.pipeline.decisions import build_system
from femflex.system.attraction import is_integrated
from femflex.view.growing import lengths_line

CASE = """
title = "growing boom"
source = "numbers of no meaning"
[run]
duration = "1.2 s"
output_step = "1 ms"
{run}
[bodies.craft]
kind = "rigid"
mass = 100
inertia = [60, 60, 60]
[[joints]]
kind = "free"
child = "craft"
[bodies.boom]
kind = "deploying"
{body}
[[joints]]
kind = "weld"
child = "boom"
parent = "craft"
"""
BOOM = """
family = "beam"
length = { kind = "smooth_step", from = 1, to = 2, start = 0.1, end = 1.1 }
stock = 3
mass_per_length = 0.5
EIy = 4
EIz = 4
functions = { y = 1, z = 1 }
initial = { marker = "tip", displacement = [0, 0.01, 0.02] }
"""


def case_of(body=BOOM, run=""):
    return parse_case(CASE.format(body=body, run=run), Path("boom.toml"))


def changed(old, new):
    assert old in BOOM
    return BOOM.replace(old, new)


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("esdirk4", "generalized_alpha")]


@pytest.mark.parametrize("method", ["dop853", *SLOW])
def test_a_run_resumes_bit_for_bit_with_every_integrator(tmp_path, method):
    text = CASE.format(body=BOOM, run=f'integrator = "{method}"' + ("\nstep = 1e-3" if "alpha" in method else ""))
    text = text.replace('output_step = "1 ms"', 'output_step = "4 ms"')
    (tmp_path / "boom.toml").write_text(text)
    case = read_case(tmp_path / "boom.toml")
    whole = run(case, tmp_path / "whole.h5")

    def stop(t):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(case, tmp_path / "part.h5", progress=stop)
    rest = run(case, tmp_path / "part.h5", resume=True)
    assert np.array_equal(rest["q"], whole["q"])
    assert np.array_equal(rest["bodies/boom/drum_force"], whole["bodies/boom/drum_force"])
    if method == "dop853":
        model = rebuilt(whole)
        assert list(model.system.varying) == ["boom"]
    tip = whole["markers/boom.tip/position"][-1]
    assert np.linalg.norm(tip - whole["bodies/craft/position"][-1]) == pytest.approx(2.0, abs=2e-3)
    whole.close(), rest.close()


@pytest.mark.sampled(1)
@pytest.mark.parametrize("rest", ["place", "material", "coordinates"])
def test_what_rests_at_the_start(rest):
    """Velocity of the tip at t = 0: (U / L) (w' of the tip) of a resting place plus transport; none of material."""
    body = changed('"smooth_step", from = 1, to = 2, start = 0.1, end = 1.1', '"polynomial", coefficients = [1, 0.1]')
    system = build_system(
        case_of(body.replace("y = 1, z = 1", "y = 6, z = 0").replace(", 0.02]", ", 0]") + f'rest = "{rest}"')
    )
    from femflex.dynamics import compile_system

    model = compile_system(system)
    speed = model.observe(np.zeros(1), model.x0[None])["markers/boom.tip/velocity"][0, 1]
    tip, slope, U = 0.01, 1.3765 * 0.01, 0.1  # w'(1) L / w(1) of the first clamped-free shape
    exact = {"place": U * slope, "material": 0.0, "coordinates": 0.0}[rest]
    assert tip > 0 and speed == pytest.approx(exact, abs=0.12 * U * slope)


MISTAKES = {
    "length": (changed("to = 2,", "to = -1,"), r"the deployed length falls to -1 m; it must stay above zero"),
    "stock": (changed("stock = 3", "stock = 1.5"), r"the deployed length grows to 2 m, above .* stock = 1\.5 m"),
    "density": (changed("mass_per_length = 0.5", "mass_per_length = -1"), r"bodies\.boom\.mass_per_length"),
    "jump": (
        changed('{ kind = "smooth_step", from = 1, to = 2, start = 0.1, end = 1.1 }',
                '{ kind = "table", times = [0, 1, 1, 2], values = [1, 1.5, 2, 2.5] }'),
        r"times must ascend",
    ),
    "family": (changed('"beam"', '"shell"'), r"bodies\.boom\.family"),
    "marker": (BOOM + "markers = { eye = { fraction = 1.4 } }", r"fraction 1\.4 of marker 'eye', a point that is st"),
    "position": (BOOM + "markers = { eye = { position = [1, 0, 0] } }", r"found position or group in marker 'eye'"),
    "membrane": (
        'family = "membrane"\nlength = 1\nmass_per_length = 1\nwidth = 1\nfunctions = { z = 1 }',
        r"found a membrane without tension; it has no stiffness then: give tension",
    ),
    "width": ('family = "plate"\nlength = 1\nmass_per_length = 1', r"found a plate without width; give width"),
    "bare": (changed("EIy = 4\nEIz = 4", ""), r"found a beam without bending stiffness; give EIy and EIz"),
    "unused": (changed("z = 1 }", "z = 1, across = 2 }"), r"found functions\.across, which a beam does not use"),
    "axial": (changed("z = 1 }", "z = 1, axial = 1 }"), r"found axial functions without EA; give EA"),
    "locked": (changed('{ kind = "smooth_step", from = 1, to = 2, start = 0.1, end = 1.1 }', '"locked"'), r"'locked'"),
    "both": (BOOM + "reel = { length = 1 }", r"found neither length nor reel, or both"),
    "mass": (changed("stock = 3\nmass_per_length = 0.5", "mass = 2"), r"found mass without stock"),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_one_sentence_before_the_run(name):
    body, sentence = MISTAKES[name]
    with pytest.raises(CaseError, match=sentence):
        build_system(case_of(body))


def in_orbit(body: str, attraction: str) -> Case:
    text = CASE.format(body=body, run="").replace('kind = "free"', 'kind = "spherical"')
    orbit = '[orbit]\nkind = "specified"\nsemi_major_axis = "7000 km"\n'
    return parse_case(f'{text}{orbit}[environment]\nattraction = "{attraction}"\n', Path("boom.toml"))


def test_exact_attraction_follows_the_points_of_a_uniform_member():
    """The attraction of a short boom is the gradient's to size over radius, while it moves."""
    rates = []
    for attraction in ("exact", "gradient"):
        system = build_system(in_orbit(BOOM, attraction))
        assert is_integrated(system) == (attraction == "exact")
        model = compile_system(system)
        rates.append(model.state_rate(0.6, model.x0))
    np.testing.assert_allclose(rates[0], rates[1], rtol=1e-5, atol=1e-12)
    assert np.abs(rates[0] - rates[1]).max() > 0.0


def test_exact_attraction_does_not_go_with_tapered_members():
    tapered = f"{BOOM}\ntaper = {{ along = [0, 1], mass = [1, 2] }}"
    with pytest.raises(CaseError, match=r"attraction 'exact' is integrated over points of mass, and those of .*'boom'"):
        build_system(in_orbit(tapered, "exact"))


def test_the_clock_shows_the_deployed_length():
    assert lengths_line({}) == ""
    assert lengths_line({"boom": 2.34567}) == "\nboom: 2.346 m"
    assert lengths_line({"a": 1.0, "b": 2.0, "c": 1.5}) == "\n3 members: 1 to 2 m"


def test_a_skin_grows_with_its_length(tmp_path):
    from femflex.view.extent import displacement, skins_of
    from femflex.view.motion import motion

    (tmp_path / "boom.toml").write_text(CASE.format(body=BOOM, run="").replace('"1 ms"', '"0.1 s"'))
    with run(tmp_path / "boom.toml", tmp_path / "boom.h5") as done:
        skins = skins_of(done.bodies())
        moving = motion(done, done.time, scale=3.0)
        skin, delta = skins["boom"], moving.delta["boom"]
        drawn = skin.points + 3.0 * np.einsum("tn,npa->tpa", delta, skin.shapes)
        assert drawn[0, :, 0].max() == pytest.approx(1.0, abs=1e-3)
        assert drawn[-1, :, 0].max() == pytest.approx(2.0, abs=5e-3)
        assert displacement(done, skins)[1].max() < 0.1  # growth is no displacement
        assert moving.lengths["boom"][-1] == pytest.approx(2.0)
