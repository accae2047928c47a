"""A flexible body as plain arrays: the interface between finite elements and dynamics.

Whatever the discretisation (finite elements, admissible functions, lumped masses), a reduced body is its mass
moments, strain tensors, damping, markers and a skin to draw.
"""

from femflex.body.flexible import FlexibleBody as FlexibleBody
from femflex.body.flexible import Foreshortening as Foreshortening
from femflex.body.flexible import LoadSet as LoadSet
from femflex.body.flexible import Skin as Skin
from femflex.body.flexible import rigid_body as rigid_body
from femflex.body.induced_strain import InducedStrain as InducedStrain
from femflex.body.marker import Marker as Marker
from femflex.body.moments import MassMoments as MassMoments
from femflex.body.patches import Patches as Patches
from femflex.body.strain import StrainTensors as StrainTensors
