"""Uniform beams by analytic functions, and strain along them."""
