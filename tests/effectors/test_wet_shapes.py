"""A floating beam by wave data with its shapes: strip theory in closed form, and Morison's pieces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from support.wave_files import write_capytaine, write_wamit

from femflex import build_system, simulate, system_modes
from femflex.case import parse_case
from femflex.hydrodynamics import WaveData

RHO, G, D, L, EI, STEEL = 1025.0, 9.80665, 0.5, 20.0, 2e6, 100.62914
WATER = RHO * np.pi * D**2 / 8  # kg/m, that a half round section displaces
ROOTS = (4.730040744862704, 7.853204624095838, 10.995607838001671)
WAVE = float(np.sqrt(G * 2 * np.pi / 50.0))  # rad/s, of 50 m length
BEAM = f"""
[run]
duration = 8
output_step = 0.1
rtol = 1e-8
[environment]
gravity = {G}
[water.sea]
waves = [{{ kind = "regular", height = "1 cm", period = {2 * np.pi / WAVE!r} }}]
[bodies.beam]
kind = "analytic"
length = {L}
EA = 1e8
EIy = {EI}
EIz = {EI}
GJ = 1e6
mass_per_length = {STEEL}
ry = 0.1
rz = 0.1
rotary_inertia = false
functions = {{ z = 3, ends = "free-free" }}
"""
MORISON = '[wet_members.water]\nbody = "beam"\ndiameter = 0.5\nCd = 0\n'
DATA = f"""
[wet_bodies.water]
body = "beam"
data = "FILE"
data_origin = [10, 0, 0]
volume = {np.pi * D**2 / 8 * L}
center_of_buoyancy = [0, 0, {-2 * D / (3 * np.pi)}]
waterplane_area = {D * L}
waterplane_moments = [{L * D**3 / 12}, {D * L**3 / 12}, 0]
"""
X, DX = np.linspace(0.0, L, 2000, endpoint=False) + L / 4000, L / 2000


def bent(k, x):
    """Bending mode k of a free beam."""
    y, b = ROOTS[k] * x / L, ROOTS[k]
    s = (np.cosh(b) - np.cos(b)) / (np.sinh(b) - np.sin(b))
    return np.cosh(y) + np.cos(y) - s * (np.sinh(y) + np.sin(y))


RISE = np.array([0 * X, 0 * X, 1 + 0 * X, 0 * X, L / 2 - X, 0 * X, *(bent(k, X) / bent(k, L) for k in range(3))])


def strips(added) -> WaveData:
    """Strip theory with an added mass per length (2000,), without radiation."""
    omega, side = np.array([0.5, 0.999, 1.0, 1.001, 2.0]) * WAVE, np.zeros((9, len(X)))
    side[1], side[5] = 1.0, X - L / 2
    A = ((RISE * added) @ RISE.T + (side * added) @ side.T) * DX
    force = (RHO * G * D - omega[:, None] ** 2 * (WATER + added)) * np.exp(1j * omega[:, None] ** 2 / G * (X - L / 2))
    many = np.tile(A, (len(omega), 1, 1))
    stiffness, excitation = RHO * G * D * RISE @ RISE.T * DX, (force @ RISE.T * DX)[:, None]
    names = ("first", "second", "third")
    return WaveData(omega, many, 0 * many, A, np.zeros(1), excitation, RHO, G, stiffness, shapes=names)


def craft(tmp_path, water: str):
    return build_system(parse_case(BEAM + water, path=tmp_path / "case.toml"))


def matrices(data: WaveData):
    """Mass and stiffness over heave, pitch and three bending modes."""
    chosen = [2, 4, 6, 7, 8]
    M = STEEL * RISE @ RISE.T * DX + data.infinite
    K = data.stiffness + np.diag([*[0.0] * 6, *(EI * (b / L) ** 4 * L / 4 for b in ROOTS)])
    K[4, 4] -= WATER * L * G * 2 * D / (3 * np.pi)  # buoyancy acts below the axis
    return M[np.ix_(chosen, chosen)], K[np.ix_(chosen, chosen)]


ORDER = 'shapes = [{ marker = "tip" }, { marker = "tip" }, { marker = "tip" }]'
NAMED = (
    'shapes = [{ dof = "second", coordinate = 2, marker = "tip" }, { dof = "first", coordinate = 1, marker = "root" }]'
)


@pytest.mark.parametrize(("file", "shapes", "taper"), [("b.1", ORDER, 0.0), ("b.1", ORDER, 0.8), ("b.nc", NAMED, 0.0)])
def test_wet_frequencies_are_those_of_the_strips(tmp_path, file, shapes, taper):
    """Uniform: omega^2 = (rho g D + EI k^4) / (m + a); a that grows along the beam couples all motions."""
    if file == "b.nc":
        pytest.importorskip("xarray"), pytest.importorskip("h5netcdf")
    data = strips(WATER * (1 + taper * (X / L - 0.5)))
    (write_capytaine if file == "b.nc" else write_wamit)(tmp_path / file, data)
    found = system_modes(craft(tmp_path, DATA.replace("FILE", file) + shapes)).frequencies * 2 * np.pi
    M, K = matrices(data)
    expected = np.sqrt(eigh(K, M, eigvals_only=True))
    if not taper:
        closed = np.sqrt((RHO * G * D + EI * (np.array([0, 0, *ROOTS]) / L) ** 4) / (STEEL + WATER))
        assert expected == pytest.approx(closed, rel=1e-3)
    if file == "b.nc":  # the third shape has no water
        expected[4] = np.sqrt(EI / STEEL) * (ROOTS[2] / L) ** 2
    assert found[-5:] == pytest.approx(expected, rel=1e-3)


def test_waves_bend_a_beam_by_its_data_as_by_strips(tmp_path):
    """Against the linear equations of heave, pitch and bending, and against the eight pieces of a wet member."""
    data = strips(WATER + 0 * X)
    write_wamit(tmp_path / "b.1", data)
    run, pieces = (simulate(craft(tmp_path, water), 8.0, output_step=0.1, rtol=1e-8)
                   for water in (DATA.replace("FILE", "b.1") + ORDER, MORISON))  # fmt: skip
    M, K = matrices(data)
    force = 0.005 * data.excitation[2, 0, [2, 4, 6, 7, 8]] * np.exp(1j * WAVE**2 / G * L / 2)  # middle at x = L / 2

    def rate(t, y):
        return [*y[5:], *np.linalg.solve(M, (force * np.exp(-1j * WAVE * t)).real - K @ y[:5])]

    y = solve_ivp(rate, (0, 8), np.zeros(10), t_eval=run.times, rtol=1e-10, atol=1e-14).y
    tip, rise = (run[path][:, 2] for path in ("markers/beam.tip/deflection", "bodies/beam/position"))
    assert tip == pytest.approx(y[2] + y[3] + y[4], abs=3e-3 * np.abs(tip).max())
    assert rise == pytest.approx(y[0] + y[1] * L / 2, abs=3e-3 * np.abs(rise).max())
    assert pieces["bodies/beam/position"][:, 2] == pytest.approx(rise, abs=0.015 * np.abs(rise).max())
