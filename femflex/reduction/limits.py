"""The limits by which shapes, bases and their stress are judged, and why each has its value."""

from __future__ import annotations

# Buckling
LARGE_BUCKLED_DEFLECTION = 0.25  # deflection at the buckling load over size above which linear buckling does not apply
# Ratio at the worst instant over that at the largest load, above which the latter is not assessed
CLEARLY_LARGER = 1.02

# Wide thin sheets
WIDE_SHEET = 10.0  # width^2 curvature / thickness (Searle's parameter), above which vibration shapes are too stiff
SMALL_SHEET_DEFLECTION = 0.05  # deflection over length, above which the loss of transverse curvature is ignored
# Largest deflection over the diagonal that a sheet's set represents, the limit of condensed strain
LARGEST_SHEET_DEFLECTION = 0.2

# Initial stress
LEAST_REMAINING_STRESS = 0.5  # share of the energy of an intended stress that must remain, below which it is reported
SMALL_STRAIN = 0.01  # limit of small strain: stiffness and shape change by as much
MOVED_BY_RELAXATION = 1e-3  # of the body's size: displacement by relaxation, above which it is reported
LOST_BY_RELAXATION = 0.01  # share of the stress energy lost by relaxation, above which linear strain is doubtful

# Modes whose errors count
JUDGED_MODES = 3  # of the modes kept, whose frequencies count

# Omitted shear
OMITTED_SHEAR = (
    0.015  # error of the frequency of such a mode above which it is reported, as printed: in tenths of a percent
)
SMOOTH_ANGLE = 0.5  # sine of the angle between facets up to which they are one curved surface

# Turns in the plane of shells
IN_PLANE_TURN = 0.05  # part of a mode's squared slopes from which it is reported

# Folded frames
SLENDER_FRAME = 300.0  # length of all beams over the radius of gyration
FOLD_ANGLE = 0.5  # sine; beams that meet at 18 degrees do not lock (0.2 %)

# Elements in a half-wave
SLENDER_BRICK = 5.0  # length over thickness at which a brick of eight nodes needs 1.4 times as many
FEW_OF_A_KIND = 0.1  # of the elements: fewer of a kind do not decide on a frequency

# Loads close to buckling
CLOSE_TO_BUCKLING = 1.25  # buckling load factor below which a warning is issued
FAR_FROM_BUCKLING = 1e3  # buckling load factor above which the stress counts as harmless

# Lumped mass
LUMPED_MASS_ERROR = 0.02  # part of a shape's elastic mass that lumping misses, above which it is warned of
