"""The strain field of a body against its strain tensors, and in states of constant strain."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from support.nonlinear_models import bent_beam, bfs, folded_plate, plate, solid, tapered_beam

from femflex.body import StrainTensors
from femflex.body.recovery import named
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Circle
from femflex.mesh import box, line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    load_body,
    reduce_structure,
    save_body,
)
from femflex.reduction.beams import strain_points
from femflex.reduction.beams.strain_points import strain_field
from femflex.reduction.large_deflection.derivatives import with_derivatives
from femflex.reduction.strain.tensors import strain_tensors

FAMILIES = {
    "beam": bent_beam,
    "tapered": tapered_beam,
    "plate": plate,
    "folded": folded_plate,
    "bfs": bfs,
    "solid": solid,
}


def energy(parts, y):
    return sum(float(part.energy(y)[0] @ part.weight) for part in parts)


def smooth_shapes(structure, n=3):
    """Answers to random loads, of largest displacement 1 m."""
    load = np.random.default_rng(4).standard_normal((structure.n_dof, n))
    K, M = structure.K.toarray(), structure.M.toarray()
    soft = K + 1e-3 * K.diagonal().max() / M.diagonal().max() * M
    phi = np.linalg.solve(soft, structure.M @ load)
    return phi / np.abs(structure.translation @ phi).max(axis=0)


@pytest.mark.parametrize("family", FAMILIES)
def test_energy_density_integrates_to_the_strain_energy(family):
    structure = FAMILIES[family]()
    phi, y = smooth_shapes(structure), np.array([0.03, -0.02, 0.05])
    tensors = strain_tensors(structure, phi)
    linear = StrainTensors.linear(tensors.V1)
    assert energy(strain_field(structure, phi, False), y) == pytest.approx(linear.energy(y), rel=1e-6)
    assert tensors.energy(y) > 1.5 * linear.energy(y)
    rel = 2e-4 if family == "bfs" else 1e-6  # its bending is seen where its stretch is sampled, at 2 x 2 points
    assert energy(strain_field(structure, phi, True), y) == pytest.approx(tensors.energy(y), rel=rel)


@pytest.mark.parametrize("family", ["beam", "plate", "bfs", "solid"])
def test_linear_energy_under_initial_stress_holds_its_stiffening(family):
    structure = FAMILIES[family](thermal_strain=1e-4)
    phi, y = smooth_shapes(structure), np.array([1e-3, -2e-3, 5e-4])
    tensors = StrainTensors(phi.T @ (structure.K @ phi), phi.T @ structure.f0)
    assert energy(strain_field(structure, phi, False), y) == pytest.approx(tensors.energy(y), rel=0.02)


@pytest.mark.parametrize("strain", ["linear", "nonlinear", "condensed"])
def test_energy_density_of_a_beam_on_functions(strain):
    beam = UniformBeam(10.0, 1e6, 40.0, 50.0, 20.0, 1.2, ry=0.01, rz=0.01)
    body = beam_body(beam, BeamFunctions(y=3, z=2, axial=8, torsion=2), strain=strain)
    delta = np.zeros(body.n_modes)
    delta[:4] = 0.5, 0.2, 0.3, 0.1
    assert energy(body.strain_field, body.amplitudes(delta)) == pytest.approx(body.strain.energy(delta), rel=1e-6)
    kept = body.truncated(4)
    assert energy(kept.strain_field, kept.amplitudes(delta[:4])) == pytest.approx(
        kept.strain.energy(delta[:4]), rel=1e-6
    )


@pytest.mark.parametrize("strain", ["linear", "nonlinear"])
def test_section_forces_of_a_beam_on_functions_are_those_of_its_stretch_bends_and_twist(strain):
    """One polynomial for each field: u and theta are linear in x, v and w quadratic, so that the tip tells them."""
    beam = UniformBeam(2.0, 7e5, 30.0, 50.0, 20.0, 1.2, 0.03, 0.04, root=(1, 2, 3), direction=(0, 1, 0))
    body = beam_body(beam, BeamFunctions(y=1, z=1, axial=1, torsion=1, family="polynomial"), strain=strain)
    (part,), tip = body.strain_field, body.markers["tip"]
    for delta in 1e-9 * np.eye(body.n_modes):
        u, v, w = beam.frame @ tip.phi @ body.amplitudes(delta)
        twist = beam.frame[0] @ tip.psi @ body.amplitudes(delta)
        wanted = {"axial_force": 7e5 * u / 2.0, "moment_z": 50.0 * v / 2.0, "moment_y": -30.0 * w / 2.0}
        for name, value in {**wanted, "torque": 20.0 * twist / 2.0}.items():
            assert named(part, name, body.amplitudes(delta))[0, :3] == pytest.approx(value, rel=1e-4, abs=1e-12), name


@pytest.mark.parametrize("most", [3000, 3])
@pytest.mark.parametrize("nonlinear", [False, True])
def test_uniform_stretch_is_exact_one_by_one_and_in_means(monkeypatch, most, nonlinear):
    monkeypatch.setattr(strain_points, "MOST_POINTS", most)
    mesh = rectangle(1.2, 0.9, 2, 2, "triangle")
    structure = build_structure(mesh, [Member("surface", "plate", 0.01, Material(70e9, 0.3, 2700.0))])
    e = 0.02
    wanted = np.zeros((len(mesh.points), 3))
    wanted[:, 0] = e * mesh.points[:, 0]
    phi = np.linalg.lstsq(structure.translation.toarray(), wanted.reshape(-1, 1), rcond=None)[0]
    (part,) = strain_field(structure, phi, nonlinear)
    assert len(part.places) == (8 if most == 3 else 24)
    assert part.weight.sum() == pytest.approx(1.2 * 0.9)
    assert part.names[:3] == ("membrane_xx", "membrane_yy", "membrane_xy")
    strains = part.strains(np.ones(1))[0]
    assert strains[:, 0] == pytest.approx(e, rel=1e-6)
    assert np.abs(strains[:, 1:]).max() < 1e-8
    assert part.energy(np.ones(1))[0] == pytest.approx(70e9 * 0.01 / (1 - 0.3**2) * e**2 / 2, rel=1e-6)  # J/m^2


def test_a_solid_turned_as_a_whole_strains_only_if_strain_is_linear():
    structure = solid()
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    u = structure.mesh.points @ (turn - np.eye(3)).T
    phi = np.linalg.lstsq(structure.translation.toarray(), u.reshape(-1, 1), rcond=None)[0]
    (whole,), (linear,) = strain_field(structure, phi, True), strain_field(structure, phi, False)
    assert np.abs(whole.strains(np.ones(1))).max() < 1e-6
    assert linear.strains(np.ones(1))[0, :, 0] == pytest.approx(np.cos(angle) - 1, rel=1e-5)


def test_the_field_goes_into_a_body_file_and_comes_back(tmp_path):
    structure = bent_beam()
    body = reduce_structure(structure, cantilever_modes(structure, "start", 3), strain="nonlinear")
    found = load_body(save_body(tmp_path / "b.h5", body)).strain_field
    assert [(part.kind, part.nonlinear) for part in found] == [("line", True)]
    for name in ("places", "weight", "rows", "linear", "quadratic", "elastic", "stress", "first"):
        assert np.array_equal(getattr(found[0], name), getattr(body.strain_field[0], name))
    size = (tmp_path / "b.h5").stat().st_size
    rows = found[0].rows
    assert rows.dtype == np.float32 and rows.nbytes < size / 4


def test_files_that_number_the_shapes_of_first_order_are_read_as_ever(tmp_path):
    """Before `first`, the attribute `leading` said how many shapes, the first ones, are of first order."""
    structure = bent_beam()
    modes = with_derivatives(structure, cantilever_modes(structure, "start", 3))
    body = reduce_structure(structure, modes, strain="condensed")
    path, y = save_body(tmp_path / "old.h5", body), body.amplitudes(np.array([0.025, -0.015, 0.01]))
    with h5py.File(path, "a") as file:
        del file["strain_field/0/first"]
        file["strain_field/0"].attrs["leading"] = 3
    (found,) = load_body(path).strain_field
    assert np.array_equal(found.strains(y), body.strain_field[0].strains(y))
    with h5py.File(path, "a") as file:
        del file["strain_field/0"].attrs["leading"]
    with pytest.raises(ValueError, match=r"old.h5 is .* with parts missing: .*leading.* Make it again"):
        load_body(path)


def test_energy_density_of_condensed_elements_is_that_of_the_condensed_body():
    structure = bent_beam()
    modes = with_derivatives(structure, cantilever_modes(structure, "start", 3))
    body = reduce_structure(structure, modes, strain="condensed")
    delta = np.array([-0.015, 0.009, 0.006])  # 2 mm of 1.5 m; what the field holds beyond the energy is of fifth order
    assert body.strain.energy(delta) < 0.985 * delta @ body.strain.V1 @ delta / 2
    assert energy(body.strain_field, body.amplitudes(delta)) == pytest.approx(body.strain.energy(delta), rel=3e-4)


def test_two_means_of_a_layer_of_solids_hold_the_energy_of_its_bending(monkeypatch):
    """eps_xx = k z over a single layer that lies askew: C_11 k^2 h^3 / 24 per area."""
    flat = box(1.0, 0.5, 0.1, 3, 2, 1, "hexahedron20")
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    mesh = flat.__class__(flat.points @ turn.T, flat.cells, flat.cell_groups, flat.point_groups)
    structure = build_structure(mesh, [Member("volume", "solid", material=Material(70e9, 0.3, 2700.0))])
    x, _, z = flat.points.T - [[0], [0], [0.05]]
    u = np.stack([x * z, 0 * x, -(x**2) / 2], axis=1) @ turn.T
    phi = np.linalg.lstsq(structure.translation.toarray(), u.reshape(-1, 1), rcond=None)[0]
    (every,) = strain_field(structure, phi, False)
    monkeypatch.setattr(strain_points, "MOST_POINTS", 3)
    (means,) = strain_field(structure, phi, False)
    C11 = 70e9 * 0.7 / (1.3 * 0.4)
    whole = C11 / 2 * 1.0 * 0.5 * 0.1**3 / 12
    assert energy([every], np.ones(1)) == pytest.approx(whole, rel=1e-6)
    assert energy([means], np.ones(1)) == pytest.approx(whole, rel=1e-5)
    assert len(means.places) == 12 and means.per == 2 and len(every.places) > 12
    height = (means.places @ turn)[:, 2] - 0.05
    np.testing.assert_allclose(np.abs(height), 0.05 / np.sqrt(3), rtol=1e-6)
    np.testing.assert_allclose(means.weight, 1.0 * 0.5 * 0.1 / 12)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_two_means_of_line_elements_stand_in_the_order_of_the_line_with_their_own_radius(monkeypatch, sense):
    """A circle whose radius grows along the line: r / sqrt 2 where each mean stands; a stretch that grows, too."""
    way = sense * np.array([-0.6, 0.8, 0.0])
    member = Member("line", "beam", Circle("0.02 + 0.01*s"), Material(70e9, 0.3, 2700.0))
    structure = build_structure(line([[0, 0, 0], (3 * way).tolist()], 3), [member])
    s = structure.mesh.points @ way
    u = (s**2 / 2)[:, None] * way
    phi = np.linalg.lstsq(structure.translation.toarray(), u.reshape(-1, 1), rcond=None)[0]
    (every,) = strain_field(structure, phi, False)
    monkeypatch.setattr(strain_points, "MOST_POINTS", 3)
    (means,) = strain_field(structure, phi, False)
    assert means.per == 2 and len(means.places) == 6 < len(every.places)
    along = means.places @ way
    assert (np.diff(along) > 0).all()
    np.testing.assert_allclose(along.reshape(3, 2).mean(axis=1), [0.5, 1.5, 2.5], rtol=1e-9)
    np.testing.assert_allclose(np.diff(along.reshape(3, 2))[:, 0], 1 / np.sqrt(3), rtol=1e-6)
    station = every.lever * np.sqrt(2) - 0.02  # of every point, linear in its place
    slope, start = np.polyfit(every.places @ way, station, 1)
    np.testing.assert_allclose(means.lever, (0.02 + start + slope * along) / np.sqrt(2), rtol=1e-9)
    assert slope > 0.003
