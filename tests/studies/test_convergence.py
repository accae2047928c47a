"""Convergence studies over meshes, modes, derivatives and segments, against closed forms and unreduced runs."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.case import Case
from femflex.cli.app import app
from femflex.pipeline import prepare
from femflex.pipeline.case_bodies import build_body
from femflex.reduction import save_body
from femflex.studies import assess_convergence, convergence, plan_study
from femflex.warning import PhysicsWarning

LENGTH, EI, MASS = 4.0, 50.0, 0.5  # as in conftest.py
ROOTS = (1.8751040687119611, 4.6940911329741746, 7.8547574382376126)  # of cosh x cos x = -1

QUANTITY = 'quantity = { of = "value", channel = "markers/beam.tip/deflection", component = "y" }'
FIRST_MODE = 'quantity = { of = "mode_frequency", body = "beam", mode = 1 }'
PLAIN = ("modes = 4 }", "modes = 4, joints = {} }")  # without the static shapes of joints that few modes get
NODAL = ('method = "cantilever", clamp = "ROOT", modes = 4', 'method = "nodal", clamp = "ROOT"')

BuildCase = Callable[..., Case]


def clamped_free(root: float, EI: float) -> float:
    """Frequency of a clamped-free Euler-Bernoulli beam [Hz]."""
    return (root / LENGTH) ** 2 * math.sqrt(EI / MASS) / (2 * math.pi)


@pytest.mark.parametrize(
    ("mode", "exact"),
    [(1, clamped_free(ROOTS[0], EI)), (2, clamped_free(ROOTS[0], 2 * EI)), (3, clamped_free(ROOTS[1], EI))],
)
def test_cubic_elements_show_order_four_and_richardson_hits_the_closed_form(
    build_case: BuildCase, mode: int, exact: float
):
    case = build_case((QUANTITY, FIRST_MODE.replace("mode = 1", f"mode = {mode}")), cells=4)
    study = convergence(case, "mesh", levels=[0, 1, 2, 3])
    assert study.order == pytest.approx(4.0, abs=0.05)
    assert study.trend.scatter < 0.2
    assert study.estimate == pytest.approx(exact, rel=1e-7)
    true = np.abs(study.values - exact)
    np.testing.assert_allclose(study.errors[:-1], true[:-1], rtol=0.02)
    assert abs(study.estimate - exact) < 0.05 * true[-1]
    assert study.counts.tolist() == [50, 94, 182, 358]  # 6 a node, 5 inside an element for axial and torsion


@pytest.mark.parametrize(("tolerance", "level"), [(1e-2, 0), (1e-4, 1), (1e-5, 2), (1e-7, None)])
def test_recommended_refinement_matches_the_closed_form(build_case: BuildCase, tolerance: float, level: int | None):
    study = convergence(build_case((QUANTITY, FIRST_MODE), cells=2), "mesh", [0, 1, 2], tolerance)
    is_within = np.abs(study.values / clamped_free(ROOTS[0], EI) - 1) <= tolerance
    assert study.recommended == level == (int(np.argmax(is_within)) if is_within.any() else None)


def test_rounding_of_too_many_cubic_elements(build_case: BuildCase):
    study = convergence(build_case((QUANTITY, FIRST_MODE), cells=16), "mesh", [0, 1, 2, 3, 4, 5], 1e-6)
    exact = clamped_free(ROOTS[0], EI)
    assert study.trend.rounded is not None and study.trend.rounded <= 4
    assert abs(study.estimate - exact) < 2e-8 * exact
    assert np.all(study.errors >= 0.2 * np.abs(study.values - exact))
    assert study.recommended == 0


def value_of_run(case: Case) -> float:
    """The quantity by a run of the case as it is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # few modes are meant to be few here
        prepared = prepare(case, case.path.parent / "none.h5")
    solution = prepared.integrator.solve(prepared.model, prepared.times, prepared.model.x0)
    channels = prepared.model.observe(prepared.times[-1:], solution.states[-1:])
    return float(channels["markers/beam.tip/deflection"][0, 1])


@pytest.mark.slow
def test_recommended_modes_match_the_unreduced_run(build_case: BuildCase):
    exact = value_of_run(build_case(NODAL))
    study = plan_study(build_case(PLAIN), "modes", [1, 2, 3, 4, 5, 6, 8, 10])
    points = list(study.points())
    recommended = []
    for tolerance in (3e-2, 1e-3):
        result = assess_convergence(study, points, tolerance)
        exceeding = np.flatnonzero(np.abs(result.values / exact - 1) > tolerance)
        assert result.recommended == result.levels[exceeding[-1] + 1]
        recommended.append(result.recommended)
    assert recommended[0] < recommended[1] < 10
    assert result.estimate == pytest.approx(exact, rel=1e-3)


