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


def test_kernels_go_with_the_numbers_compiled_into_them_and_with_rooms_below(tmp_path):
    kernels, numbers = tmp_path / "dynamics", tmp_path / "system"
    (kernels / "joints").mkdir(parents=True)
    numbers.mkdir()
    for source in (kernels / "joints" / "laws.py", numbers / "law.py"):
        source.write_text("a = 1\n")
        drop_stale_kernels(kernels, numbers)
        kernel = kernels / "joints" / "__pycache__" / "laws.f-1.py311.nbi"
        kernel.parent.mkdir(exist_ok=True)
        kernel.write_text("compiled")
        drop_stale_kernels(kernels, numbers)
        assert kernel.exists()
        source.write_text("a = 2\n")
        drop_stale_kernels(kernels, numbers)
        assert not kernel.exists()
