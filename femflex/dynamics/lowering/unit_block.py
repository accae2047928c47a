"""The block that a body with a length has at a unit rate of it, and what stands before it in the pool."""

WORKED = 4  # numbers before the block; the first: force along the length by what acts on its markers and points of mass
