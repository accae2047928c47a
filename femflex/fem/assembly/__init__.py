"""Sparse sums of element matrices on patterns found once."""

from femflex.fem.assembly.assembler import Assembler as Assembler
from femflex.fem.assembly.assembler import Part as Part
from femflex.fem.assembly.assembler import assembled as assembled
