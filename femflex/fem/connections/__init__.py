"""Connections between members of one body: rigid and distributing interfaces, and linear equations of dofs."""

from femflex.fem.connections.distributing import Distributing as Distributing
from femflex.fem.connections.equation import Equation as Equation
from femflex.fem.connections.equation import Term as Term
from femflex.fem.connections.multi_point import MultiPointConstraint as MultiPointConstraint
from femflex.fem.connections.rigid import Rigid as Rigid
