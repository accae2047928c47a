"""Cases of one large body on a hub, and the numerical work that a verb does on them, counted."""

from __future__ import annotations

from collections import Counter

from femflex.fem import structure as fem_structure
from femflex.fem.assembly import assembler
from femflex.fem.eigen import shift_invert
from femflex.mesh import write_mesh
from femflex.reduction.boundary import supported
from femflex.reduction.modes import buckling

CASE = """
title = "One flexible body on a hub"
[run]
duration = "2 s"
output_step = "0.1 s"
[attitude]
frame = "inertial"
[bodies.hub]
kind = "rigid"
mass = "400 kg"
inertia = ["150 kg m^2", "170 kg m^2", "180 kg m^2"]
[materials.metal]
E = "70 GPa"
nu = 0.3
density = "2700 kg/m^3"
[sections.sheet]
kind = "plate"
thickness = "5 mm"
[sections.bar]
kind = "rectangle"
width = "20 mm"
height = "10 mm"
[bodies.body]
kind = "flexible"
mesh = "body.msh"
members = [{{ {member}, material = "metal"{options} }}]
reduction = {{ {reduction} }}
{strain}
[bodies.body.markers.left]
[bodies.body.markers.right]
[[joints]]
kind = "weld"
parent = "hub"
child = "body"
child_marker = "left"
[[loads]]
name = "turn"
body = "hub"
torque = ["0 N m", "1 N m", "0 N m"]
{more}
"""
MEMBERS = {
    "plate": 'group = "surface", family = "plate", section = "sheet"',
    "plate_bfs": 'group = "surface", family = "plate_bfs", section = "sheet"',
    "solid": 'group = "volume", family = "solid"',
    "beam": 'group = "line", family = "beam", section = "bar"',
}
CLAMPED = 'method = "cantilever", clamp = "left", modes = 6'
HELD = 'method = "cantilever", clamp = ["left", "right"], modes = 6'
FREE = 'method = "free_free", modes = 6'


def write_case(folder, mesh, family, reduction, *, strain="", options="", more=""):
    """The case file of a body of that family on a mesh; the mesh's file is in the same folder."""
    write_mesh(folder / "body.msh", mesh)
    path = folder / "case.toml"
    strain = f'strain = "{strain}"' if strain else ""
    options = f", options = {{ {options} }}" if options else ""
    path.write_text(CASE.format(member=MEMBERS[family], reduction=reduction, strain=strain, options=options, more=more))
    return path


def count_work(monkeypatch, n_dof):
    """Counts, as they grow: "structures" assembled, "factorisations" and "Lanczos" searches of nearly all n_dof."""
    counts = Counter()

    def count_calls(module, name, kind, large=lambda *args: True):
        original = getattr(module, name)

        def call(*args, **kwargs):
            counts[kind] += bool(large(*args))
            return original(*args, **kwargs)

        monkeypatch.setattr(module, name, call)

    def has_all_dof(A, *_):
        return A.shape[0] > 0.75 * n_dof

    count_calls(fem_structure, "mass_and_stiffness", "structures")
    count_calls(assembler.Assembler, "total", "matrices")
    for module in (shift_invert, supported):
        count_calls(module, "splu", "factorisations", has_all_dof)
    for module in (shift_invert, buckling):
        count_calls(module, "eigsh", "Lanczos", has_all_dof)
    return counts
