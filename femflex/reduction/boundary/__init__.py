"""Supports and attachment points of a structure: clamps, markers, rigid motions, the supported structure."""
