"""Orbit and attitude ephemerides of CCSDS in text form (KVN): OEM (502.0-B-3) and AEM (504.0-B-2)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.system.environment import J2000

INERTIAL = ("EME2000", "J2000", "GCRF", "ICRF", "TEME", "TOD", "MOD", "MOD_EARTH", "ICRF3", "J2000_EARTH", "GCRFN")
DAY = re.compile(r"(\d{4})-(\d{3})T(.*)")  # year and day of the year
QUATERNIONS = ("QUATERNION", "QUATERNION/DERIVATIVE", "QUATERNION/RATE", "QUATERNION/ANGVEL")
WIDTH = 24  # of a number


@dataclass(frozen=True, eq=False)
class Ephemeris:
    """Rows over time: positions and velocities, or attitudes.

    days    (n,)  days since J2000, UTC
    values  (n, 6) position [m] and velocity [m/s], or (n, 4) Euler parameters of C_AB, the scalar first
    frame   inertial axes, in the word of the file
    """

    days: Array
    values: Array
    frame: str


def read_oem(path: Path) -> Ephemeris:
    """Positions and velocities of an orbit ephemeris message. Raises ValueError for what is no such message."""
    days, values, frames = list[float](), list[Array](), list[str]()
    for meta, rows in _segments(path, "CCSDS_OEM_VERS"):
        frames.append(_inertial(meta.get("REF_FRAME", ""), path))
        for words in rows:
            if len(words) < 7:
                raise ValueError(f"{path.name} has {' '.join(words)[:60]!r}; expected epoch, x, y, z, vx, vy, vz")
            days.append(_days(words[0], path))
            values.append(1e3 * _numbers(words[1:7], path))  # km to m
    return _ephemeris(path, days, values, frames)


def read_aem(path: Path) -> Ephemeris:
    """Attitudes of a body in inertial axes of an attitude ephemeris message.

    Raises ValueError for what is no such message, and for other attitude types than quaternions.
    """
    days, values, frames = list[float](), list[Array](), list[str]()
    for meta, rows in _segments(path, "CCSDS_AEM_VERS"):
        kind = meta.get("ATTITUDE_TYPE", "").replace(" ", "")
        if kind not in QUATERNIONS:
            raise ValueError(f"{path.name} has ATTITUDE_TYPE = {kind}; attitudes are read as {', '.join(QUATERNIONS)}")
        ends = [meta.get("REF_FRAME_A", ""), meta.get("REF_FRAME_B", "")]
        if meta.get("ATTITUDE_DIR", "A2B") == "B2A":
            ends.reverse()
        from_inertial = ends[0] in INERTIAL
        frames.append(_inertial(ends[0] if from_inertial else ends[1], path))
        for words in rows:
            if len(words) < 5:
                raise ValueError(f"{path.name} has {' '.join(words)[:60]!r}; expected epoch, q1, q2, q3, qc")
            q = _numbers(words[1:5], path)
            if meta.get("QUATERNION_TYPE", "LAST") != "FIRST":
                q = np.roll(q, 1)
            days.append(_days(words[0], path))
            values.append(q / np.linalg.norm(q) * ([1, 1, 1, 1] if from_inertial else [1, -1, -1, -1]))
    return _ephemeris(path, days, values, frames)


def oem_text(ephemeris: Ephemeris, name: str, identifier: str) -> str:
    """The text of an orbit ephemeris message."""
    meta = {"OBJECT_NAME": name, "OBJECT_ID": identifier, "CENTER_NAME": "EARTH", "REF_FRAME": ephemeris.frame}
    rows = ephemeris.values / 1e3
    return _text("CCSDS_OEM_VERS = 3.0", meta, ephemeris.days, rows, ("", ""))


def aem_text(ephemeris: Ephemeris, name: str, identifier: str) -> str:
    """The text of an attitude ephemeris message."""
    meta = {"OBJECT_NAME": name, "OBJECT_ID": identifier, "CENTER_NAME": "EARTH", "REF_FRAME_A": ephemeris.frame}
    meta |= {"REF_FRAME_B": "SC_BODY_1", "ATTITUDE_TYPE": "QUATERNION"}
    rows = np.roll(ephemeris.values, -1, axis=1)
    return _text("CCSDS_AEM_VERS = 2.0", meta, ephemeris.days, rows, ("DATA_START", "DATA_STOP"))


def _text(head: str, meta: Mapping[str, str], days: Array, rows: Array, around: tuple[str, str]) -> str:
    times = [_epoch(day) for day in days]
    span = {"TIME_SYSTEM": "UTC", "START_TIME": times[0], "STOP_TIME": times[-1]}
    keys = list(meta)
    first, rest = {key: meta[key] for key in keys if key != "ATTITUDE_TYPE"}, {k: meta[k] for k in keys[5:]}
    lines = [head, f"CREATION_DATE = {_epoch((datetime.now(UTC) - J2000).total_seconds() / 86400.0)}"]
    lines += [
        "ORIGINATOR = FEMFLEX",
        "",
        "META_START",
        *(f"{key} = {value}" for key, value in (first | span | rest).items()),
    ]
    lines += ["META_STOP", "", around[0]]
    lines += [
        f"{time} {' '.join(f'{value:{WIDTH}.15e}' for value in row)}" for time, row in zip(times, rows, strict=True)
    ]
    return "\n".join([*lines, around[1], ""])


def _epoch(day: float) -> str:
    return (J2000 + timedelta(days=day)).strftime("%Y-%m-%dT%H:%M:%S.%f")


def _segments(path: Path, version: str) -> Iterator[tuple[dict[str, str], list[list[str]]]]:
    """Metadata and rows of every segment. Raises ValueError for other files."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise ValueError(
            f"{path.name} is no text; expected a CCSDS message in KVN, which begins with {version}"
        ) from None
    if version not in text or text.lstrip().startswith("<"):
        raise ValueError(f"{path.name} does not begin with {version}; femflex reads messages in KVN (text), not in XML")
    for part in re.split(r"^\s*META_START\s*$", text, flags=re.MULTILINE)[1:]:
        head, _, body = part.partition("META_STOP")
        meta = dict(_pair(line) for line in head.splitlines() if "=" in line)
        if (system := meta.get("TIME_SYSTEM", "UTC")) != "UTC":
            raise ValueError(f"{path.name} has TIME_SYSTEM = {system}; give times in UTC")
        body = re.sub(r"COVARIANCE_START.*?COVARIANCE_STOP", "", body, flags=re.DOTALL)
        lines = [line.split() for line in body.splitlines()]
        yield meta, [words for words in lines if words and re.match(r"\d{4}-", words[0])]


