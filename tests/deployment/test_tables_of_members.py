"""Tables of deploying members against integrals over material points, whatever family, drum, section and axes."""

from __future__ import annotations

import numpy as np
import pytest
from support.material_points import Material, frame_of, gauss_of, put_markers, slope_of

from femflex.body.symmetric import packed
from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    MaterialTaper,
    StringFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
    deploying_tapered_line,
)
from femflex.reduction import BeamFunctions
from femflex.system import Block, Profile

ROOT, WAY, NEAR = (0.3, -0.2, 0.5), (2.0, 1.0, -0.7), (0.1, 0.9, 0.4)
SLOW = Profile.smooth_step(0.0, 300.0, 1.2, 2.1)
LENGTH = Profile.smooth_step(0.0, 3.0, 1.2, 2.1)
STATE = (1.7, 0.37, -0.21)  # length, its rate and acceleration
MARKERS = {"mid": 0.35}
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


def line_of(**more):
    return DeployingLine(mass_per_length=0.8, root=ROOT, direction=WAY, orientation=NEAR, **more)


def section_of(line):
    """Points with the section's second moments; without rotary inertia those of a line that twists."""
    if not (line.ry or line.rz):
        return np.zeros((1, 3)), np.ones(1)
    if line.rotary_inertia:
        a, b = np.sqrt(2) * line.rz, np.sqrt(2) * line.ry
        return np.array([[0, a, 0], [0, -a, 0], [0, 0, b], [0, 0, -b]]), np.full(4, 0.25)
    a = np.sqrt((line.ry**2 + line.rz**2) / 2)
    offsets = np.concatenate([a * np.eye(3), -a * np.eye(3)])
    return offsets, np.array([-0.5, 0.5, 0.5] * 2)


def material_of_line(made, line, functions, at_tip, density, stock, breaks=()):
    X = made.shapes.X if functions is not None else np.zeros((0, 0))
    n = X.shape[1]
    offsets, share = section_of(line)

    def fields(xi, L, derivative):
        return functions.fields(xi, L, derivative) @ X if n else np.zeros((len(xi), 4, 0))

    def displacements(xi, L):
        u, v, w, theta = np.moveaxis(fields(xi, L, 0), 1, 0)[:, :, None]
        _, dv, dw, _ = np.moveaxis(fields(xi, L, 1), 1, 0)[:, :, None]
        x, y, z = offsets.T[:, None, :, None]
        return np.stack([u - y * dv - z * dw, v - z * theta + x * dv, w + y * theta + x * dw], axis=2)

    def products(xi):
        slope = fields(xi, 1.0, 1)[:, 1:3]
        return np.einsum("kai,kaj->kij", slope, slope)

    frame = frame_of(WAY, NEAR)
    return Material(
        ROOT, frame, displacements, products, made.body.slaves, offsets, share, density, stock, at_tip, breaks
    ), fields


def check(made, material, others):
    block = Block(made.body, made.variation.varies)
    found = made.variation.write.block_at(*STATE)
    wanted = material.block(block, *STATE, others)
    assert found.shape == wanted.shape
    assert np.count_nonzero(wanted) > 40
    np.testing.assert_allclose(found, wanted, rtol=3e-6, atol=3e-7 * np.abs(wanted).max())
    return block


def line_markers(material, fields, n_shapes):
    """Places of markers at fixed xi, and what they turn by; of the exit, which does not move."""
    frame, n = material.frame, n_shapes - len(material.slaves)

    def marker_at(xi):
        def marker_numbers(L):
            where = np.array([xi])
            value, slope = fields(where, L, 0)[0], fields(where, L, 1)[0]
            phi, psi = np.zeros((2, 3, n_shapes))
            phi[:, :n], phi[0, n:] = value[:3], material.foreshortening(where)[0] / L
            psi[:, :n] = [value[3], -slope[2], slope[1]]
            return np.asarray(ROOT) + frame[0] * xi * L, frame.T @ phi, frame.T @ psi

        return marker_numbers

    return {"tip": marker_at(1.0), "mid": marker_at(0.35)}


