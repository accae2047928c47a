"""Pictures, movies and plots of a run, and pictures of a body's modes; VTK and matplotlib are loaded when first used."""

from femflex.view.look import Look
from femflex.view.render import render_movie, render_picture
from femflex.view.window import NoRenderer

__all__ = ["Look", "NoRenderer", "render_movie", "render_picture"]
