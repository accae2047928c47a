"""What the verbs give to the functions that draw: every option in its place, on files and results made for it."""

from __future__ import annotations

import importlib
import inspect
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.case import parse_case
from femflex.case.run import PicturesTable
from femflex.cli import converge_report, craft_modes, linearize, pictures, run, stability, stress, sweep
from femflex.cli.campbell import CampbellOutputs
from femflex.cli.progress import Bar
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, save_body
from femflex.results import RunWriter, open_run
from femflex.studies.linear import StateSpace
from femflex.studies.stability import Chart, Locus
from femflex.system import Channel

HEAD = "[run]\nduration = 9\n[bodies.a]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[dict[str, Any]]]:
    """Keeps the arguments of a drawing function by their names; nothing is drawn."""

    def keep(module: str, name: str) -> list[dict[str, Any]]:
        place = importlib.import_module(module)
        signature, calls = inspect.signature(getattr(place, name)), []

        def record(*args: Any, **kwargs: Any) -> Path:
            bound = signature.bind(*args, **kwargs)
            bound.apply_defaults()
            found = dict(bound.arguments)
            calls.append(found | found.pop("look", {}))
            if (progress := found.get("progress")) is not None:
                progress(3, 4)
            return Path(found["path"])

        monkeypatch.setattr(place, name, record)
        return calls

    return keep


@pytest.fixture
def bars(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, float, float | None]]:
    """Text and unit of the progress bars, with what they were called with."""
    kept: list[tuple[str, str, float, float | None]] = []

    def call(self: Any, reached: float, end: float | None = None) -> None:
        kept.append((self._text, self._unit, reached, end))

    monkeypatch.setattr(Bar, "__call__", call)
    return kept


def some(found: dict[str, Any], *names: str) -> tuple[Any, ...]:
    return tuple(found[name] for name in names)


@pytest.fixture
def run_file(tmp_path: Path) -> Path:
    """A run of a rigid hub of three rows; its case places the camera."""
    text = HEAD + "[pictures]\ncamera = 'fixed'\nview = [0, -1, 0.25]\nfit = 'run'\n"
    channels = {"monitors/energy": Channel("J", "energy", (), ())}
    hub = {"hub": rigid_body(2.0, np.eye(3), markers={"rim": Marker(np.ones(3), np.zeros((3, 0)), np.zeros((3, 0)))})}
    with RunWriter(tmp_path / "spin.h5", channels, hub, {"title": "spin", "case_text": text}) as writer:
        writer.write_block(np.array([0.0, 0.5, 1.5]), {"monitors/energy": np.array([1.0, 2.0, 3.0])})
        writer.finish(complete=True)
    return tmp_path / "spin.h5"


# plot


PLOT_OPTIONS = ("--theme", "dark", "--title", "mine", "--force")


