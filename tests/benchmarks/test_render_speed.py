"""A movie frame of 51k cells, updated in place, against a new plotter for every frame: ratio of times in one run."""

from __future__ import annotations

import time

import numpy as np
import pytest

from femflex.body import FlexibleBody, MassMoments, Skin, StrainTensors
from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view.look import Look
from femflex.view.motion import motion
from femflex.view.plan import plan_scene
from femflex.view.scene import Scene

SIDE, MODES, SIZE = 226, 8, (1280, 720)  # 51 076 quadrilaterals


def square_membrane():
    s = np.linspace(0, 1, SIDE + 1)
    x, y = (a.ravel() for a in np.meshgrid(s, s, indexing="ij"))
    number = np.arange(x.size).reshape(SIDE + 1, SIDE + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    shapes = np.zeros((MODES, x.size, 3))
    for k in range(MODES):
        shapes[k, :, 2] = 0.1 * np.sin((k % 3 + 1) * np.pi * x) * np.sin((k // 3 + 1) * np.pi * y)
    skin = Skin(10 * np.column_stack([x, y, 0 * x]), {"quad": quads}, shapes)
    moments = MassMoments(1.0, np.zeros((1 + MODES, 3)), np.einsum("AB,ab->AaBb", np.eye(1 + MODES), np.eye(3)))
    zero = np.zeros((MODES, MODES))
    return FlexibleBody(moments, StrainTensors.linear(zero), zero, {}, skin, omega=np.arange(1.0, MODES + 1))


@pytest.fixture
def run(tmp_path):
    times, body = np.linspace(0, 4, 101), square_membrane()
    arrays = {
        "bodies/membrane/position": np.zeros((101, 3)),
        "bodies/membrane/attitude": np.tile([1.0, 0, 0, 0], (101, 1)),
        "bodies/membrane/delta": np.cos(times[:, None] * np.arange(1, MODES + 1) + np.arange(MODES)),
    }
    channels = {path: Channel("1", path, value.shape[1:]) for path, value in arrays.items()}
    with RunWriter(tmp_path / "run.h5", channels, {"membrane": body}) as writer:
        writer.write_block(times, arrays)
        writer.finish(complete=True)
    with open_run(tmp_path / "run.h5") as opened:
        yield opened


def best_times(draws, frames):
    """Shortest time of a frame [s] of each way to draw, taken in turn so that a busy machine slows all alike."""
    times = np.array([[timed(draw, k) for draw in draws] for k in range(frames + 1)])
    return times[1:].min(axis=0)  # the first opens windows


def timed(draw, k):
    start = time.perf_counter()
    draw(k)
    return time.perf_counter() - start


@pytest.mark.benchmark
def test_a_frame_of_51k_cells_is_five_times_faster_than_a_new_plotter(run):
    import pyvista as pv

    body, delta = run.bodies()["membrane"], run["bodies/membrane/delta"]
    cells = np.column_stack([np.full(SIDE**2, 4), body.skin.cells["quad"]]).ravel()
    look = Look(size=SIZE)
    plan = plan_scene(run, look)

    def with_new_plotter(k):
        displacement = np.einsum("k,kpi->pi", delta[k], body.skin.shapes)
        mesh = pv.PolyData(body.skin.points + displacement, cells)
        mesh["displacement"] = np.linalg.norm(displacement, axis=1)
        plotter = pv.Plotter(off_screen=True, window_size=SIZE)
        plotter.add_mesh(mesh, scalars="displacement", clim=(0, plan.largest))
        plotter.add_text(f"t = {run.time[k]:.2f} s")
        plotter.camera_position = [tuple(plan.view.position), tuple(plan.view.focus), tuple(plan.view.up)]
        image = plotter.screenshot(None, return_img=True)
        plotter.close()
        return image

    moving = motion(run, run.time, plan.camera)
    with Scene(run, look, plan) as scene:

        def in_place(k):
            scene.show(moving, k)
            return scene.image()

        new, ours = best_times([with_new_plotter, in_place], frames=12)
        assert in_place(0).shape == (SIZE[1], SIZE[0], 3)
    print(f"new plotter {1e3 * new:.0f} ms a frame, in place {1e3 * ours:.1f} ms: {new / ours:.1f} times faster")
    assert new > 5 * ours
