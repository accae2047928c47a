"""Two hundred flexible links, fifty appendages: invariants kept, memory that grows with the number of bodies."""

import tracemalloc

import numpy as np
import pytest
from support import large_systems

import femflex
from femflex.case.read import parse_case
from femflex.dynamics import compile_system
from femflex.integrate import Dop853, Esdirk4
from femflex.pipeline.decisions import build_system

LARGE = {
    "chain": large_systems.chain(60, 0.1),
    "long chain": large_systems.chain(200, 0.1),
    "star": large_systems.star(50, 0.4),
}
NAMES = ["chain", pytest.param("long chain", marks=pytest.mark.slow), "star"]


def model_of(text, tmp_path):
    return compile_system(build_system(parse_case(text, tmp_path / "large.toml")))


def check_invariants(channels, model, tolerance):
    """Energy and momenta stay, measured against sums of sizes that do not cancel."""
    mass = sum(body.moments.mass for body in model.system.bodies.values())
    kinetic = channels["monitors/kinetic"][0]
    sizes = {"energy": channels["monitors/energy"][0], "momentum": np.sqrt(2 * mass * kinetic)}
    sizes["angular_momentum"] = np.linalg.norm(channels["monitors/angular_momentum"][0])
    for name, size in sizes.items():
        values = channels[f"monitors/{name}"]
        assert np.abs(values - values[0]).max() < tolerance * size, name
    assert np.ptp(channels["monitors/elastic"]) > 1e-3 * kinetic  # the shapes take part


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("method", [Dop853(rtol=1e-11, atol=1e-12), Esdirk4(rtol=1e-6)], ids=["dop853", "esdirk4"])
def test_large_system_keeps_energy_and_momenta(name, method, tmp_path):
    model = model_of(LARGE[name], tmp_path)
    times = np.linspace(0.0, 0.1, 5)
    states = method.solve(model, times, model.x0).states
    check_invariants(model.observe(times, states), model, 1e-8 if method.order == 8 else 2e-3)  # over 200 m


@pytest.mark.slow
@pytest.mark.parametrize("name", ["star", pytest.param("long chain", marks=pytest.mark.slow)])
def test_large_system_runs_from_case_file(name, tmp_path):
    path = tmp_path / "large.toml"
    path.write_text(LARGE[name])
    with femflex.run(path, tmp_path / "run.h5") as run:
        assert run.complete and len(run.time) == 5
        check_invariants(
            {f"monitors/{key}": run[f"monitors/{key}"] for key in run_monitors(run)}, run_model(path), 1e-8
        )


def run_monitors(run):
    return [path.removeprefix("monitors/") for path in run.channels if path.startswith("monitors/")]


def run_model(path):
    return compile_system(build_system(femflex.case.read_case(path)))


def measured(make, n, tmp_path):
    """Bytes of the model's arrays, and the largest memory that compiling and a short run take beyond the system's."""
    system = build_system(parse_case(make(n), tmp_path / "large.toml"))
    compile_system(system).state_rate(0.0, system.initial_state())  # what is loaded once is loaded
    tracemalloc.start()
    model = compile_system(system)
    solution = Dop853(rtol=1e-6).solve(model, np.linspace(0.0, 0.01, 50), model.x0)
    model.observe(solution.times, solution.states)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return model.table.nbytes + model.pool.nbytes + model.work.nbytes, peak


@pytest.mark.slow
@pytest.mark.parametrize("make", [large_systems.chain, large_systems.star], ids=["chain", "star"])
def test_memory_grows_no_faster_than_the_number_of_bodies(make, tmp_path):
    measured(make, 5, tmp_path)
    counts = (10, 20, 40)
    arrays, peaks = np.transpose([measured(make, n, tmp_path) for n in counts])
    print(f"\nbytes of arrays {arrays.tolist()}, of a run {peaks.tolist()} with {counts} bodies")
    for sizes, tolerance in ((arrays, 0.01), (peaks, 0.1)):
        slopes = np.diff(sizes) / np.diff(counts)
        assert slopes == pytest.approx(np.full(2, slopes[0]), rel=tolerance)


def test_bodies_alike_are_built_once(tmp_path):
    text = large_systems.star(3).replace("y = 1, z = 1", "y = 2, z = 1", 1)
    bodies = build_system(parse_case(text, tmp_path / "star.toml")).bodies
    assert bodies["boom1"].moments is bodies["boom2"].moments  # what is said of their strain may differ
    assert bodies["boom0"].n_modes == 3 and bodies["boom1"].n_modes == 2
