"""Cases with nonlinear strain: what they say, what they build, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.assembly import build_part
from femflex.case import CaseError, read_case
from femflex.cli.app import app
from femflex.pipeline.case_bodies import build_body
from femflex.reduction import load_body
from femflex.warning import PhysicsWarning

PLAIN = 'reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }'


def reduction(more: str, strain: str = "nonlinear") -> str:
    """The line of the craft's boom with other words in its reduction, and its strain."""
    return f'reduction = {{ method = "cantilever", clamp = "ROOT", modes = 4{more} }}\nstrain = "{strain}"'


def build(write_case, craft, line):
    return build_body(read_case(write_case(craft.replace(PLAIN, line))), "boom")


def test_a_nonlinear_body_has_tensors_and_shapes_that_stretch(write_case, craft):
    body = build(write_case, craft, reduction(', derivatives = "auto"'))
    assert not body.strain.is_linear
    assert body.kinds[:4] == ("vibration",) * 4 and set(body.kinds[4:]) == {"derivative", "section"}
    fewer = build(write_case, craft, reduction(", derivatives = 2"))
    assert fewer.kinds.count("derivative") == 2
    np.testing.assert_allclose(fewer.strain.V1[:4, :4], body.strain.V1[:4, :4])


@pytest.mark.slow
def test_derivatives_may_be_those_at_a_deflection(write_case, craft):
    rest = build(write_case, craft, reduction(", derivatives = 2"))
    bent = build(write_case, craft, reduction(', derivatives = 2, deflection = "0.1 m"'))
    assert bent.kinds == rest.kinds
    assert np.abs(bent.strain.V2 - rest.strain.V2).max() > 1e-3 * np.abs(rest.strain.V2).max()


@pytest.mark.parametrize(
    ("more", "text"),
    [
        (', deflection = "10 cm"', "found deflection = 0.1 m without derivatives; derivative shapes are taken"),
        (', derivatives = 2, deflection = "-1 m"', "found -1"),
    ],
)
def test_a_deflection_that_serves_nothing_is_refused(write_case, craft, more, text):
    with pytest.raises(CaseError, match=text):
        build(write_case, craft, reduction(more))


@pytest.mark.slow
def test_responses_go_beside_modes_and_derivatives(write_case, craft):
    more = ', derivatives = 2, responses = 3, deflection = "0.1 m"'
    body = build(write_case, craft, reduction(more))
    assert body.kinds[: body.n_modes] == ("vibration",) * 4 + ("derivative",) * 2 + ("response",) * 3
    np.testing.assert_allclose(body.without_slaves().moments.elastic_mass(), np.eye(9), atol=1e-8)


@pytest.mark.parametrize(
    ("more", "strain", "text"),
    [
        (", responses = 8", "nonlinear", "found responses = 8 without deflection; give the deflection that they reach"),
        (', responses = 8, deflection = "4 cm"', "condensed", "they are for strain = 'nonlinear' of a whole body"),
    ],
)
def test_responses_that_cannot_be_are_refused(write_case, craft, more, strain, text):
    with pytest.raises(CaseError, match=text):
        build(write_case, craft, reduction(more, strain))


def test_a_deflection_without_a_clamp_is_refused(write_case, craft):
    line = (
        'reduction = { method = "free_free", modes = 4, derivatives = 2, deflection = "0.1 m" }\nstrain = "nonlinear"'
    )
    with pytest.raises(CaseError, match=r"found deflection = 0.1 m in a reduction without a clamp"):
        build(write_case, craft, line)


def test_linear_strain_may_keep_the_same_shapes(write_case, craft):
    body = build(write_case, craft, reduction(', derivatives = "auto"', "linear"))
    assert body.strain.is_linear and body.strain.V2.size == 0 and "derivative" in body.kinds


def test_vibration_modes_alone_are_refused_unless_chosen(write_case, craft):
    with pytest.raises(CaseError, match=r"bodies.boom.*4 shapes \(vibration\) cannot stretch: .* the full structure"):
        build(write_case, craft, reduction(""))
    text = (
        r"bodies.boom: 4 shapes \(vibration\) cannot stretch: .* stores [\d.]+ times .* stores 1(\.\d+)? times that en"
    )
    with pytest.warns(PhysicsWarning, match=text):
        body = build(write_case, craft, reduction(', derivatives = "none"'))
    assert not body.strain.is_linear and set(body.kinds) == {"vibration", "section"}


def test_more_derivatives_than_there_are_pairs_are_told_of(write_case, craft):
    text = r"bodies.boom: 500 derivatives are requested, but the pairs of its 4 shapes give only (\d+) independent ones"
    with pytest.warns(PhysicsWarning, match=text):
        body = build(write_case, craft, reduction(", derivatives = 500"))
    kept = body.kinds.count("derivative")
    assert 0 < kept <= 10
    build(write_case, craft, reduction(f", derivatives = {kept}"))  # as many as there are: warnings are errors here


