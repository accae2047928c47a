"""Runs and models as files of other programs: scenes, tables, linear models. A writer is one function in one file."""

from femflex.export.register import WRITERS, Writer, export_run

__all__ = ["WRITERS", "Writer", "export_run"]
