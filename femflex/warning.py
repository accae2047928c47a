"""Categories of warnings: about physics, with both numbers, and about the place for compiled code."""


class PhysicsWarning(UserWarning):
    """A model is outside what its assumptions cover; the text shows the number found and the one it is held against."""


class TruncationWarning(PhysicsWarning):
    """The sets of shapes that bodies keep are too small for the craft's lowest frequencies."""


class CacheWarning(UserWarning):
    """Compiled code cannot be stored, so it is compiled again in every process."""
