"""Joints of the tree: their freedoms, laws, latches, specified motion, and what they carry."""
