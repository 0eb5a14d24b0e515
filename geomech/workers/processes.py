"""Processes of this machine, one a core. Each is a Python of its own that takes parts from its standard input: it needs no
guard in the program that starts it, does not hear the terminal's signals, and ends when that program does."""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import struct
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from geomech.terminal import BELOW
from geomech.workers.solving import at_hand
from geomech.workers.task import Order, opened, perform

TRIES = 3  # of a part whose process is ended from outside
PATIENCE = 2.0  # s for a thread to see that its process is ended
AHEAD = 4  # parts for each process, that are given out before the oldest is back
SIZE = struct.Struct("<Q")


class Processes:
    """``count`` of them, started when they are asked for something; one that is ended gets its part again."""

    remote = False

    def __init__(self, count: int):
        self.count, self.closed = count, False
        self.workers = [Worker() for _ in range(count)]
        self.idle: queue.SimpleQueue = queue.SimpleQueue()
        for worker in self.workers:
            self.idle.put(worker)
        self.parts: queue.SimpleQueue = queue.SimpleQueue()
        self.threads: list[threading.Thread] = []  # each asks a process

    def has(self) -> str:
        return at_hand()

    def each(self, order: Order, items: Iterable) -> Iterator:
        told: set = set()
        while len(self.threads) < self.count:
            thread = threading.Thread(target=self._serve, daemon=True)
            thread.start()
            self.threads.append(thread)
        submit = lambda item: self._submitted(order, pickle.dumps(item))
        with contextlib.closing(in_order(submit, items, lambda: AHEAD * self.count)) as outcomes:
            for outcome in outcomes:
                yield opened(outcome, told)

    def _submitted(self, order: Order, item: bytes) -> Part:
        part = Part(order, item)
        self.parts.put(part)
        return part

    def _serve(self) -> None:
        while (part := self.parts.get()) is not None:
            if not (part.cancelled or self.closed):
                part.do(self._done)

    def _done(self, order: Order, item: bytes) -> bytes:
        worker = self.idle.get()
        try:
            for _ in range(TRIES):
                with contextlib.suppress(Ended):
                    return worker.asked(order, item)
                if self.closed:
                    break
            raise RuntimeError(
                f"a worker process was ended {TRIES} times at the same part ({worker.last}): out of memory? Take fewer "
                "--workers"
            )
        finally:
            self.idle.put(worker)

    def close(self) -> None:
        """End all at once, in the middle of a part, too."""
        self.closed = True
        for worker in self.workers:
            worker.closed = True
            worker.kill()
        for _ in self.threads:
            self.parts.put(None)
        for thread in self.threads:
            thread.join(PATIENCE)
        for worker in self.workers:
            worker.kill()  # of one that was being started


class Part:
    """One that is asked for, and its outcome. Only queues of the kind whose locks no signal leaves held, as one that arrives
    inside of `concurrent.futures` may: its threads then wait for ever."""

    def __init__(self, order: Order, item: bytes):
        self.order, self.item, self.cancelled = order, item, False
        self.outcome: queue.SimpleQueue = queue.SimpleQueue()

    def do(self, done: Callable) -> None:
        try:
            self.outcome.put((done(self.order, self.item), None))
        except BaseException as error:
            self.outcome.put((None, error))

    def result(self) -> bytes:
        found, error = self.outcome.get()
        if error is not None:
            raise error
        return found

    def cancel(self) -> None:
        self.cancelled = True


def in_order(submit: Callable, items: Iterable, room: Callable[[], int]) -> Iterator:
    """Results of futures, in the order of the items; at most room() of them are under way, so that neither parts nor results
    pile up."""
    waiting: deque = deque()
    try:
        for item in items:
            while len(waiting) >= room():
                yield waiting.popleft().result()
            waiting.append(submit(item))
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


class Ended(Exception):
    """The process is no more."""


class Worker:
    """A process that is started at the first question."""

    def __init__(self):
        self.process, self.sent, self.last, self.closed = None, None, "", False

    def asked(self, order: Order, item: bytes) -> bytes:
        """What `perform` gives there; `Ended` if it ends meanwhile."""
        if self.process is None:
            self.process, self.sent = _started(), None
        process = self.process
        if self.closed:
            self.kill()
        try:
            _write(process.stdin, pickle.dumps((None if self.sent is order else order, item)))
            self.sent = order
            return _read(process.stdout)
        except (OSError, EOFError, ValueError):
            self.kill()
            code = process.wait()
            self.last = f"signal {-code}" if code < 0 else f"exit code {code}"
            raise Ended from None

    def kill(self) -> None:
        process, self.process = self.process, None
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    stream.close()


def _started() -> subprocess.Popen:
    code = f"import sys; sys.path[:] = {sys.path!r}; from geomech.workers.processes import serve; serve()"
    return subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
        env={**os.environ, **dict.fromkeys(BELOW, "1")},
    )  # fmt: skip


def _write(file, body: bytes) -> None:
    file.write(SIZE.pack(len(body)))
    file.write(body)
    file.flush()


def _read(file) -> bytes:
    head = file.read(SIZE.size)
    if len(head) < SIZE.size:
        raise EOFError
    body = file.read(SIZE.unpack(head)[0])
    if len(body) < SIZE.unpack(head)[0]:
        raise EOFError
    return body


def serve() -> None:
    """Be a worker: parts come by standard input, outcomes go where standard output was, what is printed goes to the error
    stream. Ends with whoever started it, also in the middle of a part."""
    sys.geomech_worker = True
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    inbox: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, inbox), daemon=True).start()
    order = None
    while True:
        fresh, item = pickle.loads(inbox.get())
        order = fresh or order
        done = perform(order, item)
        try:
            _write(answers, done)
        except OSError:  # nobody is there any more
            os._exit(0)


def _listen(file, inbox: queue.SimpleQueue) -> None:
    with contextlib.suppress(EOFError, OSError):
        while True:
            inbox.put(_read(file))
    os._exit(0)
