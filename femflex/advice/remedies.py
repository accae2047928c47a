"""Text on how to divide a body whose deflection is too large for one body frame."""

from __future__ import annotations

from femflex.body import FlexibleBody


def division_remedy(body: FlexibleBody) -> str:
    """Text on how to divide a body: mesh lines are cut into segments, other bodies are divided by hand."""
    kinds = {part.kind for part in body.strain_field}
    if "admissible" in body.kinds:
        return "give it a mesh instead of functions and cut its member into segments"
    if "line" in kinds:
        return "cut the member into segments"
    if kinds:
        return f"divide its {'plates' if 'plate' in kinds else 'solids'} into several bodies, welded to each other"
    return "divide it into several bodies, welded to each other"
