"""Root mean squares of the outputs by source, by mode and over frequency, and over the speeds of wheels and drives.

Lines have independent phases: their mean squares |H a|^2 / 2 add up, and so do those of the sources. The part of a
mode in
a mean square is that of the product of its own motion with the whole motion, so that the parts of all modes, and
of what is no mode, add up to the whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.body.random_stress import rms_stress
from femflex.body.recovery import Peak, quantities
from femflex.case import Case
from femflex.disturbances import BaseVibration, Line, Shock
from femflex.noun.problems import suggestion_text
from femflex.studies.jitter.plant import Mode, Plant, Spin, jitter_plant
from femflex.studies.jitter.shock import combined_peaks
from femflex.studies.linear.space import AROUND, response_grid
from femflex.system import Part

SPEEDS = 200  # evenly spaced speeds of a scan; those of resonances are added
BRANCHES = 60  # speeds at which the poles of a craft with a rotor are computed
TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class SpeedScan:
    """Jitter over the speed of a source.

    speeds (n,) [rad/s];  mean_squares (n, n_out);  orders (n_o,);  by_order (n, n_o, n_out) mean squares by harmonic
    spin   change of the model with the speed, None where there is none
    """

    speeds: Array
    mean_squares: Array
    orders: Array
    by_order: Array
    spin: Spin | None = None

    @property
    def worst_indices(self) -> Array:
        """Index (n_out,) of the worst speed of each output among the speeds."""
        return np.asarray(np.argmax(self.mean_squares, axis=0))


@dataclass(frozen=True, eq=False)
class Contribution:
    """Motion of the outputs by one source; of a swept source at the worst speed of each output.

    mean_squares (n_out,);  by_mode (n_modes + 1, n_out) parts of the modes, and last of what is no mode
    at_lines  frequencies [Hz] and mean squares of the lines of each output: n_out pairs of (n_l,)
    density   (n, n_out) one-sided, at the frequencies of the budget; zero for lines
    scan      over speeds, of a swept source
    """

    mean_squares: Array
    by_mode: Array
    at_lines: tuple[tuple[Array, Array], ...]
    density: Array
    scan: SpeedScan | None = None

    @property
    def rms(self) -> Array:
        """Root mean squares (n_out,) in the units of the outputs."""
        return np.sqrt(np.maximum(self.mean_squares, 0.0))


@dataclass(frozen=True, eq=False)
class Budget:
    """The pointing budget of a craft.

    names, units (n_out,)  of the outputs;  modes;  contributions by name of the source
    frequencies (n,), weights (n,), edges (n_p + 1,)  [Hz] of the integrals
    """

    plant: Plant
    modes: tuple[Mode, ...]
    frequencies: Array
    weights: Array
    edges: Array
    contributions: Mapping[str, Contribution]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self.plant.names

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the outputs."""
        return self.plant.units

    @property
    def mean_squares(self) -> Array:
        """Mean squares (n_out,) of all sources together, in squared units of the outputs."""
        return np.asarray(sum((entry.mean_squares for entry in self.contributions.values()), np.zeros(len(self.names))))

    @property
    def rms(self) -> Array:
        """Root mean squares (n_out,) of all sources together, in the units of the outputs."""
        return np.sqrt(self.mean_squares)

    def limits(self) -> list[float | None]:
        """Limit of three standard deviations of each output; None where there is none."""
        outputs = self.plant.table.outputs
        return [outputs[name.partition(":")[0]].limit for name in self.names]

    def notches(self) -> dict[str, tuple[float, float]]:
        """Of each source that a limit of force notches: largest ratio of the densities [1], and its frequency [Hz]."""
        out = {}
        for name, noun in self.plant.sources.items():
            if name in self.contributions and isinstance(noun, BaseVibration) and noun.interface:
                full = noun.spectrum(self.frequencies)[:, 0]
                ratio = full / np.where(full > 0.0, self.plant.spectrum(self.frequencies, name)[:, 0], 1.0)
                k = int(np.argmax(ratio))
                out[name] = (float(ratio[k]), float(self.frequencies[k]))
        return out

    def shocks(self) -> dict[str, tuple[Array, Array, Array]]:
        """Peaks of the outputs under each shock: SRSS (n_out,), CQC (n_out,), and of each mode (n_modes, n_out)."""
        shocks = [name for name, noun in self.plant.sources.items() if isinstance(noun, Shock)]
        return {name: combined_peaks(self.plant, name) for name in shocks}

    def rms_of(self, output: str) -> tuple[float, str]:
        """Root mean square of an output, and its unit. Raises ValueError for an output that there is not."""
        if output not in self.names:
            raise ValueError(f"[jitter] has no output {output!r}; {suggestion_text(output, self.names)}")
        k = self.names.index(output)
        return float(self.rms[k]), self.units[k]

    @property
    def by_mode(self) -> Array:
        """Parts (n_modes + 1, n_out) of `mean_squares` in their units, the last of what is no mode."""
        none = np.zeros((len(self.modes) + 1, len(self.names)))
        return np.asarray(sum((entry.by_mode for entry in self.contributions.values()), none))

    def cumulative(self) -> Array:
        """Mean squares (n_p + 1, n_out), in squared units, up to each of the edges, of all sources."""
        total = np.zeros((len(self.edges), len(self.names)))
        for entry in self.contributions.values():
            total += cumulative(entry.density, self.weights)
            for k, (frequencies, squares) in enumerate(entry.at_lines):
                order = np.argsort(frequencies)
                below = np.concatenate([[0.0], np.cumsum(squares[order])])
                total[:, k] += below[np.searchsorted(frequencies[order], self.edges, side="right")]
        return total