@pytest.mark.parametrize("own", [False, True])
def test_plots_have_the_channels_and_options_of_the_command_line(femflex: Any, drawn: Any, run_file: Path, own: bool):
    place = "femflex.view"
    other = run_file.with_name("other.h5")
    other.write_bytes(run_file.read_bytes())
    energy, histories, spectra, spectrograms = (
        drawn(place, name) for name in ("plot_energy", "plot_histories", "plot_spectra", "plot_spectrograms")
    )
    files = ["-o", "x.svg"] if own else []
    more = ["a/b", "c", "--radians", *PLOT_OPTIONS, *files] if own else []
    high = ["--highest", "7.5"] if own else []

    def target(kind: str) -> Path:
        return Path("x.svg") if own else run_file.with_name(f"spin_{kind}.png")

    common = ("channels", "degrees", "theme", "title", "force")
    said = (["a/b", "c"], False, "dark", "mine", True) if own else (None, True, "light", None, False)
    assert femflex("plot", run_file, *more, "--with", other)[:2] == (0, f"picture     {target('plot')}\n")
    (found,) = histories
    assert some(found, *common) == said and found["path"] == target("plot")
    assert (found["run"].path, found["other"].path) == (run_file, other)
    assert femflex("plot", run_file, *more, *high, "--spectrum")[1] == f"picture     {target('spectrum')}\n"
    (found,) = spectra
    assert some(found, *common, "highest", "path", "other") == (*said, 7.5 if own else None, target("spectrum"), None)
    assert femflex("plot", run_file, *more, *high, "--spectrogram")[1] == f"picture     {target('spectrogram')}\n"
    (found,) = spectrograms
    assert some(found, *common, "highest", "path") == (*said, 7.5 if own else None, target("spectrogram"))
    options = [*PLOT_OPTIONS, *files] if own else []
    assert femflex("plot", run_file, *options, "--energy")[1] == f"picture     {target('energy')}\n"
    (found,) = energy
    assert some(found, "theme", "title", "force", "path") == (*said[2:], target("energy"))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ("--energy", "time"),
            "--energy plots the energy account of one run; leave channels, --with and --spectrum out",
        ),
        (("--energy", "--with", "b.h5"), "--energy plots the energy account of one run"),
        (("--energy", "--spectrum"), "--energy plots the energy account of one run"),
        (("--energy", "--spectrogram"), "--energy plots the energy account of one run"),
        (("--spectrogram", "--spectrum"), "--spectrogram plots one run; leave --spectrum and --with out"),
        (("--spectrogram", "--with", "b.h5"), "--spectrogram plots one run; leave --spectrum and --with out"),
    ],
)
def test_plots_that_exclude_each_other_are_refused(femflex: Any, run_file: Path, options: Any, sentence: str):
    run_file.with_name("b.h5").write_bytes(run_file.read_bytes())
    code, out, err = femflex("plot", run_file, *options)
    assert (code, out) == (2, "") and err.startswith(f"femflex: {sentence}")


# render


def test_a_picture_has_the_look_of_the_command_line(femflex: Any, drawn: Any, run_file: Path):
    pictures = drawn("femflex.view", "render_picture")
    words = ["--at", "0.02 min", "--scale", "2.5", "--colour", "energy", "--theme", "dark", "--size", "640x480"]
    words += ["--edges", "mesh", "--no-triads", "--trace", "hub.rim", "--trace", "a.b", "--force", "-o", "x.png"]
    assert femflex("render", run_file, *words)[:2] == (0, "picture     x.png\n")
    assert femflex("render", run_file, "--view", "1,-2,0.5", "--scale", "auto")[0] == 0
    assert femflex("render", run_file, "--camera", "body:hub")[1] == f"picture     {run_file.with_suffix('.png')}\n"
    first, second, third = pictures
    names = ("path", "time", "scale", "colour", "theme", "size", "edges", "triads", "traces", "force")
    said = (Path("x.png"), 1.2, 2.5, "energy", "dark", (640, 480), "mesh", False, ("hub.rim", "a.b"), True)
    assert some(first, *names) == said
    assert some(first, "camera", "view", "fit") == ("fixed", (0.0, -1.0, 0.25), "run")
    plain = (run_file.with_suffix(".png"), None, "auto", "displacement", "light", (1280, 720), "auto", True, (), False)
    assert some(second, *names) == plain and some(second, "camera", "view") == ("auto", (1.0, -2.0, 0.5))
    assert "fit" not in second
    assert some(third, *names) == (*plain[:2], 1.0, *plain[3:]) and some(third, "camera", "view") == ("body:hub", None)


@pytest.mark.parametrize(
    ("words", "path", "span", "speed", "fps", "force"),
    [
        (["--movie"], "spin.mp4", (None, None), None, 25.0, False),
        (["-o", "frames", "--from", "0.5"], "frames", (0.5, None), None, 25.0, False),
        (["-o", "x.mp4", "--to", "0.02 min", "--speed", "3", "--fps", "12"], "x.mp4", (None, 1.2), 3.0, 12.0, False),
        (["-o", "x.mp4", "--movie", "--force"], "x.mp4", (None, None), None, 25.0, True),
        (["-o", "x.PNG", "--movie"], "x.PNG", (None, None), None, 25.0, False),
    ],
)  # fmt: skip
def test_a_movie_has_its_span_speed_and_rate(
    femflex: Any, drawn: Any, bars: Any, run_file: Path,
    words: Any, path: str, span: Any, speed: Any, fps: Any, force: Any
):  # fmt: skip
    movies = drawn("femflex.view", "render_movie")
    target = run_file.with_name(path) if path == "spin.mp4" else Path(path)
    assert femflex("render", run_file, *words)[:2] == (0, f"picture     {target}\n")
    (found,) = movies
    assert some(found, "path", "span", "speed", "fps", "force") == (target, span, speed, fps, force)
    assert some(found, "camera", "scale", "triads") == ("fixed", 1.0, True)
    assert bars == [("drawing", "frames", 3, 4)]


