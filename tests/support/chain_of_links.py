"""Benchmark case b in two programs: a chain of eight links of 27-node hexahedra, ten clamped modes each.

Hinges turn about y and z in turn; the first stands on the ground, the next ones on the tip face of the link before.
`exudyn_run` drives the same matrices and modes with the settings at which Exudyn was found fastest for this case
(generalised alpha of spectral radius 0.9, modified Newton, sparse solver).
"""

from __future__ import annotations

import time
from functools import cache
from itertools import pairwise

import numpy as np

from femflex.body import FlexibleBody
from femflex.dynamics import Model, compile_system
from femflex.fem import Material, Member, build_structure
from femflex.mesh import box
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.rotations import dcm_from_vector
from femflex.system import System, revolute
from support.hub_and_panels import nodal_matrices

LENGTH, WIDTH, THICKNESS = 1.0, 0.06, 0.006  # m
LINKS, DURATION = 8, 2.0  # s
ANGLE, RATES = 0.1, (1.0, 1.0, -1.0, -1.0)  # rad, rad/s
TIP_AT_END = np.array([-2.12800705, 4.87009317, -5.57340271])  # m, an independent RK4 program at h = 2e-5 s
AXES = np.eye(3)[[1, 2]]


@cache
def link_structure():
    """Structure and modes of one link, root at x = 0."""
    mesh = box(LENGTH, WIDTH, THICKNESS, 16, 1, 1, cell="hexahedron27").translated([0, -WIDTH / 2, -THICKNESS / 2])
    structure = build_structure(mesh, [Member("volume", "solid", None, Material(7e10, 0.3, 2700.0))])
    return mesh, structure, cantilever_modes(structure, ["left"], 10)


@cache
def link() -> FlexibleBody:
    """One reduced link with a marker on its tip face."""
    _, structure, modes = link_structure()
    return reduce_structure(structure, modes, {"tip": "right"})


def hinge(k: int) -> tuple[np.ndarray, float]:
    """Axis and initial rate of hinge k."""
    return AXES[k % 2], RATES[k % 4]


def femflex_model(n: int = LINKS) -> Model:
    """The compiled chain of n links with its initial state."""
    names = [f"link{k}" for k in range(n)]
    start = [{"axis": hinge(k)[0], "q0": [ANGLE], "u0": [hinge(k)[1]]} for k in range(n)]
    joints = [revolute(names[0], **start[0])]
    joints += [
        revolute(name, before, parent_marker="tip", **where)
        for (before, name), where in zip(pairwise(names), start[1:], strict=True)
    ]
    return compile_system(System(dict.fromkeys(names, link()), tuple(joints)))


def exudyn_run(step: float, tolerance: float = 1e-6) -> tuple[float, np.ndarray]:
    """CPU seconds and tip position of Exudyn's generalised-alpha method at that step [s]."""
    import exudyn as exu
    from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
    from exudyn.utilities import (
        GenericJoint,
        MarkerBodyRigid,
        MarkerNodeRigid,
        MarkerSuperElementRigid,
        SensorMarker,
    )

    mesh, structure, modes = link_structure()
    X, M, K, P = nodal_matrices(mesh, structure, modes)
    fem = FEMinterface()
    fem.nodes, fem.massMatrix, fem.stiffnessMatrix = {"Position": X}, M, K
    fem.modeBasis = {"matrix": P, "type": "NormalModes"}
    fem.eigenValues, fem.elements, fem.surface = np.zeros(10), [], []
    face = mesh.group_points("right")
    mbs = (SC := exu.SystemContainer()).AddSystem()
    interface = ObjectFFRFreducedOrderInterface(fem)
    place, C, velocity, rate = np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3)
    before = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.CreateGround(), localPosition=[0, 0, 0]))
    for k in range(LINKS):
        axis, speed = hinge(k)
        rate = rate + C @ axis * speed
        C = C @ dcm_from_vector(ANGLE * axis)
        body = interface.AddObjectFFRFreducedOrder(
            mbs, positionRef=place, rotationMatrixRef=C, initialVelocity=velocity, initialAngularVelocity=rate
        )
        root = mbs.AddMarker(MarkerNodeRigid(nodeNumber=body["nRigidBody"]))
        held = [1, 1, 1, *(1 - axis).astype(int)]
        mbs.AddObject(
            GenericJoint(
                markerNumbers=[before, root], constrainedAxes=held, rotationMarker0=np.eye(3), rotationMarker1=np.eye(3)
            )
        )
        before = mbs.AddMarker(
            MarkerSuperElementRigid(
                bodyNumber=body["oFFRFreducedOrder"],
                meshNodeNumbers=face,
                weightingFactors=[1 / len(face)] * len(face),
            )
        )
        arm = C @ [LENGTH, 0, 0]
        place, velocity = place + arm, velocity + np.cross(rate, arm)
    wanted = exu.OutputVariableType.Position
    sensor = mbs.AddSensor(SensorMarker(markerNumber=before, storeInternal=True, outputVariableType=wanted))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(DURATION / step)
    settings.timeIntegration.endTime = DURATION
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = tolerance
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = DURATION
    settings.parallel.numberOfThreads = 1
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    begin = time.process_time()
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)
    spent = time.process_time() - begin
    tip = mbs.GetSensorStoredData(sensor)[-1, 1:]
    del SC
    return spent, tip
