"""Block of a body with a length at a unit rate of it, and the numbers before it in the pool."""

WORKED = 4  # numbers before the block; the first: force along the length by what acts on its markers and points of mass
