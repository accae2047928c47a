"""Light on the faces of a box: force and torque of each attitude as Basilisk's facets have them.

Basilisk's constant of sunlight is 0.514 % higher. Its facets are rigid, do not shade one another, and lack the recoil
of a film that radiates absorbed heat. In the air they have one drag coefficient, without lift or damping.
"""

import numpy as np
import pytest

from femflex import Frame, System, rigid_body, simulate
from femflex.body import Skin
from femflex.effectors import Optical, SolarPressure, Sun, Surface
from femflex.rotations import dcm_from_quaternion
from femflex.system import spherical, with_effectors

AU = 1.495978707e11
SPECULAR, DIFFUSE = 0.35, 0.2
HALF, CENTRE = np.array([0.5, 0.6, 0.8]), np.array([0.1, 0.0, 0.05])
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def femflex_light(e):
    """Force and torque about the origin in body axes, the sun along -x."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * HALF + CENTRE
    body = rigid_body(
        100.0, np.diag([10.0, 12.0, 14.0]), skin=Skin(corners, {"quad": np.array(QUADS)}, np.zeros((0, 8, 3)))
    )
    nouns = {
        "sun": Sun(kind="sun", direction=(-1, 0, 0)),
        "skin": Surface(body="hub", front=Optical(specular=SPECULAR, diffuse=DIFFUSE)),
        "light": SolarPressure(),
    }
    craft = System({"hub": body}, [spherical("hub", q0=e)], frame=Frame("inertial"))
    run = simulate(with_effectors(craft, nouns), 1e-3)
    C = dcm_from_quaternion(run["bodies/hub/attitude"][0])
    return [C.T @ run[f"effectors/light_hub/{key}"][0] for key in ("force", "torque")]


def basilisk_light(e):
    """The same by Basilisk, the sun at the origin and the craft at 1 au along x."""
    from Basilisk.architecture import messaging
    from Basilisk.simulation import facetSRPDynamicEffector, spacecraft
    from Basilisk.utilities import SimulationBaseClass, macros

    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(1.0)))
    craft = spacecraft.Spacecraft()
    craft.hub.mHub, craft.hub.IHubPntBc_B = 100.0, np.diag([10.0, 12.0, 14.0]).tolist()
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = [[AU], [0.0], [0.0]], [[0.0]] * 3
    craft.hub.sigma_BNInit, craft.hub.omega_BN_BInit = (e[1:, None] / (1.0 + e[0])).tolist(), [[0.0]] * 3
    light = facetSRPDynamicEffector.FacetSRPDynamicEffector()
    light.setNumFacets(6)
    light.setNumArticulatedFacets(0)
    for axis in range(3):
        for side in (1.0, -1.0):
            normal = side * np.eye(3)[axis]
            area = 4.0 * HALF.prod() / HALF[axis]
            vectors = (normal, np.roll(normal, 1), CENTRE + normal * HALF)  # normal, axis of a hinge, centre
            light.addFacet(area, np.eye(3).tolist(), *(v.tolist() for v in vectors), DIFFUSE, SPECULAR)
    sun = messaging.SpicePlanetStateMsgPayload()
    sun.PositionVector = [0.0, 0.0, 0.0]
    message = messaging.SpicePlanetStateMsg().write(sun)
    light.sunInMsg.subscribeTo(message)
    craft.addDynamicEffector(light)
    for model in (craft, light):
        simulation.AddModelToTask("task", model)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(1.0))
    simulation.ExecuteSimulation()
    return [np.array(value).ravel() for value in (light.forceExternal_B, light.torqueExternalPntB_B)]


@pytest.mark.benchmark
def test_light_on_a_box_is_that_of_basilisk():
    pytest.importorskip("Basilisk")
    rng = np.random.default_rng(4)
    for e in rng.normal(size=(6, 4)):
        e = e / np.linalg.norm(e) * np.sign(e[0])
        for ours, theirs in zip(femflex_light(e), basilisk_light(e), strict=True):
            np.testing.assert_allclose(ours * 1.0051433, theirs, atol=1e-6 * np.linalg.norm(theirs))
