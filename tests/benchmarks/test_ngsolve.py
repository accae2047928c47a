"""Solid elements against NGSolve, as CPU-time ratios in one run on one thread: M and K, and 20 modes of 1e5 dofs.

NGSolve (`pip install ngsolve`) is a peer for comparison; the tests are skipped where it is not installed. Counted on
both sides: from a finished mesh and its space to M and K; for modes the factors (NGSolve's sparse Cholesky) and ARPACK.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, eigsh
from support.assembly_times import femflex_assembly, median_ratio
from threadpoolctl import threadpool_limits

from femflex.fem import Material, Member, build_structure
from femflex.fem.eigen.modes import lowest_modes
from femflex.mesh import Mesh, box

pytestmark = pytest.mark.benchmark

ngsolve = pytest.importorskip("ngsolve")

E, NU, RHO = 2e9, 0.3, 100.0
LAME, MU = E * NU / (1 + NU) / (1 - 2 * NU), E / 2 / (1 + NU)
SIZE = (2.7, 2.0, 0.5)
COUNTS = {"hexahedron27": (27, 24, 5), "tetra10": (24, 22, 5)}


def peer_mesh(kind: str):
    from ngsolve.meshes import MakeStructured3DMesh

    ngsolve.SetNumThreads(1)
    nx, ny, nz = COUNTS[kind]
    return MakeStructured3DMesh(
        hexes=kind == "hexahedron27", nx=nx, ny=ny, nz=nz, mapping=lambda x, y, z: (2.7 * x, 2.0 * y, 0.5 * z)
    )


def peer_matrices(mesh, clamp: str = ""):
    """Space, stiffness and mass of quadratic elements."""
    space = ngsolve.VectorH1(mesh, order=2, dirichlet=clamp)
    u, v = space.TnT()

    def strain(w):
        return 0.5 * (ngsolve.Grad(w) + ngsolve.Grad(w).trans)

    K, M = ngsolve.BilinearForm(space), ngsolve.BilinearForm(space)
    K += (2 * MU * ngsolve.InnerProduct(strain(u), strain(v)) + LAME * ngsolve.div(u) * ngsolve.div(v)) * ngsolve.dx
    M += RHO * u * v * ngsolve.dx
    K.Assemble()
    M.Assemble()
    return space, K, M


def own_mesh(kind: str) -> Mesh:
    return box(*SIZE, *COUNTS[kind], kind)


@pytest.mark.parametrize("kind", COUNTS)
def test_mass_and_stiffness_take_no_longer_than_those_of_ngsolve(kind):
    mesh = peer_mesh(kind)
    ours = femflex_assembly(own_mesh(kind), Member("volume", "solid", material=Material(E, NU, RHO)))
    ratio, femflex_matrices, (space, K, _) = median_ratio(ours, lambda: list(peer_matrices(mesh)), 5)
    print(f"{kind}: {femflex_matrices[0].shape[0]} dofs, ngsolve takes {ratio:.2f} times as long")
    assert femflex_matrices[0].shape[0] == space.ndof
    if kind == "hexahedron27":  # the same space in another basis: the stiffness of one displacement field is the same
        field = ngsolve.GridFunction(space)
        field.Set(ngsolve.CoefficientFunction((ngsolve.x**2, ngsolve.x * ngsolve.y, ngsolve.z**2)))
        image = field.vec.CreateVector()
        image.data = K.mat * field.vec
        x, y, z = own_mesh(kind).points.T
        mine = np.column_stack([x**2, x * y, z**2]).ravel()
        assert mine @ (femflex_matrices[1] @ mine) == pytest.approx(ngsolve.InnerProduct(field.vec, image), rel=1e-9)
    assert ratio > 1


def test_twenty_modes_of_1e5_dofs_take_no_longer_than_with_sparse_cholesky_and_arpack():
    kind = "hexahedron27"
    structure = build_structure(own_mesh(kind), [Member("volume", "solid", material=Material(E, NU, RHO))])
    free = np.setdiff1d(np.arange(structure.n_dof), structure.clamped_dofs("left"))
    K, M = structure.K[free][:, free], structure.M[free][:, free]
    mesh = peer_mesh(kind)
    end = [
        name for name in set(mesh.GetBoundaries()) if abs(ngsolve.Integrate(ngsolve.x, mesh.Boundaries(name))) < 1e-9
    ]
    space, K_peer, M_peer = peer_matrices(mesh, clamp="|".join(end))

    def peer():
        inverse = K_peer.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky")
        a, b = K_peer.mat.CreateColVector(), K_peer.mat.CreateColVector()

        def linear_operator(operator):
            def apply(x):
                a.FV().NumPy()[:] = np.ravel(x)
                b.data = operator * a
                return b.FV().NumPy().copy()

            return LinearOperator((space.ndof, space.ndof), matvec=apply, dtype=float)

        values = eigsh(
            linear_operator(K_peer.mat), 20, linear_operator(M_peer.mat), sigma=0.0, OPinv=linear_operator(inverse),
            return_eigenvectors=False,
        )  # fmt: skip
        return np.sqrt(np.sort(values))

    with threadpool_limits(1):
        times = []
        for _ in range(2):
            start = time.process_time()
            theirs = peer()
            middle = time.process_time()
            modes = lowest_modes(K, M, 20)
            times.append((middle - start, time.process_time() - middle))
    peer_time, own_time = np.median(times, axis=0)
    print(f"{len(free)} dofs: 20 modes {own_time:.1f} s, ngsolve {peer_time:.1f} s, ratio {own_time / peer_time:.2f}")
    assert modes.omega[:20] == pytest.approx(theirs, rel=1e-6)
    assert own_time < 1.2 * peer_time
