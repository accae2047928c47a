"""Solid members: isoparametric hexahedra."""
