"""Processes that work out the flights of a report, or draw films, one flight at a time."""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError
from pytest_garl.execution.processes import end_with_parent, ignore_ctrl_c
from pytest_garl.reports.html.flight_task import FlightTask, ShownFlight, shown_flight

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def cores() -> int:
    """Return how many processes can draw at once."""
    # macOS ties no process to some of the cores.
    ours = getattr(os, "sched_getaffinity", None)
    return len(ours(0)) if ours else os.cpu_count() or 1


def shown_flights(
    tasks: Sequence[FlightTask], workers: int, on_done: Callable[[int], None] = lambda done: None
) -> list[ShownFlight]:
    """Return what the pages show, in order; ``on_done`` gets the number that are ready.

    Few flights without films are worked out in this process.  Raises GarlError if a process ends.
    """
    films = sum(task.with_film for task in tasks)
    workers = min(workers, len(tasks))
    if workers <= 1 or (not films and len(tasks) < 4):
        found = []
        for task in tasks:
            found.append(shown_flight(task))
            on_done(len(found))
        return found
    # Films first: the longest task should not be the last.
    order = sorted(range(len(tasks)), key=lambda index: not tasks[index].with_film)
    ready = in_processes(shown_flight, [tasks[index] for index in order], workers, on_done)
    shown = dict(zip(order, ready, strict=True))
    return [shown[index] for index in range(len(tasks))]


def in_processes(
    work: Callable[[Task], Answer],
    tasks: Sequence[Task],
    workers: int,
    on_done: Callable[[int], None] = lambda done: None,
) -> list[Answer]:
    """Return what ``work``, a function of a module, makes of each task, in order.

    ``workers`` processes work, and each takes the next task.  ``on_done`` gets the number that are
    ready.  Raises GarlError if ``work`` does, or if a process ends.
    """
    waiting: queue.SimpleQueue[int] = queue.SimpleQueue()
    for index in range(len(tasks)):
        waiting.put(index)
    done: dict[int, Answer] = {}
    answers: queue.SimpleQueue[tuple[int, tuple[bool, Any]]] = queue.SimpleQueue()
    with contextlib.ExitStack() as stack:
        for _ in range(min(workers, len(tasks))):
            process = stack.enter_context(_worker())
            arguments = (process, [(work, task) for task in tasks], waiting, answers)
            threading.Thread(target=_feed, args=arguments, daemon=True).start()
        while len(done) < len(tasks):
            index, (succeeded, answer) = answers.get()
            if not succeeded:
                raise GarlError(f"{getattr(tasks[index], 'name', 'a film')}: {answer}")
            done[index] = answer
            on_done(len(done))
    return [done[index] for index in range(len(tasks))]


@contextlib.contextmanager
def _worker() -> Iterator[subprocess.Popen[bytes]]:
    """Start a process; end it, whatever it does, at the end."""
    process = subprocess.Popen(
        [sys.executable, "-m", __name__, str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, **cpu_dispatch.environment()},
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                assert pipe is not None
                pipe.close()


def _feed(
    process: subprocess.Popen[bytes],
    orders: Sequence[tuple[Callable[[Any], Any], Any]],
    waiting: queue.SimpleQueue[int],
    answers: queue.SimpleQueue[tuple[int, tuple[bool, Any]]],
) -> None:
    """Give a process one task after the other."""
    assert process.stdin is not None
    assert process.stdout is not None
    while True:
        try:
            index = waiting.get_nowait()
        except queue.Empty:
            return
        try:
            pickle.dump(orders[index], process.stdin)
            process.stdin.flush()
            answers.put((index, pickle.load(process.stdout)))
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):
            status = process.poll()
            words = f"the process that drew it ended (exit status {status})"
            answers.put((index, (False, words)))
            return


def main(parent: str) -> None:
    """Work out tasks from standard input until it ends; answers go to standard output."""
    ignore_ctrl_c()
    end_with_parent(int(parent))
    # What else is printed, by whatever library, must not stand among the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            work, task = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer: tuple[bool, Any] = (True, work(task))
        except GarlError as error:
            answer = (False, str(error))
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
