"""Large requests on a Dask cluster on the loopback interface."""

import os
import socket
import subprocess
import sys

import pytest
from commands import geomech
from tasks import always_dies, dies, fails
from test_digits import REQUESTS
from test_store import same

from geomech.run import executors
from geomech.run.executors import Cluster
from geomech.run.runner import runner
from geomech.run.workers import using
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


def test_the_command_computes_on_a_cluster(address, tmp_path):
    for name, option in (("a.nc", "--workers=1"), ("b.nc", f"--scheduler={address}")):
        assert geomech(*SWEEP, name, option, cwd=tmp_path)[::2] == (0, "")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_errors_of_tasks_are_those_of_the_command(address):
    with using(scheduler=address), pytest.raises(Refusal, match="no such thing as 2"):
        list(runner().map(fails, None, range(4), 4))
    unknown = pytest.raises(Refusal, match="a cluster cannot know what is to be")
    with using(scheduler=address), unknown:
        list(runner().map(lambda c, x: x, None, range(4), 4))


@pytest.fixture
def processes(tmp_path_factory):
    """A scheduler, and two workers that are processes."""
    options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory"]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with cluster() as local:
        line = [sys.executable, "-m", "dask", "worker", local.scheduler_address]
        line += [*options, tmp_path_factory.mktemp("dask")]
        pipes = {"env": env, "stderr": subprocess.DEVNULL}
        both = [subprocess.Popen(line, **pipes) for _ in range(2)]
        try:
            yield local, both
        finally:
            for process in both:
                process.kill()
                process.wait()


def test_a_worker_that_is_ended_loses_nothing(processes, tmp_path, monkeypatch):
    """One by SIGKILL; then the other, by a task that ends whoever computes it."""
    local, both = processes
    monkeypatch.setattr(executors, "WAIT", 30.0)
    monkeypatch.setattr(executors, "COUNT_INTERVAL", 0.2)
    with using(scheduler=local.scheduler_address):
        monkeypatch.setattr(executors, "WAIT", 3.0)  # its workers have come
        assert list(runner().map(dies, str(tmp_path), range(8), 8)) == [*range(8)]
        assert sorted(process.poll() is None for process in both) == [False, True]
        local.scheduler.allowed_failures = 0
        often = "workers were ended again and again at the same part"
        with pytest.raises(RuntimeError, match=often):
            list(runner().map(always_dies, None, [0], 1))


def test_a_worker_with_other_code_is_refused(address, monkeypatch):
    """Threads share the version; the function that they run tells another."""
    own = "geomech 9.9, solver 9"
    other = "geomech 9.8, solver 9"
    monkeypatch.setattr(executors, "VERSION", own)
    monkeypatch.setattr(executors, "_version_and_back_end", lambda: (other, "numpy"))
    refused = f"has {other}, this command {own}: install the same"
    with pytest.raises(Refusal, match=refused):
        Cluster(address)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("tcp://127.0.0.1:{port}", "nothing answers there"),
        ("127.0.0.1:{port}", "nothing answers there"),
        ("nonsense", "missing port"),
        ("http://127.0.0.1:{port}", "unknown address"),
        ("tcp://127.0.0.1:1;x", "invalid literal"),
        ("", "missing port"),
    ],
)
def test_a_scheduler_that_is_none_is_one_line(word, said, tmp_path, monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.1)
    with socket.socket() as one:  # at whose port nobody listens
        one.bind(("127.0.0.1", 0))
        word = word.format(port=one.getsockname()[1])
    code, out, err = geomech(*SWEEP, "s.nc", "--scheduler", word, cwd=tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"error: --scheduler {word}: ")
    assert said in err
    assert "'dask scheduler'" in err
    assert list(tmp_path.iterdir()) == []


def test_a_scheduler_that_never_answers_is_one_line(monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.1)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        with pytest.raises(Refusal, match="nothing answers there"):
            Cluster(f"tcp://127.0.0.1:{silent.getsockname()[1]}")


def test_a_cluster_without_workers_is_one_line(monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.3)
    none = pytest.raises(Refusal, match="it has no workers: start some")
    with cluster() as local, none:
        Cluster(local.scheduler_address)


def test_without_the_package_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(Refusal, match="pip install 'geomech.distributed.'"):
        Cluster("tcp://127.0.0.1:1")


def test_workers_and_a_scheduler_are_one_too_many():
    with pytest.raises(Refusal, match="give one of the two"):
        using(2, "tcp://127.0.0.1:1").__enter__()
