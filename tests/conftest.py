"""A cluster of two Dask workers on this machine, for the tests that hand work to one."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def cluster():
    """The address of a scheduler with two workers, each a process with one thread."""
    distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parent / "capture")  # where the work lies that tests only pretend to do
        two_workers = distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        )
    with two_workers:
        yield two_workers.scheduler_address


def pytest_collection_modifyitems(items):
    """Tests with a browser come last: playwright leaves its event loop running in the process that drove it."""
    items.sort(key=lambda item: "browser" in item.path.parts)