def _pair(line: str) -> tuple[str, str]:
    key, _, value = line.partition("=")
    return key.strip(), value.strip()


def _inertial(frame: str, path: Path) -> str:
    if frame not in INERTIAL:
        raise ValueError(
            f"{path.name} is in the axes {frame!r}; give one in inertial axes, such as {', '.join(INERTIAL[:5])}"
        )
    return frame


def _days(text: str, path: Path) -> float:
    """Days since J2000 of an epoch with a date, or with a year and its day."""
    text = text.removesuffix("Z")
    try:
        if match := DAY.fullmatch(text):
            date = datetime(int(match[1]), 1, 1) + timedelta(days=int(match[2]) - 1)
            text = f"{date:%Y-%m-%d}T{match[3]}"
        whole, _, fraction = text.partition(".")
        time = datetime.fromisoformat(whole).replace(tzinfo=UTC) - J2000
    except ValueError:
        raise ValueError(f"{path.name} has the epoch {text!r}; expected one such as 2026-03-20T14:46:00.000") from None
    return time.days + (time.seconds + float(f"0.{fraction or 0}")) / 86400.0


def _numbers(words: Sequence[str], path: Path) -> Array:
    try:
        return np.array(words, float)
    except ValueError:
        raise ValueError(f"{path.name} has {' '.join(words)!r}; expected numbers") from None


def _ephemeris(path: Path, days: Sequence[float], values: Sequence[Array], frames: Sequence[str]) -> Ephemeris:
    """The rows in one, without those that two segments share."""
    if len(set(frames)) > 1:
        raise ValueError(f"{path.name} has segments in the axes {sorted(set(frames))}; give one in the same axes")
    if not days:
        raise ValueError(f"{path.name} has no rows of data")
    time, data = np.array(days), np.array(values)
    keep = np.concatenate([[True], np.diff(time) > 0.0])
    if not (np.diff(time) >= 0.0).all():
        raise ValueError(f"{path.name} has epochs that do not rise; put its segments in order, without overlap")
    return Ephemeris(time[keep], data[keep], frames[0])
