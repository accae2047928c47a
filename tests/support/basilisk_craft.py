"""A rigid craft with three wheels and two thrusters in Basilisk (`peers` extra) and in femflex: the same numbers."""

from __future__ import annotations

import time

import numpy as np

from femflex.body import Marker
from femflex.body.flexible import rigid_body
from femflex.dynamics import compile_system
from femflex.system import System, free, revolute
from support.effector_builders import reaction_wheel, thruster, without_axial_inertia

MASS, INERTIA = 330.0, np.diag([82.0, 61.0, 95.0])
RATE = np.array([0.01, -0.02, 0.015])  # rad/s
AXES, WHEEL, SPEEDS = np.eye(3), 0.05, np.array([120.0, -80.0, 200.0])  # kg m^2, rad/s
TORQUES = np.array([0.01, -0.02, 0.005])  # N m, of the motors
JETS = ((np.array([0.8, 0.3, 0.0]), np.array([0.0, 0.0, 1.0])), (np.array([-0.8, 0.3, 0.1]), np.array([0.0, 1.0, 0.0])))
THRUST, ON = 0.4, (50.0, 120.0)  # N; s, from the start on: on the grid of both
DURATION = 600.0


def basilisk_run(step: float) -> tuple[float, np.ndarray, np.ndarray]:
    """CPU seconds, Euler parameters (4,) of the body and wheel speeds (3,) at the end, by RK4 with that step [s]."""
    from Basilisk.architecture import messaging
    from Basilisk.simulation import reactionWheelStateEffector, spacecraft, thrusterDynamicEffector
    from Basilisk.utilities import RigidBodyKinematics as rbk
    from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW, simIncludeThruster

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))
    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    craft.hub.mHub, craft.hub.r_BcB_B, craft.hub.IHubPntBc_B = MASS, [[0.0], [0.0], [0.0]], INERTIA.tolist()
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = [[0.0], [0.0], [0.0]], [[0.0], [0.0], [0.0]]
    craft.hub.sigma_BNInit, craft.hub.omega_BN_BInit = [[0.0], [0.0], [0.0]], RATE[:, None].tolist()
    wheels = simIncludeRW.rwFactory()
    for axis, speed in zip(AXES.T, SPEEDS, strict=True):
        wheels.create("custom", axis.tolist(), Omega=speed / macros.RPM, Js=WHEEL, RWModel=messaging.BalancedWheels,
                      u_max=10.0, useRWfriction=False, useMinTorque=False, useMaxTorque=False)  # fmt: skip
    effector = reactionWheelStateEffector.ReactionWheelStateEffector()
    wheels.addToSpacecraft("wheels", effector, craft)
    motor = messaging.ArrayMotorTorqueMsg().write(
        messaging.ArrayMotorTorqueMsgPayload(motorTorque=[*TORQUES, *np.zeros(33)])
    )
    effector.rwMotorCmdInMsg.subscribeTo(motor)
    jets = thrusterDynamicEffector.ThrusterDynamicEffector()
    factory = simIncludeThruster.thrusterFactory()
    for place, direction in JETS:
        factory.create("TEST_Thruster", place.tolist(), direction.tolist(), MaxThrust=THRUST, MinOnTime=1e-6)
    factory.addToSpacecraft("jets", jets, craft)
    on = messaging.THRArrayOnTimeCmdMsg().write(messaging.THRArrayOnTimeCmdMsgPayload(OnTimeRequest=[1e6, 1e6]))
    jets.cmdsInMsg.subscribeTo(on)
    for model in (jets, effector, craft):
        simulation.AddModelToTask("task", model)
    begin = time.process_time()
    simulation.InitializeSimulation()
    left = [1e6, 1e6]
    for k, end in enumerate((*ON, DURATION)):  # switched between two steps: within one its stages would see both
        simulation.ConfigureStopTime(macros.sec2nano(end))
        simulation.ExecuteSimulation()
        if k < len(ON):
            left[k] = 0.0
            on.write(messaging.THRArrayOnTimeCmdMsgPayload(OnTimeRequest=left), macros.sec2nano(end))
    spent = time.process_time() - begin
    sigma = np.array(craft.scStateOutMsg.read().sigma_BN)
    speeds = np.array(effector.rwSpeedOutMsg.read().wheelSpeeds[:3])
    return spent, np.asarray(rbk.MRP2EP(sigma)), speeds


