"""Commands as a user gives them: by `cli.main` in this process, or by a Python of their
own."""

import contextlib
import functools
import io
import signal
import subprocess
import sys
from unittest import mock

import pytest
import typer.main

from geomech.runs import backend
from geomech.scenes import kinds
from geomech.shell import cli
from rft.balance.backend import preferring
from rft.core.registry import REGISTRIES

PARSER = functools.cache(
    typer.main.get_command
)  # it takes 20 ms, and is the same each time


def unless_numpy(name, prefer=backend.prefer):
    """Prefers a back end, but for the one that commands begin with: what the fixture
    `fastest` prefers remains."""
    if name != "numpy":
        prefer(name)


def geomech(*args, cwd="."):
    """(exit code, standard output, standard error) of a command, run by `cli.main` in
    this process."""
    streams = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2)]
    handlers = {
        s: signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    for number in (s for s, handler in handlers.items() if handler is signal.SIG_IGN):
        signal.signal(
            number, signal.SIG_DFL
        )  # tests may run in the background, where a command heeds what is ignored
    try:
        with (
            mock.patch.object(sys, "argv", ["geomech", *map(str, args)]),
            mock.patch.object(typer.main, "get_command", PARSER),
            mock.patch.object(backend, "prefer", unless_numpy),
            preferring(""),  # what it prefers ends with it
            contextlib.redirect_stdout(streams[0]),
            contextlib.redirect_stderr(streams[1]),
            contextlib.chdir(cwd),
            pytest.raises(SystemExit) as done,
        ):
            cli.main()
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    for stream in streams:
        stream.flush()
    return done.value.code, *(stream.buffer.getvalue().decode() for stream in streams)


@contextlib.contextmanager
def own_parts():
    """Parts of one's own, and the modules they came in, are forgotten at the end."""
    before = {group: dict(registry) for group, registry in REGISTRIES.items()}
    modules = set(sys.modules)
    with mock.patch.multiple(kinds, _sources={}, _files={}):
        yield
    for group, registry in REGISTRIES.items():
        built_in = {name: registry[name] for name in registry.built_in}
        registry.restore(before.get(group, built_in))
    for name in set(sys.modules) - modules:
        if name.startswith(kinds.PLUGIN):
            del sys.modules[name]


def as_process(*args, cwd=None):
    """As `geomech`, by a Python of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "geomech", *map(str, args)],
        capture_output=True,
        text=True,
        cwd=cwd,
    )
    return done.returncode, done.stdout, done.stderr
