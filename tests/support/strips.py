"""Meshed strips that tip over sideways, and sets of their shapes."""

from functools import cache

from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_attachment, with_derivatives
from support.lateral_buckling import EI, END_LOAD, GJ, LENGTH, critical, of_narrow_beams

SLIM = 400  # stiffness of the stiff plane over that of the weak one, as of a strip 20 times as wide as thick


@cache
def strip(ratio, EA, gyration, elements=6):
    section = StiffnessSection(EA, ratio * EI, EI, GJ, 1.2, ry=gyration, rz=gyration)
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], elements)
    return build_structure(mesh, [Member("line", "beam", section, None, {"orientation": (0, 1, 0)})])


STRIPS = {"thick": (50, 2.8e7, 0.0224), "slim": (SLIM, 2.8e9, 0.005)}  # the slim one stores far more in stretch


def derived(structure, modes, n, keep, attachment=(), loads=None):
    """n modes with the static shapes of some loads, and derivatives."""
    base = modes.picked(range(n))
    if attachment or loads:
        base = with_attachment(structure, base, attachment, loads)
    return with_derivatives(structure, base, keep)


def under_end_load(name, n, keep="auto", strain="condensed", loads=None):
    """Share of the closed form at which a cantilever strip tips over under a load at its end."""
    ratio = STRIPS[name][0]
    structure = strip(*STRIPS[name])
    shapes = derived(structure, cantilever_modes(structure, "start", 12), n, keep, loads=loads)
    body = reduce_structure(structure, shapes, {"tip": "end"}, strain=strain)
    return critical(body, body.markers["tip"].phi[2], of_narrow_beams(END_LOAD, 2, ratio))
