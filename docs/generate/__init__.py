"""Generators of reference pages: each module has write(target), which leaves its pages in that folder."""
