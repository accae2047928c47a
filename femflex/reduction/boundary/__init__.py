"""Where a body is held and taken hold of: clamps, markers, rigid motions, the supported structure."""