def quartic_of_line(line, fields, x, dx, L):
    """V3 (n, n, n, n) of EIz k_y^2 / 2 + EIy k_z^2 / 2, k_a = a'' + a' (v' v'' + w' w'') / 2, to fourth order."""
    slope, bend = (fields(x, L, d)[:, 1:3] for d in (1, 2))
    ab = np.einsum("kai,kaj->kij", slope, bend)
    return sum(EI * np.einsum("k,ki,kj,klm->ijlm", dx, slope[:, a], bend[:, a], ab, optimize=True)
               for a, EI in enumerate((line.EIz, line.EIy)))  # fmt: skip


def put_stiffness(block, out, stiffness, quartic, L, U):
    """V1 and V3 of functions of the length, and their rates."""
    n = block.n
    block.put_stiffness(out, stiffness(L), np.zeros(n))
    block.put_stiffness(out, U * slope_of(stiffness, L), np.zeros(n), True)
    if block.strain >= 0:
        block.put_strain(out, np.zeros(0), packed(quartic(L)))
        block.put_strain(out, np.zeros(0), packed(U * slope_of(quartic, L)), True)


LINES = {
    "beam with twist and stretch": (
        line_of(EA=90.0, EIy=3.0, EIz=5.0, GJ=2.0, ry=0.05, rz=0.09, rotary_inertia=True),
        BeamFunctions(y=2, z=1, axial=1, torsion=1),
        {},
    ),
    "beam without rotary inertia, linear": (
        line_of(EIy=3.0, EIz=5.0, GJ=2.0, ry=0.05, rz=0.09),
        BeamFunctions(y=1, z=1, torsion=1, family="polynomial"),
        {"strain": "linear", "damping": (0.01, 0.03, 0.02), "until": 300.0},
    ),
    "tether": (
        line_of(tension=7.0),
        StringFunctions(y=2, z=1, family="characteristic"),
        {"drum": "tip", "reference": 1.5},
    ),
    "straight": (line_of(), None, {"drum": "tip"}),
    "damped beam from a drum at the tip": (
        line_of(EIy=3.0, EIz=5.0),
        BeamFunctions(y=1, z=2),
        {"drum": "tip", "damping": 0.02, "orientations": {"mid": AXES}},
    ),
}


@pytest.mark.parametrize("name", LINES)
def test_table_of_line_matches_material_integrals(name):
    line, functions, options = LINES[name]
    length, options = (SLOW, options) if "until" in options else (LENGTH, {"until": 3.0, **options})
    made = deploying_line(line, functions, length, stock=2.6, markers=MARKERS, **options)
    at_tip = options.get("drum") == "tip"
    material, fields = material_of_line(made, line, functions, at_tip, lambda s: 0.8 + 0 * s, 2.6)
    n, L0 = made.body.n_modes, options.get("reference", 1.2)
    x, w = gauss_of([0.0, 1.0])

    def stiffness(L):
        slope, bend = fields(x, L, 1), fields(x, L, 2)
        dx = w * L
        terms = ((line.EIz, bend[:, 1]), (line.EIy, bend[:, 2]), (line.EA, slope[:, 0]), (line.GJ, slope[:, 3]),
                 (line.tension, slope[:, 1]), (line.tension, slope[:, 2]))  # fmt: skip
        return sum((c * (f * dx[:, None]).T @ f for c, f in terms), np.zeros((n, n)))

    def others(block, out):
        L, U, A = STATE
        orientations = {key: options.get("orientations", {}).get(key, material.frame.T) for key in ("tip", "mid")}
        axis = material.frame[0] if len(made.body.slaves) else np.zeros(3)
        own = line_markers(material, fields, made.body.n_shapes)
        put_markers(block, out, own, orientations, dict.fromkeys(own, axis), L, U, A)
        if not n:
            return
        put_stiffness(block, out, stiffness, lambda L: quartic_of_line(line, fields, x, w * L, L), L, U)
        if "damping" in options:
            deployed = L / L0  # of unit mass at the length of reference; what is stowed at the tip is not damped
            block.put_damping(
                out, np.diag(2 * np.array(options["damping"]) * np.sqrt(np.diag(stiffness(L)) * deployed))
            )

    check(made, material, others)
    if n:
        material.stock = L0  # none stowed
        second = material.integrals(L0)["second"][1:, :, 1:]
        np.testing.assert_allclose(np.einsum("kala->kl", second)[:n, :n], np.eye(n), atol=1e-9)
        material.stock = 2.6
        K = stiffness(L0)
        np.testing.assert_allclose(K, np.diag(np.diag(K)), atol=1e-8 * K.max())
        assert (np.diff(np.diag(K)) > -1e-9).all() or options.get("drum") == "tip"
        now = np.einsum("kaka->k", material.integrals(1.2)["second"][1:, :, 1:])[:n]
        np.testing.assert_allclose(made.body.omega[:n], np.sqrt(np.diag(stiffness(1.2)) / now), rtol=1e-8)
    root = made.body.marker("root")
    np.testing.assert_allclose(root.position, ROOT)
    np.testing.assert_allclose(root.orientation, material.frame.T, atol=1e-12)
    assert not root.phi.any() and not root.psi.any()


