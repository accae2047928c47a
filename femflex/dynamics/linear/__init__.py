"""States of rest, small motions about them, and their frequencies."""