def jitter(
    case: Case, bodies: Mapping[str, Part] | None = None, progress: Callable[[str], None] | None = None
) -> Budget:
    """The pointing budget of a case with [disturbances] and [jitter].

    bodies: in place of those of the case;  progress: is told what is done. Shocks are no part of it: see
    `combined_peaks`.
    Raises CaseError, ValueError and KeyError for what the case lacks, and for a model with an undamped pole in the
    band.
    """
    say = progress or (lambda text: None)
    plant = jitter_plant(case, bodies)
    low, high = _band(plant)
    modes = tuple(mode for mode in plant.modes() if low <= mode.frequency <= high)
    breaks = [noun.breaks() for noun in plant.sources.values()]
    poles = np.asarray(np.linalg.eigvals(plant.A), complex)
    if plant.loop is not None:
        poles = np.append(poles, plant.loop.poles)
    frequencies, weights, edges = frequency_panels(low, high, poles, breaks)
    contributions = {}
    for name, noun in plant.sources.items():
        if isinstance(noun, Shock):
            continue
        say(f"source {name}")
        if noun.rates is not None:
            contributions[name] = _swept(plant, name, modes, high, len(frequencies), low)
            continue
        density, parts = _random(plant, name, modes, frequencies, weights)
        lines = [line for line in noun.lines(None, high) if line.frequency >= low]
        squares, line_parts = _of_lines(plant, name, modes, lines)
        at_lines = tuple((np.array([line.frequency for line in lines]), row) for row in squares.T)
        total = weights @ density + squares.sum(axis=0)
        contributions[name] = Contribution(total, parts + line_parts, at_lines, density)
    return Budget(plant, modes, frequencies, weights, edges, contributions)


def _band(plant: Plant) -> tuple[float, float]:
    """Lowest and highest frequency [Hz]: those of [jitter], or those of the vibrations and of the sources."""
    if plant.table.band is not None:
        return plant.table.band
    grid = response_grid(plant.model) / TURN
    ends = [(float(grid[0]), float(grid[-1]))]
    ends += [noun.band for noun in plant.sources.values() if noun.band is not None]
    return min(low for low, _ in ends), max(high for _, high in ends)


