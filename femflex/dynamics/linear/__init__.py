"""The linear equations of motion about a state, and what scales of frequency and motion follow from them."""