def test_nodal_displacements_are_not_advised_derivatives_which_they_do_not_know(write_case, craft):
    line = 'reduction = { method = "nodal", clamp = "ROOT" }\nstrain = "condensed"'
    with pytest.raises(
        CaseError, match=r"nodal displacements do not have.* strain = 'nonlinear', or a reduction to mo"
    ):
        build(write_case, craft, line)


def test_load_shapes_are_added_where_the_case_names_them(write_case, craft):
    body = build(write_case, craft, reduction(', attachment = ["x"], loads = { TIP = ["x", "z"] }', "linear"))
    added = [kind for kind in body.kinds if kind.endswith("attachment")]
    assert len(added) == 3  # its own weight along x, the pull at the tip, and z
    with pytest.raises(CaseError, match=r"reduction.loads: found 'TOP', which is no group"):
        build(write_case, craft, reduction(', loads = { TOP = ["x"] }'))


@pytest.mark.parametrize(
    ("line", "text"),
    [
        (
            reduction(', derivatives = "some"'),
            r"derivatives: found .some. \(text\); expected a number of derivative shapes",
        ),
        (
            reduction(", derivatives = -1"),
            r"derivatives: found -1 \(a number\); expected a number of derivative shapes",
        ),
        (reduction("", "quadratic"), r"bodies.boom.strain: found 'quadratic'"),
        (reduction(", third_derivatives = -1"), r"third_derivatives: found -1; it must be at least 0"),
        (reduction(", third_derivatives = 1", "linear"), r"third_derivatives in the reduction of a body with linear"),
    ],
)
def test_mistakes_are_named(write_case, craft, line, text):
    with pytest.raises(CaseError, match=text):
        build(write_case, craft, line)


def told(*words: object) -> str:
    """What the command line prints."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_verbs_show_the_derivatives_and_store_the_tensors(write_case, craft, tmp_path):
    path = write_case(craft.replace(PLAIN, reduction(", derivatives = 3")))
    shown = told("modes", path, "--bodies")
    assert "7 elastic coordinates (4 vibration, 3 derivative), 3 dependent shapes (section); nonlinear strain" in shown
    assert sum(line.rstrip().endswith("derivative") for line in shown.splitlines()) == 3
    data = json.loads(told("modes", path, "--bodies", "--json"))["boom"]
    assert data["strain"] == "nonlinear" and data["mode_kinds"].count("derivative") == 3
    shown = told("modes", path, "--backbone", "1 mm, 300 mm")
    assert "free vibration in mode 1 by its amplitude at (3, " in shown
    small, large = (float(line.split()[-1]) for line in shown.splitlines() if line.split()[:1] in (["0.001"], ["0.3"]))
    assert small == pytest.approx(1.0, abs=1e-4) and 0.98 < large < 1.02 and large != small
    assert json.loads(told("modes", path, "--json", "--backbone", "0.01"))["boom"]["backbone"]["amplitude_m"] == [0.01]
    refused = CliRunner().invoke(app, ["modes", str(path), "--backbone", "1 kg"])
    assert refused.exit_code == 2 and "--backbone: found '1 kg', which is a mass" in refused.stderr
    target = tmp_path / "stored.h5"
    assert "7 elastic coordinates, nonlinear strain" in told("body", path, "boom", "-o", target)
    body = load_body(target)
    assert body.strain.V3.shape == (210,) and body.kinds.count("derivative") == 3
    text = craft.replace('kind = "flexible"', f'kind = "file"\nfile = "{target.name}"\nmodes = 5')
    lines = [line for line in text.splitlines() if not line.startswith(("mesh", "members", "reduction", "markers.tip"))]
    with pytest.raises(CaseError, match=r"boom.modes: found 5, which leaves out 2 of the derivative shapes"):
        build_body(read_case(write_case("\n".join(lines))), "boom")


def test_segments_take_nonlinear_strain_with_derivatives_of_their_own(write_case, craft):
    cut = craft.replace('material = "aluminium" }', 'material = "aluminium", segments = 2 }')
    cut = cut.replace(PLAIN, 'strain = "nonlinear"').replace("damping = { ratio", "#").replace("initial =", "#")
    cut = cut.replace('markers.tip = { group = "TIP" }', 'markers.tip = { group = "TIP" }\nmarkers.ROOT = {}')
    segments = build_part(read_case(write_case(cut)), "boom")
    assert len(segments.bodies) == 2
    for body in segments.bodies:
        assert not body.strain.is_linear and {"craig-bampton", "derivative", "section"} == set(body.kinds)


@pytest.mark.parametrize("strain", ["linear", "nonlinear"])
def test_heat_that_nothing_holds_changes_no_frequency(write_case, craft, strain):
    line = reduction(', derivatives = "auto"', strain)
    hot = craft.replace('material = "aluminium" }', 'material = "aluminium", options = { thermal_strain = 1e-3 } }')
    found, cold = build(write_case, hot, line), build(write_case, craft, line)
    assert found.omega[:4] == pytest.approx(cold.omega[:4], rel=1e-9)
    assert np.abs(found.strain.f0).max() < 1e-9 * np.abs(found.strain.V1).max()
