"""Checks of mass and stiffness matrices: symmetry, definiteness, rigid-body motions, mass properties, grounding.

The rigid-body motions R come from the coordinates of the nodes. For an unsupported body K R = 0, and R^T M R
contains its mass, first moments and inertia; modal coordinates are zero in R. The limits are the constants below; each
finding states its value and its limit. (Craig-Bampton models: the checks of pyYeti's cb.cbcheck.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array
from femflex.body import MassMoments
from femflex.fem.matrix_structure import MatrixStructure
from femflex.matrices.model import MatrixModel
from femflex.reduction.boundary.rigid import DIRECTIONS, rigid_shapes
from femflex.reduction.boundary.supported import factors, negative_pivots
from femflex.reduction.inertia.mass_matrix import nodal_mass

SYMMETRIC = 1e-6  # |A - A^T| over the largest entry of A: beyond, a matrix is not symmetric
ROUNDED = 1e-10  # the same, beyond which it is noted that the symmetric part is taken
GROUNDED = 1e-6  # strain energy of a rigid motion over the sum of its terms' sizes, beyond which K holds the body
NEGATIVE = 1e-7  # shift of the diagonal, relative, below which eigenvalues count as zero
UNEQUAL = 1e-4  # difference of the masses along x, y and z, relative
COUPLED = 1e-6  # |K_bq| of a Craig-Bampton model over the geometric mean of diagonal entries
MOMENTS = 1e-3  # difference of mass moments written with a model from those of its mass matrix, relative
STATED = 0.01  # difference of mass properties from those stated, relative


@dataclass(frozen=True)
class Finding:
    """One finding of a check: a sentence with value and limit, and whether it makes the model unusable."""

    text: str
    fatal: bool = False


@dataclass(frozen=True, eq=False)
class MatrixReport:
    """Results of the checks.

    mass                [kg], the mean of those along x, y and z
    center_of_mass (3,) [m]
    inertia  (3, 3)     about the centre of mass [kg m^2]
    asymmetry           name of the matrix -> |A - A^T| over its largest entry
    rigid    (6,)       strain energy of the rigid motions x, y, z, rx, ry, rz (about the centre of mass), relative
    massless            degrees of freedom without mass
    findings            errors and doubts
    """

    mass: float
    center_of_mass: Array
    inertia: Array
    asymmetry: dict[str, float]
    rigid: Array
    massless: int
    findings: tuple[Finding, ...]

    @property
    def errors(self) -> tuple[str, ...]:
        """Findings with which the model cannot be used."""
        return tuple(finding.text for finding in self.findings if finding.fatal)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The other findings."""
        return tuple(finding.text for finding in self.findings if not finding.fatal)


@dataclass(frozen=True, eq=False)
class StatedMass:
    """Mass properties that a model is expected to have; None where nothing is stated.

    mass [kg], center_of_mass (3,) [m], inertia (3, 3) about the centre of mass [kg m^2]
    """

    mass: float | None = None
    center_of_mass: Array | None = None
    inertia: Array | None = None


def check_model(model: MatrixModel, stated: StatedMass | None = None) -> MatrixReport:
    """The report on a model; findings are returned and never raised."""
    asymmetries = {
        name: asymmetry(A)
        for name, A in (("mass", model.M), ("stiffness", model.K), ("damping", model.D))
        if A is not None
    }
    findings = [Finding(text, True) for text in _invalid_entries(model)]
    if findings:
        return MatrixReport(
            np.nan, np.full(3, np.nan), np.full((3, 3), np.nan), asymmetries, np.full(6, np.nan), 0, tuple(findings)
        )
    for name, value in asymmetries.items():
        if value > SYMMETRIC:
            text = f"its {name} matrix is not symmetric: |A - A^T| is {value:.2g} of its largest entry"
            findings.append(
                Finding(f"{text} (limit {SYMMETRIC:g}); was it written whole, or one triangle alone?", True)
            )
        elif value > ROUNDED:
            text = f"its {name} matrix is symmetric to {value:.1e} of its largest entry (limit {ROUNDED:g})"
            findings.append(Finding(f"{text}; its symmetric part is taken"))
    structure = model.structure()
    M, K = symmetric_part(model.M), symmetric_part(model.K)
    massless = int((np.asarray(abs(M).sum(axis=1)).ravel() == 0).sum())
    findings += _negative_eigenvalues(
        model, {"mass": (_mass_of_one_axis(structure, M), model.M), "stiffness": (K, model.K)}
    )
    findings += [] if model.D is None else _negative_eigenvalues(model, {"damping": (symmetric_part(model.D), model.D)})
    R = rigid_shapes(structure)
    mass, centre, J, mass_findings = _mass_properties(R.T @ (M @ R))
    findings += mass_findings
    if model.moments is not None:
        findings += _differences_of_moments(model.moments, M, R)
    if mass > 0:
        R = rigid_shapes(structure, about=centre)
    rigid = relative_energy(K, R)
    findings += _resisted_rigid_motions(model, K, R, rigid)
    findings += _boundary_modal_coupling(model, K)
    if stated is not None:
        findings += _differences_from_stated(stated, mass, centre, J)
    return MatrixReport(mass, centre, J, asymmetries, rigid, massless, tuple(findings))


