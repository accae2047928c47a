"""States of rest and of steady spin, small motions about them, and what these are called."""
