"""Freedoms of the whole system, increments along them, and the scales of its frequencies and motion."""
