"""The house rules that a machine can hold: which way imports go, what stays light, what is where."""

import ast
import re
import subprocess
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("capture", "mocap", "retarget", "fixtures")
TOP_LEVEL = {
    *PACKAGES,
    *("notebooks", "tests", "pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md"),
    *("Makefile", "constraints.txt"),
}
DOT_FILES = (".gitignore", ".gitattributes", ".editorconfig", ".pre-commit-config.yaml")
HEAVY = ("torch", "kornia", "cvxpy", "numba", "matplotlib.pyplot", "scipy.optimize", "sklearn")
MACHINE_PATH = re.compile(r"(?<![\w.~*-])(?:/(?:home|root|Users|work|opt|mnt|tmp)/[\w.]|[A-Z]:\\\\?Users)")


def test_capture_imports_neither_mocap_nor_retarget_nor_fixtures():
    assert _crossings("capture", {"mocap", "retarget", "fixtures"}) == []


def test_mocap_imports_nothing_from_retarget():
    assert _crossings("mocap", {"retarget"}) == []


def test_fixtures_import_nothing_of_ours_but_types():
    """The cartoons are the truth that the code is held against: a bug shared by both would cancel itself.

    fixtures/write.py draws nothing: it puts finished cartoons into files, and there is one writer for those.
    """
    assert _crossings("fixtures", {"mocap", "retarget"}) == []
    found = []
    for path in sorted((ROOT / "fixtures").rglob("*.py")):
        if path.name == "write.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found += [(path.name, alias.name) for alias in node.names if _within(alias.name, ("capture",))]
            elif isinstance(node, ast.ImportFrom) and _within(node.module or "", ("capture",)):
                found += [(path.name, alias.name) for alias in node.names if not alias.name[0].isupper()]
    assert found == []


def test_no_files_import_each_other_in_a_circle():
    """Nor name each other's types: what two files need belongs in a third, below both."""
    files = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in _ours() if path.suffix == ".py"}
    below = {
        name: {other for other in _imports(path.read_text("utf-8"), name.rpartition(".")[0], False) if other in files}
        for name, path in files.items()
    }
    TopologicalSorter(below).prepare()  # raises with the circle, file by file


def test_heavy_libraries_are_imported_only_inside_functions():
    found = [(path, name) for package in PACKAGES for path, name in _package_imports(package, top_level=True)]
    assert [where for where in found if _within(where[1], HEAVY)] == []


def test_a_package_file_holds_only_a_docstring():
    for package in PACKAGES:
        for path in (ROOT / package).rglob("__init__.py"):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            assert ast.get_docstring(tree) and len(tree.body) == 1, path


def test_no_package_file_lies_under_tests():
    """tests/capture/__init__.py would hide the package capture."""
    assert list((ROOT / "tests").rglob("__init__.py")) == []


def test_the_top_level_holds_only_the_agreed_names():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    names = {path.split("/")[0] for path in listed.stdout.split("\0") if path}
    if not names:
        pytest.skip("this copy has no git history, so what is published cannot be told from what a user made")
    assert {name for name in names if not name.startswith(".")} - TOP_LEVEL == set()


def test_no_file_passes_400_lines():
    sources = [path for path in _ours() if path.suffix in (".py", ".sh")]
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in sources}
    assert {path: length for path, length in lengths.items() if length > 400} == {}


def test_no_text_holds_a_path_of_somebodys_machine():
    found = []
    for path in _ours():
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:  # a picture or a clip
            continue
        found += [f"{path}:{number}" for number, line in enumerate(lines, 1) if MACHINE_PATH.search(line)]
    assert found == []


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("import torch.nn as nn", {"torch.nn"}),
        ("from scipy import optimize", {"scipy", "scipy.optimize"}),
        ("try:\n    import numba\nexcept ImportError:\n    pass", {"numba"}),
        ("class A:\n    import cvxpy", {"cvxpy"}),
        ("from . import arap", {"capture.motion", "capture.motion.arap"}),
        ("from ..fit.weights import solve", {"capture.fit.weights", "capture.fit.weights.solve"}),
        ("def f():\n    import torch", set()),
        (
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import torch",
            {"typing", "typing.TYPE_CHECKING"},
        ),
    ],
)
def test_the_reader_of_imports_finds_those_that_run_at_import_time(source, names):
    assert set(_imports(source, package="capture.motion", top_level=True)) == names


def test_a_machine_path_is_told_from_a_relative_one_and_an_address():
    home, shared = "/".join(("", "home", "ann", "clips")), "/".join(("..", "work", "clips"))
    assert MACHINE_PATH.search(f"open('{home}')")
    assert not MACHINE_PATH.search(shared)
    assert not MACHINE_PATH.search("https://example.org" + home)


def _crossings(package: str, refused: set[str]) -> list[tuple[str, str]]:
    return [(path, name) for path, name in _package_imports(package) if name.split(".")[0] in refused]


def _package_imports(package: str, top_level: bool = False) -> Iterator[tuple[str, str]]:
    for path in sorted((ROOT / package).rglob("*.py")):
        inside = ".".join(path.relative_to(ROOT).parent.parts)
        for name in _imports(path.read_text(encoding="utf-8"), inside, top_level):
            yield str(path.relative_to(ROOT)), name


def _imports(source: str, package: str, top_level: bool) -> Iterator[str]:
    """Full names that a file in `package` imports; with `top_level`, those run by importing it."""
    waiting: list[ast.AST] = [ast.parse(source)]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            module = ".".join([*above, *([node.module] if node.module else [])])
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)
        elif top_level and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        elif isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            waiting += node.orelse
        else:
            waiting += ast.iter_child_nodes(node)


def _within(name: str, names: tuple[str, ...]) -> bool:
    return any(name == other or name.startswith(other + ".") for other in names)


def _ours() -> list[Path]:
    """All files of the project, wherever it was copied to; not what tools leave behind."""
    folders = [ROOT / name for name in (*PACKAGES, "notebooks", "tests", ".ci")]
    loose = [ROOT / name for name in (*TOP_LEVEL, *DOT_FILES) if (ROOT / name).is_file()]
    inner = [path for folder in folders for path in folder.rglob("*") if path.is_file()]
    left_behind = {"__pycache__", ".ipynb_checkpoints"}
    return sorted(path for path in (*loose, *inner) if not left_behind & set(path.parts))
