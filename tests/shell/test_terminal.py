"""What a command tells on standard error."""

import errno
import signal
import warnings

import pytest

from geomech.core.errors import UnitWarning
from geomech.shell import terminal
from rft.core.refusal import Refusal


def test_notes_are_told_once_and_other_warnings_as_python_does(recwarn):
    with terminal.collected_notes() as notes:
        for text in ("``data`` has 2.5 m", "``data`` has 3.5 m", "turns"):
            warnings.warn(text, UnitWarning, stacklevel=1)
        warnings.warn("of Python", ResourceWarning, stacklevel=1)
    assert [(str(x.message), x.category) for x in recwarn] == [
        ("of Python", ResourceWarning)
    ]
    assert [*notes.values()] == ["--data has 2.5 m", "turns"]


@pytest.mark.parametrize(
    ("argument", "option"),
    [
        ("amplitudes", "--amplitudes"),
        ("compare_frame", "--compare-frame"),
        ("tolerance", "--tol"),
        ("at", "--slice"),
        ("longest", "--yes"),
    ],
)
def test_an_argument_is_named_as_the_option_that_a_reader_types(argument, option):
    assert terminal.option(argument) == option


def test_errors_of_users_and_of_the_system_have_a_text_and_faults_have_none():
    refusal = Refusal("is wrong", where="``body_length``")
    assert "--body-length" in terminal.error_text(refusal)
    for error in (ValueError("3 rows"), RuntimeError("3 rows")):
        assert terminal.error_text(error) == "3 rows"
    for fault in (TypeError("fault"), KeyError("fault"), AssertionError("fault")):
        assert terminal.error_text(fault) is None


@pytest.mark.parametrize(
    ("number", "name", "named"),
    [
        (errno.EMFILE, None, "ulimit"),
        (errno.ENFILE, "a.nc", "ulimit"),
        (errno.ENOSPC, "a.nc", "a.nc"),
    ],
)
def test_errors_of_the_system_name_their_file_or_cure(number, name, named):
    def fails():
        raise OSError(number, "no more", name)

    with pytest.raises(OSError, match="no more") as raised:
        fails()
    assert named in terminal.error_text(raised.value)


@pytest.mark.parametrize("name", terminal.SIGNALS)
def test_a_signal_stops_a_command_once_and_has_its_handler_back(name):
    number = getattr(signal, name)
    former = signal.signal(number, signal.default_int_handler)
    try:
        with terminal.stoppable():
            with pytest.raises(terminal.Stopped) as stopped:
                signal.raise_signal(number)
            # Impatience does not disturb what is being stored.
            signal.raise_signal(number)
        assert (stopped.value.name, stopped.value.code) == (name, 128 + number)
        assert signal.getsignal(number) is signal.default_int_handler
        signal.signal(number, signal.SIG_IGN)
        with terminal.stoppable():
            signal.raise_signal(number)
    finally:
        signal.signal(number, former)


@pytest.mark.parametrize(
    ("stop", "name", "code"),
    [
        (KeyboardInterrupt(), "SIGINT", 130),
        (terminal.Stopped(signal.SIGTERM), "SIGTERM", 143),
        (terminal.Stopped(signal.SIGHUP), "SIGHUP", 129),
    ],
)
@pytest.mark.parametrize("stored", ["", "3 points are in a.nc"])
def test_who_stops_a_command_is_told_how_to_go_on(stop, name, code, stored, capsys):
    if stored:
        stop.add_note(stored)
    assert terminal.stopped(stop, ["sweep", "a scene.toml", "-o", "a.nc"]) == code
    told = capsys.readouterr().err
    assert "geomech sweep 'a scene.toml' -o a.nc" in told
    assert name in told
    assert (stored or "nothing is stored") in told
