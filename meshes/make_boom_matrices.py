"""Makes boom_matrices.pch: mass and stiffness of a uniform boom as DMIG entries, as another program would write them.

Twenty beam elements along x with the consistent matrices of J. S. Przemieniecki, Theory of Matrix Structural Analysis,
McGraw-Hill 1968, chapters 5 and 11, without rotary inertia of bending; nothing is supported. Units mm, t, s.
"""

from pathlib import Path

import numpy as np

L, N = 4000.0, 20  # mm, elements
MASS = 1.5e-6  # t/mm
EI, EA, GJ = 1.2e9, 1e7, 8e8  # N mm^2, N, N mm^2
POLAR = 100.0  # mm^2, mass moment about the axis over the mass


def element(h):
    """Stiffness and mass (12, 12) of x, y, z, rx, ry, rz at both ends."""
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    pair, share = np.array([[1, -1], [-1, 1]]), np.array([[2, 1], [1, 2]]) / 6
    for first, stiffness, inertia in ((0, EA, 1.0), (3, GJ, POLAR)):
        at = np.ix_([first, first + 6], [first, first + 6])
        K[at], M[at] = stiffness / h * pair, MASS * inertia * h * share
    k = np.array([[12, 6 * h, -12, 6 * h], [0, 4 * h**2, -6 * h, 2 * h**2], [0, 0, 12, -6 * h], [0, 0, 0, 4 * h**2]])
    b, d = 22 * h, 13 * h
    m = np.array([[156, b, 54, -d], [0, 4 * h**2, d, -3 * h**2], [0, 0, 156, -b], [0, 0, 0, 4 * h**2]])
    k, m = (a + np.triu(a, 1).T for a in (k, m))
    for dofs, sign in (([1, 5, 7, 11], 1), ([2, 4, 8, 10], -1)):  # dz/dx is -ry
        s = np.diag([1, sign, 1, sign])
        at = np.ix_(dofs, dofs)
        K[at], M[at] = EI / h**3 * s @ k @ s, MASS * h / 420 * s @ m @ s
    return K, M


def lines():
    h, n = L / N, 6 * (N + 1)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for e in range(N):
        at = np.ix_(range(6 * e, 6 * e + 12), range(6 * e, 6 * e + 12))
        k, m = element(h)
        K[at] += k
        M[at] += m
    yield "$ Boom of 4 m, unsupported: mm, t, s. Made by make_boom_matrices.py"
    for node in range(N + 1):
        yield f"GRID    {101 + node:<16d}{h * node:<8.2f}{0.0:<8.1f}{0.0:<8.1f}"
    for name, A in (("KAAX", K), ("MAAX", M)):
        yield f"DMIG    {name:<8}{0:>8d}{6:>8d}{2:>8d}{0:>8d}"
        for column in range(n):
            rows = [row for row in range(column, n) if A[row, column]]
            yield f"DMIG*   {name:<16}{101 + column // 6:>16d}{column % 6 + 1:>16d}"
            for row in rows:
                value = f"{A[row, column]:.10E}".replace("E+0", "+").replace("E-0", "-").replace("E", "")
                yield f"*       {101 + row // 6:>16d}{row % 6 + 1:>16d}{value:>16}"
    yield "ENDDATA"


if __name__ == "__main__":
    Path(__file__).with_name("boom_matrices.pch").write_text("\n".join(lines()) + "\n", encoding="ascii")