@pytest.mark.parametrize("drum", ["root", "tip"])
@pytest.mark.parametrize("functions", [BeamFunctions(y=1, z=1), None], ids=["beam", "straight"])
def test_table_of_tapered_line_matches_material_integrals(drum, functions):
    line = line_of(EIy=3.0, EIz=5.0, ry=0.05, rz=0.09, rotary_inertia=True)
    points, mass, bending = (0.0, 1.6, 2.4, 2.6), (1.0, 2.0, 0.7, 0.7), (0.5, 1.5, 2.5, 2.5)
    taper = MaterialTaper.table(points, mass=mass, bending=bending)
    made = deploying_tapered_line(
        line, taper, functions, LENGTH, stock=2.6, until=3.0, markers=MARKERS, drum=drum, damping=0.04, reference=1.4
    )
    at_tip, n = drum == "tip", made.body.n_modes
    material, fields = material_of_line(
        made, line, functions, at_tip, lambda s: 0.8 * np.interp(s, points, mass), 2.6, points
    )

    def stiffness(L):
        sigma, dx = gauss_of([0.0, *(x for x in points if x < L), L])
        bend, factor = fields(material.xi(sigma, L), L, 2), np.interp(sigma, points, bending)
        return sum((f * (c * factor * dx)[:, None]).T @ f for c, f in ((5.0, bend[:, 1]), (3.0, bend[:, 2])))

    def quartic(L):
        sigma, dx = gauss_of([0.0, *(x for x in points if x < L), L])
        return quartic_of_line(line, fields, material.xi(sigma, L), dx * np.interp(sigma, points, bending), L)

    def others(block, out):
        L, U, A = STATE
        own = line_markers(material, fields, made.body.n_shapes)
        axis = material.frame[0] if len(made.body.slaves) else np.zeros(3)
        put_markers(block, out, own, dict.fromkeys(own, material.frame.T), dict.fromkeys(own, axis), L, U, A)
        if not n:
            return
        put_stiffness(block, out, stiffness, quartic, L, U)
        Me = np.einsum("kaka->k", material.integrals(L)["second"][1:, :, 1:])[:n]
        block.put_damping(out, np.diag(0.08 * np.sqrt(np.diag(stiffness(L)) * Me)))

    check(made, material, others)
    write = made.variation.write
    assert made.body.moments.mass == pytest.approx(material.integrals(1.2)["mass"], rel=1e-9)
    assert (write.stock, write.at_tip, write.bounds) == (2.6, at_tip, (pytest.approx(1.2), pytest.approx(2.1)))
    assert np.abs(write.origins - points[1]).min() < 1e-9  # a piece of the table ends at the kink
    np.testing.assert_allclose(
        made.body.moments.inertia(),
        np.trace(Q := material.integrals(1.2)["second"][0, :, 0]) * np.eye(3) - Q,
        rtol=1e-7,
    )