def symmetric_part(A: sparse.csr_array) -> sparse.csr_array:
    """(A + A^T) / 2 (n, n), in the unit of A."""
    return sparse.csr_array((A + A.T) / 2)


def asymmetry(A: sparse.csr_array) -> float:
    """Largest entry of A - A^T over that of A (n, n) [1]."""
    size = float(abs(A).max()) if A.nnz else 0.0
    return float(abs(A - A.T).max()) / size if size else 0.0


def _invalid_entries(model: MatrixModel) -> list[str]:
    texts = []
    matrices = (("mass", model.M), ("stiffness", model.K), ("damping", model.D), ("geometric", model.geometric))
    for name, A in matrices:
        if A is not None and not np.isfinite(A.data).all():
            texts.append(f"its {name} matrix has {np.count_nonzero(~np.isfinite(A.data))} entries that are not finite")
    if not model.M.count_nonzero():
        texts.append("its mass matrix is zero; was another matrix meant?")
    if not model.K.count_nonzero():
        texts.append("its stiffness matrix is zero; was another matrix meant?")
    return texts


def _mass_of_one_axis(structure: MatrixStructure, M: sparse.csr_array) -> sparse.csr_array:
    """The mass matrix of one axis if it is the same for all three and nothing else has mass; otherwise M itself."""
    if structure.rotation.nnz or structure.scalars.size or (M.diagonal() <= 0).any():
        return M
    lumped = nodal_mass(structure)
    return lumped.scalar if lumped.exact else M


EXPLANATIONS = {  # no body has a negative eigenvalue of
    "mass": "a body has no negative mass",
    "stiffness": "the body is unstable as it is, or signs are wrong",
    "damping": "damping takes energy out of a body, so check its sign",
}


def _negative_eigenvalues(
    model: MatrixModel, matrices: Mapping[str, tuple[sparse.csr_array, sparse.csr_array]]
) -> list[Finding]:
    """Findings about negative eigenvalues of the named matrices, counted by the pivots of a scaled factorisation
    (Sylvester's law).

    matrices: name -> (matrix to factorise, original matrix)
    """
    findings = []
    for name, (A, original) in matrices.items():
        diagonal = original.diagonal()
        if (diagonal < 0).any():
            k = int(np.argmin(diagonal))
            node, component = model.dofs[k]
            where = f"at node {node}, component {component}" if component else f"at modal coordinate {node}"
            text = f"its {name} matrix has {np.count_nonzero(diagonal < 0)} negative entries on the diagonal"
            findings.append(
                Finding(f"{text}, the least {diagonal[k]:.4g} {where} (limit 0); a {name} matrix has none", True)
            )
            continue
        d = A.diagonal()
        scale = sparse.diags_array(1.0 / np.sqrt(np.where(d > 0, d, 1.0)))
        shifted = scale @ A @ scale + NEGATIVE * sparse.eye_array(len(d))
        try:
            count = negative_pivots(factors(sparse.csr_array(shifted)))
        except RuntimeError:
            continue  # singular to rounding
        if count:
            text = f"its {name} matrix has {count} negative eigenvalues (limit 0; those above -{NEGATIVE:g} of the "
            findings.append(Finding(f"{text}diagonal do not count); {EXPLANATIONS[name]}", True))
    return findings


