"""Energy accounts, energy minus work, and stacks of terms."""

from __future__ import annotations

import numpy as np
import pytest
from support.small_craft import BOOM, CRAFT

import femflex
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view import energy_account, plot_energy, plot_terms
from femflex.view.curves import BALANCE, balance_of, curves_of, default_channels
from femflex.view.terms import CoordinateTerms

WHEEL = """
[wheels.spin]
body = "hub"
inertia = 0.4
inertia_in_body = "contained"
torque = 0.6
viscous = 0.02
initial_speed = 12
"""


def craft_run(folder, text):
    """Run of a hub with a meshed boom."""
    (folder / "boom.inp").write_text(BOOM)
    (folder / "craft.toml").write_text(text)
    return femflex.run(folder / "craft.toml", folder / "run.h5")


@pytest.fixture(scope="module")
def wheeled(tmp_path_factory):
    """A craft with a damped boom, a pushing load and a wheel that a motor drives against friction."""
    text = CRAFT.replace('"0.5 %"', "0.02").replace(
        "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "torque = [0, 0, 1]"
    )
    text = text.replace("output_step = 0.05", "output_step = 0.005")
    with craft_run(tmp_path_factory.mktemp("wheel"), text + WHEEL) as run:
        yield run


def test_account_of_a_craft_sums_to_zero(wheeled):
    account = energy_account(wheeled)
    assert {"stored: kinetic", "stored: strain", "stored: spin", "dissipated: spin", "work: spin", "work: push"} <= set(
        account
    )
    assert "dissipated: joints and structures" in account
    largest = max(np.abs(values).max() for values in account.values())
    assert np.abs(sum(account.values())).max() < 1e-6 * largest
    t, speed = wheeled.time, wheeled["effectors/spin/speed"]
    lost = np.concatenate([[0.0], np.cumsum(0.02 * (speed[1:] ** 2 + speed[:-1] ** 2) / 2 * np.diff(t))])
    assert account["dissipated: spin"] == pytest.approx(lost, rel=1e-4, abs=1e-4 * lost[-1])


PUSHED = """
[[loads]]
name = "pulse"
body = "boom"
marker = "tip"
frame = "marker"
force = [[0, 0, 0], [0, 0.4, 0.2], [0, 0, 0]]
torque = [[0, 0, 0], [0.1, 0, 0.2], [0, 0, 0]]
times = [0, 5, 10]
"""


@pytest.fixture(scope="module")
def pushed(tmp_path_factory):
    """A craft that a force and a torque at the deflected tip of its damped boom push."""
    text = CRAFT.replace('"0.5 %"', "0.02").replace(
        "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "torque = [0, 0, 1]"
    )
    text = text.replace("output_step = 0.05", "output_step = 0.005")
    assert text.count("0.02") == 1 and "times" not in text  # its push goes on, so that no power jumps
    with craft_run(tmp_path_factory.mktemp("push"), text + PUSHED) as run:
        yield run


def test_energy_minus_work_of_a_craft_is_constant(pushed):
    E = pushed["monitors/energy"]
    brought = np.ptp(E)
    assert BALANCE in default_channels(pushed) and brought > 1e-3
    assert pushed["monitors/dissipation"].max() > 1e-4 * brought
    assert np.abs(balance_of(pushed).values).max() < 1e-5 * brought
    ((curve,),) = [group for group in curves_of(pushed) if group[0].quantity == BALANCE]
    assert curve.unit == "J" and curve.label == "energy"


def test_power_of_a_load_is_force_times_velocity(pushed):
    force, power = pushed["loads/pulse/force"], pushed["loads/pulse/power"]
    assert pushed["monitors/supplied"] == pytest.approx(power + pushed["loads/push/power"], abs=1e-12)
    velocity = pushed["markers/boom.tip/velocity"]
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_quat(pushed["bodies/boom/attitude"], scalar_first=True)
    pushes = np.einsum("tk,tk->t", turn.apply(force), velocity)
    torques = np.einsum("tk,tk->t", pushed["loads/pulse/torque"], pushed["bodies/boom/rate"])
    bending = power - pushes - torques  # the torque turns the section of the tip too
    assert 1e-4 * np.abs(power).max() < np.abs(bending).max() < 0.9 * np.abs(power).max()


TIME = 1800.0 + 900.0 * np.linspace(0, 2, 13) ** 1.5  # uneven


def stored_run(path, arrays, times=TIME):
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
    energy_names = ("kinetic", "elastic", "spring", "gravity")
    channels = {f"monitors/{name}": 100.0 + rng.normal(size=13) for name in energy_names}
    channels |= {f"effectors/{name}/energy": 50.0 + rng.normal(size=13) for name in ("wheel", "gyro")}
    channels |= {f"effectors/{name}/power": rng.normal(size=13) for name in ("wheel", "gyro")}
    channels |= {path: power for path, (power, _) in POWERS.items()}
    channels["latches/door/loss"] = np.where(np.arange(13) > 6, 8.0, 0.0)
    channels["monitors/energy"] = 1e3 + sum(channels[f"monitors/{name}"] for name in energy_names)
    return channels


