"""Pictures, movies and plots of a run, and pictures of modes; VTK and matplotlib are loaded when first used."""

from femflex.view.look import Look
from femflex.view.modes import craft_montage, craft_movie, mode_montage, mode_movie
from femflex.view.plot import plot_histories
from femflex.view.scene import render_movie, render_picture
from femflex.view.spectra import plot_spectra, plot_spectrograms
from femflex.view.terms import energy_account, plot_energy, plot_terms
from femflex.view.window import NoRenderer

__all__ = [
    "Look",
    "NoRenderer",
    "craft_montage",
    "craft_movie",
    "energy_account",
    "mode_montage",
    "mode_movie",
    "plot_energy",
    "plot_histories",
    "plot_spectra",
    "plot_spectrograms",
    "plot_terms",
    "render_movie",
    "render_picture",
]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
