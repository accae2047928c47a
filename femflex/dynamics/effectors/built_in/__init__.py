"""Functions of the effectors of femflex: compiled once, kept on disk, and called for any number of effectors.

Each is an entry of signature ACT (see femflex.dynamics.effectors.effector_functions). An `Effector` names it by the
word that it has as its function. Sizes and constants come as numbers, so none is compiled for a single effector.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from femflex.kernels.entries import Entry

MODULES = {
    "wheel": "wheel",
    "rotor": "wheel",
    "gimbals": "gimbals",
    "thruster": "thruster",
    "tank": "thruster",
    "measure": "measure",
    "state_space": "blocks",
    "attitude_feedback": "blocks",
    "signal": "signals",
    "separation": "separation",
    "cable": "cable",
    "cable_chain": "cable_chain",
}
WRITING_ALL = frozenset(
    {"wheel", "rotor", "thruster"}
)  # functions that write all their numbers, so that none is set to zero


@cache
def built_in(word: str) -> Entry:
    """The function of that word.

    Raises KeyError with the known words when there is none.
    """
    if word not in MODULES:
        raise KeyError(f"femflex has no effector function {word!r}; it has {', '.join(MODULES)}")
    function: Entry = getattr(import_module(f"{__name__}.{MODULES[word]}"), word)
    return function


def writes_all(word: str) -> bool:
    """Return whether the function of that word writes all its numbers; for others they are zeroed before each call."""
    return word in WRITING_ALL