def _mass_properties(G: Array) -> tuple[float, Array, Array, list[Finding]]:
    """Mass, centre of mass and central inertia of R^T M R (6, 6) about the origin, and findings where it is
    inconsistent."""
    translational = np.diag(G)[:3]
    mass = float(translational.mean())
    findings = []
    if not mass > 0:
        text = (
            f"its mass in rigid translation is {mass:.4g} kg (limit 0); check mass matrix and map of degrees of freedom"
        )
        return mass, np.full(3, np.nan), np.full((3, 3), np.nan), [Finding(text, True)]
    if np.ptp(translational) > UNEQUAL * mass:
        text = ", ".join(f"{value:.6g}" for value in translational)
        findings.append(
            Finding(
                f"its mass is {text} kg along x, y, z (limit: {UNEQUAL:g} of their mean apart); are degrees of freedom "
                "missing, or their order wrong?"
            )
        )
    # e_a . (e_b x r) = eps_abc r_c
    s = np.array([G[1, 3 + 2] - G[2, 3 + 1], G[2, 3 + 0] - G[0, 3 + 2], G[0, 3 + 1] - G[1, 3 + 0]]) / 2
    centre = s / mass
    J = G[3:, 3:] - mass * ((centre @ centre) * np.eye(3) - np.outer(centre, centre))
    J = (J + J.T) / 2
    principal = np.linalg.eigvalsh(J)
    size = max(float(np.trace(G[3:, 3:])), 1e-300)
    if principal[0] < -UNEQUAL * size or principal[2] - principal[0] - principal[1] > UNEQUAL * size:
        text = ", ".join(f"{value:.6g}" for value in principal)
        findings.append(
            Finding(
                f"its principal inertias {text} kg m^2 about the centre of mass cannot be those of a body (the two "
                "smaller sum to at least the largest); check coordinates and units",
                True,
            )
        )
    return mass, centre, J, findings


def relative_energy(K: sparse.csr_array, R: Array) -> Array:
    """Strain energy of the columns R (k,) [1], relative to |R|^T |K| |R|, the sum of the magnitudes of its terms."""
    size = np.abs(R)
    bound = np.einsum("ik,ik->k", size, abs(K) @ size)
    return np.abs(np.einsum("ik,ik->k", R, K @ R)) / np.maximum(bound, 1e-300)


def _resisted_rigid_motions(model: MatrixModel, K: sparse.csr_array, R: Array, rigid: Array) -> list[Finding]:
    """Findings about rigid motions that K resists, with the node at which the force is largest."""
    findings = []
    for k in np.flatnonzero(rigid > GROUNDED):
        force = K @ R[:, k]
        stiffness = float(R[:, k] @ force)
        row = int(np.argmax(np.abs(force)))
        node, component = model.dofs[row]
        unit = "N/m" if k < 3 else "N m/rad"
        where = f"node {node}, {DIRECTIONS[component - 1]}" if component else f"modal coordinate {row + 1}"
        findings.append(
            Finding(
                f"its stiffness resists the rigid motion {DIRECTIONS[k]} with {stiffness:.4g} {unit}, {rigid[k]:.1e} "
                f"of the sizes summed (limit {GROUNDED:g}), most at {where}: the model is grounded there, or its "
                "coordinates and its stiffness do not belong together; give the matrices of the unsupported body"
            )
        )
    return findings


def _boundary_modal_coupling(model: MatrixModel, K: sparse.csr_array) -> list[Finding]:
    """A finding about stiffness between boundary and modal coordinates, which a Craig-Bampton model does not have."""
    q = np.flatnonzero(model.dofs[:, 1] == 0)
    b = np.flatnonzero(model.dofs[:, 1] > 0)
    if not q.size or not b.size:
        return []
    d = np.sqrt(np.maximum(K.diagonal(), 0.0))
    block = K[b][:, q].tocoo()
    size = np.maximum(d[b][block.coords[0]] * d[q][block.coords[1]], 1e-300)
    worst = float(np.max(np.abs(block.data) / size, initial=0.0))
    if worst <= COUPLED:
        return []
    return [
        Finding(
            f"its stiffness couples boundary and modal coordinates by {worst:.1e} of their own (limit {COUPLED:g}): it "
            "is no Craig-Bampton model, whose constraint modes and fixed-interface modes do not couple; it is used as "
            "it is"
        )
    ]


