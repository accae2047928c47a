"""Strain tensors, and what they depend on: prestress, condensed stretch, sections that turn."""
