"""Mass that resists the accelerations of a body's markers, such as the water that moves with it: a matrix (6 + n).

A scalar mass per point cannot carry it, so it stands next to the body's own inertia and is added to its rows:

    added  work: six rows as [A | 0] (48), then rows as those of the border (n, stride)
    then the bias (8 + row): its forces on the body at rest accelerations, as the bias wrench, and on the coordinates;
    then room for one marker: columns (6, row), the same times the mass (6, row), and the mass itself (36)

It is written by the function at `add_mass` of the header, after the bodies are placed.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Record
from femflex.dynamics.layout.pool import Scratch
from femflex.dynamics.layout.records import W_M, W_P
from femflex.kernels.compiled import inner
from femflex.kernels.entries import POINTERS, REAL, VOID, caller
from femflex.kernels.lanes import lane, put_lane, zero_lane

ADD_MASS = VOID(REAL, *POINTERS)
call_add_mass = caller(ADD_MASS)

SIX_ROWS, MATRIX = 48, 36


def take_added_mass(record: np.void, scratch: Scratch) -> None:
    """Reserve places for the added mass of a body, whose elastic block then changes with the motion."""
    row, stride = int(record["row"]), int(record["stride"])
    record["added"] = scratch.take(SIX_ROWS + row * stride + 8 + row + 12 * row + MATRIX)
    record["dense"] = int(record["n"] > 0)


@inner
def place_of_bias(b: Record) -> int:
    """Index of the bias in the work array."""
    return b["added"] + SIX_ROWS + b["row"] * b["stride"]


@inner
def clear_added_mass(b: Record, work: Array) -> None:
    """Set the added mass and its bias to zero."""
    for k in range(0, SIX_ROWS + b["row"] * b["stride"] + 8 + b["row"], 4):
        put_lane(work, b["added"] + k, zero_lane())


@inner
def add_added_rows(b: Record, work: Array) -> None:
    """Add the mass to the written rows of the rigid motion and to the coupling of the elastic rows."""
    for k in range(0, SIX_ROWS, 4):
        entry = b["work"] + W_M + k
        put_lane(work, entry, lane(work, entry) + lane(work, b["added"] + k))
    for i in range(b["n"]):
        start = b["stride"] * i + b["row"]
        for k in range(0, 8, 4):
            entry = b["border"] + start + k
            put_lane(work, entry, lane(work, entry) + lane(work, b["added"] + SIX_ROWS + start + k))


@inner
def add_added_block(b: Record, work: Array) -> None:
    """Add the mass of the shapes to the elastic block of the border."""
    for i in range(b["n"]):
        start = b["stride"] * i
        for k in range(0, b["row"], 4):
            entry = b["border"] + start + k
            put_lane(work, entry, lane(work, entry) + lane(work, b["added"] + SIX_ROWS + start + k))


@inner
def add_added_bias(b: Record, work: Array) -> None:
    """Add the mass times the bias accelerations of the markers to the bias wrench and the elastic bias."""
    bias = place_of_bias(b)
    for k in range(0, 8, 4):
        put_lane(work, b["work"] + W_P + k, lane(work, b["work"] + W_P + k) + lane(work, bias + k))
    for k in range(0, b["row"], 4):
        put_lane(work, b["pn"] + k, lane(work, b["pn"] + k) + lane(work, bias + 8 + k))


@inner
def add_added_inertia(b: Record, work: Array) -> None:
    """Add the mass of the shapes times their accelerations to the elastic bias."""
    for j in range(b["n"]):
        start = b["added"] + SIX_ROWS + b["stride"] * j
        for k in range(0, b["row"], 4):
            force = work[b["accel"] + j] * lane(work, start + k)
            put_lane(work, b["pn"] + k, lane(work, b["pn"] + k) + force)
