"""How a body that bends too far for one frame is made of several."""

from __future__ import annotations

from femflex.body import FlexibleBody


def division_remedy(body: FlexibleBody) -> str:
    """What to do, in words: lines of meshes are cut into segments; what has none is divided by hand."""
    kinds = {part.kind for part in body.strain_field}
    if "admissible" in body.kinds:
        return "give it a mesh instead of functions and cut its member into segments"
    if "line" in kinds:
        return "cut the member into segments"
    if kinds:
        return f"divide its {'plates' if 'plate' in kinds else 'solids'} into several bodies, welded to each other"
    return "divide it into several bodies, welded to each other"
