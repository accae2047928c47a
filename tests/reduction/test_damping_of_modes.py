"""A damping ratio is that of the body's vibration modes at rest, whatever shapes stand beside them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh.generators import line
from femflex.reduction import (
    Damping,
    cantilever_modes,
    craig_bampton,
    free_free_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
)

ZETA = 0.005
SIX = ("x", "y", "z", "rx", "ry", "rz")


def boom(EI=1.0, lag=1.9):
    section = StiffnessSection(EA=1e6, EIy=EI, EIz=lag * EI, GJ=EI, mass_per_length=1.0, ry=1e-3, rz=1e-3)
    return build_structure(line([[0, 0, 0], [1, 0, 0]], 6), [Member("line", "beam", section, options={"order": 4})])


def ratios_of_set(body, count):
    """Damping ratios of the first modes of a body at rest, and what damping couples them by."""
    D = body.damping[:count, :count]
    omega = np.sqrt(np.diag(body.strain.V1)[:count])
    return np.diag(D) / (2 * omega), D - np.diag(np.diag(D))


@pytest.mark.parametrize(
    ("make", "directions"),
    [
        (lambda s: cantilever_modes(s, "start", 4), SIX),
        (lambda s: free_free_modes(s, 4), ()),
        (lambda s: craig_bampton(s, ["end"], 2, clamp="start"), ("y", "z", "rz")),
    ],
    ids=["cantilever", "free-free", "craig-bampton"],
)
@pytest.mark.parametrize("ratio", [ZETA, "each"])
def test_added_shapes_do_not_change_the_damping_of_the_modes(make, directions, ratio):
    structure = boom()
    modes = make(structure)
    n = modes.n_modes
    given = np.linspace(0.01, 0.02, n) if ratio == "each" else np.full(n, ratio)
    damping = Damping(given if ratio == "each" else ratio)
    more = with_attachment(structure, modes, directions, {"end": ("y", "z", "ry", "rz")})
    assert more.n_modes > n
    body = reduce_structure(structure, more, damping=damping)
    found, between = ratios_of_set(body, n)
    np.testing.assert_allclose(found, given, rtol=1e-6)
    assert np.abs(between).max() < 1e-6 * np.abs(body.damping).max()
    np.testing.assert_allclose(
        body.damping[:n, :n], reduce_structure(structure, modes, damping=damping).damping, atol=1e-6
    )
    # what stands beside them comes to rest as fast as the first mode, and no faster; stretch and twist, of which there
    # are no modes, have the ratio at their own frequency
    alone = [kind == "unanswered attachment" for kind in more.kinds[n:]]
    assert sum(alone) == (2 if "rx" in directions and not modes.omega[:n].max() > 1e3 else 0)
    first = np.where(alone, 2 * given[0] * more.omega[n:], 2 * given[0] * modes.omega[0])
    np.testing.assert_allclose(body.damping[n:, n:], np.diag(first), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("strain", ["linear", "condensed", "nonlinear"])
def test_damping_of_twist_by_tip_body_matches_many_modes(strain):
    """J of the tip turns a boom with two bending modes: ratio and frequency are those of a set of 40 modes.

    Closed form of a light boom, w = sqrt(GJ / J L): the ratio is zeta w / w_r, w_r = sqrt(3 GJ / I_p L^2).
    """
    structure, J = boom(), 0.3
    found = []
    for n, form in ((2, strain), (40, "linear")):
        modes = with_attachment(structure, cantilever_modes(structure, "start", n), (), {"end": ("y", "z", "rx")})
        if form != "linear":
            modes = with_derivatives(structure, modes)
        body = reduce_structure(structure, modes, {"tip": "end"}, Damping(ZETA), form).without_slaves()
        turn = body.markers["tip"].psi[0]
        M = body.moments.elastic_mass() + J * np.outer(turn, turn)
        squares, X = eigh(body.strain.V1, M)
        k = int(np.argmax((turn @ X) ** 2))
        omega = np.sqrt(squares[k])
        found.append((omega, X[:, k] @ body.damping @ X[:, k] / (2 * omega)))
    (few, ratio), (many, limit) = found
    assert few == pytest.approx(many, rel=1e-4)
    assert ratio == pytest.approx(limit, rel=0.1)
    own = np.sqrt(3 * 1.0 / (2e-6))  # ry^2 + rz^2 = 2e-6 m^2, with 1 kg/m
    assert few == pytest.approx(np.sqrt(1.0 / J), rel=1e-3) and ratio == pytest.approx(ZETA * few / own, rel=1e-3)


def test_rayleigh_damping_is_that_of_all_shapes():
    structure = boom()
    more = with_attachment(structure, cantilever_modes(structure, "start", 2), ("y", "z"))
    body = reduce_structure(structure, more, damping=Damping(mass=0.1, stiffness=1e-3))
    np.testing.assert_allclose(body.damping, 0.1 * np.eye(4) + 1e-3 * body.strain.V1, atol=1e-6)