@pytest.fixture(scope="module")
def full_run(tmp_path_factory):
    with stored_run(tmp_path_factory.mktemp("energy") / "run.h5", arrays()) as run:
        yield run


def work_of_path(path):
    return POWERS[path][1]


def band(collection):
    (path,) = collection.get_paths()
    x, y = path.vertices.T
    abscissae = np.unique(x)
    return (
        abscissae,
        np.array([y[x == abscissa].min() for abscissa in abscissae]),
        np.array([y[x == abscissa].max() for abscissa in abscissae]),
    )


def test_energy_picture_stacks_positive_and_negative_parts(tmp_path, wheeled, drawn_figure):
    account, balance, time = energy_account(wheeled), balance_of(wheeled).values, wheeled.time
    plot_energy(wheeled, tmp_path / "a.svg", dpi=42)
    ax, below = drawn_figure().axes
    largest = max(np.abs(values).max() for values in account.values())
    large_terms = {name: values for name, values in account.items() if np.abs(values).max() >= 1e-3 * largest}
    assert len(ax.collections) == 2 * len(large_terms) > 4
    up, down = np.zeros(len(time)), np.zeros(len(time))
    for k, (name, values) in enumerate(large_terms.items()):
        upper, lower = ax.collections[2 * k : 2 * k + 2]
        assert upper.get_label() == name
        new_up, new_down = up + np.maximum(values, 0), down + np.minimum(values, 0)
        for collection, (low, high) in ((upper, (up, new_up)), (lower, (new_down, down))):
            abscissae, bottom, top = band(collection)
            np.testing.assert_allclose(abscissae, time)
            np.testing.assert_allclose([bottom, top], [low, high], atol=1e-9 * largest)
        up, down = new_up, new_down
    np.testing.assert_allclose(ax.lines[0].get_data(), [time, sum(account.values())], atol=1e-9 * largest)
    np.testing.assert_allclose(below.lines[0].get_data(), [time, balance], atol=1e-9 * largest)


SWING = np.linspace(0, 10, 201)
SPRING, PUSH = 3.0 * np.cos(SWING), np.where(SWING < 5, -1.0, 0.0)
PARTS = {
    "inertia/base-hub": -(SPRING + PUSH + 1e-9),
    "joint_springs": SPRING,
    "loads/push": PUSH,
    "damping": np.full(len(SWING), 1e-9),
}
PARTS = {name: np.stack([rows, 0 * rows], axis=1) for name, rows in PARTS.items()}
HUB = CoordinateTerms(0, "base-hub.angle_rate", "N m", "inertia/base-hub")


@pytest.fixture
def swinging_run(tmp_path):
    """A run of two coordinates, of which the first swings."""
    q, u = np.stack([np.sin(SWING), SWING], axis=1), np.stack([np.cos(SWING), 0 * SWING + 1], axis=1)
    names = ("base-hub.angle", "boom.delta1")
    channels = {
        "q": Channel("rad, kg^1/2 m", "coordinates", (2,), names),
        "u": Channel("rad/s, kg^1/2 m/s", "quasi-velocities", (2,), tuple(f"{name}_rate" for name in names)),
    }
    with RunWriter(
        tmp_path / "run.h5", channels, {}, {"title": "swing", "without": "gravity_gradient, loads/pull"}
    ) as writer:
        writer.write_block(SWING, {"q": q, "u": u})
    with open_run(tmp_path / "run.h5") as opened:
        yield opened


@pytest.mark.sampled(1)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_terms_picture_has_motion_and_terms_that_add_up(tmp_path, swinging_run, drawn_figure, theme):
    rows = SWING <= 8
    terms = {name: values[rows] for name, values in PARTS.items()}
    plot_terms(swinging_run, SWING[rows], terms, [HUB], tmp_path / "a.png", theme=theme, dpi=50)
    motion, forces = drawn_figure().axes
    assert motion.get_title(loc="left") == "base-hub.angle" and motion.get_ylabel() == "[deg]"
    assert motion.lines[0].get_ydata() == pytest.approx(np.rad2deg(np.sin(SWING[rows])))
    assert forces.get_ylabel() == "moment [N m]" and forces.get_xlabel() == "time [s]"
    legend_names = [text.get_text().split("  ")[0] for text in forces.get_legend().get_texts()]
    assert legend_names == ["sum: inertia of base-hub", "joint springs", "load push"]
    total, spring, push = (line.get_ydata() for line in forces.lines[1:])
    assert total == pytest.approx(terms["inertia/base-hub"][:, 0]) and spring + push == pytest.approx(total)
    assert spring == pytest.approx(-SPRING[rows])
    assert drawn_figure().get_suptitle() == "swing (without gravity gradient, pull)"