@pytest.mark.parametrize("drum", ["root", "tip"])
def test_table_of_strip_matches_material_integrals(drum):
    strip = DeployingStrip(mass_per_length=1.0, width=0.5, bending_stiffness=3.0, poisson=0.3, tension=4.0,
                           tension_across=0.9, root=ROOT, direction=WAY, orientation=NEAR)  # fmt: skip
    along = BeamFunctions(z=2)
    made = deploying_strip(strip, StripFunctions(along, 3), LENGTH, stock=2.6, until=3.0, markers=MARKERS, drum=drum)
    eta, weight = np.polynomial.legendre.leggauss(9)
    X, n, b, nu = made.shapes.X, 6, 0.5, 0.3
    assert made.body.n_modes == n
    Y = [np.polynomial.legendre.Legendre.basis(j) for j in range(3)]

    def w(xi, at, L, dx, dy):
        """Derivatives of w by x and y (k, m, n)."""
        f = along.fields(xi, L, dx)[:, 2]
        g = np.stack([(p.deriv(dy) if dy else p)(at) for p in Y], axis=1) * (2 / b) ** dy
        return np.einsum("ki,mj->kmij", f, g).reshape(len(xi), len(at), -1) @ X

    def displacements(xi, L):
        out = np.zeros((len(xi), len(eta), 3, n))
        out[:, :, 2] = w(xi, eta, L, 0, 0)
        return out

    def products(xi):
        slope = w(xi, eta, 1.0, 1, 0)
        return np.einsum("m,kmi,kmj->kij", weight / 2, slope, slope)

    offsets = np.outer(eta, [0, b / 2, 0])
    material = Material(ROOT, frame_of(WAY, NEAR), displacements, products, made.body.slaves, offsets, weight / 2,
                        lambda s: 1.0 + 0 * s, 2.6, drum == "tip")  # fmt: skip

    def stiffness(L, quartic=False):
        """V1; or V3 of the curvatures w,ab (1 + |grad w|^2 / 2)."""
        x, v = gauss_of([0.0, 1.0])
        dA = np.outer(v * L, weight * b / 2).ravel()[:, None]
        d = {key: w(x, eta, L, *key).reshape(len(dA), n) for key in ((2, 0), (0, 2), (1, 1), (1, 0), (0, 1))}
        xx, yy, xy = d[2, 0], d[0, 2], d[1, 1]
        Mx, My = 3.0 * (xx + nu * yy), 3.0 * (yy + nu * xx)
        if quartic:
            steep = np.einsum("kqi,kqj->qij", *[np.stack([d[1, 0], d[0, 1]])] * 2)
            pairs = sum(np.einsum("qi,qj->qij", m, f) for m, f in ((Mx, xx), (My, yy), (6.0 * (1 - nu) * xy, xy)))
            return np.einsum("q,qij,qkl->ijkl", dA[:, 0], pairs, steep, optimize=True)
        K = (dA * xx).T @ Mx + (dA * yy).T @ My + 2 * 3.0 * (1 - nu) * (dA * xy).T @ xy
        return K + 4.0 / b * (dA * d[1, 0]).T @ d[1, 0] + 0.9 * (dA * d[0, 1]).T @ d[0, 1]

    def marker_at(xi):
        def marker_numbers(L):
            where, middle = np.array([xi]), np.zeros(1)
            phi, psi = np.zeros((2, 3, made.body.n_shapes))
            phi[2, :n], phi[0, n:] = w(where, middle, L, 0, 0)[0, 0], material.foreshortening(where)[0] / L
            psi[0, :n], psi[1, :n] = w(where, middle, L, 0, 1)[0, 0], -w(where, middle, L, 1, 0)[0, 0]
            return np.asarray(ROOT) + material.frame[0] * xi * L, material.frame.T @ phi, material.frame.T @ psi

        return marker_numbers

    def others(block, out):
        L, U, A = STATE
        own = {"tip": marker_at(1.0), "mid": marker_at(0.35)}
        put_markers(
            block, out, own, dict.fromkeys(own, material.frame.T), dict.fromkeys(own, material.frame[0]), L, U, A
        )
        put_stiffness(block, out, stiffness, lambda L: stiffness(L, quartic=True), L, U)

    check(made, material, others)
