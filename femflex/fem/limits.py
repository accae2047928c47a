"""The limits by which elements and meshes are judged, and why each has its value."""

from __future__ import annotations

# Locking of solids
ACROSS_THICKNESS = 0.7  # cosine to the rise of other edges, above which an edge goes through the thickness
THIN_LAYER = 0.25  # thickness over the longest edge, below which an element belongs to a thin layer
FEW_SOLIDS = 0.2  # of the elements; fewer curved ones count as fillets
LOCKING_ERROR = 0.05  # estimated error above which a warning is given
# Poisson's ratio above which the volume constraint at all points of strain costs over 1 % of a deflection
NEARLY_INCOMPRESSIBLE = 0.49

# Solids
# Largest distance of a middle node from the mean of its corners, over the distance of these from it
MISPLACED_NODE = 0.5

# Beams
CURVED_CELL = 5e-3  # relative length that chords of curved cells may lack: an arc of 39 deg in two of them
SLENDER_BEAM = 20.0  # length over radius of gyration below which neglected shear shifts the first mode by over 1 %

# Axes of sections
UNLIKE_STIFFNESSES = 0.01  # relative difference of the two bending stiffnesses above which the axes of a section matter
# Sine of the angle to the mesh's z axis below which the selected axes depend strongly on the direction
UPRIGHT_AXIS = 0.2

# Shells
WARPED_SHELL = 15.0  # [deg] between the normals at two corners of a four-node element, above which a warning is given
FOLDED_SHELL = 120.0  # [deg] above which such an element is an error: its sides cross
# Of the area in three-node triangles (constant membrane strain), above which a warning is given
CONSTANT_STRAIN_SHARE = 0.2

# Coarse shells
# Of sqrt(R h): length of four-node elements above which they are 18 % too stiff at loads and edges
LONG_LINEAR_SHELL = 1.5
# Of sqrt(R h): length of second-order elements above which low modes of a thin dish are over 10 % too high
LONG_SHELL = 16.0
SHELL_STIFFNESS_ERROR = 0.08  # of s^2: coefficient of the relative error in stiffness, as above
TAPERED_SHELL = 1.0  # a tan(delta) above which trapezoids are over twice as stiff as they should be in their plane
FEW_SHELLS = 0.2  # share of the elements above which trapezoids cause a warning, because most meshes have some
