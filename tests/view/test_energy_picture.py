"""The energy account and its picture from a run made by hand: every contributor, its sign and its integral."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view import energy_account, plot_energy
from femflex.view.curves import balance_of, curves_of, default_channels, has_balance
from femflex.view.theme import THEMES

TIME = 1800.0 + 900.0 * np.linspace(0, 2, 13) ** 1.5  # uneven


def made(path, arrays, times=TIME):
    channels = {name: Channel("W", name, values.shape[1:]) for name, values in arrays.items()}
    with RunWriter(path, channels, {}, {"title": "made"}) as writer:
        writer.write_block(times, arrays)
    return open_run(path)


def square(a, b, c):
    """A power a + b s + c s^2 over s = t - t_0, and its integral: exact for Simpson's rule."""
    s = TIME - TIME[0]
    return a + b * s + c * s**2, a * s + b * s**2 / 2 + c * s**3 / 3


POWERS = {
    "monitors/dissipation": square(9.0, 2e-3, 1e-6),
    "monitors/supplied": square(-4.0, 5e-3, 0.0),
    "effectors/wheel/dissipation": square(2.0, 0.0, 3e-7),
    "effectors/wheel/supplied": square(1.0, 1e-3, 0.0),
    "effectors/gyro/dissipation": square(3.0, 1e-3, 0.0),
    "effectors/gyro/supplied": square(-2.0, 0.0, 0.0),
    "loads/push/power": square(-3.0, 4e-3, 0.0),
    "loads/pull/power": square(0.5, 0.0, 2e-7),
    "monitors/drive_power": square(0.7, 0.0, 1e-7),
    "monitors/variation_power": square(0.0, 3e-4, 0.0),
}


def arrays():
    rng = np.random.default_rng(7)
    stored = ("kinetic", "elastic", "spring", "gravity")
    found = {f"monitors/{name}": 100.0 + rng.normal(size=13) for name in stored}
    found |= {f"effectors/{name}/energy": 50.0 + rng.normal(size=13) for name in ("wheel", "gyro")}
    found |= {f"effectors/{name}/power": rng.normal(size=13) for name in ("wheel", "gyro")}
    found |= {path: power for path, (power, _) in POWERS.items()}
    found["latches/door/loss"] = np.where(np.arange(13) > 6, 8.0, 0.0)
    found["monitors/energy"] = 1e3 + sum(found[f"monitors/{name}"] for name in stored)
    return found


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    with made(tmp_path_factory.mktemp("energy") / "run.h5", arrays()) as run:
        yield run


def work(path):
    return POWERS[path][1]


def test_every_contributor_of_an_account_has_its_integral_and_sign(full):
    given, account = arrays(), energy_account(full)
    expected = {
        f"stored: {name}": given[f"monitors/{key}"] - given[f"monitors/{key}"][0]
        for key, name in (("kinetic", "kinetic"), ("elastic", "strain"), ("spring", "springs"), ("gravity", "gravity"))
    }
    for name in ("wheel", "gyro"):
        energy = given[f"effectors/{name}/energy"]
        expected[f"stored: {name}"] = energy - energy[0]
        expected[f"dissipated: {name}"] = work(f"effectors/{name}/dissipation")
        expected[f"work: {name}"] = -work(f"effectors/{name}/supplied")
    expected["dissipated: joints and structures"] = work("monitors/dissipation") - sum(
        work(f"effectors/{name}/dissipation") for name in ("wheel", "gyro")
    )
    expected["work: push"], expected["work: pull"] = -work("loads/push/power"), -work("loads/pull/power")
    expected["work: specified motions"] = -work("monitors/drive_power")
    expected["work: varying bodies"] = -work("monitors/variation_power")
    expected["dissipated: latch door"] = given["latches/door/loss"]
    assert set(account) == set(expected)
    for name, values in expected.items():
        assert account[name] == pytest.approx(values, rel=1e-9, abs=1e-9 * max(1.0, np.abs(values).max())), name


def test_loads_whose_potential_is_stored_are_one(tmp_path):
    given = arrays() | {"monitors/load": 3.0 + np.linspace(0, 1, 13) ** 2}
    with made(tmp_path / "run.h5", given) as run:
        account = energy_account(run)
    assert "work: push" not in account and "work: pull" not in account
    assert account["stored: constant loads"] == pytest.approx(np.linspace(0, 1, 13) ** 2)
    rest = work("monitors/supplied") - work("effectors/wheel/supplied") - work("effectors/gyro/supplied")
    assert account["work: loads"] == pytest.approx(-rest, abs=1e-9 * np.abs(rest).max())


