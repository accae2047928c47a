"""The compiled model of the last system, cached for the next call with the same system."""

from __future__ import annotations

from threading import local

from femflex.dynamics import compile_system
from femflex.dynamics.model import Model
from femflex.dynamics.motion.freedoms import refuse_singular_mass
from femflex.system import System

_last = local()  # of every thread: the system and its model


def compiled(system: System) -> Model:
    """The compiled model of a system (`femflex.compile_system`), cached for the last system.

    The check of the channels of a case and the run that follows use the same system. Raises ValueError for coordinates
    that describe the same motion.
    """
    last: tuple[System, Model] | None = getattr(_last, "pair", None)
    if last is None or last[0] is not system:
        last = (system, compile_system(system))
        refuse_singular_mass(last[1])
        _last.pair = last
    return last[1]
