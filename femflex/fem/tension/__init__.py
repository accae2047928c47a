"""Members without bending stiffness: tethers and membranes, which carry loads by tension alone."""
