"""The equations of motion (9) by recursion over the tree, and the rate of the state."""
