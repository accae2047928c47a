"""The equations of motion (9) by recursion over the tree: rate, residual and Newton's correction."""
