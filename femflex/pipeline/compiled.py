"""The compiled model of a system, kept for the next who asks for that of the same system."""

from __future__ import annotations

from threading import local

from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.singular_mass import refuse_singular_mass
from femflex.dynamics.model import Model
from femflex.system import System

_last = local()  # of every thread: the system and its model


def compiled(system: System) -> Model:
    """`femflex.compile_system` of a system; of the one asked for last it is not done again.

    The case's check of its channels and the run that follows ask for the same one. Raises ValueError for coordinates
    that describe the same motion.
    """
    known: tuple[System, Model] | None = getattr(_last, "pair", None)
    if known is None or known[0] is not system:
        known = (system, compile_system(system))
        refuse_singular_mass(known[1])
        _last.pair = known
    return known[1]
