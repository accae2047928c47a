"""Benchmark case a in two programs: a tumbling hub with two panels of 27-node hexahedra, ten clamped modes each.

`femflex_model` is the hub and two reduced bodies; `exudyn_model` the same matrices and modes as one floating body with
the hub as eight point masses, the setting in which Exudyn was found fastest (RK44, rotation vector node).
"""

from __future__ import annotations

import time
from functools import cache

import numpy as np
from scipy import sparse

from femflex.body import FlexibleBody, Marker, rigid_body
from femflex.dynamics import Model, compile_system
from femflex.fem import Material, Member, build_structure
from femflex.mesh import box
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.system import System, free, weld

LENGTH, WIDTH, THICKNESS = 6.0, 1.5, 0.03  # m
HUB_MASS, HUB_INERTIA, OFFSET = 200.0, np.diag([120.0, 100.0, 140.0]), 0.5  # kg, kg m^2, m
RATE = np.array([0.10, 0.45, 0.30])  # rad/s
AMPLITUDES = (0.4, -0.3)  # kg^1/2 m, first mode of each panel
DURATION = 20.0  # s
TIP_AT_END = np.array([-1.36144573, -3.77749162, 5.16672077])  # m, an independent RK4 program at h = 1e-4 s
HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # the second panel points the other way


@cache
def panel_structure():
    """Structure and modes of one panel, root at x = 0."""
    mesh = box(LENGTH, WIDTH, THICKNESS, 16, 4, 1, cell="hexahedron27").translated([0, -WIDTH / 2, -THICKNESS / 2])
    structure = build_structure(mesh, [Member("volume", "solid", None, Material(2e9, 0.3, 100.0))])
    return mesh, structure, cantilever_modes(structure, ["left"], 10)


@cache
def panel() -> FlexibleBody:
    """One reduced panel with a marker at its corner."""
    mesh, structure, modes = panel_structure()
    corner = mesh.nearest_point([LENGTH, WIDTH / 2, THICKNESS / 2])
    body = reduce_structure(structure, modes, {})
    rows = structure.translation.tocsr()[3 * corner : 3 * corner + 3] @ modes.phi
    body.markers["corner"] = Marker(mesh.points[corner], np.asarray(rows), np.zeros((3, 10)))
    return body


def femflex_model() -> Model:
    """The compiled system with its initial state."""
    ends = {"east": Marker.at_position([OFFSET, 0, 0]), "west": Marker.at_position([-OFFSET, 0, 0], HALF_TURN)}
    bodies = {"hub": rigid_body(HUB_MASS, HUB_INERTIA, markers=ends), "east": panel(), "west": panel()}
    joints = (
        free("hub", u0=np.r_[0, 0, 0, RATE]),
        weld("east", "hub", parent_marker="east"),
        weld("west", "hub", parent_marker="west"),
    )
    start = {name: np.r_[a, np.zeros(9)] for name, a in zip(("east", "west"), AMPLITUDES, strict=True)}
    return compile_system(System(bodies, joints, delta0=start))


def exudyn_run(step: float) -> tuple[float, np.ndarray]:
    """CPU seconds and tip position of Exudyn's classical Runge-Kutta method of order 4 at that step [s]."""
    import exudyn as exu
    from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
    from exudyn.utilities import SensorSuperElement

    mesh, structure, modes = panel_structure()
    X, M, K, P = nodal_matrices(mesh, structure, modes)
    east = X + np.array([OFFSET, 0, 0])
    west = east @ HALF_TURN
    turn = sparse.kron(sparse.eye(len(X)), HALF_TURN).tocsr()
    second = np.trace(HUB_INERTIA) / 2 - np.diag(HUB_INERTIA)  # int x^2, y^2, z^2 dm
    arm = np.sqrt(second / HUB_MASS)
    hub = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * arm
    zero = sparse.csr_matrix((24, 24))
    fem = FEMinterface()
    fem.nodes = {"Position": np.vstack([east, west, hub])}
    fem.massMatrix = sparse.block_diag([M, M, sparse.eye(24) * HUB_MASS / 8]).tocsr()
    fem.stiffnessMatrix = sparse.block_diag([K, turn @ K @ turn.T, zero]).tocsr()
    shapes = np.zeros((fem.massMatrix.shape[0], 20))
    shapes[: P.shape[0], :10], shapes[P.shape[0] : 2 * P.shape[0], 10:] = P, turn @ P
    fem.modeBasis = {"matrix": shapes, "type": "NormalModes"}
    fem.eigenValues, fem.elements, fem.surface = np.zeros(20), [], []
    mbs = (SC := exu.SystemContainer()).AddSystem()
    interface = ObjectFFRFreducedOrderInterface(fem, rigidBodyNodeType="NodeType.RotationRotationVector")
    body = interface.AddObjectFFRFreducedOrder(
        mbs, positionRef=[0, 0, 0], rotationMatrixRef=np.eye(3), initialVelocity=[0, 0, 0], initialAngularVelocity=RATE
    )
    start = np.zeros(20)
    start[0], start[10] = AMPLITUDES
    mbs.SetNodeParameter(body["nGenericODE2"], "initialCoordinates", list(start))
    corner = mesh.nearest_point([LENGTH, WIDTH / 2, THICKNESS / 2])
    sensor = mbs.AddSensor(
        SensorSuperElement(
            bodyNumber=body["oFFRFreducedOrder"], meshNodeNumber=corner, storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )  # fmt: skip
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(DURATION / step)
    settings.timeIntegration.endTime = DURATION
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = DURATION
    settings.parallel.numberOfThreads = 1
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    begin = time.process_time()
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)
    spent = time.process_time() - begin
    tip = mbs.GetSensorStoredData(sensor)[-1, 1:]
    del SC
    return spent, tip


def nodal_matrices(mesh, structure, modes):
    """Points, M, K and modes with three consecutive dofs per node, as Exudyn wants them."""
    order = structure.translation.tocsr()  # (3 n_points, n_dof), one 1 a row
    M, K = order @ structure.M @ order.T, order @ structure.K @ order.T
    return mesh.points, sparse.csr_matrix(M), sparse.csr_matrix(K), np.asarray(order @ modes.phi)
