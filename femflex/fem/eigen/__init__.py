"""Lowest modes of sparse structures, in one fixed order and sign."""
