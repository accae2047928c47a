"""Plate members: flat triangles and rectangles, from their fields to blocks of inertia and strain."""
