"""Forces from outside and between markers: gravity, loads, springs, and the motion of the base frame."""
