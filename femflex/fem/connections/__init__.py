"""Connections between members of one body: rigid and distributing interfaces, and linear equations of dofs."""

from femflex.fem.connections.connection import Distributing as Distributing
from femflex.fem.connections.connection import Rigid as Rigid
from femflex.fem.connections.multi_point import Equation as Equation
from femflex.fem.connections.multi_point import MultiPointConstraint as MultiPointConstraint
from femflex.fem.connections.multi_point import Term as Term
