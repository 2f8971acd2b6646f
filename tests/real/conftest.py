"""Real clips and drawings, which are not part of the project: TOONCAP_DATA says where they are."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real material; the test is skipped where there is none."""
    folder = Path(os.environ.get("TOONCAP_DATA", ROOT.parent / "shared" / "data"))
    if not (folder / "clips").is_dir():
        pytest.skip(f"no real material at {folder}: set TOONCAP_DATA to the folder that holds clips/ and drawings/")
    return folder


@pytest.fixture(scope="session")
def sheets() -> Path:
    """Where contact sheets are left for a person to look at."""
    folder = ROOT / "out" / "real"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
