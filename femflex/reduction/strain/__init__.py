"""Strain tensors and what goes with them: prestress, condensed stretch, sections that turn."""