def _random(plant: Plant, name: str, modes: Sequence[Mode], frequencies: Array, weights: Array) -> tuple[Array, Array]:
    """Spectral densities (n, n_out) of the outputs, and the parts (n_modes + 1, n_out) of their mean squares."""
    spectrum = plant.spectrum(frequencies, name)
    if not spectrum.any():
        return np.zeros((len(frequencies), len(plant.names))), np.zeros((len(modes) + 1, len(plant.names)))
    H = plant.response(frequencies, name)
    density = np.einsum("noc,nc->no", np.abs(H) ** 2, spectrum)
    parts = np.array([
        weights @ np.einsum("noc,noc,nc->no", H.conj(), plant.modal_response(mode, frequencies, name), spectrum).real
        for mode in modes
    ]).reshape(len(modes), len(plant.names))  # fmt: skip
    return density, np.vstack([parts, weights @ density - parts.sum(axis=0)])


def _of_lines(
    plant: Plant, name: str, modes: Sequence[Mode], lines: Sequence[Line], spin: Spin | None = None, speed: float = 0.0
) -> tuple[Array, Array]:
    """Mean squares (n_l, n_out) of lines, and the parts (n_modes + 1, n_out) of their sum; a rotor has this speed."""
    if not lines:
        return np.zeros((0, len(plant.names))), np.zeros((len(modes) + 1, len(plant.names)))
    frequencies, amplitudes = np.array([line.frequency for line in lines]), np.array([line.amplitude for line in lines])
    H = plant.response(frequencies, name, spin, np.full(len(lines), speed))
    motion = np.einsum("noc,nc->no", H, amplitudes)
    squares = 0.5 * np.abs(motion) ** 2
    parts = np.zeros((len(modes) + 1, len(plant.names)))
    for k, mode in enumerate(modes):
        own = np.einsum("noc,nc->no", plant.modal_response(mode, frequencies, name), amplitudes)
        parts[k] = 0.5 * (motion.conj() * own).real.sum(axis=0)
    parts[-1] = squares.sum(axis=0) - parts[:-1].sum(axis=0)
    return squares, parts


def _swept(plant: Plant, name: str, modes: Sequence[Mode], high: float, n_frequencies: int, low: float) -> Contribution:
    """The contribution of a source over its range of rates, at the worst of each output."""
    noun = plant.sources[name]
    assert noun.rates is not None
    first, last = noun.rates
    spin = plant.spin(name, first, last)
    orders = noun.orders(high)
    speeds = _speeds(plant.A, spin, first, last, orders)
    place = {order: k for k, order in enumerate(orders)}
    rows = [
        (i, place[line.order], line)
        for i, speed in enumerate(speeds)
        for line in noun.lines(speed, high)
        if line.frequency >= low and line.order in place
    ]
    by_order = np.zeros((len(speeds), len(orders), len(plant.names)))
    if rows:
        at, of = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        H = plant.response(np.array([line.frequency for *_, line in rows]), name, spin, speeds[at])
        motion = np.einsum("noc,nc->no", H, np.array([line.amplitude for *_, line in rows]))
        np.add.at(by_order, (at, of), 0.5 * np.abs(motion) ** 2)
    scan = SpeedScan(speeds, by_order.sum(axis=1), np.array(orders), by_order, spin)
    total, parts, at_lines = np.zeros(len(plant.names)), np.zeros((len(modes) + 1, len(plant.names))), []
    for k, i in enumerate(scan.worst_indices):
        lines = [line for line in noun.lines(speeds[i], high) if line.frequency >= low]
        own_modes = list(modes)
        if spin is not None:
            own_modes = _matched(replace(plant, A=plant.A + spin.change(speeds[i])), modes)
        squares, line_parts = _of_lines(plant, name, own_modes, lines, spin, speeds[i])
        total[k], parts[:, k] = squares[:, k].sum(), line_parts[:, k]
        at_lines.append((np.array([line.frequency for line in lines]), squares[:, k]))
    return Contribution(total, parts, tuple(at_lines), np.zeros((n_frequencies, len(plant.names))), scan)


