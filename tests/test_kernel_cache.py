"""Kernels on disk are dropped when a source they were compiled from has changed."""

from femflex.kernel_cache import drop_stale_kernels


def test_kernels_are_dropped_when_a_source_changes_and_kept_otherwise(tmp_path):
    (tmp_path / "inner.py").write_text("a = 1\n")
    cache = tmp_path / "__pycache__"
    drop_stale_kernels(tmp_path)
    kernel = cache / "entry.f-1.py311.nbi"
    kernel.write_text("compiled")
    drop_stale_kernels(tmp_path)
    assert kernel.exists()
    (tmp_path / "inner.py").write_text("a = 2\n")
    drop_stale_kernels(tmp_path)
    assert not kernel.exists()
