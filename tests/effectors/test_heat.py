"""Temperatures of surfaces, and what they do to the motion, against closed forms and series."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femflex import Orbit, System, fem, rigid_body, run, simulate, system_modes
from femflex.body import Skin
from femflex.case import parse_case
from femflex.effectors import EarthRadiation, HeatBalance, Optical, Sun, Surface, TemperatureHistory
from femflex.mesh import rectangle
from femflex.reduction import BeamFunctions, Damping, UniformBeam, beam_body, cantilever_modes, reduce_structure
from femflex.system import weld, with_effectors

CASES = Path(__file__).parents[2] / "cases"
SIGMA, SOLAR = 5.670374419e-8, 1361.0
L, EI, MASS = 8.0, 44.0, 0.034  # of a tube
RADIUS = 6378137.0
BETA = 1.8751040687
OPAQUE = Optical(emissivity=1.0)
PLATE = {"thickness": 0.01, "density": 1500.0, "specific_heat": 900.0, "conductivity": 0.5, "expansion": 1e-6}


def boom(direction, z, functions=1, strain="linear", **heat):
    """A clamped tube along x in the light from a direction."""
    beam = UniformBeam(L, 1e6, EI, EI, 30.0, MASS, ry=0.007, rz=0.007, rotary_inertia=False)
    shapes = BeamFunctions(z=functions)
    body = beam_body(beam, shapes, z, strain=strain, patches=["all"], induced=["all"])
    side = Optical(specular=0.5, emissivity=heat.pop("emissivity", 0.01))
    nouns = {
        "sun": Sun(kind="sun", direction=direction),
        "skin": Surface(body="boom", front=side, diameter=0.02),
        "heat": HeatBalance(kind="balance", body="boom", **heat),
    }
    return with_effectors(System({"boom": body}, [weld("boom", child_marker="root")]), nouns)


@pytest.mark.parametrize(("share", "grows"), [(0.99, False), (1.01, True)])
def test_one_mode_flutters_beyond_the_limit_of_routh(share, grows):
    """Row N': w = 2 rad/s, damping 0.005 and tau = 30 s flutter beyond g = -2 z (1 + 2 z w tau + (w tau)^2) / (w tau).

    Light along the boom, from behind: the slope w' of the mode phi changes d by -D cos(e) w', so that g = -(cte D / R)
    (phi'(L)^2 / 2) / int phi''^2 dx, here for e = 1e-3 rad off the axis, which keeps the tube warm.
    """
    z, tau = 0.005, 30.0
    w = BETA**2 * np.sqrt(EI / MASS / L**4)
    g = -2 * z * (1 + 2 * z * w * tau + (w * tau) ** 2) / (w * tau)
    capacity, thickness, radius, tilt = 2700.0 * 900.0, 2e-4, 0.01, 1e-3
    T = (0.5 * SOLAR * tilt / np.pi / (0.01 * SIGMA)) ** 0.25
    conductivity = capacity * radius**2 * (1 / tau - 4 * SIGMA * 0.01 * T**3 / (capacity * thickness))
    D = 0.5 * SOLAR * tau / (2 * capacity * thickness)
    slope = 2 * BETA / L * 0.734095514 / 2  # phi'(L) of the unit tip: (beta / L) sigma
    bend = BETA**4 / L**3 / 4  # int phi''^2 dx = (beta / L)^4 int phi^2 dx
    expansion = share * g * radius / D * bend / (-(slope**2) / 2)
    system = boom(
        (-np.cos(tilt), 0, np.sin(tilt)), Damping(z), density=2700, specific_heat=900,
        conductivity=conductivity, expansion=expansion, thickness=thickness,
    )  # fmt: skip
    motions = system_modes(system)
    assert (motions.about.growth > 0) == grows
    poles = np.roots([tau, 1 + 2 * z * w * tau, 2 * z * w + w * w * tau, w * w * (1 - share * g)])
    expected = poles[np.argmax(poles.imag)]
    found = motions.about.eigenvalues[np.argmin(np.abs(motions.about.eigenvalues - expected))]
    assert found == pytest.approx(expected, abs=2e-4 * abs(expected))


def plate(nodes, front=OPAQUE, back=OPAQUE, direction=(0, 0, 1), earth=None, upright=False, roof=False, **heat):
    """A square plate of 1 m, clamped at one side, in light on its front; upright: its normal is x, not z."""
    mesh = rectangle(1.0, 1.0, 4, 4, "quad")
    if upright:
        mesh = replace(mesh, points=mesh.points[:, [2, 0, 1]])
    material = fem.sections.Material(E=70e9, nu=0.3, density=2700)
    structure = fem.build_structure(mesh, [fem.Member("surface", "plate_bfs", fem.sections.isotropic(0.01, material))])
    modes = cantilever_modes(structure, ["left"], 2)
    body = reduce_structure(structure, modes, {}, None, "linear", None, ["surface"], None, ["surface"])
    nouns = {
        "sun": Sun(kind="sun", direction=direction, eclipse=False),
        "skin": Surface(body="plate", group="surface", front=front, back=back),
    }
    orbit = None
    if earth is not None:
        orbit, heat["earth"] = Orbit(RADIUS + earth.pop("altitude")), "earth"
        nouns["earth"] = EarthRadiation(**earth)
    nouns["heat"] = HeatBalance(kind="balance", body="plate", group="surface", nodes=nodes, **PLATE, **heat)
    bodies, joints = {"plate": body}, [weld("plate", child_marker="left")]
    if roof:  # over x < 1/2, 1 m above
        x = np.array([[-0.5, -1, 1], [0.5, -1, 1], [0.5, 2, 1], [-0.5, 2, 1]], float)
        skin = Skin(x, {"quad": np.array([[0, 1, 2, 3]])}, np.zeros((0, 4, 3)))
        bodies["roof"], joints = rigid_body(1.0, np.eye(3), skin=skin), [*joints, weld("roof")]
        nouns["roof"] = Surface(body="roof")
    return with_effectors(System(bodies, joints, orbit=orbit), nouns)


@pytest.mark.parametrize("nodes", [2, 5])
def test_plate_in_the_sun_settles_at_what_its_back_radiates(nodes):
    """Front absorbs q = 0.7 S and the back radiates it: sigma 0.8 T^4 = q there, and q h / k between the sides."""
    front, back = Optical(diffuse=0.3), Optical(diffuse=1.0, emissivity=0.8)
    run = simulate(plate(nodes, front, back), 1e-3)
    q, behind = 0.7 * SOLAR, (0.7 * SOLAR / (0.8 * SIGMA)) ** 0.25
    difference = q * PLATE["thickness"] / PLATE["conductivity"]
    assert run["effectors/heat/difference_3"][0] == pytest.approx(difference, rel=1e-9)
    assert run["effectors/heat/mean_3"][0] == pytest.approx(behind + difference / 2, rel=1e-9)
    bend = 70e9 * 0.01**3 / 12 / (1 - 0.3) * PLATE["expansion"] * difference / PLATE["thickness"]
    assert run["effectors/heat/moment_3"][0] == pytest.approx(bend, rel=1e-9)


@pytest.mark.parametrize("nodes", [4, 10])
def test_back_of_a_plate_warms_by_fouriers_law(nodes):
    """Flux q on the front of a slab (Carslaw and Jaeger, 3.8): T - T0 = q t / (rho c h) + (q h / k) times a series."""
    run = simulate(plate(nodes, Optical(), Optical(diffuse=1.0), initial=300.0), 20.0, output_step=1.0)
    h, k, capacity = PLATE["thickness"], PLATE["conductivity"], PLATE["density"] * PLATE["specific_heat"]
    n, t = np.arange(1, 60), run.times[1:, None]
    decay = np.exp(-(n**2) * np.pi**2 * k / capacity * t / h**2) * 2 / np.pi**2 / n**2
    front, back = SOLAR * h / k * np.array([1 / 3 - decay.sum(axis=1), -1 / 6 - (decay * (-1.0) ** n).sum(axis=1)])
    error = 0.5 * SOLAR * h / k / (nodes - 1) ** 2  # of linear elements
    assert run["effectors/heat/difference_1"][1:] == pytest.approx(front - back, abs=error)
    mean = 300.0 + SOLAR * run.times / (capacity * h)
    assert run["effectors/heat/mean_1"] == pytest.approx(mean, rel=1e-9)


@pytest.mark.parametrize(("infrared", "altitude"), [(237.0, 500e3), (200.0, 5000e3)])
def test_infrared_of_the_earth_warms_a_level_plate(infrared, altitude):
    """A plate across the vertical absorbs M (R / r)^2 below, and radiates on both sides."""
    earth = {"albedo": 0.0, "infrared": infrared, "altitude": altitude}
    run = simulate(plate(2, direction=(0, 0, 1), earth=earth, upright=True), 1e-3)
    mean, half = run["effectors/heat/mean_1"][0], run["effectors/heat/difference_1"][0] / 2
    flux = infrared * (RADIUS / (RADIUS + altitude)) ** 2
    assert SIGMA * ((mean + half) ** 4 + (mean - half) ** 4) == pytest.approx(flux, rel=1e-9)
    assert -2 * half * PLATE["conductivity"] / PLATE["thickness"] == pytest.approx(SIGMA * (mean + half) ** 4, rel=1e-9)


def test_history_bends_a_plate_by_its_difference(tmp_path):
    """E h^2 cte d / 12 (1 - nu) per width; d rises linearly from 0 to 20 K within 10 s, in any of the file's units."""
    (tmp_path / "analysis.csv").write_text("time [min],difference [K],middle [K]\n0,0,250\n0.1666666666666667,20,260\n")
    craft = plate(2)
    nouns = {
        "heat": TemperatureHistory(
            kind="history",
            body="plate",
            group="surface",
            file="analysis.csv",
            temperature="middle",
            difference="difference",
            thickness=0.01,
            expansion=1e-6,
        )
    }
    run = simulate(with_effectors(replace(craft, effectors=()), nouns, tmp_path), 20.0, output_step=2.5)
    rise = np.minimum(run.times / 10.0, 1.0)
    assert run["effectors/heat/temperature"] == pytest.approx(250 + 10 * rise)
    assert run["effectors/heat/moment_2"] == pytest.approx(70e9 * 0.01**2 / 12 / (1 - 0.3) * 1e-6 * 20 * rise)


def test_shaded_patches_absorb_nothing():
    """A roof over the half of a plate next to its root; the shadow is found at the start, and acts from then on."""
    craft = plate(2, Optical(diffuse=0.2), Optical(), roof=True, shadow_period=1.0, initial=300.0)
    run = simulate(craft, 0.5, output_step=0.1)
    x = [outlines.mean(axis=(0, 1))[0] for outlines in craft.bodies["plate"].patches["surface"].outlines]
    light = [run[f"effectors/heat/absorbed_{k + 1}"][-1] for k in range(len(x))]
    assert light == pytest.approx(np.where(np.array(x) < 0.5, 0.0, 0.8 * SOLAR), abs=1e-6 * SOLAR)


@pytest.mark.parametrize("strain", ["linear", "condensed"])
@pytest.mark.parametrize(("integrator", "error"), [("dop853", 1e-6), ("esdirk4", 1e-4)])
def test_work_of_heat_closes_the_balance_of_energy(strain, integrator, error):
    """The energy of a heated boom, that of its thermal strain included, is what the change of this strain supplies."""
    damping = Damping(0.02)
    tube = {"material": "aluminium_6061", "thickness": 2e-4, "initial": 300.0}
    run = simulate(boom((0, 0.6, 0.8), damping, 2, strain, **tube), 4.0, output_step=2e-3, integrator=integrator)
    power = run["monitors/supplied"] - run["monitors/dissipation"]
    given = np.concatenate([[0.0], np.cumsum(power[1:] + power[:-1]) * 1e-3])
    energy = run["monitors/energy"] - run["monitors/energy"][0]
    assert energy == pytest.approx(given, abs=error * np.abs(energy).max())
    assert run["effectors/heat/energy"].min() < 0.0 < run["monitors/elastic"].max()


def test_resumed_run_has_the_same_heat_and_numbers(tmp_path):
    path = CASES / "boom_heated.toml"
    text = path.read_text().replace('duration = "30 s"', "duration = 2.2").replace("50 ms", "2 ms")
    case = parse_case(text.partition("[pictures]")[0], path=path)

    def stop(t):
        raise KeyboardInterrupt

    whole = run(case, tmp_path / "whole.h5")
    with pytest.raises(KeyboardInterrupt):
        run(case, tmp_path / "part.h5", progress=stop)
    rest = run(case, tmp_path / "part.h5", resume=True)
    assert all(np.array_equal(rest[key], whole[key]) for key in ("q", "u", "z", "monitors/supplied") if key in whole)
    body = next(iter(case.bodies))
    assert whole["monitors/elastic"].max() > 0.0
    assert not np.any(run(case, tmp_path / "cold.h5", without=["thermal"])[f"bodies/{body}/delta"])
