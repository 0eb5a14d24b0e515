"""One thread a process, as many processes as cores for the whole suite, the truths that are kept, and what solves."""

import math
import os
import sys

import pytest

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before NumPy loads: the processes share the cores already

from rft import backend, compiled  # noqa: E402

backend.AUTO.worked = -math.inf  # "auto" is NumPy, however long a process has been testing, but for `solved_by`
TRUTHS = pytest.StashKey()
BY_HAND = {"soak", "benchmark"}


def pytest_addoption(parser):
    parser.addoption("--renew-truths", action="store_true", help="compute what tests/data keeps, and write it anew")


def pytest_configure(config):
    from truths import Truths

    config.stash[TRUTHS] = Truths(config.getoption("--renew-truths"))


def pytest_sessionfinish(session):
    truths = session.config.stash[TRUTHS]
    if truths.renew:
        truths.write()
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["missing"] = truths.missing


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    node.config.stash[TRUTHS].missing += getattr(node, "workeroutput", {}).get("missing", [])


def pytest_terminal_summary(terminalreporter, config):
    if missing := config.stash[TRUTHS].missing:
        files = ", ".join(sorted({f"{name}.json" for name in missing}))
        terminalreporter.write_line(f"{len(missing)} truths were computed, {files} lacks them: pytest --renew-truths")


def pytest_collection_modifyitems(items):
    for item in items:
        if BY_HAND & {mark.name for mark in item.iter_markers()} and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(4 * 3600))


@pytest.hookimpl(tryfirst=True)
def pytest_xdist_auto_num_workers(config):
    """None (a process for each core) for the whole suite; 0 for tests picked by hand, for what prints and what writes."""
    picked = config.args_source is not config.ArgsSource.TESTPATHS
    return 0 if picked or config.option.capture == "no" or config.getoption("--renew-truths") else None


@pytest.fixture(scope="session")
def truths(request):
    return request.config.stash[TRUTHS]


@pytest.fixture(autouse=True)
def no_lines_of_progress(monkeypatch):
    """What a command says does not hang on how busy the machine is."""
    from geomech import progress

    monkeypatch.setattr(progress, "EVERY", 1e9)


@pytest.fixture(scope="session")
def compiled_code():
    """Compiled descents. To make them takes some twenty seconds, so that is left to `python -m rft`, and to .ci/run."""
    if not backend.installed():
        pytest.skip("numba is not installed")
    if not compiled.made():
        pytest.skip("compiled code is not made yet: python -m rft")


@pytest.fixture(params=["numpy", "numba"])
def solved_by(request, monkeypatch):
    """Runs a test twice: "auto" is NumPy, and compiled code."""
    if request.param == "numba":
        request.getfixturevalue("compiled_code")
        monkeypatch.setattr(backend.AUTO, "is_ready", True)
    return request.param


@pytest.fixture
def geomech(tmp_path, monkeypatch, capsys):
    """Runs a command in an empty folder: (exit code, standard output, standard error)."""
    from geomech import cli

    monkeypatch.chdir(tmp_path)

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["geomech", *map(str, args)])
        with pytest.raises(SystemExit) as left:
            cli.main()
        said = capsys.readouterr()
        return left.value.code, said.out, said.err

    return run
