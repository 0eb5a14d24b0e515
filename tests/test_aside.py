"""Work beside the computing, in copies of this process: files, errors, ends."""

import os
import signal
import time

import pytest
from parts import doubled

from geomech import workers
from geomech.errors import SceneError
from geomech.output import report
from geomech.workers import aside as asides
from geomech.workers.aside import aside

pytestmark = pytest.mark.skipif(not asides.COPIES, reason="no copies of processes here")


@pytest.fixture
def crew():
    with workers.using(2):
        yield


def mine(path):
    return lambda: path.write_text(str(os.getpid()))


@pytest.mark.usefixtures("crew")
def test_copies_have_done_at_the_end(tmp_path):
    files = [tmp_path / name for name in "ab"]
    with aside() as beside:
        for file in files:
            beside(mine(file))
    pids = {int(file.read_text()) for file in files}
    assert len(pids) == 2 and os.getpid() not in pids


def test_without_others_it_is_done_here_and_now(tmp_path):
    with aside() as beside:
        beside(mine(tmp_path / "a"))
        assert int((tmp_path / "a").read_text()) == os.getpid()


@pytest.mark.usefixtures("crew")
def test_a_copy_computes_what_is_large_by_itself(tmp_path, monkeypatch):
    """It has none of the threads that ask the workers, and would wait for them for ever."""
    large = lambda: list(workers.each(doubled, 2, range(4), 4, seconds=1e9))

    def call():
        signal.alarm(20)
        (tmp_path / "a").write_text(str(large()))

    with monkeypatch.context() as patch, aside() as beside:
        patch.setattr(workers._crew.get(), "threads", [None, None])
        beside(call)
    assert (tmp_path / "a").read_text() == "[0, 2, 4, 6]"


@pytest.mark.usefixtures("crew")
def test_what_a_copy_raises_is_raised():
    def fails():
        raise SceneError("no room")

    with pytest.raises(SceneError, match="no room"), aside() as beside:
        beside(fails)


@pytest.mark.usefixtures("crew")
def test_a_copy_that_is_killed_is_told():
    with pytest.raises(RuntimeError, match="was killed: the same with --workers 1"), aside() as beside:
        beside(lambda: os.kill(os.getpid(), signal.SIGKILL))


@pytest.mark.usefixtures("crew")
def test_no_copy_outlives_the_statement(tmp_path):
    """One that goes on when the command is stopped ends with it, though it does not hear the signal itself."""
    there = tmp_path / "a"

    def stopped():
        with aside() as beside:
            beside(lambda: (mine(there)(), time.sleep(60)))
            while not there.exists() or not there.read_text():
                time.sleep(0.01)
            os.kill(int(there.read_text()), signal.SIGINT)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    with pytest.raises(ProcessLookupError):
        os.kill(int(there.read_text()), 0)


@pytest.mark.usefixtures("crew")
def test_a_run_draws_its_maps_beside(tmp_path, monkeypatch):
    from geomech.scene import load
    from geomech.study.bench import Study

    here = []
    monkeypatch.setattr(report, "_save", lambda fig, stem: (here.append(stem.name), stem.write_text("drawn")))
    study = Study(load("three-link-viscous").with_numerics(grid=7, phases=16))
    report.write(study, tmp_path, lambda done: None)
    assert here == ["displacement"] and all((tmp_path / name).read_text() == "drawn" for name in ("connection", "ccf"))
