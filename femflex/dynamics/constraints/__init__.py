"""Constraints besides the tree of joints: rows A u = b, multipliers, and consistent states."""
