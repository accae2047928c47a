"""Text files of WAMIT: NAME.1 (added mass and damping), NAME.3 (excitation) and NAME.hst (hydrostatic stiffness).

With a length of 1 m they hold A/(rho L^k) and B/(rho omega L^k) with k = 3, 4, 5 for forces of translations, mixed and
moments of rotations; X/(rho g L^m) with m = 2, 3 by the convention exp(+i omega t); C/(rho g L^m). A period of 0 stands
for infinite frequency, a negative one for frequency zero. Modes from 7 on are those of a flexible body (NEWMODES).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.hydrodynamics.data import WaveData
from femflex.reading import reading

ADVICE = "Give NAME.1 of WAMIT, with periods in seconds and a unit length of 1 m"


def read(path: Path, density: float, gravity: float) -> WaveData:
    """The data of NAME.1, with NAME.3 and NAME.hst next to it. Raises ValueError and OSError."""
    if path.suffix != ".1":
        raise ValueError(f"{path.name} is neither NAME.nc of Capytaine nor NAME.1 of WAMIT; give one of them")
    with reading(path, "NAME.1 of WAMIT", ADVICE):
        rows = _rows(path, (4, 5))
        m = max([6, *(int(max(row[1], row[2])) for row in rows)])
        omega, A, B, infinite = _radiation(rows, density, m)
    headings, X = np.zeros(0), np.zeros((len(omega), 0, m), complex)
    excitation = path.with_suffix(".3")
    if excitation.exists():
        with reading(excitation, "NAME.3 of WAMIT", ADVICE):
            headings, X = _excitation(_rows(excitation, (7,)), omega, density * gravity, m)
    stiffness, hydrostatics = None, path.with_suffix(".hst")
    if hydrostatics.exists():
        with reading(hydrostatics, "NAME.hst of WAMIT", ADVICE):
            stiffness = np.zeros((m, m))
            for i, j, value in _rows(hydrostatics, (3,)):
                stiffness[_mode_index(i, m), _mode_index(j, m)] = density * gravity * value
    shapes = tuple(str(k) for k in range(7, m + 1))
    return WaveData(omega, A, B, infinite, headings, X, density, gravity, stiffness, shapes=shapes)


def _rows(path: Path, counts: tuple[int, ...]) -> list[list[float]]:
    """Numbers of each line; lines of words, such as a heading, are left out."""
    out = []
    for k, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words = line.split()
        try:
            numbers = [float(word.replace("D", "E").replace("d", "e")) for word in words]
        except ValueError:
            if k == 1:
                continue
            raise
        if numbers and len(numbers) not in counts:
            raise ValueError(f"line {k} has {len(numbers)} numbers, where {' or '.join(map(str, counts))} belong")
        out += [numbers] if numbers else []
    return out


def _mode_index(number: float, m: int) -> int:
    if number not in range(1, m + 1):
        raise ValueError(f"it has the mode {number:g}, where NAME.1 has modes 1 to {m}")
    return int(number) - 1


def _radiation(rows: list[list[float]], density: float, m: int) -> tuple[Array, Array, Array, Array | None]:
    periods = sorted({row[0] for row in rows if row[0] > 0.0}, reverse=True)
    omega = 2 * np.pi / np.array(periods)
    A, B = np.zeros((len(periods), m, m)), np.zeros((len(periods), m, m))
    infinite = np.zeros((m, m)) if any(row[0] == 0.0 for row in rows) else None
    at = {period: k for k, period in enumerate(periods)}
    for period, i, j, a, *b in rows:
        place = _mode_index(i, m), _mode_index(j, m)
        if period == 0.0 and infinite is not None:
            infinite[place] = density * a
        if period > 0.0:
            k = at[period]
            A[k][place] = density * a
            B[k][place] = density * omega[k] * b[0]
    return omega, A, B, infinite


def _excitation(rows: list[list[float]], omega: Array, scale: float, m: int) -> tuple[Array, Array]:
    angles = sorted({row[1] for row in rows})
    X = np.full((len(omega), len(angles), m), np.nan, complex)
    for period, angle, i, _, _, real, imaginary in rows:
        if period > 0.0:
            k = int(np.argmin(np.abs(omega - 2 * np.pi / period)))
            X[k, angles.index(angle), _mode_index(i, m)] = scale * (
                real - 1j * imaginary
            )  # its conjugate: exp(-i omega t)
    if not np.isfinite(X).all():
        raise ValueError("it lacks excitation at some period and heading of NAME.1")
    return np.radians(angles), X
