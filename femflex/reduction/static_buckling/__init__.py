"""Linear buckling of bodies under loads at their markers and over their volume."""
