"""Makes ground_motion.csv: an artificial earthquake of 0.35 g, noise in the spectrum of Kanai and Tajimi for firm soil.

Ground frequency 15.6 rad/s, damping ratio 0.6; below 1.5 rad/s it is filtered as R. W. Clough and J. Penzien do
(Dynamics of Structures, 1975). It grows over 2 s and fades from 7 s on.
"""

from pathlib import Path

import numpy as np

STEP, DURATION, PEAK = 0.02, 15.0, 0.35  # s, s, g0
GROUND, GROUND_RATIO, HIGH, HIGH_RATIO = 15.6, 0.6, 1.5, 0.6  # rad/s


def ground_motion() -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and accelerations [g0]."""
    n = round(DURATION / STEP) + 1
    t = STEP * np.arange(n)
    w = 2.0 * np.pi * np.fft.rfftfreq(n, STEP)
    r, s = w / GROUND, w / HIGH
    soil = (1 + 2j * GROUND_RATIO * r) / (1 - r**2 + 2j * GROUND_RATIO * r)
    high = s**2 / (1 - s**2 + 2j * HIGH_RATIO * s)
    noise = np.random.default_rng(1940).normal(size=n)
    a = np.fft.irfft(np.fft.rfft(noise) * soil * high, n)
    a = a * np.minimum(t / 2.0, 1.0) ** 2 * np.exp(-0.35 * np.maximum(t - 7.0, 0.0))
    return t, PEAK * a / np.abs(a).max()


if __name__ == "__main__":
    rows = "\n".join(f"{t:.2f},{a:.6f}" for t, a in zip(*ground_motion(), strict=True))
    head = "# an artificial earthquake, made by ground_motion.py\ntime [s],along [g0]\n"
    Path(__file__).with_name("ground_motion.csv").write_text(f"{head}{rows}\n", encoding="utf-8")
