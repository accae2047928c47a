"""The register of integrators by name; each module adds its own."""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches
from typing import Any

from femflex.integrate.protocol import Integrator

INTEGRATORS: dict[str, Callable[..., Integrator]] = {}


def integrator(name: str, **settings: Any) -> Integrator:
    """The integrator of that name with the given settings (rtol, atol, max_step, ...)."""
    if name not in INTEGRATORS:
        matches = get_close_matches(name, INTEGRATORS, n=1)
        hint = f" Did you mean {matches[0]!r}?" if matches else ""
        raise ValueError(f"integrator {name!r} is not known.{hint} Known are {sorted(INTEGRATORS)}.")
    return INTEGRATORS[name](**settings)
