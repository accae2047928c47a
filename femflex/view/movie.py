"""Frames into an MP4 file or a folder of PNG pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from femflex.extras import require
from femflex.results.interrupts import finished_on_interrupt, without_interrupts
from femflex.view.window import Drawing, Image
from femflex.writing import atomic_file

PNG_COMPRESSION = 1  # 18 ms a frame; the default takes 45 for a tenth less
CODEC = {"preset": "veryfast", "crf": "18"}
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
                add(frame)  # nor does an encoder


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
    """H.264 for every player, as fast as drawing."""
    require("view", "movies")
    import av

    with atomic_file(path, force, keep_interrupted=True) as draft:
        container = av.open(str(draft), "w", format="mp4", options={"movflags": "+faststart"})
        stream: Any = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(10_000), options=CODEC)
        stream.pix_fmt = "yuv420p"

        def add(frame: Image) -> None:
            height, width = frame.shape[0] % 2, frame.shape[1] % 2
            even = np.pad(frame, ((0, height), (0, width), (0, 0))) if height or width else frame
            if not stream.codec_context.is_open:
                stream.height, stream.width = even.shape[:2]
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")))

        try:
            try:
                yield add
            finally:  # also where drawing fails or is interrupted, so that the file plays up to there
                with without_interrupts():
                    if stream.codec_context.is_open:
                        container.mux(stream.encode(None))
                    container.close()
        except av.FFmpegError as error:
            raise OSError(error.errno, f"the movie cannot be written: {error.strerror}", str(path)) from error
