"""Bodies for other multibody programs: read back, against integrals of point masses, and in Exudyn itself."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import FlexibleBody, MassMoments, StrainTensors
from femflex.body.marker import Marker
from femflex.export.multibody import read_mbdyn, read_sid, write_exudyn, write_mbdyn, write_sid
from femflex.reduction import BeamFunctions, Damping, UniformBeam, beam_body
from femflex.rotations import dcm_from_angles

BEAM = UniformBeam(2.0, EA=1e5, EIy=20.0, EIz=10.0, GJ=15.0, mass_per_length=1.3, ry=0.02, rz=0.03)


def beam():
    """A beam that bends both ways, stretches and twists."""
    return beam_body(
        BEAM, BeamFunctions(y=2, z=1, axial=1, torsion=1), damping=Damping(ratio=0.02)
    ).with_linear_strain()


def cloud():
    """Point masses dm, rho, phi (p, 3, n) at random, and the body whose moments are their sums."""
    rng = np.random.default_rng(3)
    n, p = 3, 40
    dm, rho, phi = rng.uniform(0.1, 1.0, p), rng.normal(size=(p, 3)), rng.normal(size=(p, 3, n))
    z = np.concatenate([rho[:, None], phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(dm.sum(), np.einsum("p,pka->ka", dm, z), np.einsum("p,pka,plb->kalb", dm, z, z))
    K, D = (A @ A.T for A in rng.normal(size=(2, n, n)))
    axes = dcm_from_angles([0.3, -0.4, 0.5], "xyz")
    marker = Marker(rng.normal(size=3), rng.normal(size=(3, n)), rng.normal(size=(3, n)), axes)
    return (dm, rho, phi), FlexibleBody(moments, StrainTensors.linear(K), D, {"tip": marker})


BODIES = {"beam": beam, "cloud": lambda: cloud()[1]}


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize(
    ("end", "write", "read"), [("x.SID_FEM", write_sid, read_sid), ("x.fem", write_mbdyn, read_mbdyn)]
)
def test_file_gives_the_body_back(name, end, write, read, tmp_path):
    body = BODIES[name]()
    write(body, tmp_path / end)
    back = read(tmp_path / end, list(body.markers))
    for key in ("mass", "first", "second"):
        expected = np.asarray(getattr(body.moments, key))
        assert getattr(back.moments, key) == pytest.approx(expected, abs=1e-13 * np.abs(expected).max()), key
    assert back.strain.V1 == pytest.approx(body.strain.V1, rel=1e-15)
    assert back.damping == pytest.approx(body.damping, rel=1e-15)
    for marker, expected in body.markers.items():
        found = back.markers[marker]
        keys = ("position", "phi", "psi", *["orientation"] * (end != "x.fem"))
        assert all(getattr(found, key) == pytest.approx(getattr(expected, key), abs=1e-15) for key in keys)


def test_sid_has_the_integrals_of_its_definition(tmp_path):
    """Sums over point masses of the products that Wallrapp's table names, and Oe as work of the centrifugal force."""
    (dm, rho, phi), body = cloud()
    write_sid(body, tmp_path / "x.sid")
    terms, key = {}, ""
    for line in (tmp_path / "x.sid").read_text().splitlines():
        word, _, value = (text.strip() for text in line.partition("="))
        key = word if word.isalnum() and not value else key
        if word.startswith(("m0", "m1")):
            index = tuple(int(k) - 1 for k in word[3:-1].split(","))
            terms[(key, word[:2], *index)] = float(value)
    cross = np.cross
    for k in range(3):
        for l in range(3):
            fk, fl = phi[:, :, k], phi[:, :, l]
            for a in range(3):
                assert terms["Cr", "m1", k, a, l] == pytest.approx(dm @ cross(fl, fk)[:, a])
                assert terms["Ge", "m0", l, 3 * k + a] == pytest.approx(2 * dm @ cross(fk, fl)[:, a])
                w = np.eye(3)[a]
                product = -2 * dm @ cross(fl, cross(fk, w))  # -2 phi_l~ phi_k~ w
                assert [terms["Gr", "m1", b, 3 * k + a, l] for b in range(3)] == pytest.approx(product)
        for c, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
            w, v = np.eye(3)[a], np.eye(3)[b]
            centrifugal = cross(w, cross(v, rho)) + (0 if a == b else cross(v, cross(w, rho)))
            assert terms["Oe", "m0", k, c] == pytest.approx(dm @ np.sum(phi[:, :, k] * centrifugal, axis=1))
            inertia = -dm @ (cross(rho, cross(phi[:, :, k], v)) + cross(phi[:, :, k], cross(rho, v)))
            assert terms["J", "m1", a, b, k] == pytest.approx(inertia[a])


def test_bodies_that_do_not_fit_are_refused(tmp_path):
    body = beam()
    write_sid(body, tmp_path / "x.sid")
    with pytest.raises(ValueError, match="3 nodes and 1 names"):
        read_sid(tmp_path / "x.sid", ["root"])
    text = (tmp_path / "x.sid").read_text()
    head, _, tail = text.partition("        Gr\n            order = 1")
    (tmp_path / "y.sid").write_text(f"{head}        Gr\n            order = 0{tail}")
    with pytest.raises(ValueError, match="Gr to zeroth order"):
        read_sid(tmp_path / "y.sid")


def test_exudyn_computes_the_same_terms_and_takes_the_file(tmp_path):
    """Its own class on the point masses as nodes of a mesh, against what it reads."""
    exu = pytest.importorskip("exudyn")
    from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
    from scipy.sparse import csr_matrix

    (dm, rho, phi), body = cloud()
    write_exudyn(body, tmp_path / "x.exudyn.npz")
    cms = ObjectFFRFreducedOrderInterface()
    cms.LoadFromFile(str(tmp_path / "x.exudyn.npz"))
    fem = FEMinterface()
    fem.nodes = {"Position": rho}
    fem.modeBasis = {"matrix": phi.reshape(-1, 3), "type": "NormalModes"}
    fem.massMatrix = csr_matrix(np.diag(np.repeat(dm, 3)))
    fem.stiffnessMatrix = csr_matrix(np.zeros((3 * len(dm),) * 2))
    reference = ObjectFFRFreducedOrderInterface(fem)
    for key in ("massMatrixReduced", "inertiaLocal", "Mtt", "chiU", "mPsiTildePsi", "mPsiTildePsiTilde", "mPhitTPsi",
                "mPhitTPsiTilde", "mXRefTildePsi", "mXRefTildePsiTilde"):  # fmt: skip
        expected = np.asarray(getattr(reference, key))
        assert getattr(cms, key) == pytest.approx(expected, abs=1e-11 * np.abs(expected).max()), key
    mbs = exu.SystemContainer().AddSystem()
    cms.AddObjectFFRFreducedOrder(mbs, initialAngularVelocity=[0, 0, 1e-6])
    mbs.Assemble()
