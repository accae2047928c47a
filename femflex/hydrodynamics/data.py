"""Added mass, radiation damping and excitation of a body by waves, over frequency."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femflex.arrays import Array, ComplexArray

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")


@dataclass(frozen=True, eq=False)
class WaveData:
    """Data of one body over frequency; motions and forces at one point of its mean place, SI.

    The m motions are the six of a rigid body, then those of the shapes of a flexible one.

    omega       (n,)       frequencies, rising [rad/s]
    added_mass  (n, m, m)  symmetric;  damping (n, m, m) likewise
    infinite    (m, m)     added mass at infinite frequency, None where the data have none
    headings    (h,)       directions in which the waves run, from x about z, rising [rad]
    excitation  (n, h, m)  X per amplitude: the force of a wave a cos(k x - omega t) is Re(a X exp(-i omega t))
    stiffness   (m, m)     hydrostatic stiffness of a floating body, None where the data have none
    volume, buoyancy_center, mass_center  with which the stiffness was found, None where the data have none [m^3, m]
    density, gravity       with which it was computed [kg/m^3, m/s^2]
    shapes      (m - 6,)   names of the motions beyond the six; of WAMIT their numbers "7", "8", ...
    """

    omega: Array
    added_mass: Array
    damping: Array
    infinite: Array | None
    headings: Array
    excitation: ComplexArray
    density: float
    gravity: float
    stiffness: Array | None = None
    volume: float | None = None
    buoyancy_center: Array | None = None
    mass_center: Array | None = None
    shapes: tuple[str, ...] = ()

    def excitation_at(self, omega: float, heading: float) -> ComplexArray:
        """X (m,) at a frequency and heading, by straight lines. Raises ValueError outside the data."""
        if not len(self.headings):
            raise ValueError("the data have no excitation")
        turned = (heading - self.headings[0] + 1e-9) % (2 * np.pi) + self.headings[0] - 1e-9
        if len(self.headings) == 1 and abs(np.sin((heading - self.headings[0]) / 2)) < 1e-6:
            turned = float(self.headings[0])
        if not (self.omega[0] <= omega <= self.omega[-1]):
            raise ValueError(
                f"a wave of {omega:.4g} rad/s is outside the data, which reach from {self.omega[0]:.4g} to "
                f"{self.omega[-1]:.4g} rad/s"
            )
        if not self.headings[0] - 1e-6 <= turned <= self.headings[-1] + 1e-6:
            raise ValueError(
                f"waves that run at {np.degrees(heading):.4g} deg are outside the data, whose headings reach from "
                f"{np.degrees(self.headings[0]):.4g} to {np.degrees(self.headings[-1]):.4g} deg"
            )
        j = int(np.clip(np.searchsorted(self.headings, turned) - 1, 0, max(len(self.headings) - 2, 0)))
        rows = [self._over_frequency(j, omega)]
        if len(self.headings) > 1:
            share = (turned - self.headings[j]) / (self.headings[j + 1] - self.headings[j])
            rows = [(1.0 - share) * rows[0] + share * self._over_frequency(j + 1, omega)]
        return rows[0]

    def over_motions(self, J: Array) -> WaveData:
        """The same over other motions (k,), of which each moves those of the data by a column of J (m, k)."""

        def projected(a: Array | None) -> Any:
            return None if a is None else J.T @ a @ J

        matrices = {key: projected(getattr(self, key)) for key in ("added_mass", "damping", "infinite", "stiffness")}
        return replace(self, excitation=self.excitation @ J, **matrices)

    def _over_frequency(self, heading: int, omega: float) -> ComplexArray:
        rows = self.excitation[:, heading]
        return np.array(
            [np.interp(omega, self.omega, row.real) + 1j * np.interp(omega, self.omega, row.imag) for row in rows.T]
        )

    def rising(self) -> WaveData:
        """The same with frequencies and headings in rising order, and symmetric matrices."""
        order, turn = np.argsort(self.omega), np.argsort(self.headings)

        def symmetric(a: Array) -> Array:
            return np.asarray((a + a.swapaxes(-1, -2)) / 2)

        return replace(
            self, omega=self.omega[order], added_mass=symmetric(self.added_mass[order]),
            damping=symmetric(self.damping[order]), headings=self.headings[turn],
            excitation=self.excitation[order][:, turn],
            infinite=None if self.infinite is None else symmetric(self.infinite),
        )  # fmt: skip
