"""Tension of a film under loads along a run, against the stress of a strip pulled along its plane."""

from __future__ import annotations

import re
from contextlib import nullcontext

import numpy as np
import pytest

from femflex.advice.bodies import KnownBodies
from femflex.advice.tension import SLACK, TensionWatch
from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.mesh.generators import rectangle
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.reduction.origin import Meshed, Origin
from femflex.system import Environment, System, weld
from femflex.warning import PhysicsWarning

LENGTH, WIDTH, H = 2.0, 0.5, 1e-4
FILM = Material(3e9, 0.0, 1400.0)
ALONG, ACROSS = 20.0, 35.0  # N/m
SUPPORTS = {
    "left": ("x", "y", "z"), "right": ("x", "y", "z"), "top": ("y", "z"), "bottom": ("y", "z"),
}  # fmt: skip


@pytest.fixture(scope="module")
def film():
    mesh = rectangle(LENGTH, WIDTH, 16, 2, "triangle6")
    member = Member("surface", "membrane", H, FILM, {"prestress": (ALONG, ACROSS, 0.0)})
    structure = build_structure(mesh, [member])
    modes = cantilever_modes(structure, SUPPORTS, 3)
    return structure, modes, reduce_structure(structure, modes, turning=())


def watched(film, known=True, gravity=(0.0, 0.0, 0.0)):
    structure, modes, body = film
    field = Environment(np.array(gravity, float))
    system = System({"film": body}, (weld("film", child_marker="left"),), environment=field)
    model = compile_system(system)
    origins = {"film": Origin(Meshed(structure, modes) if known else None)}
    return TensionWatch(model, KnownBodies(origins)), model.observe(np.zeros(1), model.x0[None])


def test_a_film_pulled_along_its_plane_has_the_tension_of_a_strip(film):
    """N = N_0 + m'' g (L / 2 - x) between fixed ends; the lowest principal one, the other being across."""
    g = 90.0
    watch, channels = watched(film, gravity=[g, 0, 0])
    (one,) = watch._watched
    found = watch.tension(one, channels)[0]
    assert len(found) == 9 and one.places[:, 0].min() < 0.1 and one.places[:, 0].max() > 1.9
    pulled = ALONG + FILM.density * H * g * (LENGTH / 2 - one.places[:, 0])
    assert found == pytest.approx(np.minimum(pulled, ACROSS), abs=0.2) and pulled.max() < ACROSS
    alone, channels = watched(film)
    assert alone.tension(alone._watched[0], channels)[0] == pytest.approx(np.full(9, ALONG), abs=1e-6)


def test_a_film_that_wrinkles_is_warned_of_with_the_worst_of_all_rows(film):
    g = 300.0
    watch, weak = watched(film, gravity=[40.0, 0, 0])
    strong = watched(film, gravity=[g, 0, 0])[0]
    (one,) = strong._watched
    blocks = [(np.array([3.0]), weak), (np.array([4.5]), weak)]
    for times, channels in blocks:
        strong.watch(times, channels)
    (lowest,) = strong.lowest().values()
    assert set(strong.lowest()) == {("film", "surface")} and lowest.time == 3.0
    at = one.places[:, 0].max()
    least = ALONG - FILM.density * H * g * (at - LENGTH / 2)
    assert lowest.value == pytest.approx(least, abs=0.6) and lowest.place[0] == at and least < -15
    with pytest.warns(PhysicsWarning) as given:
        strong.warn()
    (said,) = [str(w.message) for w in given]
    head = r"body 'film': its membrane on group 'surface' went wrinkled at t = 3 s near \(1\.9\d*, 0\.\d+, 0\): its "
    rest = r"lowest principal stress resultant falls to -\d+\.\d+ N/m, below zero, and the model carries that "
    assert re.fullmatch(head + rest + "compression. Raise the tension, or lower the load against it", said)
    watch.watch(np.zeros(1), weak)
    watch.warn()  # in tension: warnings are errors here


@pytest.mark.parametrize(("part", "warned"), [(0.5, False), (-0.5, False), (-2.0, True)])
def test_a_film_is_wrinkled_where_its_least_tension_lies_below_zero_by_more_than_rounding(film, part, warned):
    """The least tension is linear in the weight; that weight is taken at which it is a part of the limit."""
    wanted = part * SLACK * max(ALONG, ACROSS)
    least = {}
    for g in (0.0, 100.0):
        watch, channels = watched(film, gravity=[g, 0, 0])
        watch.watch(np.zeros(1), channels)
        least[g] = watch.lowest()["film", "surface"].value
    g = 100.0 * (wanted - least[0.0]) / (least[100.0] - least[0.0])
    watch, channels = watched(film, gravity=[g, 0, 0])
    watch.watch(np.zeros(1), channels)
    assert watch.lowest()["film", "surface"].value == pytest.approx(wanted, abs=0.1 * SLACK * ALONG)
    with pytest.warns(PhysicsWarning, match="went wrinkled") if warned else nullcontext():
        watch.warn()


def test_bodies_whose_elements_are_not_known_are_not_watched(film):
    watch, channels = watched(film, known=False)
    watch.watch(np.zeros(1), channels)
    assert watch.lowest() == {}
    assert TensionWatch(compile_system(System({"film": film[2]}, (weld("film", child_marker="left"),)))).lowest() == {}
