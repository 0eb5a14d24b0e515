"""One thread a process, as many processes as cores for the whole suite, the truths that
are kept, and what solves."""

import compileall
import gc
import os
import pathlib
import subprocess
import sys

import pytest

# Before NumPy loads: the processes share the cores already.
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

from rft.balance import backend  # noqa: E402

gc.disable()  # until all is read
backend._preferred.set("numpy")  # "auto" is NumPy, but for `solved_by`
TRUTHS = pytest.StashKey()
COMPILED = pytest.StashKey()
BY_HAND = {"soak", "benchmark"}
# Files that look at pictures as they are.
LAID_OUT = {"test_figures", "test_look", "test_pictures", "test_shown"}


@pytest.fixture
def own_parts():
    """Parts of one's own, and the modules they came in, are forgotten after the
    test."""
    from commands import own_parts

    with own_parts():
        yield


def pytest_addoption(parser):
    parser.addoption(
        "--renew-truths",
        action="store_true",
        help="compute what tests/data keeps, and write it anew",
    )


def pytest_configure(config):
    from truths import Truths

    config.stash[TRUTHS] = Truths(config.getoption("--renew-truths"))


def pytest_sessionstart(session):
    """Compile the balance once, while tests are read, before the processes of the whole
    suite would do so side by side."""
    full = session.config.args_source is session.config.ArgsSource.TESTPATHS
    if full and not hasattr(session.config, "workerinput"):
        # For processes that tests start, also where Python writes no bytecode.
        for folder in ("geomech", "rft"):
            compileall.compile_dir(pathlib.Path(__file__).parents[1] / folder, quiet=2)
        if backend.installed():
            session.config.stash[COMPILED] = subprocess.Popen(
                [sys.executable, "-m", "rft"], stdout=subprocess.DEVNULL
            )


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished(node):
    """No test begins before."""
    if compiled := node.config.stash.get(COMPILED, None):
        assert not compiled.wait(), "python -m rft"


def pytest_collection_finish():
    """What is there for good is not looked through again and again: a tenth of the
    time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)
    gc.enable()


def pytest_sessionfinish(session):
    gc.collect()
    gc.freeze()  # pytest collects five times more, and Python as it ends
    session.config.stash[TRUTHS].write()


def pytest_collection_modifyitems(items):
    for item in items:
        by_hand = BY_HAND & {mark.name for mark in item.iter_markers()}
        if by_hand and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(4 * 3600))


@pytest.hookimpl(tryfirst=True)
def pytest_xdist_auto_num_workers(config):
    """None (a process for each core) for the whole suite; 0 for tests picked by hand,
    for what prints and what writes."""
    picked = config.args_source is not config.ArgsSource.TESTPATHS
    if picked or config.option.capture == "no" or config.getoption("--renew-truths"):
        return 0
    return None


@pytest.fixture(scope="session")
def truths(request):
    return request.config.stash[TRUTHS]


@pytest.fixture(autouse=True)
def no_lines_of_progress(monkeypatch):
    """What a command says does not hang on how busy the machine is."""
    from geomech.runs import progress

    monkeypatch.setattr(progress, "PRINT_INTERVAL", 1e9)


@pytest.fixture(autouse=True)
def blank_pictures(request, monkeypatch):
    """Pictures of dots are saved without being drawn, which takes longest; the files of
    LAID_OUT have all as they are."""
    agg = sys.modules.get("matplotlib.backends.backend_agg")
    if agg and request.module.__name__ not in LAID_OUT:
        figure = sys.modules["matplotlib.figure"].Figure
        drawn = figure.draw

        def blank(fig, renderer):
            if not isinstance(renderer, agg.RendererAgg):
                drawn(fig, renderer)

        monkeypatch.setattr(figure, "draw", blank)


@pytest.fixture(scope="session")
def compiled_code():
    """The compiled driver."""
    if not backend.installed():
        pytest.skip("numba is not installed")


@pytest.fixture(scope="module")
def fastest():
    """Has "auto" take compiled code where it is installed, for marches, whose digits
    `test_backend.py` compares with those of NumPy."""
    with backend.preferring(backend.fastest()):
        yield


@pytest.fixture(params=["numpy", "numba"])
def solved_by(request):
    """Runs a test twice: "auto" is NumPy, and compiled code."""
    if request.param == "numba":
        request.getfixturevalue("compiled_code")
    with backend.preferring(request.param):
        yield request.param


@pytest.fixture
def geomech(tmp_path, monkeypatch):
    """Runs a command in an empty folder: (exit code, standard output, standard
    error)."""
    from commands import geomech

    monkeypatch.chdir(tmp_path)
    return geomech
