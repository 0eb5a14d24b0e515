"""Large requests on a Dask cluster on the loopback interface."""

import contextlib
import os
import subprocess
import sys

import pytest
from commands import geomech
from tasks import always_dies, dies, fails
from test_digits import REQUESTS
from test_store import same

from geomech.runs import executors
from geomech.runs.executors import Cluster
from geomech.runs.runner import runner
from geomech.runs.workers import using
from geomech.studies.displacement import cycles
from rft.core.refusal import Refusal

distributed = pytest.importorskip(
    "distributed", reason="the extra 'distributed' is not installed"
)
pytestmark = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::DeprecationWarning"
)  # of Dask's own
SWEEP = ["sweep", "three-link-viscous", "--over", "gait.amplitude=0.5,1", "-o"]


def cluster(n_workers=0):
    return distributed.LocalCluster(
        protocol="tcp://",
        silence_logs=50,
        processes=False,
        n_workers=n_workers,
        threads_per_worker=1,
        dashboard_address=":0",
    )


@pytest.fixture(scope="module")
def address():
    """The address of a cluster of two threads of this process."""
    with cluster(2) as local:
        yield local.scheduler_address


def test_a_cluster_gives_the_digits_of_one_process(address, monkeypatch):
    monkeypatch.setattr(cycles, "BATCH_SIZE", 4)
    alone = REQUESTS["sweep"]()
    with using(scheduler=address):
        assert same(REQUESTS["sweep"](), alone)


def test_errors_of_tasks_are_those_of_the_command(address):
    with using(scheduler=address):
        with pytest.raises(Refusal, match="no such thing as 2"):
            list(runner().map(fails, None, range(4), 4))
        with pytest.raises(Refusal, match="a cluster does not know what to"):
            list(runner().map(lambda c, x: x, None, range(4), 4))


@pytest.fixture
def processes(tmp_path):
    """A scheduler, and two workers that are processes."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    options = ["--nthreads=1", "--no-nanny", "--no-dashboard"]
    with cluster() as local, contextlib.ExitStack() as stack:
        line = [sys.executable, "-m", "dask", "worker", local.scheduler_address]
        line += [*options, "--local-directory", tmp_path / "dask"]
        workers = []
        for _ in range(2):
            worker = subprocess.Popen(line, env=env, stderr=subprocess.DEVNULL)
            stack.callback(worker.wait)
            stack.callback(worker.kill)
            workers.append(worker)
        yield local, workers


def test_a_worker_that_is_ended_loses_nothing(processes, tmp_path, monkeypatch):
    """One by SIGKILL; then the other, by a task that ends whoever computes it."""
    local, workers = processes
    monkeypatch.setattr(executors, "WAIT", 30.0)
    monkeypatch.setattr(executors, "COUNT_INTERVAL", 0.2)
    with using(scheduler=local.scheduler_address):
        assert list(runner().map(dies, str(tmp_path), range(8), 8)) == [*range(8)]
        assert sorted(x.poll() is None for x in workers) == [False, True]
        local.scheduler.allowed_failures = 0
        often = "workers were ended repeatedly during the same task"
        with pytest.raises(RuntimeError, match=often):
            list(runner().map(always_dies, None, [0], 1))


def test_a_worker_with_other_code_is_refused(address, monkeypatch):
    """Threads share the version; the function that they run tells another."""
    other = "geomech 9.8, solver 9"
    monkeypatch.setattr(executors, "_version_and_back_end", lambda: (other, "numpy"))
    with pytest.raises(Refusal, match=f"has {other}, this command "):
        Cluster(address)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("127.0.0.1:1", "nothing answers there"),  # at whose port nobody listens
        ("http://127.0.0.1:1", "unknown address"),
        ("", "missing port"),
    ],
)
def test_a_scheduler_that_is_none_is_one_line(word, said, tmp_path, monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.1)
    code, _, err = geomech(*SWEEP, "s.nc", "--scheduler", word, cwd=tmp_path)
    assert (code, err.count("\n")) == (2, 1)
    assert said in err


def test_a_cluster_without_workers_is_one_line(monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.3)
    with cluster() as local, pytest.raises(Refusal, match="it has no workers: start"):
        Cluster(local.scheduler_address)


def test_without_the_package_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(Refusal, match="pip install 'geomech.distributed.'"):
        Cluster("tcp://127.0.0.1:1")
