"""From a mesh of a boom, panel or blanket to the motion of the whole spacecraft."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from femflex.advice import Advice as Advice
    from femflex.advice import advise as advise
    from femflex.body import FlexibleBody as FlexibleBody
    from femflex.body import Marker as Marker
    from femflex.body import rigid_body as rigid_body
    from femflex.case import Case as Case
    from femflex.case import CaseError as CaseError
    from femflex.case import read_case as read_case
    from femflex.case import with_values as with_values
    from femflex.dynamics import compile_system as compile_system
    from femflex.linear.equilibrium import equilibrium as equilibrium
    from femflex.linear.settled import settled as settled
    from femflex.linear.system_modes import system_modes as system_modes
    from femflex.mesh import Mesh as Mesh
    from femflex.mesh import read_mesh as read_mesh
    from femflex.pipeline import run as run
    from femflex.pipeline.case_bodies import build_body as build_body
    from femflex.pipeline.decisions import build_system as build_system
    from femflex.pipeline.simulate import simulate as simulate
    from femflex.reduction import load_body as load_body
    from femflex.reduction import save_body as save_body
    from femflex.reduction.reduce import flexible_body as flexible_body
    from femflex.results import Run as Run
    from femflex.results import open_run as open_run
    from femflex.system import Controller as Controller
    from femflex.system import Effector as Effector
    from femflex.system import Frame as Frame
    from femflex.system import Joint as Joint
    from femflex.system import Load as Load
    from femflex.system import Orbit as Orbit
    from femflex.system import System as System
    from femflex.warning import PhysicsWarning as PhysicsWarning

_HOME = {
    "Advice": "advice",
    "Case": "case",
    "CaseError": "case",
    "Controller": "system",
    "Effector": "system",
    "FlexibleBody": "body",
    "Frame": "system",
    "Joint": "system",
    "Load": "system",
    "Marker": "body",
    "Mesh": "mesh",
    "Orbit": "system",
    "PhysicsWarning": "warning",
    "Run": "results",
    "System": "system",
    "advise": "advice",
    "build_body": "pipeline.case_bodies",
    "build_system": "pipeline.decisions",
    "compile_system": "dynamics",
    "equilibrium": "linear.equilibrium",
    "flexible_body": "reduction.reduce",
    "load_body": "reduction",
    "open_run": "results",
    "read_case": "case",
    "read_mesh": "mesh",
    "rigid_body": "body",
    "run": "pipeline",
    "save_body": "reduction",
    "settled": "linear.settled",
    "simulate": "pipeline.simulate",
    "system_modes": "linear.system_modes",
    "with_values": "case",
}

__all__ = [*sorted(_HOME), "__version__"]


def __getattr__(name: str) -> Any:
    """Public names, loaded when first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'femflex' has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")
    return getattr(import_module(f"femflex.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*_HOME, *(name for name in globals() if name.startswith("__"))})
