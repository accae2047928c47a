"""The linear equations of motion, states of rest and steady spin, small motions about them, and their names."""
