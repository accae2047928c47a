"""Sparse sums of element matrices on patterns found once."""

from femflex.fem.assembly.assembler import Assembler as Assembler
from femflex.fem.assembly.assembler import assemble as assemble
from femflex.fem.assembly.pattern import ElementMatrices as ElementMatrices