def test_a_picture_whose_suffix_is_in_capitals_is_no_movie(femflex: Any, drawn: Any, run_file: Path):
    pictures = drawn("femflex.view", "render_picture")
    assert femflex("render", run_file, "-o", "X.PNG")[0] == 0 and pictures[0]["path"] == Path("X.PNG")


@pytest.fixture
def body_file(tmp_path: Path) -> Path:
    """A boom of 2.5 kg with two shapes along y and one along z."""
    boom = UniformBeam(2.0, EA=1e6, EIy=40, EIz=90, GJ=100, mass_per_length=1.25)
    save_body(tmp_path / "boom.h5", beam_body(boom, BeamFunctions(y=2, z=1)))
    return tmp_path / "boom.h5"


def test_shapes_of_a_body_file_are_a_montage_or_a_movie(
    femflex: Any, drawn: Any, bars: Any, body_file: Path, run_file: Path
):
    montages, movies = (drawn("femflex.view", name) for name in ("mode_montage", "mode_movie"))
    look = ["--theme", "dark", "--view", "1,2,3", "--colour", "energy", "--force"]
    assert femflex("render", body_file, *look)[1] == f"picture     {body_file.with_suffix('.png')}\n"
    assert femflex("render", body_file, "-o", "m.png")[1] == "picture     m.png\n"
    first, second = montages
    names = ("theme", "view", "colour", "force", "title", "path", "modes")
    own = body_file.with_suffix(".png")
    assert some(first, *names) == ("dark", (1.0, 2.0, 3.0), "energy", True, "modes of boom", own, None)
    assert some(second, *names) == ("light", None, "displacement", False, "modes of boom", Path("m.png"), None)
    assert first["body"].moments.mass == pytest.approx(2.5)
    assert femflex("render", body_file, "--mode", "2", "--fps", "10", *look)[0] == 0
    assert femflex("render", body_file, "--mode", "3", "-o", "m.mp4")[1] == "picture     m.mp4\n"
    first, second = movies
    names = ("theme", "view", "colour", "force", "path", "mode", "fps")
    own = body_file.with_name("boom_mode2.mp4")
    assert some(first, *names) == ("dark", (1.0, 2.0, 3.0), "energy", True, own, 2, 10.0)
    assert some(second, *names) == ("light", None, "displacement", False, Path("m.mp4"), 3, 25.0)
    assert bars == [("drawing", "frames", 3, 4)] * 2
    code, _, err = femflex("render", run_file, "--mode", "2")
    sentence = f"--mode draws a mode of a body file, and {run_file} is a run; make one with `femflex body`"
    assert (code, err) == (2, f"femflex: {sentence}\n")


# pictures of a case


TABLE = """
picture = true
movie = true
times = [1.5]
modes = ['boom', 'stiff']
plots = ['e', 'gone']
spectra = ['e']
spectrograms = ['e']
start = 0.25
end = 1.25
speed = 3
fps = 12
highest = 40
traces = ['boom.tip']
scale = 2.5
colour = 'energy'
theme = 'dark'
camera = 'fixed'
view = [0, -1, 0.25]
fit = 'run'
triads = false
edges = 'mesh'
size = [640, 480]
"""
LOOK = {
    "scale": 2.5, "colour": "energy", "theme": "dark", "camera": "fixed", "view": (0.0, -1.0, 0.25), "fit": "run",
    "triads": False, "edges": "mesh", "size": (640, 480), "traces": ("boom.tip",),
}  # fmt: skip


class Rows(dict):
    """A run by its channels."""

    without: tuple[str, ...] = ()
    linearised = False


