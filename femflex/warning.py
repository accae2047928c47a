"""The category of warnings about physics: a doubtful model, told with both numbers."""


class PhysicsWarning(UserWarning):
    """A model is outside what its assumptions cover; the text shows the number found and the one it is held against."""
