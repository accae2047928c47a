"""The nodes family: points that move without being part of an element, for masses and springs between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, Option, Options, family, member_options

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

OPTIONS: Options = {"rotations": Option(True, "whether the nodes have rotations too")}


@family("nodes", OPTIONS)
def nodes(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Displacements and rotations of the points of a group, without mass or stiffness.

    section   none
    material  none
    options   rotations  False: the points have no rotation

    Springs, bushings, point masses and connections act on them: lumped models. Dofs without stiffness must be clamped.
    """
    options = member_options(member)
    points = np.asarray(mesh.group_points(member.group))
    numbering.translation(points)
    if options["rotations"]:
        numbering.rotation(points)
    return Contribution((), ())