def test_what_does_nothing_is_not_in_the_account_and_two_rows_have_no_work(tmp_path):
    two = {name: values[:2] for name, values in arrays().items()}
    with made(tmp_path / "run.h5", two, TIME[:2]) as run:
        account = energy_account(run)
    assert {name.split(":")[0] for name in account} == {"stored"}


def test_energy_minus_work_holds_every_power_and_loss(tmp_path, full):
    given, curve = arrays(), balance_of(full)
    assert has_balance(full) and default_channels(full)[-1] == "energy minus work"
    E = given["monitors/energy"]
    brought = work("monitors/supplied") + work("monitors/drive_power") + work("monitors/variation_power")
    left = E - E[0] - brought + work("monitors/dissipation") + given["latches/door/loss"]
    assert curve.values == pytest.approx(left, abs=1e-9 * np.abs(left).max())
    assert (curve.label, curve.unit, curve.quantity) == ("energy", "J", "energy minus work")
    two = {name: values[:2] for name, values in given.items()}
    with made(tmp_path / "two.h5", two, TIME[:2]) as run:
        curve = balance_of(run)
    power = sum(given[f"monitors/{p}"][:2].mean() for p in ("supplied", "drive_power", "variation_power"))
    power -= given["monitors/dissipation"][:2].mean()
    assert curve.values == pytest.approx([0.0, E[1] - E[0] - power * (TIME[1] - TIME[0])])


@pytest.mark.parametrize(("spread", "supplied", "kept"), [(0.0, False, True), (1e-6, False, False), (0.0, True, False)])
def test_on_a_specified_orbit_the_jacobi_integral_is_kept_where_the_orbit_is_circular_and_nothing_pushes(
    tmp_path, spread, supplied, kept
):
    given = {
        "monitors/energy": np.linspace(0, 9, 13),
        "monitors/jacobi": 5.0 + np.linspace(0, 1, 13),
        "orbit/radius": 7e6 * (1 + spread * np.linspace(0, 1, 13)),
    }
    if supplied:
        given["monitors/supplied"] = np.ones(13)
    with made(tmp_path / "run.h5", given) as run:
        assert has_balance(run) == kept
        curve = balance_of(run)
        with pytest.raises(ValueError, match="not conserved on a specified orbit; plot monitors/jacobi instead"):
            energy_account(run)
    assert curve.label == "Jacobi integral"
    assert curve.values == pytest.approx(np.linspace(0, 1, 13) - (TIME - TIME[0] if supplied else 0.0))


def band(collection):
    (path,) = collection.get_paths()
    x, y = path.vertices.T
    at = np.unique(x)
    return at, np.array([y[x == one].min() for one in at]), np.array([y[x == one].max() for one in at])


def test_the_picture_stacks_what_is_positive_upwards_and_what_is_negative_downwards(tmp_path, full, drawn_figure):
    account, left = energy_account(full), balance_of(full).values
    plot_energy(full, tmp_path / "a.svg", dpi=42)
    figure = drawn_figure()
    ax, below = figure.axes
    assert figure.get_suptitle() == "made" and figure.keywords == {"format": "svg", "dpi": 42}
    largest = max(np.abs(values).max() for values in account.values())
    drawn = {name: values for name, values in account.items() if np.abs(values).max() >= 1e-3 * largest}
    assert 3 < len(drawn) < len(account)  # the smallest are not drawn
    assert len(ax.collections) == 2 * len(drawn)
    up, down = np.zeros(13), np.zeros(13)
    for k, (name, values) in enumerate(drawn.items()):
        upper, lower = ax.collections[2 * k : 2 * k + 2]
        assert upper.get_label() == name
        new_up, new_down = up + np.maximum(values, 0), down + np.minimum(values, 0)
        for collection, (low, high) in ((upper, (up, new_up)), (lower, (new_down, down))):
            at, bottom, top = band(collection)
            np.testing.assert_allclose(at, TIME / 60)
            np.testing.assert_allclose([bottom, top], [low, high], atol=1e-9 * largest)
        up, down = new_up, new_down
    (line,) = ax.lines
    np.testing.assert_allclose(line.get_data(), [TIME / 60, sum(account.values())], atol=1e-9 * largest)
    np.testing.assert_allclose(below.lines[0].get_data(), [TIME / 60, left], atol=1e-9 * largest)
    assert (ax.get_ylabel(), below.get_ylabel(), below.get_xlabel()) == (
        "energy since\nthe start [J]",
        "sum [J]",
        "time [min]",
    )
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [*drawn, "sum"]
    assert line.get_color() == THEMES["light"].text


