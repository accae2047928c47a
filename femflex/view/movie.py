"""Frames into an MP4 file or a folder of PNG pictures."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from femflex.results.interrupts import finished_on_interrupt, without_interrupts
from femflex.view.drawing import Drawing
from femflex.view.window import Image
from femflex.writing import atomic_file

PNG_COMPRESSION = 1  # 18 ms a frame; the default takes 45 for a tenth less
Progress = Callable[[int, int], Any]


def write_png(path: Path, image: Image) -> None:
    """Write one picture."""
    from PIL import Image as Pillow

    Pillow.fromarray(image).save(path, format="PNG", compress_level=PNG_COMPRESSION)


def write_movie(
    path: str | Path,
    frames: Iterable[Image],
    count: int,
    fps: float,
    force: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Path of the movie written from `count` frames: an MP4 file, or a folder of PNG files when there is no suffix.

    `progress(done, count)` is called after every frame. When interrupted, the frames so far are kept and playable.
    """
    path = Path(path)
    if path.suffix.lower() not in (".mp4", ""):
        raise ValueError(f"{path.name} is neither an .mp4 file nor a folder of pictures (no suffix); give one of these")
    if not fps > 0:
        raise ValueError(f"fps is {fps}; a movie needs a positive number of frames a second")
    with _folder(path, force) if path.suffix == "" else _mp4(path, fps, force) as add:
        _add_frames(add, iter(frames), count, progress)
    return Drawing(path)


def _add_frames(add: Callable[[Image], None], frames: Iterator[Image], count: int, progress: Progress | None) -> None:
    first_frame = next(frames, None)
    if first_frame is None:
        return
    with finished_on_interrupt("a movie"):
        add(first_frame)
        for done in range(1, count + 1):
            if progress is not None:
                progress(done, count)
            with without_interrupts():  # a renderer does not survive an exception
                frame = next(frames, None)
            if frame is None:
                return
            add(frame)


@contextmanager
def _folder(path: Path, force: bool) -> Iterator[Callable[[Image], None]]:
    if path.is_file() or (path.is_dir() and any(path.iterdir()) and not force):
        raise FileExistsError(f"{path} exists and is not empty; choose another folder, or force to write into it")
    path.mkdir(parents=True, exist_ok=True)
    for old in path.glob("frame_*.png"):
        old.unlink()
    done = 0

    def add(frame: Image) -> None:
        nonlocal done
        done += 1
        with atomic_file(path / f"frame_{done:05d}.png", force=True) as draft:
            write_png(draft, frame)

    yield add


@contextmanager
def _mp4(path: Path, fps: float, force: bool) -> Iterator[Callable[[Image], None]]:
    process: subprocess.Popen[bytes] | None = None

    with atomic_file(path, force, keep_interrupted=True) as draft:

        def add(frame: Image) -> None:
            nonlocal process
            process = process or _encoder(draft, frame.shape[1], frame.shape[0], fps)
            assert process.stdin is not None
            process.stdin.write(np.ascontiguousarray(frame).data)

        try:
            yield add
        except BrokenPipeError as error:
            raise OSError(f"{path} cannot be written: {_close_encoder(process) or error}") from error
        except BaseException:
            _close_encoder(process)  # ends the file properly, so that it plays up to here
            raise
        if text := _close_encoder(process):
            raise OSError(f"{path} cannot be written: {text}")


def _encoder(path: Path, width: int, height: int, fps: float) -> subprocess.Popen[bytes]:
    """H.264 for every player, as fast as drawing; not reached by Ctrl-C, so that it can end the file."""
    import imageio_ffmpeg

    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-"]
    even = "pad=ceil(iw/2)*2:ceil(ih/2)*2"
    codec = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-v", "error", *source, "-vf", even, *codec, str(path)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)


def _close_encoder(process: subprocess.Popen[bytes] | None) -> str:
    """Close the encoder; its message when it failed, or ""."""
    if process is None or process.stdin is None or process.stdin.closed:
        return ""
    try:
        _, text = process.communicate()
    except BrokenPipeError:
        text = process.stderr.read() if process.stderr else b""
    return (
        ""
        if process.returncode == 0
        else text.decode(errors="replace").strip() or f"ffmpeg ended with {process.returncode}"
    )
