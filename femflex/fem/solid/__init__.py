"""Solid members: isoparametric tetrahedra, pyramids, wedges and hexahedra."""
