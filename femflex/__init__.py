"""From a mesh of a boom, panel or blanket to the motion of the whole spacecraft."""

__version__ = "0.1.0"