def _speeds(A: ComplexArray, spin: Spin | None, first: float, last: float, orders: Sequence[float]) -> Array:
    """Speeds (n,) [rad/s] of a scan: evenly spaced, and around each resonance of each order, split or not."""
    speeds = [np.linspace(first, last, SPEEDS)]
    coarse = np.linspace(first, last, BRANCHES if spin else 2)
    branches = [_positive(A if spin is None else A + spin.change(speed)) for speed in coarse]
    count = min(len(branch) for branch in branches)
    poles = np.array([branch[:count] for branch in branches])  # by rank: branches may cross
    for order in orders:
        gap = order * coarse[:, None] - poles.imag
        for j, k in np.argwhere(gap[:-1] * gap[1:] <= 0):
            share = gap[j, k] / (gap[j, k] - gap[j + 1, k] or 1.0)
            pole = poles[j, k] + share * (poles[j + 1, k] - poles[j, k])
            speeds.append(pole.imag / order + AROUND * max(-pole.real, 1e-6 * abs(pole)) / order)
    grid = np.unique(np.concatenate(speeds))
    return np.asarray(grid[(grid >= first) & (grid <= last)])


def _positive(A: ComplexArray) -> ComplexArray:
    """Eigenvalues (n,) [1/s] of oscillations, by rising frequency."""
    values = np.linalg.eigvals(A)
    values = values[values.imag > 1e-9 * np.abs(values).max(initial=0.0)]
    return np.asarray(values[np.argsort(values.imag)])


def _matched(plant: Plant, modes: Sequence[Mode]) -> list[Mode]:
    """The modes of a plant in the order of those of another speed, by rank of frequency."""
    own = plant.modes()
    low, count = 0, len(modes)
    if modes:
        low = int(np.argmin([abs(mode.frequency - modes[0].frequency) for mode in own]))
    return own[low : low + count]


PER_DECADE = 24  # panels on a log axis
HALF_WIDTHS = 2.0 ** np.arange(-1, 12)  # half widths of a resonance at which panels end
ORDER = 8  # points of Gauss in a panel
LEAST = 1e-7  # damping ratio of the narrowest resonance that is resolved


def frequency_panels(
    low: float, high: float, poles: ComplexArray, breaks: Iterable[Array] = ()
) -> tuple[Array, Array, Array]:
    """Frequencies (n,), weights (n,) and ends (n_p + 1,) of the panels of an integral from low to high [Hz].

    poles (m,) [1/s]: panels grow by a factor of two from each resonance on, so that Gauss's rule of 8 points is exact
    to rounding for oscillators.   breaks: frequencies [Hz] at which a spectrum has a kink.
    """
    decades = np.log10(high / low)
    ends = [np.geomspace(low, high, max(2, int(np.ceil(PER_DECADE * decades)) + 1)), *breaks]
    for pole in poles[poles.imag > 0]:
        width = max(-pole.real, LEAST * abs(pole))
        ends.append((pole.imag + width * np.concatenate([-HALF_WIDTHS, [0.0], HALF_WIDTHS])) / (2.0 * np.pi))
    edges = np.unique(np.concatenate(ends))
    edges = np.concatenate([[low], edges[(edges > low * (1 + 1e-12)) & (edges < high * (1 - 1e-12))], [high]])
    x, w = np.polynomial.legendre.leggauss(ORDER)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * w).ravel(), edges


def cumulative(values: Array, weights: Array) -> Array:
    """The integral (n_p + 1, ...) up to each end of the panels, of values (n, ...) [SI] at the points of their rule."""
    weighted = values * weights.reshape((-1,) + (1,) * (values.ndim - 1))
    panels = weighted.reshape((-1, ORDER, *values.shape[1:])).sum(axis=1)
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(panels, axis=0)])


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
