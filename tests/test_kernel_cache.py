"""Stored kernels: never out of date, rebuilt when damaged, done without where nothing can be written."""

import ast
import os
import re
import shutil
import subprocess
import sys
import warnings

import pytest

from femflex import kernel_cache, kernel_digest
from femflex.cli.verb import verb
from femflex.warning import CacheWarning

PACKAGE = kernel_digest.PACKAGE
TOP = PACKAGE.parent
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
loaded = sum(sum(kernel.stats.cache_hits.values()) for kernel in (probe, second_probe))
print(probe(3.0), second_probe(3.0), loaded)
"""


@pytest.fixture
def package(tmp_path):
    """A copy of femflex with a kernel whose callee and constant are in another file."""
    place = tmp_path / "site" / "femflex"
    shutil.copytree(PACKAGE, place, ignore=shutil.ignore_patterns("__pycache__"))
    (place / "integrate" / "probe.py").write_text(KERNEL)
    (place / "integrate" / "callee.py").write_text(CALLEE)
    return place


def environment(package, **changes):
    """Environment of a process that uses this copy and stores kernels there, or as the changes say."""
    own = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA_", "XDG_"))}
    return {**own, "PYTHONPATH": str(package.parent), "HOME": str(package.parent / "home"), **changes}


def answer(package, *words, **changes):
    """What a process of its own prints: the words after python, or the call of both kernels."""
    done = subprocess.run(
        [sys.executable, *(words or ("-c", CALL))],
        env=environment(package, **changes),
        cwd=package.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split(), done.stderr


def stored_files(folder):
    return sorted(folder.rglob("*probe*.kernel"))


@pytest.mark.sampled(1)
@COMPILED
@pytest.mark.parametrize("place", ["the package", "NUMBA_CACHE_DIR", "the home folder"])
def test_an_edited_callee_and_constant_give_the_new_numbers(package, tmp_path, place):
    changes = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")} if place == "NUMBA_CACHE_DIR" else {}
    if place == "the home folder":
        (package / "__pycache__").mkdir()
        (package / "__pycache__" / "kernels").write_text("in the way")
    assert answer(package, **changes) == (["7.0", "5.0", "0"], "")
    assert answer(package, **changes) == (["7.0", "5.0", "2"], "")
    callee = package / "integrate" / "callee.py"
    callee.write_text(CALLEE.replace("2.0 * x", "5.0 * x").replace("1.0", "0.5"))
    assert answer(package, **changes)[0] == ["15.5", "14.5", "0"]
    expected = {
        "NUMBA_CACHE_DIR": tmp_path / "cache",
        "the package": package,
        "the home folder": tmp_path / "site/home",
    }
    assert len(stored_files(expected[place])) == 4 == len(stored_files(tmp_path))


def cut(content):
    return content[: len(content) // 2]


def flipped(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.slow
@COMPILED
@pytest.mark.parametrize("damage", [cut, flipped, lambda content: b"", lambda content: os.urandom(len(content))])
def test_a_damaged_kernel_is_compiled_again_and_replaced(package, damage):
    answer(package)
    first, second = stored_files(package)
    whole = first.read_bytes()
    first.write_bytes(damage(whole))
    assert answer(package) == (["7.0", "5.0", "1"], "")
    assert answer(package) == (["7.0", "5.0", "2"], "")
    assert stored_files(package) == [first, second]


@pytest.mark.slow
@COMPILED
def test_without_a_place_to_write_kernels_are_compiled_with_one_sentence(package, tmp_path):
    blocked = tmp_path / "blocked"
    blocked.write_text("a file, so that no folder can be made below it, whoever the user is")
    (package / "__pycache__").mkdir()
    (package / "__pycache__" / "kernels").write_text("in the way")
    places = {"NUMBA_CACHE_DIR": str(blocked), "XDG_CACHE_HOME": str(blocked)}
    printed, err = answer(package, "-W", "always::UserWarning", "-c", CALL, **places)
    assert printed == ["7.0", "5.0", "0"]
    assert err.count("compiled kernels cannot be stored") == 1
    assert f"{blocked / 'femflex'}, {package / '__pycache__' / 'kernels'}, " in err
    assert "set NUMBA_CACHE_DIR to a folder that you can write" in err


@pytest.mark.slow
@COMPILED
def test_a_full_or_missing_first_folder_is_passed_over(package, tmp_path):
    (tmp_path / "file").write_text("")
    assert answer(package, NUMBA_CACHE_DIR=str(tmp_path / "file")) == (["7.0", "5.0", "0"], "")
    assert len(stored_files(package)) == 2  # in the next folder
    assert answer(package, NUMBA_CACHE_DIR=str(tmp_path / "new")) == (["7.0", "5.0", "2"], "")  # read from there


@pytest.mark.slow
@COMPILED
def test_processes_that_compile_at_the_same_time_agree(package):
    command = [sys.executable, "-c", CALL]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    both = [subprocess.Popen(command, env=environment(package), cwd=package.parent, **pipes) for _ in range(3)]
    for process in both:
        printed, err = process.communicate(timeout=300)
        assert (printed.split()[:2], err) == (["7.0", "5.0"], "")
    assert answer(package)[0] == ["7.0", "5.0", "2"]
    assert {path.suffix for path in stored_files(package)[0].parent.iterdir()} == {".kernel"}  # no drafts left


@pytest.mark.slow
@COMPILED
def test_another_processor_has_its_own_kernels(package):
    assert answer(package)[0][2] == "0"
    assert answer(package, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="")[0] == ["7.0", "5.0", "0"]
    assert answer(package, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="")[0] == ["7.0", "5.0", "2"]
    assert answer(package)[0] == ["7.0", "5.0", "2"]


def test_only_the_folders_and_files_used_last_are_kept(tmp_path):
    def aged(place, age):
        os.utime(place, (1e9 - age, 1e9 - age))

    for age in range(12):
        (tmp_path / f"version{age}").mkdir()
        aged(tmp_path / f"version{age}", age)
    assert kernel_cache._written(tmp_path / "now" / "a.f-0.kernel", b"code")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"now", *(f"version{age}" for age in range(kernel_cache.KEPT - 1))}
    for age in range(12):
        for name in ("a.f", "a.ff"):
            (tmp_path / "now" / f"{name}-{age + 1}.kernel").write_text("")
            aged(tmp_path / "now" / f"{name}-{age + 1}.kernel", age)
    assert kernel_cache._written(tmp_path / "now" / "a.f-13.kernel", b"code")
    left = {path.name for path in (tmp_path / "now").glob("a.f-*")}
    assert left == {f"a.f-{k}.kernel" for k in (13, 0, *range(1, kernel_cache.KEPT - 1))}
    assert len(list((tmp_path / "now").glob("a.ff-*"))) == 12


def test_the_command_line_prints_the_sentence_once(capsys):
    @verb("femflex probe")
    def probe():
        for _ in range(2):
            warnings.warn("compiled kernels cannot be stored", CacheWarning, stacklevel=2)

    with warnings.catch_warnings():
        probe()
    assert capsys.readouterr().err == "femflex: warning: compiled kernels cannot be stored\n"


@pytest.fixture
def digest_of(package, monkeypatch):
    """The digest of a kernel in a file of the copied package, as a new process finds it."""
    monkeypatch.setattr(kernel_digest, "PACKAGE", package)

    def digest(name):
        for found in (kernel_digest.imported_files, kernel_digest._digest_of_sources, kernel_digest._digest_of_file):
            found.cache_clear()
        return kernel_digest._digest_of_sources(package / name)

    return digest


def test_the_digest_changes_with_every_source_of_the_kernel_and_no_other(package, digest_of):
    place = "dynamics/motion/equations.py"
    seen = {digest_of(place)}
    for name in ("dynamics/lowering/layout.py", "dynamics/arithmetic/compiled.py", "kernel_linking.py", place):
        with open(package / name, "a") as file:
            file.write("# edited\n")
        seen.add(digest_of(place))
    assert len(seen) == 1 + 4
    for name in ("cli/run.py", "dynamics/model.py", "integrate/dop853_kernel.py"):
        with open(package / name, "a") as file:
            file.write("# holds nothing that the kernel calls\n")
    assert digest_of(place) in seen


@pytest.mark.parametrize("kernel", ["femflex/parts/a.py", "user/own.py"])
def test_sources_are_found_through_any_number_of_imports(tmp_path, monkeypatch, kernel):
    """a -> b -> c -> a, d; d -> the package e; what no file names, and what is named inside a function, is none."""
    imports = {
        "femflex/parts/a.py": "from femflex.parts.b import one\n",
        "femflex/parts/b.py": "from femflex.parts import (  # several\n    c,\n)\n",
        "femflex/parts/c.py": "import femflex.parts.d\nfrom femflex.parts.a import two as three\n",
        "femflex/parts/d.py": "def late():\n    import femflex.other\n\n\nfrom femflex.parts.e import four, five\n",
        "femflex/parts/e/__init__.py": "five = 5\nfrom femflex.parts.e.four import six\n",
        "femflex/parts/e/four.py": "six = 6\n",
        "femflex/parts/__init__.py": "",
        "femflex/other.py": "",
        "femflex/kernels.py": "from femflex.under import seven\n",
        "femflex/under.py": "",
        "user/own.py": "import beside\nfrom femflex.parts.c import four\n",
        "user/beside.py": "",
    }
    for name, text in imports.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(kernel_digest, "PACKAGE", tmp_path / "femflex")
    monkeypatch.setattr(kernel_digest, "COMPILERS", ("kernels.py",))
    found = {str(source.relative_to(tmp_path)) for source in kernel_digest.sources_of(tmp_path / kernel)}
    own = {"user/own.py", "user/beside.py"} if kernel.startswith("user") else set()
    parts = {f"femflex/parts/{name}" for name in ("a.py", "b.py", "c.py", "d.py", "e/__init__.py", "e/four.py")}
    assert found == own | parts | {"femflex/kernels.py", "femflex/under.py"}


def test_another_file_is_another_source(package, digest_of):
    before = digest_of("integrate/probe.py")
    (package / "integrate" / "callee.py").rename(package / "integrate" / "called.py")
    (package / "integrate" / "probe.py").write_text(KERNEL.replace(".callee", ".called"))
    assert digest_of("integrate/probe.py") != before


def test_the_folder_changes_with_every_version(monkeypatch):
    seen = {kernel_digest.versions_digest()}
    for library in ("numba", "llvmlite", "np"):
        monkeypatch.setattr(getattr(kernel_digest, library), "__version__", "0.0")
        seen.add(kernel_digest.versions_digest())
    assert len(seen) == 1 + 3


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
    for place in (path, path.parent):
        if place.with_suffix(".py").is_file():
            return place.with_suffix(".py")
        if (place / "__init__.py").is_file():
            return place / "__init__.py"
    raise AssertionError(name)


def test_the_digest_follows_every_import():
    for file in PACKAGE.rglob("*.py"):
        expected = {file_of(name) for name in imports_at_module_level(file)} - {PACKAGE / "__init__.py"}
        assert expected == set(kernel_digest.imported_files(file)), file


def test_kernels_take_nothing_from_the_names_that_the_package_loads_when_asked():
    files = [file for file in PACKAGE.rglob("*.py") if re.search(r"^@(kernel|entry)\(", file.read_text(), re.M)]
    assert len(files) > 20
    for source in {source for file in files for source in kernel_digest.sources_of(file)}:
        assert "from femflex import " not in source.read_text(), source


@COMPILED
@pytest.mark.slow
def test_a_run_without_a_place_to_write_gives_the_answer_and_the_sentence(package, tmp_path, write_case):
    case, blocked = write_case(), tmp_path / "blocked"
    blocked.write_text("")
    (package / "__pycache__").mkdir()
    (package / "__pycache__" / "kernels").write_text("in the way")
    places = {"NUMBA_CACHE_DIR": str(blocked), "XDG_CACHE_HOME": str(blocked)}
    for words in (["check", str(case)], ["run", str(case), "-o", str(tmp_path / "run.h5")]):
        _, err = answer(package, "-m", "femflex", *words, **places)
        assert err.count("femflex: warning: compiled kernels cannot be stored") == 1
