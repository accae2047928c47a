"""Joints of the tree: their freedoms, laws, latches, prescribed motion, and reactions."""
