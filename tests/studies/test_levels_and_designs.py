"""What a level of a study changes in the tables of a case, and what a sweep makes of its table."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from femflex.case.body import AnalyticTable
from femflex.case.read import parse_case
from femflex.case.sweep import parse_sweep
from femflex.studies.chosen import with_choice
from femflex.studies.derivative_ladder import with_derivatives_of
from femflex.studies.explain import Explanation, integral
from femflex.studies.function_kinds import kinds_of, with_functions_of
from femflex.studies.level import with_level
from femflex.studies.strain_forms import StrainForm, StrainStudy, with_strain_of
from femflex.studies.sweep import workers
from femflex.studies.sweep.design import designed, unit_samples
from femflex.studies.sweep.member import Outcome, Watched, history
from femflex.studies.sweep.sweep import Sweep, gathered, open_sweep, written
from femflex.system import Channel

CASE = """
[run]
duration = 1
samples = 11
[bodies.hub]
kind = "rigid"
mass = 5
inertia = [3, 3, 3]
[bodies.bar]
kind = "analytic"
length = 2
mass = 1
EA = 1e7
EIy = 2000
EIz = 2000
GJ = 1500
radius = 0.02
functions = { y = 4, z = 2, torsion = 3 }
[bodies.rod]
kind = "analytic"
length = 2
mass = 1
EA = 1e7
EIy = 2000
EIz = 2000
GJ = 1500
radius = 0.02
functions = { axial = 2, y = 1 }
[[joints]]
kind = "weld"
parent = "hub"
child = "bar"
[[joints]]
kind = "weld"
parent = "hub"
child = "rod"
"""


@pytest.fixture(scope="module")
def case():
    return parse_case(CASE)


def counts(table: AnalyticTable) -> tuple[int, ...]:
    return tuple(getattr(table.functions, key) for key in ("y", "z", "axial", "torsion"))


def test_a_level_sets_every_field_that_a_beam_has_functions_of(case):
    assert counts(with_level(case.bodies["bar"], "modes", 6)) == (6, 6, 0, 6)
    assert counts(with_level(case.bodies["rod"], "modes", 3)) == (3, 0, 3, 0)
    assert counts(case.bodies["bar"]) == (4, 2, 0, 3)  # the case itself stays


def test_a_choice_goes_to_the_bodies_of_its_study_alone(case):
    level = SimpleNamespace(recommended=5, over="modes", levels=np.array([5]), n_resolved=1)
    found = with_choice(case, level, ["rod"])
    assert counts(found.bodies["rod"]) == (5, 0, 5, 0) and found.bodies["bar"] is case.bodies["bar"]
    nothing = StrainStudy("x", 1e-3, (StrainForm("linear", 1, 0, 0, problem="y"),), {})
    assert with_choice(case, nothing, ["rod"]) is case


def test_types_of_functions_go_to_the_bodies_named_with_their_number(case):
    assert kinds_of(case, ["bar"]) == ["characteristic", "characteristic, static", "polynomial"]
    found = with_functions_of(case, ["bar"], "polynomial", 5)
    assert counts(found.bodies["bar"]) == (5, 5, 0, 5) and found.bodies["bar"].functions.family == "polynomial"
    assert found.bodies["rod"] is case.bodies["rod"]
    static = with_functions_of(case, ["bar", "rod"], "characteristic, static")
    for name in ("bar", "rod"):
        functions = static.bodies[name].functions
        assert (functions.family, functions.static, counts(static.bodies[name])) == (
            "characteristic",
            True,
            counts(case.bodies[name]),
        )
    plain = with_functions_of(static, ["bar"], "characteristic")
    assert not plain.bodies["bar"].functions.static and plain.bodies["rod"].functions.static


def test_refinements_modes_and_segments_change_their_keys_alone(built):
    meshed = built(("modes = 4 }", "modes = 4 }\nrefine = 1"))
    table = with_level(meshed.bodies["beam"], "mesh", 2)
    assert table.refine == 3 and table.reduction.modes == 4
    more = with_level(meshed.bodies["beam"], "modes", 7)
    assert more.refine == 1 and more.reduction.modes == 7
    shapes = with_derivatives_of(meshed, ["beam"], 3).bodies["beam"]
    assert (shapes.reduction.derivatives, shapes.reduction.modes) == (3, 4)
    assert with_derivatives_of(meshed, ["beam"], 0).bodies["beam"].reduction.derivatives == "none"


def test_a_form_of_strain_brings_its_derivatives_along(built):
    given = built(("modes = 4 }", "modes = 4, derivatives = 2 }"))
    linear = with_strain_of(given, ["beam"], "linear").bodies["beam"]
    assert (linear.strain, linear.reduction.derivatives, linear.reduction.deflection) == ("linear", "none", None)
    bent = with_strain_of(given, ["beam"], "nonlinear").bodies["beam"]
    assert (bent.strain, bent.reduction.derivatives, bent.reduction.modes) == ("nonlinear", 2, 4)
    plain = with_strain_of(built(), ["beam"], "condensed").bodies["beam"]
    assert (plain.strain, plain.reduction.derivatives) == ("condensed", "auto")


SWEEP = """
case = "c.toml"
{head}
[vary."a.mass"]
{first}
[vary."b.size"]
{second}
[outputs.speed]
channel = "bodies/a/rate"
component = "z"
"""


def table(head: str, first: str, second: str):
    return parse_sweep(SWEEP.format(head=head, first=first, second=second))


def test_a_grid_has_all_pairs_and_a_list_those_side_by_side():
    grid = table('design = "grid"', 'values = ["1 kg", "2 kg"]', "values = [5, 6, 7]")
    assert [(one["a.mass"], one["b.size"]) for one in designed(grid)] == [
        (m, s) for m in ("1 kg", "2 kg") for s in (5, 6, 7)
    ]
    pairs = table('design = "list"', 'values = ["1 kg", "2 kg"]', "values = [7, 5]")
    assert designed(pairs) == [{"a.mass": "1 kg", "b.size": 7}, {"a.mass": "2 kg", "b.size": 5}]


@pytest.mark.parametrize("design", ["random", "latin_hypercube", "sobol", "sobol_indices"])
def test_draws_are_between_their_ends_or_about_their_mean_and_bear_their_units(design: str):
    made = table(f'design = "{design}"\nmembers = 16\nseed = 3', 'between = ["2 kg", "5 kg"]', "normal = [10, 2]")
    unit, members = unit_samples(made), designed(made)
    runs = 16 * 4 if design == "sobol_indices" else 16
    assert unit.shape == (runs, 2) and len(members) == runs and ((unit > 0) & (unit < 1)).all()
    for row, one in zip(unit, members, strict=True):
        number, word = one["a.mass"].split()
        assert word == "kg" and float(number) == pytest.approx(2 + 3 * row[0]) and isinstance(one["b.size"], float)
        assert one["b.size"] == pytest.approx(10 + 2 * norm.ppf(row[1]))
    assert np.array_equal(unit, unit_samples(made))
    if design == "latin_hypercube":  # one in each of sixteen strips
        assert (np.sort((unit * 16).astype(int), axis=0) == np.arange(16)[:, None]).all()
    if design == "sobol_indices":
        A, B, first, second = unit.reshape(4, 16, 2)
        assert np.array_equal(first, np.column_stack([B[:, 0], A[:, 1]])) and np.array_equal(
            second, np.column_stack([A[:, 0], B[:, 1]])
        )
        assert not np.array_equal(A, B)


def test_results_are_in_the_order_of_members_and_come_back_from_their_file(tmp_path):
    made = parse_sweep(
        SWEEP.format(
            head='design = "list"\nhistories = ["bodies/a/rate:z", "q:h"]\npercentiles = [10, 60]',
            first='values = ["1 kg", "2 kg", "4 kg"]',
            second='values = ["low", 6, 7]',
        )
        + '[outputs.other]\nchannel = "q"\ncomponent = "h"\n'
    )
    members = designed(made)
    done = [
        Outcome(2, [3.0, 30.0], ["rad/s", "m", "rad/s", "rad"], [0.0, 0.5], [[1.0, 2.0], [3.0, 4.0]]),
        Outcome(1, [], [], [], [], "it broke"),
        Outcome(0, [1.0, 50.0], ["rad/s", "m", "rad/s", "rad"], [0.0, 0.5], [[5.0, 8.0], [7.0, 9.0]]),
    ]
    found = gathered(made, members, done)
    assert found.outputs["speed"].tolist()[::2] == [1.0, 3.0] and np.isnan(found.outputs["speed"][1])
    assert found.outputs["other"].tolist()[::2] == [50.0, 30.0] and found.problems == ("", "it broke", "")
    assert found.inputs["a.mass"].tolist() == [1.0, 2.0, 4.0] and found.inputs["b.size"].tolist()[1:] == [6.0, 7.0]
    assert np.isnan(found.inputs["b.size"][0]) and found.units["a.mass"] == "kg"
    assert [found.units[key] for key in ("speed", "other", "bodies/a/rate:z", "q:h")] == ["rad/s", "m", "rad/s", "rad"]
    assert (
        found.histories["q:h"][[0, 2]].tolist() == [[7.0, 9.0], [3.0, 4.0]]
        and np.isnan(found.histories["q:h"][1]).all()
    )
    assert found.of_outputs()["other"] == pytest.approx([30 + 20 * 0.1, 30 + 20 * 0.6])
    assert found.of_histories()["bodies/a/rate:z"] == pytest.approx(
        np.array([[1.4, 2.6], [3.4, 5.6]])
    ) and found.time.tolist() == [0.0, 0.5]
    plan = workers.Plan("sweep", "case", "c.toml")
    written(found, tmp_path / "s.h5", plan)
    again = open_sweep(tmp_path / "s.h5")
    assert isinstance(again, Sweep) and again.units == found.units and again.problems == found.problems
    for group in ("inputs", "outputs", "histories"):
        one, other = getattr(found, group), getattr(again, group)
        assert set(one) == set(other) and all(np.array_equal(one[key], other[key], equal_nan=True) for key in one)
    assert again.percentiles.tolist() == [10.0, 60.0] and again.time.tolist() == [0.0, 0.5]
    import h5py

    with h5py.File(tmp_path / "s.h5") as file:
        assert file.attrs["sweep"] == "sweep" and file.attrs["case_text"] == "case"
        assert file["percentiles_of_outputs/other"][:] == pytest.approx([32.0, 42.0])
        assert (
            file["percentiles_of_histories/bodies|a|rate:z"].shape == (2, 2)
            and file["outputs/other"].attrs["unit"] == "m"
        )
    assert [path.name for path in tmp_path.iterdir()] == ["s.h5"]


def test_members_are_handed_out_a_few_ahead_and_all_come_back(monkeypatch):
    started = []
    monkeypatch.setattr(
        workers,
        "run_member",
        lambda plan, number, values: started.append(number) or Outcome(number, [values["x"]], [], [], []),
    )
    plan, todo = workers.Plan("a", "b", "c"), [(k, {"x": 10.0 * k}) for k in (3, 1, 7, 5, 2, 9)]
    with ThreadPoolExecutor(1) as pool:
        coming = workers._spread(pool, plan, todo, 2)
        first = next(coming)
        rest = list(coming)
    found = {one.number: one.outputs for one in [first, *rest]}
    assert found == {k: [10.0 * k] for k in (3, 1, 7, 5, 2, 9)} and sorted(started) == [1, 2, 3, 5, 7, 9]
    alone = list(workers.outcomes(plan, todo, 1))
    assert [one.number for one in alone] == [3, 1, 7, 5, 2, 9]
    assert [one.number for one in workers.outcomes(plan, todo[:1], 4)] == [3]


def test_a_history_is_one_component_of_its_channel():
    channels = {"v": Channel("m/s", "velocity", (3,), ("x", "y", "z")), "s": Channel("m", "way")}
    values = {"v": np.arange(12.0).reshape(4, 3), "s": np.arange(4.0)}
    seen = Watched(np.arange(4.0), values, channels, {})
    assert history(seen, "v:y").tolist() == [1.0, 4.0, 7.0, 10.0] and history(seen, "s").tolist() == [
        0.0,
        1.0,
        2.0,
        3.0,
    ]
    with pytest.raises(ValueError, match="history 'v' is that of a vector; name one of x, y, z, as in 'v:x'"):
        history(seen, "v")
    with pytest.raises((ValueError, KeyError), match="w"):
        history(seen, "v:w")


def explanation() -> Explanation:
    """Two terms over three coordinates, of N, N and N m."""
    t = np.linspace(0, 2, 21)
    u = np.column_stack([np.cos(t), 2 * np.sin(t), 0.1 * np.cos(3 * t)])
    forces = np.column_stack([3 * np.sin(5 * t), 0.5 * np.cos(t), 40 * np.cos(2 * t)])
    terms = {"inertia": -forces, "loads": forces}
    return Explanation(
        t,
        terms,
        {"of a": -0.25 * forces, "of b": -0.75 * forces},
        u,
        ("x_rate", "y_rate", "turn_rate"),
        ("N", "N", "N m"),
        ("a", "a", "b"),
    )


def test_energies_are_the_ranges_of_the_work_of_all_terms():
    found = explanation()
    for k in range(3):
        work = np.concatenate(
            [
                [0],
                np.cumsum(
                    np.diff(found.time) * (f := found.terms["loads"][:, k] * found.u[:, k])[1:] / 2
                    + np.diff(found.time) * f[:-1] / 2
                ),
            ]
        )
        assert found.energies()[k] == pytest.approx(2 * (work.max() - work.min()))
    ranked = np.argsort(-found.energies())
    assert found.dominant_coordinates() == sorted(ranked[:3].tolist())
    assert integral(found.time, found.u)[-1, 0] == pytest.approx(np.trapezoid(found.u[:, 0], found.time))
    peak, rms = found.sizes(0)["loads"]
    f = found.terms["loads"][:, 0]
    assert abs(peak) == np.abs(f).max() and peak in f and rms == pytest.approx(np.sqrt(np.mean(f**2)))
    assert set(found.sizes(1)) == {"inertia", "loads", "of a", "of b"} and set(found.parts) == {"of a", "of b", "loads"}
    assert found.remainder == 0.0
    unbalanced = Explanation(
        found.time,
        {**found.terms, "inertia": -1.1 * found.terms["loads"]},
        found.inertia,
        found.u,
        found.names,
        found.units,
        found.own,
    )
    assert unbalanced.remainder == pytest.approx(0.1 / 1.1)


def test_a_coordinate_is_found_by_its_name_its_rate_or_its_number():
    found = explanation()
    assert [found.index(name) for name in ("y", "y_rate", "2", "1", "3")] == [1, 1, 1, 0, 2]
    with pytest.raises(KeyError, match=r"'turm' is not a coordinate of the run; near it are \['turn'\]"):
        found.index("turm")
    with pytest.raises(KeyError, match=r"'4' is not a coordinate of the run; known are \['x', 'y', 'turn'\]"):
        found.index("4")
    many = Explanation(found.time, {}, {}, found.u, tuple(f"q{k}" for k in range(20)), (), ())
    with pytest.raises(KeyError, match=r"'q15'\] and 4 more"):
        many.index("zzz")


@pytest.mark.parametrize("design", ["latin_hypercube", "random"])
def test_each_layer_of_a_latin_hypercube_is_drawn_from_once(design: str):
    table = parse_sweep(
        f"case = 'a'\ndesign = '{design}'\nmembers = 20\nseed = 3\nhistories = ['time']\n"
        "[vary.a]\nbetween = [0, 1]\n[vary.ab]\nbetween = [0, 1]\n[vary.b]\nnormal = [0, 1]\n"
    )
    drawn = unit_samples(table)
    layers = [sorted(np.floor(20 * column).astype(int).tolist()) for column in drawn.T]
    assert [layer == list(range(20)) for layer in layers] == [design == "latin_hypercube"] * 3
    assert len(np.unique(drawn)) == 60