def run_of(path, arrays, times, units, names=()):
    channels = {
        name: Channel(units[name], name, values.shape[1:], dict(names).get(name, ())) for name, values in arrays.items()
    }
    with RunWriter(path, channels, {}, {"title": "made"}, force=True) as writer:
        writer.write_block(times, arrays)
    return open_run(path)


def test_what_a_plot_shows_by_default_is_the_largest_marker_of_every_body(tmp_path):
    times = np.linspace(0, 1, 5)
    sizes = {"boom.tip": 1.0, "boom.root": 3.0, "boom.2.end": 2.0, "mast.top": -5.0, "mast.still": 0.0, "hub.eye": 0.0}
    arrays = {f"markers/{name}/deflection": size * np.eye(5, 3) for name, size in sizes.items()}
    arrays |= {f"bodies/{name}/position": np.zeros((5, 3)) for name in ("boom", "boom.2", "mast", "hub")}
    with run_of(tmp_path / "run.h5", arrays, times, dict.fromkeys(arrays, "m")) as run:
        chosen = default_channels(run)
    assert sorted(chosen) == ["markers/boom.root/deflection", "markers/mast.top/deflection"]
    only = {"q": np.zeros((5, 2)), "u": np.zeros((5, 2))}
    with run_of(tmp_path / "b.h5", only, times, {"q": "rad", "u": "rad/s"}) as run:
        assert default_channels(run) == ["q"]


def test_quotients_labels_and_units_of_curves(tmp_path):
    times = np.linspace(0, 1, 4)
    arrays = {
        "a/b": np.arange(8.0).reshape(4, 2) + 1,
        "c/d": np.array([[2.0], [0.0], [4.0], [5.0]]),
        "joints/hinge/torque": np.arange(12.0).reshape(4, 3),
        "q": np.ones((4, 2)) * np.array([[1.0], [2.0], [3.0], [5.0]]),
        "u": np.ones((4, 2)) * np.array([[1.0], [2.0], [3.0], [5.0]]),
    }
    units = {"a/b": "N", "c/d": "m", "joints/hinge/torque": "N m, N m, N", "q": "m, rad", "u": "m/s, rad/s"}
    names = {"joints/hinge/torque": ("x", "y", "force")}.items()
    with run_of(tmp_path / "run.h5", arrays, times, units, names) as run:
        ((one, two),) = curves_of(run, ["a/b over c/d"])
        torques, forces = curves_of(run, ["joints/hinge/torque"])
        (angle,) = curves_of(run, ["q:2"])
        length, turn = curves_of(run, ["q"])
        speed, rate = curves_of(run, ["u"], degrees=True)
        (same,) = curves_of(run, ["a/b:1 over a/b:2"])
        for bad in ("q:0", "q:3"):
            with pytest.raises(KeyError, match=rf"'{bad[-1]}' is not a component of 'q'; its components are"):
                curves_of(run, [bad])
    assert one.values == pytest.approx([0.5, 0.0, 1.25, 1.4]) and two.values == pytest.approx([1, 0, 1.5, 1.6])
    assert (one.unit, one.quantity, one.label) == ("N/(m)", "b over d", "1 over d") and two.label == "2 over d"
    assert [c.label for c in torques] == ["hinge x", "hinge y"] and [c.label for c in forces] == ["hinge force"]
    assert (forces[0].unit, torques[1].unit) == ("N", "N m")
    assert forces[0].values == pytest.approx([2, 5, 8, 11])
    assert angle[0].values == pytest.approx(np.rad2deg([1, 2, 3, 5])) and angle[0].unit == "deg"
    assert (length[0].quantity, length[0].unit, turn[0].unit) == ("coordinate", "m", "deg")
    assert (speed[0].quantity, speed[0].unit, rate[0].unit) == ("velocity", "m/s", "deg/s")
    assert rate[0].values == pytest.approx(np.rad2deg([1, 2, 3, 5]))
    assert same[0].unit == "1" and same[0].values == pytest.approx(arrays["a/b"][:, 0] / arrays["a/b"][:, 1])
