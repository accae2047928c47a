"""Members without bending stiffness: tethers and membranes, which bear loads by tension alone."""
