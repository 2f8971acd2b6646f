"""Setting up from nothing: which Python is taken, when .venv is made anew, and what the pins promise."""

import importlib.util
import os
import re
import shutil
import subprocess
import tomllib
from itertools import chain
from pathlib import Path
from types import SimpleNamespace

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def setup():
    """The bootstrap as a module."""
    spec = importlib.util.spec_from_file_location("tooncap_setup", ROOT / ".ci" / "setup.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def project(tmp_path):
    """A folder with a blank in its name that holds just what the bootstrap reads."""
    root = tmp_path / "a project"
    root.mkdir()
    (root / "pyproject.toml").write_text("[project]\n")
    (root / "constraints.txt").write_text("numpy==2.4.6\ntorch==2.13.0\n")
    return root


@pytest.fixture
def pip(setup, project, monkeypatch):
    """A pip on Linux that installs nothing: it keeps the calls, and fails at a word in `refused`."""
    fake = SimpleNamespace(calls=[], refused=())

    def run(root, *arguments):
        fake.calls.append(arguments)
        return not set(fake.refused) & set(arguments)

    def make_venv(root):
        shutil.rmtree(root / ".venv", ignore_errors=True)
        (root / ".venv" / "bin").mkdir(parents=True)
        for name in setup.SCRIPTS:
            (root / ".venv" / "bin" / name).touch()
        (root / ".venv" / "setup.log").write_text("ERROR: no wheel for a toaster\n")
        fake.calls.append(("venv",))

    monkeypatch.setattr(setup, "pip", run)
    monkeypatch.setattr(setup, "make_venv", make_venv)
    monkeypatch.setattr(setup, "has_nvidia_card", lambda: False)
    monkeypatch.setattr(setup.sys, "platform", "linux")
    return fake


def test_a_second_call_finds_nothing_to_do(setup, project, pip):
    assert not setup.is_current(project, "")
    setup.install(project, "")
    assert setup.is_current(project, "")
    assert pip.calls[-1] == ("-c", "constraints.txt", "-e", ".[torch,notebook,dask,dev]")


@pytest.mark.parametrize("name", ["pyproject.toml", "constraints.txt"])
def test_a_changed_requirement_is_installed_into_the_venv_that_is_there(setup, project, pip, name):
    setup.install(project, "")
    with open(project / name, "a") as file:
        file.write("# more\n")
    assert not setup.is_current(project, "")
    setup.install(project, "")
    assert setup.is_current(project, "")
    assert pip.calls.count(("venv",)) == 1


@pytest.mark.parametrize("lost", ["python", "tooncap", "pytest"])
def test_a_venv_that_lost_a_program_is_made_anew(setup, project, pip, lost):
    setup.install(project, "")
    (project / ".venv" / "bin" / lost).unlink()
    assert not setup.is_current(project, "")
    setup.install(project, "")
    assert setup.is_current(project, "")
    assert pip.calls.count(("venv",)) == 2


def test_a_venv_whose_python_is_gone_is_made_anew(setup, project, pip):
    setup.install(project, "")
    python = project / ".venv" / "bin" / "python"
    python.unlink()
    python.symlink_to(project / "no" / "longer" / "here")
    assert not setup.is_whole(project)


def test_a_venv_that_was_copied_with_the_project_is_made_anew(setup, project, pip):
    setup.install(project, "")
    copy = project.parent / "another place"
    shutil.copytree(project, copy)
    assert setup.is_current(project, "")
    assert not setup.is_whole(copy)


def test_a_set_up_that_was_cut_short_is_made_anew(setup, project, pip):
    pip.refused = ("-e",)
    with pytest.raises(setup.SetupError, match=r"no wheel for a toaster.*see \.venv/setup\.log"):
        setup.install(project, "")
    assert not setup.is_whole(project)

    pip.refused = ()
    setup.install(project, "")
    (project / "constraints.txt").write_text("torch==2.13.0\n")
    pip.refused = ("-e",)
    with pytest.raises(setup.SetupError):
        setup.install(project, "")
    assert not setup.is_whole(project)


def test_where_torch_cannot_be_had_the_rest_is_installed_and_one_line_says_so(setup, project, pip, capsys, monkeypatch):
    monkeypatch.setattr(setup.sys, "platform", "a toaster")
    pip.refused = ("torch==2.13.0",)
    setup.install(project, "")
    assert pip.calls[-1][-1] == ".[notebook,dask,dev]"
    said = [line for line in capsys.readouterr().out.splitlines() if "left out torch==2.13.0" in line]
    assert len(said) == 1 and "no wheel for a toaster" in said[0]
    assert setup.is_current(project, "")
    assert not setup.is_current(project, "somewhere/else")  # an address not tried yet is a reason to try again


def test_where_a_cpu_build_is_on_offer_it_is_taken(setup, project, pip):
    setup.install(project, "")
    assert [call for call in pip.calls if "--no-deps" in call] == [("--no-deps", "torch==2.13.0+cpu")]


def test_a_cuda_build_is_not_installed_where_there_is_no_card(setup, project, pip, capsys):
    pip.refused = ("torch==2.13.0+cpu",)
    setup.install(project, "")
    assert ("--no-deps", "torch==2.13.0") not in pip.calls
    assert pip.calls[-1][-1] == ".[notebook,dask,dev]"
    assert "make setup TORCH_INDEX=ADDRESS" in capsys.readouterr().out


def test_the_index_is_asked_for_torch_alone(setup, project, pip):
    setup.install(project, "an/index")
    assert [call for call in pip.calls if "an/index" in call] == [
        ("--no-deps", "--index-url", "an/index", "torch==2.13.0")
    ]
    assert setup.is_current(project, "an/index") and setup.is_current(project, "")


def test_a_torch_that_is_there_is_kept(setup, project, pip):
    setup.install(project, "an/index")
    (project / ".venv" / "lib" / "python3" / "site-packages" / "torch-2.13.0+cpu.dist-info").mkdir(parents=True)
    (project / "pyproject.toml").write_text("[project]\n# more\n")
    pip.calls.clear()
    setup.install(project, "")
    assert pip.calls == [("-c", "constraints.txt", "-e", ".[torch,notebook,dask,dev]")]


def test_the_newest_python_that_works_is_taken(tmp_path):
    pythons = _bare_machine(tmp_path)
    _program(pythons / "python3.14", "exit 127")  # a name without a Python behind it
    _program(pythons / "python3.12", 'case "$*" in *--check*) exit 1;; *-c*) exit 0;; esac; echo "3.12 runs $*"')
    _program(pythons / "python3", "exit 0")
    ran = _set_up(tmp_path, pythons)
    assert ran.stdout == "3.12 runs -I .ci/setup.py\n"


def test_a_machine_without_a_fit_python_is_told_so_in_one_sentence(tmp_path):
    pythons = _bare_machine(tmp_path)
    _program(pythons / "python3", "exit 1")  # too old, or without ensurepip
    ran = _set_up(tmp_path, pythons)
    assert ran.returncode == 1 and ran.stdout == ""
    assert ran.stderr.count("\n") == 1 and "3.11 or newer" in ran.stderr


def test_a_python_given_by_name_is_the_only_one_tried(tmp_path):
    pythons = _bare_machine(tmp_path)
    _program(pythons / "python3", "exit 0")
    ran = _set_up(tmp_path, pythons, PYTHON=str(tmp_path / "my own" / "python"))
    assert ran.returncode == 1 and "my own" in ran.stderr


def test_every_requirement_is_pinned_within_its_bounds():
    pins = _pins()
    for requirement in map(Requirement, _requirements()):
        assert requirement.specifier.contains(pins[canonicalize_name(requirement.name)]), requirement


def test_the_metadata_leaves_room_and_the_constraints_none():
    assert not [requirement for requirement in _requirements() if "==" in requirement]
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+|#.*", line) for line in lines)  # no address, no "+cpu", no range


def test_no_registry_is_named_in_what_sets_up():
    for name in ("Makefile", "constraints.txt", "pyproject.toml", ".ci/setup.py", ".ci/setup.sh", ".ci/run"):
        assert "://" not in (ROOT / name).read_text(encoding="utf-8"), name


def test_make_lists_its_targets():
    if shutil.which("make") is None:
        pytest.skip("there is no make on this machine")
    said = subprocess.run(
        ["make", "-s", "--no-print-directory"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    targets = re.search(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    listed = [line.split()[0] for line in said.splitlines()[1:]]
    assert listed == targets.group(1).split()


def test_what_the_checks_run_is_make_test():
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    assert "exec make test" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def _requirements() -> list[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return [*project["dependencies"], *chain(*project["optional-dependencies"].values())]


def _pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pairs = [line.split("==") for line in lines if not line.startswith("#")]
    return {canonicalize_name(name): version for name, version in pairs}


def _bare_machine(folder: Path) -> Path:
    """A copy of the bootstrap and a folder of programs with nothing on it but `dirname`."""
    shutil.copytree(ROOT / ".ci", folder / ".ci")
    programs = folder / "programs"
    programs.mkdir()
    (programs / "dirname").symlink_to(shutil.which("dirname"))
    return programs


def _program(path: Path, body: str) -> None:
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(0o755)


def _set_up(folder: Path, programs: Path, **environment: str) -> subprocess.CompletedProcess:
    script = str(folder / ".ci" / "setup.sh")
    variables = {"PATH": str(programs), **environment}
    return subprocess.run(["/bin/sh", script], env=variables, capture_output=True, text=True, check=False)
