"""`make bench`: ours against peers in one run, on one core; prints a table and writes results.json beside this file.

Every module here but this one and those that begin with "_" has a function `rows()` that returns flat names and
numbers.  Only ratios within one run are comparable: machines differ, and so does their load.
"""

import json
import os
import sys
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"  # before NumPy is imported: each figure is one core's

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))


def main() -> None:
    """Run the modules named on the command line, or all, and keep the other modules' last figures."""
    from importlib import import_module

    import cv2
    from rich.console import Console
    from rich.table import Table

    cv2.setNumThreads(1)
    stored = HERE / "results.json"
    results = json.loads(stored.read_text()) if stored.exists() else {}
    chosen = sys.argv[1:] or sorted(
        path.stem for path in HERE.glob("*.py") if path.stem != "run" and path.stem[0] != "_"
    )
    table = Table("figure", "value", box=None)
    for name in chosen:
        found = import_module(name).rows()
        results = {row: value for row, value in results.items() if not row.startswith(f"{name}.")}
        for row, value in found.items():
            results[f"{name}.{row}"] = round(float(value), 5)
            table.add_row(f"{name}.{row}", f"{value:.4g}")
    Console().print(table)
    stored.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n")
    print(f"{stored.relative_to(HERE.parents[1])}: {len(results)} figures")


if __name__ == "__main__":
    main()
