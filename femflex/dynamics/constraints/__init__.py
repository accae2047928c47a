"""What ties bodies together beside the tree: rows A u = b, multipliers, and consistent states."""