def test_pictures_of_a_case_have_its_looks_times_and_channels(drawn: Any, bars: Any, monkeypatch: pytest.MonkeyPatch):
    names = ("render_picture", "render_movie", "mode_montage", "plot_spectra", "plot_spectrograms", "plot_histories")
    pictured, movies, montages, spectra, spectrograms, histories = (drawn("femflex.view", name) for name in names)
    table = PicturesTable.model_validate(tomllib.loads(TABLE))
    bodies: Any = {"boom": SimpleNamespace(n_modes=2), "stiff": SimpleNamespace(n_modes=0)}
    done, second, output = Rows(e=1), Rows(e=2), Path("out/r.h5")
    paths = list(pictures.draw_pictures(table, done, bodies, output, force=True, other=second))  # type: ignore[arg-type]
    assert paths == pictures.picture_paths(table, output) and len(paths) == 9
    assert [found["time"] for found in pictured] == [None, 1.5]
    for found in (*pictured, *movies):
        assert {key: found[key] for key in LOOK} == LOOK and found["force"] and found["run"] is done
    (found,) = movies
    assert some(found, "fps", "speed", "span") == (12.0, 3.0, (0.25, 1.25))
    assert bars == [("drawing", "of the frames", 0.75, None)]
    assert [some(one, "body", "title", "force", "theme") for one in montages] == [
        (bodies["boom"], "modes of boom", True, "dark"),
        (bodies["stiff"], "modes of stiff", True, "dark"),
    ]
    assert [found["channels"] for found in histories] == [["e"], ["gone"]]
    for found in histories:
        assert some(found, "run", "force", "theme", "other") == (done, True, "dark", second)
    assert some(spectra[0], "run", "channels", "force", "theme", "highest", "other") == (
        done, ["e"], True, "dark", 40.0, second,
    )  # fmt: skip
    assert some(spectrograms[0], "run", "channels", "force", "theme", "highest") == (done, ["e"], True, "dark", 40.0)
    done.without = ("flexibility",)
    paths = list(pictures.draw_pictures(table, done, bodies, output))  # type: ignore[arg-type]
    assert [path.name for path in paths] == [
        "r.png", "r_1.5s.png", "r.mp4", "r_modes_boom.png", "r_e.png", "r_e_spectrum.png", "r_e_spectrogram.png",
    ]  # fmt: skip
    assert not pictured[-1]["force"] and histories[-1]["other"] is None


def test_pictures_in_the_way_are_named_before_the_run(tmp_path: Path):
    case = parse_case(
        HEAD + "[campbell]\nspeeds = [0, 1]\naxis = [0, 0, 1]\n[pictures]\nplots = ['e', 'f']\nlinearised = true\n"
    )
    output = tmp_path / "r.h5"
    run.check_pictures(case, output, force=False)
    run.check_pictures(parse_case(HEAD), output, force=False)
    ways = [tmp_path / name for name in ("r_e.png", "r_linearised.h5", "r_campbell.csv", "r_campbell.png")]
    for path in ways:
        path.touch()
    with pytest.raises(FileExistsError) as told:
        run.check_pictures(case, output, force=False)
    assert str(told.value) == (
        f"{', '.join(map(str, ways))} exist; choose another --output, --no-pictures, or force to overwrite"
    )
    run.check_pictures(case, output, force=True)
    for path in ways[1:]:
        path.unlink()
    with pytest.raises(FileExistsError, match=r"r_e\.png exists; choose"):
        run.check_pictures(case, output, force=False)