def _differences_of_moments(moments: MassMoments, M: sparse.csr_array, R: Array) -> list[Finding]:
    """Findings about mass moments that are not those of the mass matrix, as far as this determines them.

    Of the unit dofs k, l and rigid motions R about the origin: mass R^T M R, int phi_k dm and int rho x phi_k dm
    (M R), and int phi_k . phi_l dm = M_kl.
    """
    MR = M @ R
    mixed = moments.second[0, :, 1:, :]  # int rho_a phi_kb dm
    turned = np.stack([mixed[b, :, c] - mixed[c, :, b] for b, c in ((1, 2), (2, 0), (0, 1))], axis=1)
    inertia = np.trace(moments.second[0, :, 0]) * np.eye(3) - moments.second[0, :, 0]
    elastic = np.einsum("kala->kl", moments.second[1:, :, 1:])
    G = R.T @ MR
    mass = float(np.trace(G[:3, :3])) / 3
    static = np.array([G[1, 5] - G[2, 4], G[2, 3] - G[0, 5], G[0, 4] - G[1, 3]]) / 2  # int rho dm
    length = np.sqrt(max(np.trace(G[3:, 3:]) / (2 * mass), 1e-300)) if mass > 0 else 1.0
    size = np.sqrt(np.maximum(M.diagonal(), 0.0))
    size = np.maximum(size, 1e-3 * size.max(initial=0.0))
    root = np.sqrt(max(mass, 1e-300))
    differences = {
        "moments_mass": abs(moments.mass - mass) / root**2,
        "moments_first": max(
            float(np.abs(moments.first[0] - static).max()) / (root**2 * length),
            float((np.abs(moments.first[1:] - MR[:, :3]) / (root * size[:, None])).max(initial=0.0)),
        ),
        "moments_second": max(
            float(np.abs(inertia - G[3:, 3:]).max()) / (root * length) ** 2,
            float((np.abs(turned - MR[:, 3:]) / (root * length * size[:, None])).max(initial=0.0)),
            float((np.abs(elastic - M.toarray()) / (size * size[:, None])).max(initial=0.0)),
        ),
    }
    return [
        Finding(
            f"its {name} differ from those of its mass matrix by {value:.2g} of their size (limit {MOMENTS:g}); write "
            "mass matrix and moments from one model, or leave all moments out",
            True,
        )
        for name, value in differences.items()
        if value > MOMENTS
    ]


def _differences_from_stated(stated: StatedMass, mass: float, centre: Array, J: Array) -> list[Finding]:
    findings = []
    if stated.mass is not None and abs(mass - stated.mass) > STATED * stated.mass:
        findings.append(
            Finding(f"its mass is {mass:.6g} kg, and {stated.mass:.6g} kg is stated (limit {STATED:.0%} apart)")
        )
    radius = float(np.sqrt(max(np.trace(J), 0.0) / (2 * mass))) if mass > 0 else 1.0
    if stated.center_of_mass is not None:
        difference = float(np.linalg.norm(centre - stated.center_of_mass))
        if difference > STATED * radius:
            text = ", ".join(f"{x:.6g}" for x in centre)
            findings.append(
                Finding(
                    f"its centre of mass is ({text}) m, {difference:.4g} m from that stated (limit "
                    f"{STATED * radius:.4g} m)"
                )
            )
    if stated.inertia is not None:
        difference = float(np.abs(J - stated.inertia).max())
        limit = STATED * float(np.abs(stated.inertia).max())
        if difference > limit:
            findings.append(
                Finding(
                    f"its inertia about the centre of mass differs from that stated by up to {difference:.6g} kg m^2 "
                    f"(limit {limit:.4g})"
                )
            )
    return findings
