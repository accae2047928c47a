"""Lines of elements: arc length, what varies along it, and where it is cut."""