@pytest.mark.parametrize(("without", "linearised"), [((), False), (("a",), False), ((), True)])
def test_a_whole_run_is_drawn_with_its_second_one(
    without: Any, linearised: bool, drawn: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    from contextlib import nullcontext

    histories, asked, second = drawn("femflex.view", "plot_histories"), [], Rows(e=2)
    monkeypatch.setattr(run, "second_run", lambda *words: asked.append(words) or nullcontext(second))
    case, done, output = parse_case(HEAD + "[pictures]\nplots = ['e']\n"), Rows(e=1), Path("r.h5")
    done.without, done.linearised = without, linearised
    prepared: Any = SimpleNamespace(case=case, system=SimpleNamespace(bodies={}))
    run.draw_pictures(prepared, done, output, True)  # type: ignore[arg-type]
    whole = not (without or linearised)
    assert asked == ([(case, output, True)] if whole else [])
    assert some(histories[0], "other", "force") == (second if whole else None, True)
    assert capsys.readouterr().out == "picture     r_e.png\n"
    run.draw_pictures(SimpleNamespace(case=parse_case(HEAD)), done, output, True)  # type: ignore[arg-type]
    assert len(histories) == 1


# modes of crafts and bodies


def craft(known: list[bool]) -> Any:
    n = len(known)
    return SimpleNamespace(
        names=[f"mode {chr(97 + k)}" for k in range(n)], frequencies=np.arange(n) * 1.25,
        growing=np.arange(n) == n - 1, known=np.array(known), skin=lambda modes: ("skin", *modes),
    )  # fmt: skip


def test_the_montage_of_a_craft_has_its_first_twelve_modes_that_move(drawn: Any):
    montages = drawn("femflex.view", "craft_montage")
    drawing = craft_modes.Drawing(Path("m.png"), None, None, True)
    assert drawing.make(craft([True, False, True, *[False] * 12]), "a craft") == [("picture", Path("m.png"))]
    (found,) = montages
    assert found["skin"] == ("skin", 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14)
    assert found["captions"][:2] == ["2 · mode b · 1.25 Hz", "4 · mode d · 3.75 Hz"] and len(found["captions"]) == 12
    assert some(found, "title", "force", "path") == ("a craft", True, Path("m.png"))
    with pytest.raises(ValueError, match="the craft has only rigid-body modes, which are not drawn"):
        drawing.make(craft([True, True]), "a craft")


def test_the_movie_of_a_craft_is_of_one_mode(drawn: Any, bars: Any):
    movies = drawn("femflex.view", "craft_movie")
    path = Path("m.mp4")
    for mode, known in ((None, [True, True, False, False]), (2, [True, True, False]), (None, [True, True])):
        made = craft_modes.Drawing(None, path, mode, mode == 2).make(craft(known), "a craft")
        assert made == [("movie", path)]
    assert [some(one, "skin", "caption", "path", "force") for one in movies] == [
        (("skin", 3), "3 · mode c · 2.5 Hz", path, False),
        (("skin", 2), "2 · mode b · 1.25 Hz", path, True),
        (("skin", 1), "1 · mode a · 0 Hz", path, False),
    ]
    assert bars == [("drawing", "frames", 3, 4)] * 3
    for mode in (4, 5):
        with pytest.raises(ValueError, match=f"--mode is {mode}; the modes of the craft are 1 to 3"):
            craft_modes.Drawing(None, path, mode, False).make(craft([True, True, False]), "a craft")


def test_shapes_of_one_body_are_drawn_by_modes(femflex: Any, drawn: Any, body_file: Path):
    montages = drawn("femflex.view", "mode_montage")
    code, out, _ = femflex("modes", body_file, "-o", "m.png", "--force")
    assert code == 0 and out.endswith("picture     m.png\n")
    assert some(montages[0], "title", "force", "path") == ("modes of boom", True, Path("m.png"))
    assert femflex("modes", body_file, "-o", "m.png")[0] == 0 and not montages[1]["force"]
    for text in ("--mode 3", "--at 3", "-o x.mp4"):
        code, _, err = femflex("modes", body_file, *text.split())
        sentence = "movies, --mode and --at are for the modes of a craft; leave --body and its options out"
        assert (code, err) == (2, f"femflex: {sentence}\n")


def test_a_montage_is_of_one_body(femflex: Any, monkeypatch: pytest.MonkeyPatch):
    bodies: Any = {"wing": None, "boom": None}
    monkeypatch.setattr("femflex.cli.modes.flexible_bodies", lambda *words: (bodies, {}))
    code, out, err = femflex("modes", "two.toml", "--bodies", "-o", "m.png")
    sentence = "-o draws one body; name one of ['boom', 'wing'] with --body"
    assert (code, out, err) == (2, "", f"femflex: {sentence}\n")


# studies


def test_a_locus_and_a_chart_are_drawn_with_their_second_ones(drawn: Any):
    loci, charts = (drawn("femflex.view.stability", name) for name in ("plot_locus", "plot_chart"))
    locus, other = object.__new__(Locus), object.__new__(Locus)
    chart, second = object.__new__(Chart), object.__new__(Chart)
    for one in (chart, second):
        object.__setattr__(one, "names", ("k_roll", "k_yaw"))
    path, left_out = Path("s.png"), ("flexibility",)

    def found(first: Any, more: Any, ratios: bool) -> Any:
        return SimpleNamespace(found=first, second=more, left_out=left_out, ratios=ratios)

    stability.draw(found(locus, other, False), path, "craft", "dark", True)
    stability.draw(found(locus, None, False), path, "craft", "dark", False)
    names = ("path", "theme", "title", "force", "second", "left_out")
    assert [one["locus"] for one in loci] == [locus, locus]
    assert some(loci[0], *names) == (path, "dark", "craft", True, other, left_out)
    assert some(loci[1], *names) == (path, "dark", "craft", False, None, left_out)
    stability.draw(found(chart, second, True), path, "craft", "dark", True)
    stability.draw(found(chart, None, False), path, "craft", "dark", False)
    assert [one["chart"] for one in charts] == [chart, chart]
    assert some(charts[0], *names) == (path, "dark", "craft", True, second, left_out)
    assert some(charts[1], *names) == (path, "dark", "craft", False, None, left_out)
    assert len(charts[0]["known"]) == 4 and charts[1]["known"] == ()
    text, line = charts[0]["known"][0]
    assert text.startswith("regions of Lagrange") and line[-1].tolist() == [1.0, 1.0]


def test_a_sweep_is_drawn_as_points_envelopes_or_indices(drawn: Any):
    place = "femflex.view.sweep_plots"
    scatter, envelopes, indices = (drawn(place, name) for name in ("plot_scatter", "plot_envelopes", "plot_indices"))
    found: Any = SimpleNamespace(
        inputs={"m": [1], "k": [2]}, outputs={"peak": [3]}, units={"peak": "m"}, sobol={"peak": [4]}, time=[0, 1],
        histories={"e": [5]}, of_histories=lambda: {"e": [6]}, percentiles=[5, 95],
    )  # fmt: skip
    path = Path("s.png")
    sweep.draw(found, path, "study", ("dark", True), "")
    assert some(scatter[0], "inputs", "outputs", "units") == (found.inputs, found.outputs, found.units)
    sweep.draw(found, path, "study", ("dark", True), "envelope")
    assert some(envelopes[0], "time", "histories", "bands", "percentiles", "units") == (
        [0, 1], {"e": [5]}, {"e": [6]}, [5, 95], {"peak": "m"},
    )  # fmt: skip
    sweep.draw(found, path, "study", ("dark", True), "indices")
    assert some(indices[0], "inputs", "indices") == (["m", "k"], {"peak": [4]})
    for calls in (scatter, envelopes, indices):
        assert len(calls) == 1 and some(calls[0], "path", "theme", "title", "force") == (path, "dark", "study", True)


def test_a_response_is_drawn_by_pairs_of_output_and_input(drawn: Any, tmp_path: Path):
    bode, nichols = (drawn("femflex.view.bode", name) for name in ("plot_bode", "plot_nichols"))
    A, B = np.array([[0.0, 1.0], [-4.0, -0.1]]), np.array([[0.0, 3.0], [1.0, 0.5]])
    C, D = np.array([[1.0, 0.0], [0.5, -2.0], [0.0, 7.0]]), np.arange(6.0).reshape(3, 2)
    small = StateSpace(
        A, B, C, D, (("x", "m"), ("v", "m/s")), (("f", "N"), ("g", "N")), (("a", ""), ("b", ""), ("c", ""))
    )
    files = {"model": tmp_path / "m.npz", "picture": Path("b.png")}
    assert linearize.written(small, files, "craft", ("dark", True, False)) == list(files.items())
    with pytest.raises(FileExistsError):
        linearize.written(small, files, "craft", ("dark", False, False))
    assert linearize.written(small, {"picture": Path("n.png")}, "craft", ("dark", False, True)) == [
        ("picture", Path("n.png"))
    ]
    (found,), (chart,) = bode, nichols
    assert some(found, "path", "theme", "title", "force") == (Path("b.png"), "dark", "craft", True)
    assert some(chart, "path", "theme", "title", "force") == (Path("n.png"), "dark", "craft", False)
    w = found["omega"]
    for calls in (found, chart):
        assert list(calls["responses"]) == ["a / f", "b / f", "c / f", "a / g", "b / g", "c / g"]
        for i, into in enumerate("fg"):  # s x = v + b0, s v = -4 x - 0.1 v + b1
            s, (b0, b1) = 1j * w, B[:, i]
            x = (b0 * (s + 0.1) + b1) / (s * (s + 0.1) + 4)
            v = s * x - b0
            np.testing.assert_allclose(calls["responses"][f"b / {into}"], 0.5 * x - 2 * v + D[1, i], rtol=1e-9)


def test_studies_are_drawn_in_one_picture_unless_broken_off(drawn: Any, capsys: pytest.CaptureFixture[str]):
    from test_choices_of_verbs import study

    calls = drawn("femflex.view.side_by_side", "plot_studies")
    findings = [study()]
    wanted = converge_report.StudyOutputs(None, False, Path("c.png"), "dark", True)
    wanted.report(findings, {}, complete=False)
    assert not calls and capsys.readouterr().out == ""
    wanted.report(findings, {}, complete=True)
    assert some(calls[0], "studies", "path", "theme", "force") == (findings, Path("c.png"), "dark", True)
    assert capsys.readouterr().out == "picture     c.png\n"
    converge_report.StudyOutputs(None, False, None, "dark", True).report(findings, {}, complete=True)
    assert len(calls) == 1


def test_files_of_a_diagram_are_a_table_and_a_picture(drawn: Any, tmp_path: Path):
    from test_printed_numbers import campbell

    calls = drawn("femflex.view.campbell", "plot_campbell")
    table, picture, found = tmp_path / "c.csv", tmp_path / "c.png", campbell()
    made = CampbellOutputs(table, picture, "dark", True).files(found, 0.5, "rpm")
    assert made == [("table", table), ("picture", picture)] and table.is_file()
    names = ("diagram", "path", "theme", "scale", "unit", "force")
    assert some(calls[0], *names) == (found, picture, "dark", 0.5, "rpm", True)
    with pytest.raises(FileExistsError):
        CampbellOutputs(table, None, "dark", False).files(found, 0.5, "rpm")
    assert CampbellOutputs(None, None, "dark", False).files(found, 0.5, "rpm") == []


@pytest.mark.parametrize(
    ("wanted", "known", "drawn_quantity"),
    [
        (None, ("moment_y", "von_mises"), "von_mises"),
        (None, ("moment_y", "shear"), "moment_y"),
        (["shear"], ("moment_y", "shear", "von_mises"), "shear"),
    ],
)
def test_a_map_of_peaks_is_of_the_named_quantity_or_of_von_mises(
    wanted: Any, known: Any, drawn_quantity: str, drawn: Any, run_file: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):  # fmt: skip
    calls = drawn("femflex.view", "render_picture")
    monkeypatch.setattr("femflex.body.recovery.quantities", lambda parts: dict.fromkeys(known, "N"))
    bodies = {"wing": SimpleNamespace(strain_field=("a",)), "other": SimpleNamespace(strain_field=("b",))}
    with open_run(run_file) as opened:
        stress._draw(opened, bodies, ["wing"], Path("s.png"), wanted, True)
        assert calls[0]["run"] is opened
        with pytest.raises(ValueError, match=r"-o s.png draws one quantity, and --quantity names 2; give one"):
            stress._draw(opened, bodies, ["wing"], Path("s.png"), ["a", "b"], True)
    names = ("path", "force", "colour", "camera", "view", "fit")
    assert some(calls[0], *names) == (
        Path("s.png"), True, f"peak:{drawn_quantity}", "fixed", (0.0, -1.0, 0.25), "run",
    )  # fmt: skip
    assert capsys.readouterr().err == f"picture     s.png ({drawn_quantity})\n"
