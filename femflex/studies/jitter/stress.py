"""Random stress of bodies: the covariance of their amplitudes under all sources, and the largest rms of each
quantity."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.body.random_stress import rms_stress
from femflex.body.recovery import Peak, quantities
from femflex.studies.jitter.budget import Budget


def amplitude_covariance(budget: Budget, body: str) -> Array:
    """Covariance (n, n) of the amplitudes of a body under all sources, in squared units of the amplitudes.

    Of a swept source that speed counts, of the worst ones of the outputs, at which the amplitudes are largest.
    """
    plant, high = budget.plant, float(budget.edges[-1])
    total = np.zeros((plant.amplitude_count(body),) * 2)
    for name, noun in plant.sources.items():
        spectrum = plant.spectrum(budget.frequencies, name)
        if spectrum.any():
            H = plant.amplitudes(budget.frequencies, name, body)
            total += np.einsum("n,noc,nc,npc->op", budget.weights, H, spectrum, H.conj()).real
        scan = budget.contributions[name].scan if name in budget.contributions else None
        spin = None if scan is None else scan.spin
        speeds = [None] if scan is None else [float(scan.speeds[k]) for k in np.unique(scan.worst_indices)]
        candidates = []
        for speed in speeds:
            lines = [line for line in noun.lines(speed, high) if line.frequency >= budget.edges[0]]
            frequencies = np.array([line.frequency for line in lines])
            each = np.zeros_like(total)
            if lines:
                H = plant.amplitudes(frequencies, name, body, spin, np.full(len(lines), speed or 0.0))
                motion = np.einsum("noc,nc->no", H, np.array([line.amplitude for line in lines]))
                each = 0.5 * np.einsum("no,np->op", motion, motion.conj()).real
            candidates.append(each)
        total += max(candidates, key=lambda matrix: float(np.trace(matrix)))
    return total


def stress_peaks(budget: Budget, body: str) -> list[Peak]:
    """The largest root mean square of every quantity of a body over its points, by group and name; time is nan.

    Raises ValueError for a body that is not in `stress` of [jitter], or has no stress.
    """
    field = budget.plant.model.model.system.bodies[body].strain_field
    if not field:
        raise ValueError(f"body {body!r} has no elements to recover stress from; leave it out of jitter.stress")
    covariance = amplitude_covariance(budget, body)
    best: dict[tuple[str, str], Peak] = {}
    for part in field:
        units = quantities([part])
        for name, values in rms_stress(part, covariance).items():
            k = int(np.argmax(values))
            key = part.group or part.kind, name
            if key not in best or values[k] > best[key].value:
                x, y, z = (float(value) for value in part.places[k])
                best[key] = Peak(part.kind, name, units[name], float(values[k]), float("nan"), (x, y, z), part.group)
    return list(best.values())
