"""The compiled model: a System lowered to flat arrays, and the kernels of its equations of motion."""

from femflex.dynamics.model import Model, compile_system

__all__ = ["Model", "compile_system"]
