"""An independent derivation of eq. (9): Kane's equations summed over material points, with second-order jets in time.

Nothing here knows of moments, recursions or quasi-coordinates' bias terms: each point's position is a product of
rotations and sums, its acceleration comes from differentiating that product twice along the motion.
"""

import numpy as np


class Jet:
    """A matrix with its first and second time derivatives."""

    def __init__(self, v, d=None, dd=None):
        self.v = np.asarray(v, float)
        self.d = np.zeros_like(self.v) if d is None else np.asarray(d, float)
        self.dd = np.zeros_like(self.v) if dd is None else np.asarray(dd, float)

    def __add__(self, o):
        o = o if isinstance(o, Jet) else Jet(o)
        return Jet(self.v + o.v, self.d + o.d, self.dd + o.dd)

    def __sub__(self, o):
        return self + o * -1.0 if isinstance(o, Jet) else self + Jet(-np.asarray(o))

    def __mul__(self, s):
        if isinstance(s, Jet):
            return Jet(self.v * s.v, self.d * s.v + self.v * s.d, self.dd * s.v + 2 * self.d * s.d + self.v * s.dd)
        return Jet(self.v * s, self.d * s, self.dd * s)

    def __matmul__(self, o):
        o = o if isinstance(o, Jet) else Jet(o)
        return Jet(self.v @ o.v, self.d @ o.v + self.v @ o.d, self.dd @ o.v + 2 * self.d @ o.d + self.v @ o.dd)

    @property
    def T(self):
        return Jet(self.v.T, self.d.T, self.dd.T)


def const(m):
    return m if isinstance(m, Jet) else Jet(np.asarray(m, float))  # what moves by itself comes as a jet


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def expm(theta):
    """exp(skew(theta)) of a jet (3,) by its power series."""
    X = Jet(skew(theta.v), skew(theta.d), skew(theta.dd))
    term, total = const(np.eye(3)), const(np.eye(3))
    for k in range(1, 40):
        term = (term @ X) * (1.0 / k)
        total = total + term
        if max(np.abs(part).max() for part in (term.v, term.d, term.dd)) < 1e-20:
            break
    return total


def rotation_vector(s, axis):
    """Of a section of a beam along that unit axis, as a jet: s = (twist, sines of the slopes); without an axis s."""
    if not axis.any():
        return s
    twist, p = const(axis) @ s, const(np.eye(3) - np.outer(axis, axis)) @ s
    return s - (const(skew(axis)) @ s) * twist * 0.5 + p * (p @ p) * (1 / 6)


def turn(axis, angle):
    return expm(Jet(axis * angle.v, axis * angle.d, axis * angle.dd))


class Tree:
    """Points of a system and their jets along a motion given by (q, u, udot) at one instant."""

    def __init__(self, system, clouds):
        self.system, self.clouds = system, clouds

    def points(self, q, u, udot, base, shift=None):
        """Jets of all points' positions [(mass, position)], elastic coordinates' slices, from F's jet C_NF."""
        frames, out = {None: (base, const(np.zeros(3)) if shift is None else shift)}, []
        iq = iu = 0
        self.attitude = {}
        for name in self.system.order:
            joint, body = self.system.joint_of(name), self.system.bodies[name]
            if joint.parent is None:
                marker_C, marker_r = const(np.eye(3)), const(np.zeros(3))
            else:
                marker_C, marker_r = self.marker(
                    self.system.bodies[joint.parent].marker(joint.parent_marker), self.delta[joint.parent]
                )
            C, r = frames[joint.parent]
            C_NP, r_P = C @ marker_C, r + C @ marker_r
            nt = len(joint.translations)
            t = const(np.zeros(3))
            for k in range(nt):
                t = t + Jet(
                    joint.translations[k] * q[iq + k],
                    joint.translations[k] * u[iu + k],
                    joint.translations[k] * udot[iu + k],
                )
            C_PQ = const(np.eye(3))
            if joint.ball is None:
                for k in range(len(joint.rotations)):
                    C_PQ = C_PQ @ turn(joint.rotations[k], Jet(q[iq + nt + k], u[iu + nt + k], udot[iu + nt + k]))
            else:
                C0 = self.ball(joint.ball, q[iq + nt : iq + joint.n_q])
                w, a = u[iu + nt : iu + nt + 3], udot[iu + nt : iu + nt + 3]
                C_PQ = Jet(C0, C0 @ skew(w), C0 @ (skew(w) @ skew(w) + skew(a)))
            iq, iu = iq + joint.n_q, iu + joint.n_u
            n = body.n_modes
            self.delta = getattr(self, "delta", {})
            self.delta[name] = Jet(q[iq : iq + n], u[iu : iu + n], udot[iu : iu + n])
            iq, iu = iq + n, iu + n
            own_C, own_r = self.marker(body.marker(joint.child_marker), self.delta[name])
            C_Ni = C_NP @ C_PQ @ own_C.T
            r_i = r_P + C_NP @ t - C_Ni @ own_r
            frames[name] = (C_Ni, r_i)
            self.attitude[name] = C_Ni
            self.frames = frames
            mass, rho, phi = self.clouds[name]
            for m, x, f in zip(mass, rho, phi, strict=True):
                out.append((m, r_i + C_Ni @ (const(x) + const(f) @ self.delta[name])))
        return out

    @staticmethod
    def marker(marker, delta):
        turned = expm(rotation_vector(const(marker.psi) @ delta, marker.axis)) @ marker.orientation
        return turned, const(marker.position) + const(marker.phi) @ delta

    @staticmethod
    def ball(kind, q):
        from scipy.spatial.transform import Rotation

        if kind == "euler_parameters":
            return Rotation.from_quat(np.roll(q, -1)).as_matrix()
        return Rotation.from_euler(kind.upper(), q).as_matrix()


def partial_velocities(tree, q, n, base):
    """Velocity of every point per unit of every quasi-velocity, (n, n_points, 3)."""
    return np.array([[p[1].d for p in tree.points(q, unit, np.zeros(n), base(False))] for unit in np.eye(n)])


def equations(tree, q, u, udot, base, force, hidden=False, partial=None):
    """sum over points of (partial velocity) . (m a - force), eq. (9) without elastic and joint forces.

    partial: as partial_velocities gives it, where it is known already
    base(d) gives the jet of C_NF at rest order: base(True) moves, base(False) is frozen for partial velocities.
    hidden: three root translations are eliminated.
    """
    n = len(u)
    moving = tree.points(q, u, udot, base(True))
    m = np.array([p[0] for p in moving])
    a = np.array([p[1].dd for p in moving])
    r = np.array([p[1].v for p in moving])
    if hidden:
        c = m @ r / m.sum()
        r = r - c
    load = m[:, None] * a - force(m, r)
    partial = partial_velocities(tree, q, n, base) if partial is None else partial
    residual = np.einsum("kpa,pa->k", partial, load)
    if hidden:
        M_v = np.einsum("kpa,p->ka", partial, m)
        residual = residual - M_v @ load.sum(0) / m.sum()
    return residual
