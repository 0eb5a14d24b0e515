"""Sweeps on a Dask cluster on the loopback interface."""

import os
import socket
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from commands import geomech
from tabled import swept_table
from tasks import always_dies, dies, fails
from test_workers import OVER, power  # noqa: F401  power is a fixture

from geomech import scenes
from geomech.run import executors
from geomech.run.executors import Cluster
from geomech.run.runner import runner
from geomech.run.workers import using
from geomech.studies.displacement import cycles, sweep
from rft.core.refusal import Refusal

distributed = pytest.importorskip(
    "distributed", reason="the extra 'distributed' is not installed"
)


GLASS = scenes.load("three-link-glass").with_numerics(phases=32)
pytestmark = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::DeprecationWarning"
)  # of Dask's own


@pytest.fixture(scope="module")
def address():
    """Of a cluster of two threads of this process."""
    settings = {
        "processes": False,
        "n_workers": 2,
        "threads_per_worker": 1,
        "dashboard_address": ":0",
    }
    with distributed.LocalCluster(
        protocol="tcp://", silence_logs=50, **settings
    ) as local:
        yield local.scheduler_address


def test_the_cluster_gives_the_same_digits(address, power, monkeypatch):  # noqa: F811
    monkeypatch.setattr(cycles, "BATCH_SIZE", 4)
    for scene, over in (
        (GLASS, OVER),
        (GLASS.changed(medium=power(1.0)), {"medium.power": [0.9, 1.0]}),
    ):
        alone, told = swept_table(sweep.sweep(scene, over)), []
        with using(scheduler=address):
            shared = swept_table(sweep.sweep(scene, over, progress=told.append))
        for key in ("displacement", "estimate", "estimate_heading"):
            np.testing.assert_array_equal(shared[key], alone[key])
        assert told == sorted(told) and told[-1] == 1.0


def test_errors_of_parts_are_those_of_the_command(address):
    with using(scheduler=address), pytest.raises(Refusal, match="no such thing as 2"):
        list(runner().map(fails, None, range(4), 4))
    with (
        using(scheduler=address),
        pytest.raises(Refusal, match="a cluster cannot know what is to be computed"),
    ):
        list(runner().map(lambda c, x: x, None, range(4), 4))


@pytest.fixture
def processes():
    """A scheduler, and two workers that are processes."""
    settings = {
        "processes": False,
        "n_workers": 0,
        "dashboard_address": ":0",
        "protocol": "tcp://",
    }
    options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory"]
    with (
        distributed.LocalCluster(silence_logs=50, **settings) as local,
        tempfile.TemporaryDirectory() as folder,
    ):
        command = [
            sys.executable,
            "-m",
            "dask",
            "worker",
            local.scheduler_address,
            *options,
            folder,
        ]
        env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        both = [
            subprocess.Popen(command, env=env, stderr=subprocess.DEVNULL)
            for _ in range(2)
        ]
        try:
            yield local, both
        finally:
            for process in both:
                process.kill()
                process.wait()


def test_a_worker_that_is_ended_loses_nothing(processes, tmp_path, monkeypatch):
    """By its own id, with SIGKILL; then the other one, by a part that ends whoever does it."""
    local, both = processes
    monkeypatch.setattr(executors, "WAIT", 30.0)
    monkeypatch.setattr(executors, "COUNT_INTERVAL", 0.2)
    with using(scheduler=local.scheduler_address):
        monkeypatch.setattr(
            executors, "WAIT", 3.0
        )  # to close the connection; its workers have come
        assert list(runner().map(dies, str(tmp_path), range(8), 8)) == [*range(8)]
        assert (tmp_path / "died").exists()
        assert sorted(process.poll() is None for process in both) == [False, True]
        local.scheduler.allowed_failures = 0
        with pytest.raises(
            RuntimeError, match="workers were ended again and again at the same part"
        ):
            list(runner().map(always_dies, None, [0], 1))


def test_a_worker_with_other_code_is_refused(address, monkeypatch):
    monkeypatch.setattr(
        executors, "VERSION", "geomech 9.9, solver 9"
    )  # of this command; threads share it, parts bear it
    monkeypatch.setattr(
        executors, "_version_and_back_end", lambda: ("geomech 9.8, solver 9", "numpy")
    )
    with pytest.raises(
        Refusal,
        match="has geomech 9.8, solver 9, this command geomech 9.9, solver 9: install the same",
    ):
        Cluster(address)


def listening():
    """A port of this machine at which nobody listens."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.mark.parametrize(
    "word",
    [
        "tcp://127.0.0.1:{port}",
        "127.0.0.1:{port}",
        "nonsense",
        "http://127.0.0.1:{port}",
        "",
    ],
)
def test_a_scheduler_that_is_none_is_one_line(word, tmp_path, monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.1)
    word = word.format(port=listening())
    args = [
        "three-link-viscous",
        "--over",
        "gait.amplitude=0.5,1",
        "-o",
        "s.nc",
        "--scheduler",
        word,
    ]
    code, out, err = geomech("sweep", *args, cwd=tmp_path)
    assert (code, out) == (2, "") and err.count("\n") == 1
    assert err.startswith(f"error: --scheduler {word}: ") and "'dask scheduler'" in err
    assert list(tmp_path.iterdir()) == []


def test_no_client_is_made_of_what_is_no_address(monkeypatch):
    """One whose connection fails so prints a traceback, seconds later."""
    monkeypatch.setattr(distributed, "Client", None)
    for word in ("nonsense", "http://127.0.0.1:80", "tcp://127.0.0.1:1;x", ""):
        with pytest.raises(
            Refusal, match="missing port|unknown address|invalid literal"
        ):
            Cluster(word)


def test_a_scheduler_that_never_answers_is_one_line(monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.1)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        with pytest.raises(Refusal, match="nothing answers there"):
            Cluster(f"tcp://127.0.0.1:{silent.getsockname()[1]}")


def test_a_cluster_without_workers_is_one_line(monkeypatch):
    monkeypatch.setattr(executors, "WAIT", 0.3)
    settings = {
        "processes": False,
        "n_workers": 0,
        "dashboard_address": ":0",
        "protocol": "tcp://",
    }
    none = pytest.raises(Refusal, match="it has no workers: start some")
    with distributed.LocalCluster(silence_logs=50, **settings) as local, none:
        Cluster(local.scheduler_address)


def test_without_the_package_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(Refusal, match="pip install 'geomech.distributed.'"):
        Cluster("tcp://127.0.0.1:1")


def test_workers_and_a_scheduler_are_one_too_many():
    with (
        pytest.raises(Refusal, match="give one of the two"),
        using(2, "tcp://127.0.0.1:1"),
    ):
        pass


def test_the_command_computes_on_a_cluster(address, tmp_path):
    args = ["three-link-viscous", "--over", "gait.amplitude=0.5,1"]
    for name, more in (
        ("a.nc", ["--workers", "1"]),
        ("b.nc", ["--scheduler", address]),
    ):
        assert geomech("sweep", *args, "-o", name, *more, cwd=tmp_path)[::2] == (0, "")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
