"""Shapes that bending calls for: modal derivatives, bent states, stretch, responses."""
