"""The result file of a run (HDF5): one documented layout, its writer and its reader.

Layout, version 1 (plain HDF5 1.8 format; any HDF5 reader opens it):

    /                     attributes: format, layout, title, case_text, femflex_version, complete, ended,
                          and what the run adds: case_path, without (what was switched off), integrator, inputs, ...
    /progress      (2,)   rows that are valid, and the slot of /resume that belongs to them (-1: none)
    /time          (n,)   [s]
    /q  /u         (n, k) coordinates and quasi-velocities; attribute `names` per column
    /bodies/<name>/{position,attitude,rate,delta}    inertial axes, Euler parameters of C_NB (scalar first), body axes
    /bodies/<name>.<k>/...  segment k of a body cut into segments; /bodies/<name>/{position,attitude} is then where the
                          body would be undeformed, and its markers' deflections are counted from there
    /markers/<body>.<marker>/{position,velocity,deflection,displacement}
    /terms/<name>         (n, n_u) on request: every term of M udot + h - Q = 0, names as /u
    /attitude/angles  /orbit/...  /loads/<name>/...  /monitors/...
    /model/<body>         attributes: mass, n_modes; omega (n,), kinds (n,), markers/<name> (3,) [m],
                          points (n_p, 3) [m], cells/<type> (n_c, nodes), shapes (n, n_p, 3)
    /resume/{0,1}/...     state of the integrator after the last block, written in turn
    /statistics           attributes: steps, evaluations, ... as the integrator counted them
    /versions             attributes: versions of Python and of the libraries

Every data set over time has the attributes unit, description, names (of the entries along its last axis) and frame.
A body point at an instant is position + C_NB (points + sum_k delta_k shapes[k]).

A run in progress, or one that was killed or interrupted, has `complete` False and further rows after the valid ones;
their time is nan (in files up to 256 MB all else too), and `open_run` omits them. The file opens and is
consistent at every moment, also while it is written: space for all rows is reserved before the first, blocks are
written into it, and `progress` last. How the run ended is written into space of its own (`ended` is text of fixed
length, bytes to h5py). What changes the layout (a run that stops early is trimmed, a trimmed one resumed) is written
next to it as `<file>.part` and moved into place. An existing file is refused unless `force` is given, and then replaced
only when the new run has its first block. While a file is written, `.<file>.lock` next to it keeps other writers away
(`lock`).
"""

from femflex.results.copying import ResumePoint, resume_point
from femflex.results.reader import Run, RunBody, open_run
from femflex.results.writer import FileLock, RunWriter, add_channels

__all__ = ["FileLock", "ResumePoint", "Run", "RunBody", "RunWriter", "add_channels", "open_run", "resume_point"]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
