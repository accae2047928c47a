"""Deploying members at one instant: their body there, modes, equilibria and what is said of lengths that move."""

import numpy as np
import pytest
from support.members import wall_beam

from femflex.deployment import DeployingLine, deploying_line
from femflex.dynamics import compile_system
from femflex.linear.system_modes import system_modes
from femflex.reduction import BeamFunctions
from femflex.system import Profile, System, weld
from femflex.system.fixed_length import with_fixed_lengths

CLAMPED = 1.8751040687119611  # root of cos x cosh x = -1


def test_body_at_fixed_length_matches_body_built_at_length():
    """Moments, stiffness, markers and skin from the table, against the series of the member."""
    length = Profile.smooth_step(0.0, 2.0, 1.0, 2.3)
    line = DeployingLine(mass_per_length=1.3, EIy=2.0, EIz=3.0, EA=50.0, GJ=1.0, ry=0.02, rz=0.03, root=(0.1, 0.2, 0.3))
    made = deploying_line(line, BeamFunctions(y=2, z=1, axial=1, torsion=1), length, until=2.0, stock=3.0)
    system = System({"boom": made.body}, (weld("boom"),), varying={"boom": made.variation})
    found, L = with_fixed_lengths(system, 1.3), float(length(1.3)[0])
    exact, body = made.parts.body(L), found.bodies["boom"]
    assert 1.3 < L < 2.3
    for key in ("mass", "first", "second"):
        assert getattr(body.moments, key) == pytest.approx(getattr(exact.moments, key), rel=1e-12, abs=1e-13)
    assert body.strain.V1 == pytest.approx(exact.strain.V1, rel=1e-12)
    assert body.strain.V3 == pytest.approx(exact.strain.V3, rel=1e-12) and body.strain.V3.any()
    assert body.omega[:2] == pytest.approx(exact.omega[:2], rel=1e-12)
    for name, marker in exact.markers.items():
        assert body.markers[name].position == pytest.approx(marker.position, abs=1e-14)
        assert body.markers[name].phi == pytest.approx(marker.phi, abs=1e-13)
        assert body.markers[name].psi == pytest.approx(marker.psi, abs=1e-13)
    assert body.skin.points[:, 0].max() == pytest.approx(0.1 + L, abs=1e-12)
    seen = compile_system(found).observe(np.array([7.0]), compile_system(found).x0[None])
    assert seen["bodies/boom/length"][0] == pytest.approx(L)
    assert seen["bodies/boom/length_rate"][0] == 0.0


@pytest.mark.parametrize("field", ["y", "torsion", "axial"])
def test_damping_ratio_is_constant_with_length(field):
    """D = 2 ratio sqrt(V1 Me) on the diagonal: bending slows by the square of the length, torsion by the length."""
    length = Profile.smooth_step(0.0, 2.0, 1.0, 2.6)
    line = DeployingLine(mass_per_length=1.3, EIy=2.0, EIz=3.0, EA=50.0, GJ=1.0, ry=0.02, rz=0.03)
    made = deploying_line(line, BeamFunctions(**{field: 2}), length, until=2.0, stock=3.0, damping=[0.01, 0.03])
    system = System({"boom": made.body}, (weld("boom"),), varying={"boom": made.variation})
    for t in (0.0, 1.0, 1.4, 2.0):
        body = with_fixed_lengths(system, t).bodies["boom"]
        critical = 2.0 * np.sqrt(np.diag(body.strain.V1) * np.diag(body.moments.elastic_mass())[:2])
        assert np.diag(body.damping) / critical == pytest.approx([0.01, 0.03], rel=1e-10)


def test_modes_at_a_time_are_those_of_the_length_then():
    """f = (1.8751 / L)^2 / (2 pi) of a unit cantilever; without a time its first length stays."""
    system = wall_beam(Profile.smooth_step(0.0, 2.0, 1.0, 2.0), 6)
    for at, L in ((None, 1.0), (0.0, 1.0), (1.0, 1.5), (9.0, 2.0)):
        found = system_modes(system, at)
        assert found.frequencies[0] == pytest.approx((CLAMPED / L) ** 2 / (2 * np.pi), rel=1e-6)
    assert system_modes(system).left_out == ("length of 'beam'",)