def femflex_model():
    """The same craft."""
    markers = {f"jet{k}": Marker.at_position(place) for k, (place, _) in enumerate(JETS)}
    hub = rigid_body(MASS, INERTIA, markers=markers)
    effectors = []
    for k in range(3):
        wheel = reaction_wheel(
            f"wheel{k}", "hub", WHEEL, axis=AXES[:, k], torque=float(TORQUES[k]), initial_speed=float(SPEEDS[k])
        )
        hub = without_axial_inertia(hub, wheel)
        effectors.append(wheel)
    for k, (_, direction) in enumerate(JETS):
        effectors.append(thruster(f"jet{k}", "hub", THRUST, marker=f"jet{k}", axis=direction, pulses=[(0.0, ON[k])]))
    start = free("hub", u0=[0.0, 0.0, 0.0, *RATE])
    return compile_system(System({"hub": hub}, (start,), effectors=tuple(effectors)))


PANEL, PANEL_INERTIA, ARM = 25.0, np.diag([4.0, 8.0, 11.0]), 1.4  # kg, kg m^2, m from hinge to centre
SPRING, DAMPER, BENT = 20.0, 0.3, (0.1, -0.05)  # N m/rad, N m s/rad, rad
HINGES = (np.array([0.6, 0.0, 0.2]), np.array([-0.6, 0.1, 0.2]))
TO_HINGE = (np.diag([-1.0, -1.0, 1.0]), np.eye(3))  # C_HB: panels reach along -x of their hinge


def basilisk_hinged_run(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Euler parameters (4,) and hinge angles (2,) at the end of the craft with two hinged rigid panels."""
    from Basilisk.simulation import hingedRigidBodyStateEffector, spacecraft
    from Basilisk.utilities import RigidBodyKinematics as rbk
    from Basilisk.utilities import SimulationBaseClass, macros

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))
    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    craft.hub.mHub, craft.hub.r_BcB_B, craft.hub.IHubPntBc_B = MASS, [[0.0], [0.0], [0.0]], INERTIA.tolist()
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = [[0.0], [0.0], [0.0]], [[0.0], [0.0], [0.0]]
    craft.hub.sigma_BNInit, craft.hub.omega_BN_BInit = [[0.0], [0.0], [0.0]], RATE[:, None].tolist()
    panels = []
    for k, (place, turn, angle) in enumerate(zip(HINGES, TO_HINGE, BENT, strict=True)):
        panel = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
        panel.mass, panel.IPntS_S, panel.d = PANEL, PANEL_INERTIA.tolist(), ARM
        panel.k, panel.c, panel.thetaInit, panel.thetaDotInit = SPRING, DAMPER, angle, 0.0
        panel.r_HB_B, panel.dcm_HB = place[:, None].tolist(), turn.tolist()
        panel.nameOfThetaState, panel.nameOfThetaDotState = f"theta{k}", f"rate{k}"
        craft.addStateEffector(panel)
        panels.append(panel)
    for model in (craft, *panels):
        simulation.AddModelToTask("task", model)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(DURATION))
    simulation.ExecuteSimulation()
    angles = np.ravel([craft.dynManager.getStateObject(panel.nameOfThetaState).getState() for panel in panels])
    return np.asarray(rbk.MRP2EP(np.array(craft.scStateOutMsg.read().sigma_BN))), angles


def hinged_model():
    """The same craft in femflex."""
    markers = {
        f"hinge{k}": Marker.at_position(place, turn.T)
        for k, (place, turn) in enumerate(zip(HINGES, TO_HINGE, strict=True))
    }
    bodies = {"hub": rigid_body(MASS, INERTIA, markers=markers)}
    joints = [free("hub", u0=[0.0, 0.0, 0.0, *RATE])]
    for k in range(2):
        bodies[f"panel{k}"] = rigid_body(PANEL, PANEL_INERTIA, np.array([-ARM, 0.0, 0.0]))
        springs = {"stiffness": SPRING, "damping": DAMPER, "q0": [BENT[k]]}
        joints.append(revolute(f"panel{k}", "hub", (0, 1, 0), parent_marker=f"hinge{k}", name=f"hinge{k}", **springs))
    return compile_system(System(bodies, tuple(joints)))
