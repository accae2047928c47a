"""Materials, beam sections and lay-ups of plates."""

from femflex.fem.sections.laminates import Lamina as Lamina
from femflex.fem.sections.laminates import PlateSection as PlateSection
from femflex.fem.sections.laminates import Ply as Ply
from femflex.fem.sections.laminates import isotropic as isotropic
from femflex.fem.sections.laminates import layup as layup
from femflex.fem.sections.laminates import orthotropic as orthotropic
from femflex.fem.sections.laminates import sandwich as sandwich
from femflex.fem.sections.library import Box as Box
from femflex.fem.sections.library import CableSection as CableSection
from femflex.fem.sections.library import Circle as Circle
from femflex.fem.sections.library import GivenSection as GivenSection
from femflex.fem.sections.library import ISection as ISection
from femflex.fem.sections.library import Rectangle as Rectangle
from femflex.fem.sections.library import StiffnessSection as StiffnessSection
from femflex.fem.sections.library import Tube as Tube
from femflex.fem.sections.materials import Material as Material
from femflex.fem.sections.named import FullSection as FullSection
