"""Make .venv and install the project into it; `.ci/setup.sh` finds the Python that runs this.

Standard library only.  The stamp in .venv is written last, so a set-up that was cut short is made anew, and a
finished one costs the next call no more than reading two files.
"""

import argparse
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

EXTRAS = ("torch", "notebook", "dask", "dev")
SCRIPTS = ("python", "tooncap", "ruff", "pytest")


class SetupError(Exception):
    """One sentence for the user: what failed and what to do."""


def main() -> int:
    parser = argparse.ArgumentParser(description="Make .venv and install tooncap into it.")
    parser.add_argument("--check", action="store_true", help="only tell, by exit code, if it is done")
    check = parser.parse_args().check
    root = Path(__file__).resolve().parent.parent
    index = os.environ.get("TORCH_INDEX", "").strip()
    if is_current(root, index):
        return 0
    if check:
        return 1
    try:
        install(root, index)
    except SetupError as error:
        print(f"set-up: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("set-up: stopped; the next call begins it again", file=sys.stderr)
        return 130
    return 0


def is_whole(root: Path) -> bool:
    """Whether .venv was finished once, by this Python version, where it now stands.

    A virtual environment holds absolute paths: one that was copied or moved is of no use.
    """
    scripts = root / ".venv" / "bin"
    return _stamp(root)[:1] == [_place(root)] and all((scripts / name).exists() for name in SCRIPTS)


def is_current(root: Path, index: str) -> bool:
    """Whether .venv is whole and holds what pyproject.toml and constraints.txt now ask for.

    Where torch could not be had, a TORCH_INDEX that was not tried yet is a reason to try again.
    """
    if not is_whole(root) or len(_stamp(root)) != 3:
        return False
    _, contents, torch = _stamp(root)
    return contents == _contents(root) and (not index or torch in ("torch", _no_torch(index)))


def install(root: Path, index: str) -> None:
    """Bring .venv to what the two files ask for: in place if it is whole, otherwise from nothing."""
    stamp = root / ".venv" / "stamp"
    if is_whole(root):
        stamp.unlink()  # until the end: what is cut short from here on is made anew
    else:
        make_venv(root)
    has_torch = install_torch(root, index)
    extras = [extra for extra in EXTRAS if has_torch or extra != "torch"]
    with _stage("3 of 3: tooncap and the packages it needs (about a minute, or a few)"):
        if not pip(root, "-c", "constraints.txt", "-e", f".[{','.join(extras)}]"):
            raise SetupError(f"pip could not install the packages ({_complaint(root)}); see .venv/setup.log")
    lines = [_place(root), _contents(root), "torch" if has_torch else _no_torch(index)]
    stamp.write_text("\n".join(lines), encoding="utf-8")
    print("set-up: done; the next call goes straight on", flush=True)


def make_venv(root: Path) -> None:
    """An empty .venv in the place of whatever was there."""
    with _stage(f"1 of 3: .venv, with Python {platform.python_version()}"):
        venv = root / ".venv"
        if venv.is_symlink() or venv.is_file():
            venv.unlink()
        shutil.rmtree(venv, ignore_errors=True)
        # where .venv was activated, the Python that runs this went with it
        python = getattr(sys, "_base_executable", sys.executable)
        made = subprocess.run([python, "-m", "venv", str(venv)], capture_output=True, text=True)
        if made.returncode:
            said = (made.stdout + made.stderr).strip().splitlines() or ["it said nothing"]
            raise SetupError(f"{python} could not make {venv}: {said[-1]}")


def install_torch(root: Path, index: str) -> bool:
    """Install the pinned torch and tell whether it is there; it is an extra, so its lack is no error."""
    pin = torch_pin(root)
    with _stage(f"2 of 3: {pin}"):
        why = _torch_trouble(root, pin, index)
    if why:
        print(f"set-up: left out {pin}, which only the extra 'torch' needs: {why}", flush=True)
    return not why


def _torch_trouble(root: Path, pin: str, index: str) -> str:
    """Install torch without its dependencies, which come with the rest: `index` is asked for torch alone.

    On Linux the usual registry's torch is a CUDA build, so the one marked "+cpu" is asked for first.
    """
    if _holds_torch(root, pin):
        return ""
    if index:
        return "" if pip(root, "--no-deps", "--index-url", index, pin) else f"{_complaint(root)} at {index}"
    if sys.platform == "linux":
        if pip(root, "--no-deps", f"{pin}+cpu"):
            return ""
        if not has_nvidia_card():
            return (
                "the build on offer brings gigabytes of CUDA packages and this machine shows no NVIDIA card; "
                "for the small one give the address of PyTorch's CPU wheels: make setup TORCH_INDEX=ADDRESS"
            )
        print("for CUDA, as there is an NVIDIA card (gigabytes) ", end="", flush=True)
    return "" if pip(root, "--no-deps", pin) else _complaint(root)


def _holds_torch(root: Path, pin: str) -> bool:
    """Whether .venv holds the pinned torch, in whatever build."""
    builds = (root / ".venv" / "lib").glob(f"*/site-packages/{pin.replace('==', '-')}*.dist-info")
    return any(re.fullmatch(r"torch-[\d.]+(\+\w+)?", build.stem) for build in builds)


def torch_pin(root: Path) -> str:
    """The line "torch==..." of constraints.txt."""
    found = re.search(r"^torch==\S+", (root / "constraints.txt").read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise SetupError("constraints.txt must pin torch in a line torch==VERSION and has none; put it back")
    return found.group()


def has_nvidia_card() -> bool:
    """Whether an NVIDIA driver is at work here."""
    return Path("/proc/driver/nvidia").exists() or shutil.which("nvidia-smi") is not None


def pip(root: Path, *arguments: str) -> bool:
    """Run `pip install` in .venv and tell if it went well; a dot every three seconds, the rest in a log."""
    command = [str(root / ".venv" / "bin" / "python"), "-I", "-m", "pip", "install", "--no-input"]
    quiet = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_PROGRESS_BAR": "off"}
    environment = os.environ | quiet | {"PIP_USER": "0"}  # a venv refuses the user's own folder
    with open(root / ".venv" / "setup.log", "ab") as log:
        process = subprocess.Popen(
            [*command, *arguments], cwd=root, env=environment, stdout=log, stderr=subprocess.STDOUT
        )
        while True:
            try:
                return process.wait(timeout=3) == 0
            except subprocess.TimeoutExpired:
                print(".", end="", flush=True)


class _stage:
    """Print a stage's name, leave room for dots, end the line with the seconds it took."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        self.began = time.monotonic()
        print(f"set-up {self.name} ", end="", flush=True)

    def __exit__(self, kind: object, *_: object) -> None:
        print(" failed" if kind else f" {time.monotonic() - self.began:.0f} s", flush=True)


def _place(root: Path) -> str:
    return f"Python {sys.version_info[0]}.{sys.version_info[1]} in {root}"


def _contents(root: Path) -> str:
    both = b"\0".join((root / name).read_bytes() for name in ("pyproject.toml", "constraints.txt"))
    return hashlib.sha256(both).hexdigest()


def _no_torch(index: str) -> str:
    return f"no torch from {index or 'the usual place'}"


def _stamp(root: Path) -> list[str]:
    try:
        return (root / ".venv" / "stamp").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []


def _complaint(root: Path) -> str:
    log = (root / ".venv" / "setup.log").read_text(encoding="utf-8", errors="replace")
    lines = [line.strip() for line in log.splitlines() if line.strip()] or ["it gave no reason"]
    errors = [line for line in lines if line.startswith("ERROR: ")]
    return (errors or lines)[-1].removeprefix("ERROR: ")


if __name__ == "__main__":
    sys.exit(main())
