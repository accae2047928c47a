"""Stored kernels: never out of date, rebuilt when damaged, done without where nothing can be written."""

import ast
import os
import re
import shutil
import subprocess
import sys

import pytest

from femflex.kernels import digest

PACKAGE = digest.PACKAGE
COMPILED = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") == "1", reason="the compiler is off")

KERNEL = """
from femflex.integrate.compiled import REAL, kernel
from femflex.integrate.callee import FACTOR, scaled

@kernel(REAL(REAL))
def probe(x):
    return scaled(x) + FACTOR

@kernel(REAL(REAL))
def second_probe(x):
    return scaled(x) - FACTOR
"""
CALLEE = """
from femflex.integrate.compiled import part

FACTOR = 1.0

@part
def scaled(x):
    return 2.0 * x
"""
CALL = """
from femflex.integrate.probe import probe, second_probe
values = probe(3.0), second_probe(3.0)
print(*values, sum(sum(kernel.stats.cache_hits.values()) for kernel in (probe, second_probe)))
"""


@pytest.fixture
def package(tmp_path):
    """A copy of femflex with a kernel whose callee and constant are in another file."""
    copy = tmp_path / "site" / "femflex"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "integrate" / "probe.py").write_text(KERNEL)
    (copy / "integrate" / "callee.py").write_text(CALLEE)
    return copy


def environment(package, **changes):
    """Environment of a process that uses this copy and stores kernels there, or as the changes say."""
    inherited = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA_", "XDG_"))}
    return {**inherited, "PYTHONPATH": str(package.parent), "HOME": str(package.parent / "home"), **changes}


def run_python(package, *words, **changes):
    """Output and errors of a new process: Python with these words, or the call of both kernels."""
    process = subprocess.run(
        [sys.executable, *(words or ("-c", CALL))],
        env=environment(package, **changes),
        cwd=package.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    return process.stdout.split(), process.stderr


def stored_files(folder):
    return sorted(folder.rglob("*probe*.kernel"))


@pytest.mark.sampled(1)
@COMPILED
@pytest.mark.parametrize("folder", ["the package", "NUMBA_CACHE_DIR", "the home folder"])
def test_an_edited_callee_and_constant_give_the_new_numbers(package, tmp_path, folder):
    changes = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")} if folder == "NUMBA_CACHE_DIR" else {}
    if folder == "the home folder":
        (package / "__pycache__").mkdir()
        (package / "__pycache__" / "kernels").write_text("in the way")
    assert run_python(package, **changes) == (["7.0", "5.0", "0"], "")
    assert run_python(package, **changes) == (["7.0", "5.0", "2"], "")
    callee = package / "integrate" / "callee.py"
    callee.write_text(CALLEE.replace("2.0 * x", "5.0 * x").replace("1.0", "0.5"))
    assert run_python(package, **changes)[0] == ["15.5", "14.5", "0"]
    expected = {
        "NUMBA_CACHE_DIR": tmp_path / "cache",
        "the package": package,
        "the home folder": tmp_path / "site/home",
    }
    assert len(stored_files(expected[folder])) == 4 == len(stored_files(tmp_path))


def truncate(content):
    return content[: len(content) // 2]


def flip_bit(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.slow
@COMPILED
@pytest.mark.parametrize("damage", [truncate, flip_bit, lambda content: b"", lambda content: os.urandom(len(content))])
def test_a_damaged_kernel_is_compiled_again_and_replaced(package, damage):
    run_python(package)
    first, second = stored_files(package)
    intact = first.read_bytes()
    first.write_bytes(damage(intact))
    assert run_python(package) == (["7.0", "5.0", "1"], "")
    assert run_python(package) == (["7.0", "5.0", "2"], "")
    assert stored_files(package) == [first, second]


@pytest.mark.slow
@COMPILED
def test_unwritable_first_folder_is_skipped(package, tmp_path):
    (tmp_path / "file").write_text("")
    assert run_python(package, NUMBA_CACHE_DIR=str(tmp_path / "file")) == (["7.0", "5.0", "0"], "")
    assert len(stored_files(package)) == 2  # in the next folder
    assert run_python(package, NUMBA_CACHE_DIR=str(tmp_path / "new")) == (["7.0", "5.0", "2"], "")  # read from there


@pytest.mark.slow
@COMPILED
def test_processes_that_compile_at_the_same_time_agree(package):
    command = [sys.executable, "-c", CALL]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    both = [subprocess.Popen(command, env=environment(package), cwd=package.parent, **pipes) for _ in range(3)]
    for process in both:
        printed, err = process.communicate(timeout=300)
        assert (printed.split()[:2], err) == (["7.0", "5.0"], "")
    assert run_python(package)[0] == ["7.0", "5.0", "2"]
    assert {path.suffix for path in stored_files(package)[0].parent.iterdir()} == {".kernel"}  # no drafts left


@pytest.mark.slow
@COMPILED
def test_another_processor_has_its_own_kernels(package):
    assert run_python(package)[0][2] == "0"
    assert run_python(package, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="")[0] == ["7.0", "5.0", "0"]
    assert run_python(package, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="")[0] == ["7.0", "5.0", "2"]
    assert run_python(package)[0] == ["7.0", "5.0", "2"]


def imports_at_module_level(file):
    """Modules of femflex that a file imports before anything of it is called; those for types alone left out."""
    todo = list(ast.parse(file.read_text()).body)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("femflex"):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith("femflex"))
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            todo.extend(node.orelse)
        elif not isinstance(node, ast.FunctionDef):
            todo.extend(child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt))


def file_of(name):
    """The file of a module, or of the module that holds a name."""
    path = PACKAGE.parent.joinpath(*name.split("."))
    for module in (path, path.parent):
        if module.with_suffix(".py").is_file():
            return module.with_suffix(".py")
        if (module / "__init__.py").is_file():
            return module / "__init__.py"
    raise AssertionError(name)


@pytest.mark.slow
def test_the_digest_follows_every_import():
    for file in PACKAGE.rglob("*.py"):
        expected = {file_of(name) for name in imports_at_module_level(file)} - {PACKAGE / "__init__.py"}
        assert expected == set(digest.imported_files(file)), file


def test_kernels_import_nothing_from_the_package_itself():
    files = [file for file in PACKAGE.rglob("*.py") if re.search(r"^@(kernel|entry)\(", file.read_text(), re.M)]
    assert len(files) > 20
    for source in {source for file in files for source in digest.sources_of(file)}:
        assert "from femflex import " not in source.read_text(), source


@COMPILED
@pytest.mark.slow
def test_run_without_writable_folder_warns_once(package, tmp_path, write_case):
    case, blocked = write_case(), tmp_path / "blocked"
    blocked.write_text("")
    (package / "__pycache__").mkdir()
    (package / "__pycache__" / "kernels").write_text("in the way")
    places = {"NUMBA_CACHE_DIR": str(blocked), "XDG_CACHE_HOME": str(blocked)}
    for words in (["check", str(case)], ["run", str(case), "-o", str(tmp_path / "run.h5")]):
        _, err = run_python(package, "-m", "femflex", *words, **places)
        assert err.count("femflex: warning: compiled kernels cannot be stored") == 1
        assert err.count("femflex: compiling equations") == 1
