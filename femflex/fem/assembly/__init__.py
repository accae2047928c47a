"""Sparse sums of element matrices on patterns found once."""

from femflex.fem.assembly.assembler import Assembler as Assembler
from femflex.fem.assembly.assembler import assembled as assembled
from femflex.fem.assembly.part import Part as Part
