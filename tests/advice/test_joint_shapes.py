"""Few modes of bodies that carry others, against transcendental equations: 1 %, or a warning with the error."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import brentq

from femflex import build_system, read_case
from femflex.advice.elastic_motion import rest_modes
from femflex.warning import TruncationWarning

EI, GJ, MASS, LENGTH = 4e3, 3e3, 0.8, 5.0  # N m^2, N m^2, kg/m, m
HEAD = f"""
[run]
duration = 1
samples = 11

[sections.tube]
kind = "stiffness"
EA = 1e7
EIy = {EI}
EIz = {EI}
GJ = {GJ}
mass_per_length = {MASS}
ry = 0.02
rz = 0.02
"""
BOOM = """
[bodies.{name}]
kind = "flexible"
strain = "linear"
mesh = "beam.inp"
members = [{{ group = "BOOM", family = "beam", section = "tube", options = {{ order = 4, rotary_inertia = false }} }}]
reduction = {{ {reduction} }}
markers.root = {{ group = "ROOT" }}
markers.tip = {{ group = "TIP" }}
"""
ANALYTIC = f"""
[bodies.a]
kind = "analytic"
strain = "linear"
length = {LENGTH}
EA = 1e7
EIy = {EI}
EIz = {EI}
GJ = {GJ}
mass_per_length = {MASS}
rotary_inertia = false
functions = {{{{ y = {{n}}, z = {{n}}{{more}} }}}}
"""
RIGID = """
[bodies.{name}]
kind = "rigid"
mass = {mass}
inertia = [{J}, {J}, {J}]
markers.seat = {{ position = [0.0, 0, 0] }}
"""
CANTILEVER = 'method = "cantilever", clamp = "ROOT", modes = {}'
OFF = ", loads = {}, attachment = []"


def weld(child, child_marker, parent="", parent_marker=""):
    joint = f'\n[[joints]]\nkind = "weld"\nchild = "{child}"\nchild_marker = "{child_marker}"\n'
    return joint + (f'parent = "{parent}"\nparent_marker = "{parent_marker}"\n' if parent else "")


def boom(name, reduction):
    return BOOM.format(name=name, reduction=reduction)


@pytest.fixture
def frequencies_of(tmp_path):
    """Writes a case; returns its elastic frequencies [rad/s], and warnings of sets that are too small."""
    xs = np.linspace(0.0, LENGTH, 7)
    lines = ["*NODE", *(f"{k + 1}, {x}, 0.0, 0.0" for k, x in enumerate(xs)), "*ELEMENT, TYPE=B31, ELSET=BOOM"]
    lines += [f"{k}, {k}, {k + 1}" for k in range(1, len(xs))]
    lines += ["*NSET, NSET=ROOT", "1", "*NSET, NSET=TIP", str(len(xs))]
    (tmp_path / "beam.inp").write_text("\n".join(lines) + "\n")

    def frequencies(text, run=""):
        head = HEAD.replace("samples = 11", f"samples = 11\n{run}")
        (tmp_path / "case.toml").write_text('title = "carried"\n' + head + text)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", TruncationWarning)
            system = build_system(read_case(tmp_path / "case.toml"))
        texts = [str(warning.message) for warning in caught if warning.category is TruncationWarning]
        modes = rest_modes(system)
        return modes.omega[modes.elastic], texts, system

    return frequencies


def waves(x):
    """cos, sin, exp(-x) and exp(-(b - x)) with three derivatives by x = beta s, for b = 1: (4 derivatives, 4)."""
    c, s, e = np.cos(x), np.sin(x), np.exp(-x)
    return np.array([[c, s, e, 0], [-s, c, -e, 0], [-c, -s, e, 0], [s, -c, -e, 0]], float)


def determinant(b, ends):
    """Of a beam of length b in units of 1 / beta, its ends as `ends` say: rows (w, w', w'', w''') -> two each."""
    root, tip = waves(0.0), waves(b)
    decay = np.array([1.0, 1.0, 1.0, 1.0])
    root[:, 3], tip[:, 3] = np.exp(-b) * decay, decay  # exp(-(b - x)): all its derivatives are alike
    return np.linalg.det(np.array([*ends[0](root, b), *ends[1](tip, b)]))


def roots(ends, n=3):
    """The n lowest omega [rad/s] at which the end conditions can be met."""
    grid = np.linspace(0.15, 14.0, 4000)
    values = [determinant(b, ends) for b in grid]
    at = np.flatnonzero(np.diff(np.sign(values)) != 0)[:n]
    b = np.array([brentq(determinant, grid[k], grid[k + 1], args=(ends,), xtol=1e-13) for k in at])
    return (b / LENGTH) ** 2 * np.sqrt(EI / MASS)


def clamped_end(w, b):
    return w[0], w[1]


def end_with_rigid_body(m, J, sign):
    """An end with a rigid body of mass m and inertia J about it: sign 1 at the tip, -1 at the root.

    Shear and moment: EI w''' = -sign m omega^2 w, EI w'' = sign J omega^2 w', over EI beta^3 and EI beta^2.
    """

    def rows(w, b):
        beta = b / LENGTH
        return w[3] + sign * m * beta / MASS * w[0], w[2] - sign * J * beta**3 / MASS * w[1]

    return rows


def checked_errors(frequencies, texts, exact):
    """Relative errors of the frequencies: each is below 1 %, or the warning names the body."""
    for k, true in enumerate(exact):
        error = frequencies[k] / true - 1.0
        assert error > -2e-4  # a reduced set is too stiff; the mesh is good to 1e-4
        if error > 0.011:
            assert len(texts) == 1
            assert "frequencies" in texts[0] and "'a'" in texts[0]
    if max(frequencies[k] / true - 1.0 for k, true in enumerate(exact)) < 0.009:
        assert not texts
    return [frequencies[k] / true - 1.0 for k, true in enumerate(exact)]


@pytest.mark.sampled(1)
@pytest.mark.parametrize("modes", [2, 4, 8])
def test_two_booms_in_line_match_one_of_twice_the_length(frequencies_of, modes):
    """1.8751^2, 4.6941^2 sqrt(EI / m (2 L)^4), each in two planes; without the static shapes 7.7, 3.1, 1.3 % off."""
    exact = np.repeat(np.array([1.8751040687, 4.6940911330]) ** 2 * np.sqrt(EI / MASS) / (2 * LENGTH) ** 2, 2)[:3]
    for off, first in (("", 0.0), (OFF, {2: 0.077, 4: 0.031, 8: 0.013}[modes])):
        reduction = CANTILEVER.format(modes) + off
        text = boom("a", reduction) + boom("b", reduction) + weld("a", "root") + weld("b", "root", "a", "tip")
        frequencies, texts, system = frequencies_of(text)
        errors = checked_errors(frequencies, texts, exact if len(frequencies) >= 3 else exact[:2])
        assert errors[0] == pytest.approx(first, abs=1e-3)
        assert bool(texts) == bool(off)
        if not off:
            assert max(errors) < 2e-3
            assert all(body.n_modes <= modes + 12 for body in system.bodies.values())
            assert system.bodies["a"].omega.max() < 2 * np.pi * 5e3 / 10  # no pull along the boom among them


@pytest.mark.sampled(2)
@pytest.mark.parametrize("modes", [2, 4, 8])
@pytest.mark.parametrize("off", ["", OFF])
def test_boom_with_payload_at_its_tip(frequencies_of, modes, off):
    """20 kg on 4 kg; bending in two planes, and twist with x tan x = I_p L / J."""
    m, J = 20.0, 0.5
    text = boom("a", CANTILEVER.format(modes) + off) + RIGID.format(name="pay", mass=m, J=J)
    frequencies, texts, _ = frequencies_of(text + weld("a", "root") + weld("pay", "origin", "a", "tip"))
    bending = roots((clamped_end, end_with_rigid_body(m, J, 1.0)), 2)
    polar = MASS * 2 * 0.02**2
    x = brentq(lambda x: x * np.tan(x) - polar * LENGTH / J, 1e-6, 1.5)
    exact = np.sort([*np.repeat(bending, 2), x / LENGTH * np.sqrt(GJ / polar)])[:3]
    errors = checked_errors(frequencies, texts, exact[: len(frequencies)])
    assert off or (max(errors) < 2e-3 and not texts)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("m", "J"), [(200.0, 50.0), (1.0, 0.05)], ids=["heavy hub", "light hub"])
@pytest.mark.parametrize("modes", [2, 4, 6])
@pytest.mark.parametrize(
    "reduction",
    [
        CANTILEVER,
        CANTILEVER + OFF,
        'method = "free_free", modes = {}',
        'method = "free_free", modes = {}, joints = {{}}',
    ],
    ids=["cantilever", "cantilever alone", "free-free", "free-free alone"],
)
def test_free_hub_with_a_boom(frequencies_of, m, J, modes, reduction):
    """A light hub: 22 % with four modes alone. Free-free modes alone know nothing of the hub's clamp."""
    reduction = reduction.replace(OFF, OFF.replace("{}", "{{}}")).format(modes)
    frequencies, texts, _ = frequencies_of(
        RIGID.format(name="hub", mass=m, J=J) + boom("a", reduction) + weld("a", "root", "hub", "seat")
    )
    exact = np.repeat(roots((end_with_rigid_body(m, J, -1.0), end_with_rigid_body(0.0, 0.0, 1.0)), 2), 2)[:3]
    errors = checked_errors(frequencies, texts, exact[: len(frequencies)])
    if "joints" not in reduction and "loads" not in reduction and modes > 2:
        assert max(errors) < 2e-3


@pytest.mark.sampled(1)
@pytest.mark.parametrize("n", [2, 4])
@pytest.mark.parametrize("more", ["", ", joints = []", ', joints = ["tip"]'])
def test_beam_on_functions_with_payload(frequencies_of, n, more):
    m, J = 20.0, 0.5
    text = ANALYTIC.format(n=n, more=more) + RIGID.format(name="pay", mass=m, J=J)
    frequencies, texts, system = frequencies_of(text + weld("a", "root") + weld("pay", "origin", "a", "tip"))
    exact = np.repeat(roots((clamped_end, end_with_rigid_body(m, J, 1.0)), 2), 2)[:3]
    errors = checked_errors(frequencies, texts, exact)
    assert more == ", joints = []" or (max(errors) < 2e-3 and not texts)
    assert system.bodies["a"].n_modes == 2 * n + {"": 4, ', joints = ["tip"]': 4}.get(more, 0)
