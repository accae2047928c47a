"""A small craft as texts: its case file, and the mesh of its boom."""

CRAFT = """
title = "hub with a boom"

[run]
duration = "10 s"
output_step = 0.05

[attitude]
rates = ["2 deg/s", 0, 0.01]

[materials.aluminium]
E = "70 GPa"
nu = 0.33
density = "2700 kg/m^3"

[sections.tube]
kind = "tube"
outer_radius = "30 mm"
thickness = "2 mm"

[bodies.hub]
kind = "rigid"
mass = 200
inertia = [120, 100, 140]
markers.left = { position = [0.5, 0, 0] }

[bodies.boom]
kind = "flexible"
mesh = "boom.inp"
members = [{ group = "BOOM", family = "beam", section = "tube", material = "aluminium" }]
reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }
damping = { ratio = "0.5 %" }
markers.tip = { group = "TIP" }
initial = { marker = "tip", displacement = [0, "10 mm", 0] }

[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "left"
child = "boom"
child_marker = "ROOT"

[[loads]]
name = "push"
body = "hub"
torque = [[0, 0, 1], [0, 0, 1]]
times = [0, 2]
"""

BOOM = """*NODE
1, 0.0, 0.0, 0.0
2, 1.0, 0.0, 0.0
3, 2.0, 0.0, 0.0
4, 3.0, 0.0, 0.0
*ELEMENT, TYPE=B31, ELSET=BOOM
1, 1, 2
2, 2, 3
3, 3, 4
*NSET, NSET=ROOT
1
*NSET, NSET=TIP
4
*NSET, NSET=NOTHING
"""
