"""Run notebooks from clean kernels and keep their outputs: `python notebooks/run.py`, or `... run.py 03 08` for some."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
PATIENCE = 300  # seconds for a cell
PLAIN = {"display_name": "Python 3", "language": "python", "name": "python3"}


def main(names: list[str]) -> None:
    """Run the notebooks whose names begin so, or all; what fails keeps its old outputs, and stops the rest."""
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE.parent), os.environ.get("PYTHONPATH", "")])
    for path in sorted(HERE.glob("*.ipynb")):
        if not names or path.name.startswith(tuple(names)):
            keep(path)


def keep(path: Path) -> None:
    """Run one notebook, and write it with its outputs; no times, no versions."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", record_timing=False).execute()
    notebook.metadata = {"kernelspec": PLAIN, "language_info": {"name": "python"}}
    for cell in notebook.cells:
        cell.metadata = {}
    written = path.with_suffix(".new")
    nbformat.write(notebook, written)
    written.replace(path)
    print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
