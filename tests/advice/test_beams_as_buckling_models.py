"""One cantilever as a buckling model of elements and of functions: every answer that buckling asks, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.advice.buckling.beam import BeamBuckling
from femflex.advice.buckling.structure import StructureBuckling
from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh.generators import line
from femflex.reduction import cantilever_modes
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam

L, M, EIY, EIZ, GJ, X0 = 2.0, 0.7, 90.0, 40.0, 25.0, 0.3  # m, kg/m, N m^2; the root is at x = X0
FIRST = 1.87510406871196**4 / (M * L**4)  # squared first frequency, over EI


def of_elements() -> StructureBuckling:
    section = StiffnessSection(EA=1e6, EIy=EIY, EIz=EIZ, GJ=GJ, mass_per_length=M, ry=1e-3, rz=1e-3)
    member = Member("line", "beam", section, options={"orientation": (0, 1, 0)})
    structure = build_structure(line([[X0, 0, 0], [X0 + L, 0, 0]], 8), [member])
    return StructureBuckling(structure, cantilever_modes(structure, "start", 4), {"head": "end", "foot": "start"})


def of_functions() -> BeamBuckling:
    beam = UniformBeam(L, 1e6, EIY, EIZ, GJ, M, 1e-3, 1e-3, root=(X0, 0, 0), orientation=(0, 1, 0))
    return BeamBuckling(beam, BeamFunctions(2, 2, 1, 1), {"head": "tip", "foot": "root"})


@pytest.fixture(scope="module", params=[of_elements, of_functions])
def model(request):
    return request.param()


def test_a_buckling_model_knows_its_size_its_markers_and_its_slowest_shape(model):
    assert model.scale == pytest.approx((M * L, L))
    assert model.knows("head") and model.knows("foot") and model.knows(None) and not model.knows("end")
    assert model.slowest == pytest.approx(FIRST * EIZ, rel=1e-3)
    phi, K, mass = model.flutter_basis
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, K)).real)
    assert squares[:2] == pytest.approx([FIRST * EIZ, FIRST * EIY], rel=1e-3)
    assert phi.shape[0] == model.size and phi.shape[1] == len(K)
    K = model.K.toarray() if hasattr(model.K, "toarray") else model.K
    assert np.einsum("ij,ik,kj->j", model.basis, K, model.basis) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("way", "moved"),
    [(1, L**3 / (3 * EIZ)), (2, L**3 / (3 * EIY)), (4, L**2 / (2 * EIY)), (5, L**2 / (2 * EIZ))],
)
def test_forces_and_moments_at_a_marker_bend_it_as_the_textbook_says(model, way, moved):
    load = model.loads("head")
    assert load.shape[1] == 6
    assert model.moved(-3.0 * load[:, way]) == pytest.approx(3.0 * moved, rel=1e-4)
    assert model.moved(model.loads("foot")[:, way]) == pytest.approx(0.0, abs=1e-9 * moved)


def test_fields_of_acceleration_load_every_mass_by_its_place(model):
    """b along each axis, then W_ij x_j along i, by columns of W: m L^4 / 8 EI, and 11 m L^5 / 120 EI of x itself."""
    fields = model.loads(None)
    assert fields.shape[1] == 12
    EI = {1: EIZ, 2: EIY}
    for i in (1, 2):
        assert model.moved(2.0 * fields[:, i]) == pytest.approx(2.0 * M * L**4 / (8 * EI[i]), rel=1e-4)
        ramp = M * (X0 * L**4 / 8 + 11 * L**5 / 120) / EI[i]
        assert model.moved(fields[:, 3 + i]) == pytest.approx(ramp, rel=2e-3)  # j = 0
        for j in (1, 2):  # of a line on the x axis
            assert model.moved(fields[:, 3 + 3 * j + i]) < 2e-3 * ramp
    push = model.loads("head")[:, 2]
    assert model.moved(fields[:, 2] + M * L * 3 / 8 * push) < M * L**4 / (8 * EIY) / 3  # inertia is against b


def lowest(model, load, held=None) -> float:
    """Part of the buckling load, negative of compression."""
    found, x = model.lowest(model.stress(load), held)
    K = model.K.toarray() if hasattr(model.K, "toarray") else model.K
    sigma = model.stress(load)
    if held is None:
        assert x @ (K @ x) == pytest.approx(1.0, rel=1e-6) and x @ (sigma @ x) == pytest.approx(found, rel=1e-4)
    return found


def test_a_column_buckles_at_the_loads_of_euler_with_its_head_free_and_held(model):
    push = model.loads("head")
    P = 5.0
    euler = np.pi**2 * EIZ / (4 * L**2)
    if isinstance(model, BeamBuckling):
        assert push.shape[0] > model.size  # loads act on what follows
    assert lowest(model, -P * push[:, 0]) == pytest.approx(-P / euler, rel=2e-3)
    held = model.at("head", np.diag([0.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    assert lowest(model, -P * push[:, 0], held) == pytest.approx(-P * L**2 / (20.1907 * EIZ), rel=5e-3)
    sigma = model.stress_in_basis(-P * push[:, :1])[0]
    assert np.allclose(sigma, model.basis.T @ (model.stress(-P * push[:, 0]) @ model.basis), atol=1e-9)


def test_what_is_kept_is_the_reduced_body(model):
    kept = model.kept
    assert kept.knows("head") and not kept.knows("end")
    squares = np.linalg.eigvalsh(kept.K)
    load = kept.loads("head")
    if isinstance(model, StructureBuckling):
        assert np.diag(kept.K) == pytest.approx(model.modes.omega**2) and len(kept.K) == 4
        assert squares[:2] == pytest.approx([FIRST * EIZ, FIRST * EIY], rel=1e-3)
        tip = model.structure.translation.toarray()[-3:] @ model.modes.phi
        assert load[:, :3] == pytest.approx(tip.T, abs=1e-9)
        A = np.diag([0.0, 2.0, 3.0, 0.0, 0.0, 0.0])
        assert kept.at("head", A) == pytest.approx(tip.T @ A[:3, :3] @ tip, abs=1e-9)
    else:
        assert kept.own and not model.own and kept.size == 5 and model.size == 18  # two, two, one; six of each
    # two of a cantilever's modes in each plane do 99.52 % of the static work of a force at its tip
    static = load[: len(kept.K), 1] @ np.linalg.solve(kept.K, load[: len(kept.K), 1])
    assert static == pytest.approx(0.9952 * L**3 / (3 * EIZ), rel=1e-3)
