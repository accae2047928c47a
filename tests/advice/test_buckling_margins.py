"""How near what a meshed structure bears comes to buckling it, against closed forms."""

import numpy as np
import pytest

from femflex.advice.buckling.applied_load import AppliedLoad
from femflex.advice.buckling.buckling_analysis import BucklingAnalysis
from femflex.advice.buckling.flutter import first_flutter
from femflex.advice.buckling.structure import StructureBuckling
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line, rectangle
from femflex.reduction import cantilever_modes

L, EI, LINE = 3.0, 1.4e4, 1.2
ALL = ("x", "y", "z", "rx", "ry", "rz")
FIXINGS = [
    ({"start": ALL}, np.pi**2 / 4),
    ({"start": ("x", "y", "z", "rx"), "end": ("y", "z")}, np.pi**2),
    ({"start": ALL, "end": ("y", "z")}, 20.1907),  # tan x = x, x = 4.4934
    ({"start": ALL, "end": ("y", "z", "rx", "ry", "rz")}, 4 * np.pi**2),
]


def column(clamp, elements=8):
    section = StiffnessSection(2.8e8, EI, 2 * EI, 1.2e3, LINE, ry=0.005, rz=0.005)
    structure = build_structure(
        line([[0, 0, 0], [L, 0, 0]], elements), [Member("line", "beam", section, None, {"orientation": (0, 1, 0)})]
    )
    return BucklingAnalysis(StructureBuckling(structure, cantilever_modes(structure, clamp, 6), {"tip": "end"}))


def push(force=(0, 0, 0), torque=(0, 0, 0), name="push", **more):
    values = np.atleast_2d(np.hstack([np.atleast_2d(force), np.broadcast_to(torque, np.atleast_2d(force).shape)]))
    return AppliedLoad(name, "tip", values.astype(float), values.astype(float), **more)


def field(b=(0, 0, 0), W=None):
    values = np.concatenate([b, np.zeros(9) if W is None else np.transpose(W).ravel()])[None]
    return AppliedLoad("inertia", None, values, np.zeros((1, 6)))


@pytest.mark.parametrize(("clamp", "coefficient"), FIXINGS)
def test_columns_of_all_four_end_fixings_buckle_at_eulers_loads(clamp, coefficient):
    bearing, load = column(clamp), coefficient * EI / L**2
    assert bearing.nearest([push((-0.5 * load, 0, 0))]).part == pytest.approx(0.5, rel=2e-3)
    assert bearing.nearest([push((0.5 * load, 0, 0))]).part == 0.0


def test_a_column_held_at_its_tip_by_a_loop_buckles_as_one_with_both_ends_held():
    bearing, load = column({"start": ALL}), EI / L**2
    for held, coefficient in ((3, 20.1907), (6, 4 * np.pi**2)):
        assert bearing.nearest([push((-load, 0, 0), held=held)]).part == pytest.approx(1 / coefficient, rel=3e-3)


@pytest.mark.slow
def test_fields_of_acceleration_press_a_column_as_greenhill_and_spin_do():
    """q L^3 = 7.837 EI (Greenhill, 1881). A field that grows along it, q = c x, by power series of its own equation

    EI theta'' + c (L^2 - x^2) / 2 theta = 0, theta(0) = theta'(L) = 0.
    """
    bearing = column({"start": ALL})
    assert bearing.nearest([field((0.5 * 7.837 * EI / L**3 / LINE, 0, 0))]).part == pytest.approx(0.5, rel=2e-3)
    W = np.zeros((3, 3))
    W[0, 0] = EI / L**4 / LINE
    assert bearing.nearest([field(W=W)]).part == pytest.approx(1 / _growing_load(), rel=2e-3)
    assert bearing.nearest([field(W=-W)]).part == 0.0


def _growing_load():
    """Least k of theta'' + k (1 - s^2) / 2 theta = 0, theta(0) = theta'(1) = 0, by finite differences."""
    n = 2000
    s = (np.arange(n) + 1) / n
    A = (np.diag(np.full(n, 2.0)) - np.eye(n, k=1) - np.eye(n, k=-1)) * n**2
    A[-1, -1] = n**2  # half a cell at the free end
    weight = (1 - s**2) / 2
    weight[-1] /= 2
    return 1 / np.linalg.eigvals(np.linalg.solve(A, np.diag(weight))).real.max()


def test_loads_add_up_and_each_is_given_its_share():
    bearing, euler = column({"start": ALL}), np.pi**2 / 4 * EI / L**2
    found = bearing.nearest([push((-0.5 * euler, 0, 0)), push((-0.2 * euler, 0, 0)), push((0.1 * euler, 0, 0))])
    assert found.part == pytest.approx(0.6, rel=2e-3)
    assert found.shares == pytest.approx((0.5, 0.2, -0.1), rel=2e-3)


