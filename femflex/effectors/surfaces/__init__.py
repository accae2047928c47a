"""Surfaces of bodies, with their optical properties, and the forces of light and air on them."""
