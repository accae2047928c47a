"""Ways of loads on a truss of three bars, against the energy of its bars written out: snaps, stops and steps."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Circle
from femflex.mesh import Mesh
from femflex.reduction import cantilever_modes, with_responses
from femflex.reduction.large_deflection.load_path import trace_load_path

METAL, RISE, DEFLECTION = Material(70e9, 0.3, 2700.0), 0.2, 0.8
POINTS = np.array([[-1.0, 0, 0], [0, 0, RISE], [1.2, 0, 0], [0, 0, RISE + 4.0]])
BARS = ((0, 1, 1.0), (1, 2, 1.0), (1, 3, 0.1))  # two legs, and a soft bar that pushes on the crown; parts of the area
AREA = np.pi * 1e-4


@pytest.fixture(scope="module")
def truss():
    cells, legs = np.array([bar[:2] for bar in BARS]), {"line": np.arange(2)}
    groups = {name: np.array([k]) for k, name in enumerate(("a", "crown", "b", "top"))}
    mesh = Mesh(POINTS, {"line": cells}, {"legs": legs, "spring": {"line": np.array([2])}}, groups)
    sections = (Circle(0.01), Circle(0.01 * np.sqrt(0.1)))
    members = [Member(name, "rod", section, METAL) for name, section in zip(("legs", "spring"), sections, strict=True)]
    structure = build_structure(mesh, members)
    clamp = {"a": ("x", "y", "z"), "b": ("x", "y", "z"), "crown": ("y",), "top": ("x", "y")}
    return structure, cantilever_modes(structure, clamp, 1), -structure.translation[[11]].toarray()[0]


@pytest.fixture(scope="module")
def walked(truss):
    structure, modes, load = truss
    return trace_load_path(structure, modes, load, 0 * load, DEFLECTION)


def energy(u):
    """Of node displacements u (4, 3): EA L / 2 times the square of Green's strain of each bar."""
    total = 0.0
    for i, j, part in BARS:
        L2, new = np.sum((POINTS[j] - POINTS[i]) ** 2), POINTS[j] + u[j] - POINTS[i] - u[i]
        total += METAL.E * AREA * part * np.sqrt(L2) / 2 * ((new @ new / L2 - 1) / 2) ** 2
    return total


def of_free(q):
    """Displacements of crown x, crown z and top z."""
    u = np.zeros((4, 3))
    u[1, 0], u[1, 2], u[3, 2] = q
    return u


def slopes(q, h=1e-5):
    e = h * np.eye(3)
    g = np.array([energy(of_free(q + d)) - energy(of_free(q - d)) for d in e]) / (2 * h)
    corners = [(i, j) for i in (1, -1) for j in (1, -1)]
    H = [[sum(i * j * energy(of_free(q + i * a + j * b)) for i, j in corners) for a in e] for b in e]
    H = np.array(H) / (4 * h * h)
    return g, H


def test_a_truss_snaps_through_and_back_by_way_of_states_that_stand(truss, walked):
    structure, path, deflection = truss[0], walked, DEFLECTION
    assert path.snapped and not path.saddle
    u = [(structure.translation @ x).reshape(-1, 3) for x in path.states]
    q = np.array([[one[1, 0], one[1, 2], one[3, 2]] for one in u])
    work = -q[:, 2]
    turn = int(np.argmax(work))
    # up in twelfths of what a linear truss takes, until the top has moved so far; then down to nothing
    size = np.array([np.linalg.norm(one, axis=1).max() for one in u])
    assert deflection * (1 - 1e-6) < size[turn] < deflection * 1.09
    parts = np.diff(np.unique(work.round(9)))
    np.testing.assert_allclose(parts, deflection / 12, rtol=1e-6)
    assert work[-1] <= 1e-12 and np.all(np.diff(work[: turn + 1]) > -1e-9) and np.all(np.diff(work[turn:]) < 1e-9)
    stiff, scale, jumps = slopes(np.zeros(3))[1], METAL.E * AREA * RISE**3, 0
    linear = np.linalg.solve(stiff, [0, 0, -1.0])
    linear *= deflection / np.abs(linear).max()
    step = np.sqrt(linear @ stiff @ linear) / 12
    apart = np.diff(np.concatenate([np.zeros((1, 3)), q]), axis=0)
    assert np.sqrt(np.einsum("ki,ij,kj->k", apart, stiff, apart)).max() < 2.0 * step * (1 + 1e-6) + 0.4 * step
    for k, state in enumerate(q):
        last = k + 1 == len(q) or abs(work[k + 1] - work[k]) > 1e-9
        if last:  # at rest under the load alone, and stable with its work held
            g, H = slopes(state)
            assert np.abs(g[:2]).max() < 1e-5 * scale
            assert np.linalg.eigvalsh(H[:2, :2])[0] > 0
        else:  # let go, it falls
            assert energy(of_free(q[k + 1])) < energy(of_free(state))
            jumps += 1
        assert path.held.energy(path.states[k][path.held.free]) == pytest.approx(energy(of_free(state)), rel=1e-9)
    assert jumps >= 4
    assert q[turn, 1] < -1.5 * RISE and abs(q[-1, 1]) < 0.2 * RISE  # through, and back


def test_a_walk_ends_with_the_first_state_that_stores_enough(truss, walked):
    structure, modes, load = truss
    stored = [walked.held.energy(x[walked.held.free]) for x in walked.states[:4]]
    assert np.all(np.diff(stored) > 0)
    short = trace_load_path(structure, modes, load, 0 * load, DEFLECTION, (stored[1] + stored[2]) / 2)
    assert len(short.states) == 3 and short.stored() == pytest.approx(stored[2], rel=1e-9)


def test_responses_hold_the_states_of_their_load_and_the_note_says_how_many(truss):
    structure, modes, _ = truss
    found = with_responses(structure, modes, 2, 0.1, loads={"top": ["z"]})
    n = found.n_modes - 1
    assert found.kinds == ("vibration", *["response"] * n)
    np.testing.assert_allclose(found.phi.T @ (structure.M @ found.phi), np.eye(n + 1), atol=1e-9)
    states = []
    for sense in (1.0, -1.0):
        load = sense * structure.translation[[11]].toarray()[0]
        states += trace_load_path(structure, modes, load, 0 * load, 0.1).states
    x = np.array(states).T
    left = x - found.phi @ (found.phi.T @ (structure.M @ x))
    share = np.einsum("in,in->n", left, structure.K @ left) / np.einsum("in,in->n", x, structure.K @ x)
    assert share.max() < 1e-3
    reach = np.linalg.norm((structure.translation @ x).reshape(4, 3, -1), axis=1).max()
    count = int(found.note.split(" states")[0].split()[-1])
    assert abs(count - len(states)) <= 2  # the stiffer way ends at the energy of the softer
    assert found.note.startswith(f"{n} response shapes of ")
    assert float(found.note.split("up to ")[1].split(" m")[0]) == pytest.approx(reach, rel=0.1)