def test_of_many_instants_the_worst_is_found():
    """Two loads that swing apart: what presses is their sum, and it is largest where neither is."""
    bearing, euler = column({"start": ALL}), np.pi**2 / 4 * EI / L**2
    t = np.linspace(0, 2 * np.pi, 721)
    x, zero = np.eye(3)[0], np.zeros(3)
    loads = [
        push(-0.4 * euler * np.outer(np.cos(t), x), zero, "a"),
        push(-0.4 * euler * np.outer(np.sin(t), x), zero, "b"),
        push(np.outer(0.02 * euler * np.cos(3 * t), np.eye(3)[1]), zero, "c"),
    ]
    found = bearing.nearest(loads)
    assert found.part == pytest.approx(0.4 * np.sqrt(2), rel=3e-3)
    assert t[found.row] == pytest.approx(np.pi / 4, abs=0.03)


def test_a_load_that_follows_the_tip_makes_the_column_flutter_at_becks_load_and_never_buckles_it():
    bearing, beck = column({"start": ALL}, 12), 20.051 * EI / L**2
    found = bearing.nearest([push((-0.5 * beck, 0, 0), follows=True)])
    assert found.flutters and found.part == pytest.approx(0.5, rel=5e-3)
    assert bearing.nearest([push((-0.05 * beck, 0, 0), follows=True)]).part == 0.0  # beyond what is looked for
    assert bearing.nearest([push((0.5 * beck, 0, 0), follows=True)]).part == 0.0


def test_flutter_is_found_where_two_modes_of_a_double_pendulum_meet():
    """K = [[2, -1], [-1, 1]], M = [[3, 1], [1, 1]] and the following load's work [[-1, 1], [0, 0]]: Ziegler's column of
    two bars, masses 2 and 1, flutters at 7/2 - sqrt(2) (Ziegler, 1952)."""
    K, M = np.array([[2.0, -1], [-1, 1]]), np.array([[3.0, 1], [1, 1]])
    G = np.array([[-1.0, 1], [0, 0]])
    assert first_flutter(K, G, M) == pytest.approx(3.5 - np.sqrt(2), rel=1e-5)


@pytest.mark.parametrize("height", [0.3, 1.0])
def test_a_load_high_above_the_tip_tips_the_column_over_before(height):
    """A stiff mast of that height times L above the tip: k h tan(k L) = 1, of w = d (1 - cos k x)."""
    x = np.linspace(1e-3, np.pi / 2 - 1e-6, 2_000_001)
    root = x[np.argmin(np.abs(x * height * np.tan(x) - 1))]
    arm = np.array([[height * L, 0.0, 0.0]])
    found = column({"start": ALL}).nearest([push((-0.5 * root**2 * EI / L**2, 0, 0), arm=arm)])
    assert found.part == pytest.approx(0.5, rel=2e-3)


def test_a_square_plate_pressed_in_its_plane_buckles_at_four_pi_squared():
    """N = 4 pi^2 D / b^2, all edges supported: pressed by a field, uniform stress being that of its edge's nodes."""
    metal, h, n = Material(7e10, 0.3, 2700.0), 0.002, 12
    structure = build_structure(rectangle(1.0, 1.0, n, n, "quad"), [Member("surface", "plate_bfs", h, metal)])
    edges = {name: ("z",) for name in ("right", "bottom", "top")} | {"left": ("x", "z"), "bottom_left": ("x", "y", "z")}
    bearing = BucklingAnalysis(StructureBuckling(structure, cantilever_modes(structure, edges, 6), {"tip": "right"}))
    D = 7e10 * h**3 / 12 / (1 - 0.3**2)
    found = bearing.nearest([push((-0.5 * 4 * np.pi**2 * D, 0, 0))])
    assert found.part == pytest.approx(0.5, rel=0.02)  # nodes at the corners carry twice their part of the edge


def test_a_following_load_that_softens_gives_way_where_the_stiffness_is_used_up():
    """Real squares of frequencies, 4 - 1.5 lambda over 2 and 9 - lambda over 3: the first passes zero at 8 / 3."""
    K, G, M = np.diag([4.0, 9.0]), np.diag([-1.5, -1.0]), np.diag([2.0, 3.0])
    assert first_flutter(K, G, M) == pytest.approx(8 / 3, rel=1e-5)
    assert first_flutter(K, -G, M) == np.inf