def test_frequency_of_a_run_converges_to_that_of_the_coupled_beam(build_case: BuildCase):
    """Hub and beam free in the plane: the transcendental equation of a free-free beam with a rigid body at one end."""
    ring = QUANTITY.replace('"value"', '"frequency"').replace("}", ", start = 2, tones = 2 }")
    long_run = ('duration = "4 s"', 'duration = "40 s"')
    weak_pulse = (
        "torque = [[0, 0, 0], [0, 4, 8]",
        "torque = [[0, 0, 0], [0, 0.04, 0.08]",
    )  # spin would shift it by 2e-3
    short_pulse = ("times = [0, 1, 2]", "times = [0, 0.2, 0.4]")  # two seconds would hardly excite a mode at one hertz
    study = convergence(build_case((QUANTITY, ring), long_run, weak_pulse, short_pulse, PLAIN), "modes", [2, 4, 6, 8])
    assert study.unit == "Hz"
    assert study.estimate == pytest.approx(coupled_frequency(2 * EI), rel=1e-4)


def coupled_frequency(EI: float) -> float:
    """First bending frequency [Hz] of a beam with a rigid body (5 kg, 3 kg m^2) at its root, free in space."""
    from scipy.optimize import brentq

    def determinant(b: float) -> float:
        # w = a cos + b sin + c cosh + d sinh of b x / L; shear and moment at the root move the body, none at the tip
        k, w2 = b / LENGTH, (b / LENGTH) ** 4 * EI / MASS
        c, s, ch, sh = math.cos(b), math.sin(b), math.cosh(b), math.sinh(b)
        root_force = [5.0 * w2, EI * k**3, 5.0 * w2, -EI * k**3]
        root_moment = [-EI * k**2, 3.0 * w2 * k, EI * k**2, 3.0 * w2 * k]
        rows = [root_force, root_moment, [-c, -s, ch, sh], [s, -c, sh, ch]]
        return float(np.linalg.det(np.array(rows) / np.abs(rows).max(axis=1, keepdims=True)))

    grid = np.linspace(0.5, 8.0, 400)
    signs = np.sign([determinant(b) for b in grid])
    sign_change = int(np.flatnonzero(signs[:-1] * signs[1:] < 0)[0])
    root = brentq(determinant, grid[sign_change], grid[sign_change + 1], xtol=1e-13)
    return (root / LENGTH) ** 2 * math.sqrt(EI / MASS) / (2 * math.pi)


HUBS_MODE, MODE_200, LOST = (
    FIRST_MODE.replace(old, new) for old, new in (("beam", "hub"), ("1", "200"), ("beam", "bem"))
)


FREQUENCY = (
    'of = "value", channel = "markers/beam.tip/deflection", component = "y"',
    'of = "mode_frequency", body = "beam", mode = 1',
)
CANTILEVER = 'method = "cantilever", clamp = "ROOT", modes = 4'
MESHED = """kind = "flexible"
mesh = "beam.inp"
members = [{ group = "BEAM", family = "beam", section = "beam", options = { rotary_inertia = false } }]
reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }
markers.tip = { group = "TIP" }
"""
POLYNOMIALS = """kind = "analytic"
length = 4
EA = 1e5
EIy = 50
EIz = 100
GJ = 4
mass = 2
rotary_inertia = false
functions = { y = 3, z = 3, family = "polynomial" }
"""
EXACT = (1.8751040687119611 / 4.0) ** 2 * math.sqrt(50.0 / 0.5) / (2 * math.pi)  # clamped-free, EIy


def test_polynomials_converge_to_the_beam(build_case: BuildCase):
    case = build_case(FREQUENCY, (MESHED, POLYNOMIALS), ('child_marker = "ROOT"', 'child_marker = "root"'))
    study = convergence(case, "modes", [1, 2, 3, 4], 1e-3)
    assert study.counts.tolist() == [2, 4, 6, 8]
    error = np.abs(study.values / EXACT - 1)
    assert np.all(study.errors >= 0.95 * error * EXACT)
    assert abs(study.estimate - EXACT) < 1.2 * study.trend.spread  # errors fall faster than by either law
    assert study.recommended == study.levels[np.argmax(error < 1e-3)]


def test_craig_bampton_levels_converge_from_above(build_case: BuildCase):
    fixed = 'method = "craig_bampton", clamp = "ROOT", interfaces = ["TIP"], modes = 2, joints = {}'
    study = convergence(build_case(FREQUENCY, (CANTILEVER, fixed)), "modes", [1, 2, 4, 6])
    assert study.counts.tolist() == [7, 8, 10, 12]  # six of the tip
    assert np.all(np.diff(study.values) <= 1e-12) and study.values[0] > EXACT  # Rayleigh and Ritz
    assert study.values[-1] == pytest.approx(EXACT, rel=5e-5)  # of six elements


def test_levels_of_a_body_file_match_those_of_its_mesh(build_case: BuildCase):
    plain = ("modes = 4 }", "modes = 4, joints = {} }")
    case = build_case(FREQUENCY, plain)
    save_body(case.path.parent / "beam.h5", build_body(case, "beam", modes=6))
    case_with_file = build_case((MESHED, 'kind = "file"\nfile = "beam.h5"\n'))
    assert [level.level for level in plan_study(case_with_file).level_set.levels] == [1, 2, 3, 4, 6]
    direct, from_file = (
        convergence(build_case(plain), "modes", [2, 4, 6]),
        convergence(case_with_file, "modes", [2, 4, 6]),
    )
    np.testing.assert_allclose(from_file.values, direct.values, rtol=1e-9)


@pytest.mark.slow
def test_segments_converge_with_second_order():
    cases = Path(__file__).resolve().parents[2] / "cases"
    study = convergence(cases / "elastica.toml", "segments", [2, 4, 8])
    assert list(study.levels) == [2, 4, 8] and list(study.counts) == [12, 24, 48]
    assert study.order == pytest.approx(2.0, abs=0.3)


FAR = [
    ("modes = 4 }", 'modes = 3, joints = {}, derivatives = "auto" }\nstrain = "nonlinear"'),
    ("torque = [[0, 0, 0], [0, 4, 8], [0, 0, 0]]", "torque = [[0, 0, 0], [0, 0, 20], [0, 0, 0]]"),
    ('duration = "4 s"\noutput_step = "0.05 s"\nrtol = 1e-10', 'duration = "2 s"\noutput_step = "0.02 s"\nrtol = 1e-6'),
    ('of = "value", channel', 'of = "peak", channel'),
]


def test_few_derivatives_are_enough_for_large_deflection(build_case: Callable[..., Case]):
    study = convergence(build_case(*FAR), "derivatives", [0, 1, 2, 3])
    assert study.levels.tolist() == study.derivatives.tolist() == [0, 1, 2, 3]
    assert study.counts.tolist() == [3, 4, 5, 6]
    exact = study.values[-1]
    assert study.values[0] < 0.3 * exact
    assert np.abs(study.values[2] / exact - 1) < 1e-3


WriteCaseFile = Callable[..., Path]
DERIVED = 'modes = 3, derivatives = 2 }\nstrain = "condensed"'
UNSAID = ('strain = "linear"\n', "")
SILENT = ("modes = 4 }", "modes = 3, derivatives = 2 }")
SHORT = (
    'duration = "4 s"\noutput_step = "0.05 s"\nrtol = 1e-10',
    'duration = "1 s"\noutput_step = "0.02 s"\nrtol = 1e-7',
)
SPUN = ('kind = "weld"\nparent', 'kind = "revolute"\naxis = "z"\nrate = "9 rad/s"\nparent')


def invoke_femflex(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(word) for word in arguments])
    return result.exit_code, " ".join(result.stdout.split()), " ".join(result.stderr.split())


@pytest.mark.slow
def test_automatic_and_condensed_strain_have_the_same_study(build_case: BuildCase):
    automatic = convergence(build_case(UNSAID, SILENT, SPUN, SHORT), "derivatives", [1, 2])
    condensed = convergence(build_case(("modes = 4 }", DERIVED), SPUN, SHORT), "derivatives", [1, 2])
    assert automatic.values.tolist() == condensed.values.tolist()
    assert automatic.followers.tolist() == [1, 2]


@pytest.mark.slow
def test_backbones_of_condensed_and_nonlinear_strain_agree(write_case_file: WriteCaseFile):
    curves = {}
    for strain in ("condensed", "nonlinear"):
        path = write_case_file(("modes = 4 }", DERIVED.replace("condensed", strain)))
        data = json.loads(invoke_femflex("modes", path, "--backbone", "1 mm, 1 cm", "--json")[1])
        curves[strain] = np.array([row["Hz"] for row in data["beam"]["backbone"]])
    condensed, nonlinear = curves["condensed"], curves["nonlinear"]
    assert condensed == pytest.approx(nonlinear, rel=1e-4) and (condensed != nonlinear).any()


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
def test_backbone_of_a_body_file(write_case_file: WriteCaseFile, tmp_path: Path, strain: str):
    path, file = write_case_file(("modes = 4 }", DERIVED.replace("condensed", strain))), tmp_path / "beam_file.h5"
    assert invoke_femflex("body", path, "beam", "-o", file)[0] == 0
    case_output, file_output = (
        json.loads(invoke_femflex("modes", f, "--backbone", "1 mm, 1 cm", "--json")[1]) for f in (path, file)
    )
    assert file_output["beam_file"]["backbone"] == case_output["beam"]["backbone"] and case_output["beam"]["backbone"]
