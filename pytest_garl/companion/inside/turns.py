"""Tasks that take turns in the flight's time; Python's clocks, threads and locks over them."""

from __future__ import annotations

import _thread
import heapq
import os
import queue
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

TICK_S = 20e-6
"""What each reading of a clock takes: real ones take less, but loops that poll shall end."""
EPOCH_S = 1_700_000_000.0
"""What ``time.time()`` says at the begin of a flight."""

_CALL = -1
"""In place of a parking's number: an entry of the queue that is a function."""

_new_real_lock = _thread.allocate_lock
_start_real_thread = _thread.start_new_thread


class Task:
    """One thread of the program."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.done = False
        self.token = 0
        """Counts its parkings: an entry of the queue for an earlier one is void."""
        self.roused = False
        self.gate = _new_real_lock()
        self.gate.acquire()
        self.ended: list[Task] = []
        """Tasks that wait for its end."""


class Turns:
    """Gives the turn to one task after the other.

    ``more`` is called when no task is due before ``until_s``: it must move ``until_s`` on, and may
    rouse tasks.
    """

    def __init__(self, more: Callable[[], None]) -> None:
        self.now_s = self.until_s = 0.0
        self._more = more
        self._due: list[tuple[float, int, int, Any]] = []
        self._count = 0
        self.current = Task("main")
        self._nobody = Task("nobody")

    def clock_s(self) -> float:
        """Return the time; others have their turn if they are due by then."""
        self.pass_time(TICK_S)
        return self.now_s

    def pass_time(self, seconds: float) -> None:
        """Let the current task use up time."""
        self.now_s += seconds
        if self.now_s >= self.until_s or (self._due and self._due[0][0] <= self.now_s):
            self.park(self.now_s)

    def park(self, until_s: float | None) -> bool:
        """Stop the current task until it is roused or a time has come; return whether it was."""
        me = self.current
        me.token += 1
        me.roused = False
        if until_s is not None:
            self._push(until_s, me)
        self._switch(me)
        return me.roused

    def rouse(self, task: Task) -> None:
        """Make a parked task due at once."""
        if not task.roused and not task.done and task is not self.current:
            task.roused = True
            task.token += 1
            self._push(self.now_s, task)

    def spawn(self, run: Callable[[], None], name: str) -> Task:
        """Start a task; it is due at once, and runs when the current one parks."""
        task = Task(name)
        self._push(self.now_s, task)
        _start_real_thread(self._carry, (task, run))
        return task

    def end(self, task: Task) -> None:
        """Note the end of a task, for those that wait for it."""
        task.done = True
        for each in task.ended:
            self.rouse(each)

    def join(self, task: Task, until_s: float | None) -> None:
        """Wait for the end of a task."""
        while not task.done and (until_s is None or self.now_s < until_s):
            task.ended.append(self.current)
            self.park(until_s)

    def _carry(self, task: Task, run: Callable[[], None]) -> None:
        task.gate.acquire()
        try:
            run()
        finally:
            self.end(task)
            self._pass_on()

    def call_at(self, time_s: float, call: Callable[[], None]) -> None:
        """Call a function when the time has come, between the turns of the tasks."""
        self._count += 1
        heapq.heappush(self._due, (time_s, self._count, _CALL, call))

    def _push(self, time_s: float, task: Task) -> None:
        self._count += 1
        heapq.heappush(self._due, (time_s, self._count, task.token, task))

    def _next(self) -> Task:
        # The task that parked last may be roused too, by what ``more`` brings.
        self.current = self._nobody
        while True:
            while self._due and self._due[0][0] <= self.until_s:
                time_s, _, token, task = heapq.heappop(self._due)
                if token == _CALL:
                    self.now_s = max(self.now_s, time_s)
                    task()
                elif token == task.token and not task.done:
                    self.now_s = max(self.now_s, time_s)
                    found: Task = task
                    return found
            self.now_s = max(self.now_s, self.until_s)
            self._more()

    def _switch(self, me: Task) -> None:
        self.current = task = self._next()
        if task is not me:
            task.gate.release()
            me.gate.acquire()

    def _pass_on(self) -> None:
        self.current = task = self._next()
        task.gate.release()


class Lock:
    """A lock whose waiters are served in the order of their coming."""

    turns: Turns

    def __init__(self) -> None:
        self._held = False
        self._waiting: list[Task] = []

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """Take the lock; return whether it was free in time."""
        turns = self.turns
        if not self._held:
            self._held = True
            return True
        if not blocking:
            turns.pass_time(TICK_S)
            return False
        until_s = None if timeout is None or timeout < 0 else turns.now_s + timeout
        me = turns.current
        self._waiting.append(me)
        # Who releases it hands it over: it stays held.
        if turns.park(until_s):
            return True
        self._waiting.remove(me)
        return False

    __enter__ = acquire

    def release(self) -> None:
        """Give the lock to the first who waits."""
        if not self._held:
            raise RuntimeError("release unlocked lock")
        if self._waiting:
            self.turns.rouse(self._waiting.pop(0))
        else:
            self._held = False

    def __exit__(self, *_: object) -> None:
        self.release()

    def locked(self) -> bool:
        """Return whether somebody holds it."""
        return self._held

    def _at_fork_reinit(self) -> None:
        self.__init__()  # type: ignore[misc]

    acquire_lock, release_lock, locked_lock = acquire, release, locked


def install(turns: Turns) -> None:
    """Let Python's clocks, threads and locks use these turns."""
    Lock.turns = turns
    _install_clocks(turns)
    _install_threads(turns)
    thread: Any = _thread
    thread.allocate_lock = thread.allocate = Lock
    thread.LockType = Lock
    changes: Any = threading
    changes.Lock = changes._allocate_lock = Lock
    # The lock of C would not give its turn away; Python has one of its own above a plain lock.
    changes._CRLock = None
    changes.RLock = changes._RLock
    changes._time = time.monotonic
    changes._active_limbo_lock = threading.RLock()
    queue.time = time.monotonic  # type: ignore[attr-defined]
    queue.SimpleQueue = queue._PySimpleQueue  # type: ignore[attr-defined, misc]
    changes = signal
    changes.pause = lambda: turns.park(None)
    # It wants a real socket, and tells asyncio of signals that no flight has.
    changes.set_wakeup_fd = lambda *_, **__: -1
    for name in ("alarm", "setitimer", "sigwait", "sigwaitinfo", "sigtimedwait"):
        setattr(changes, name, refusing(f"calls signal.{name}", "threading.Timer"))


class Clocks:
    """The functions of ``time`` that read a clock.

    They are methods: a function that a program keeps in a class would become a method of its
    objects there, as ``time.localtime`` in ``logging.Formatter``, and those of C do not.
    """

    def __init__(self, turns: Turns) -> None:
        self._turns = turns
        self._gmtime, self._localtime = time.gmtime, time.localtime
        self._asctime, self._strftime = time.asctime, time.strftime
        self.monotonic = self.perf_counter = self.process_time = self.thread_time = turns.clock_s

    def time(self) -> float:
        return EPOCH_S + self._turns.clock_s()

    def time_ns(self) -> int:
        return round(1e9 * EPOCH_S) + self.monotonic_ns()

    def monotonic_ns(self) -> int:
        return round(1e9 * self._turns.clock_s())

    perf_counter_ns = process_time_ns = thread_time_ns = monotonic_ns

    def clock_gettime(self, clock: int) -> float:
        return self.time() if clock == time.CLOCK_REALTIME else self._turns.clock_s()

    def clock_gettime_ns(self, clock: int) -> int:
        return self.time_ns() if clock == time.CLOCK_REALTIME else self.monotonic_ns()

    def gmtime(self, seconds: float | None = None) -> Any:
        return self._gmtime(self.time() if seconds is None else seconds)

    def localtime(self, seconds: float | None = None) -> Any:
        return self._localtime(self.time() if seconds is None else seconds)

    def ctime(self, seconds: float | None = None) -> str:
        return self._asctime(self.localtime(seconds))

    def asctime(self, moment: Any = None) -> str:
        return self._asctime(moment or self.localtime())

    def strftime(self, form: str, moment: Any = None) -> str:
        return self._strftime(form, moment or self.localtime())

    def sleep(self, seconds: float) -> None:
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")
        self._turns.park(self._turns.now_s + max(seconds, TICK_S))


def _install_clocks(turns: Turns) -> None:
    clocks = Clocks(turns)
    for name in dir(clocks):
        if name[0] != "_":
            setattr(time, name, getattr(clocks, name))
    changes: Any = os
    kind: Any = os.times_result
    changes.times = lambda: kind((turns.clock_s(), 0.0, 0.0, 0.0, turns.now_s))


def change_datetime(module: Any) -> None:
    """Let ``datetime`` read the flight's clock: its type in C reads that of the system."""
    real: Any = module.datetime

    class Kind(type):
        """Takes what C makes for an object of the class that the program knows."""

        def __instancecheck__(cls, value: object) -> bool:
            return isinstance(value, real) if cls is Datetime else super().__instancecheck__(value)

    class Datetime(real, metaclass=Kind):  # type: ignore[misc]
        """A date and a time."""

        @classmethod
        def now(cls, tz: Any = None) -> Any:
            return cls.fromtimestamp(time.time(), tz)

        @classmethod
        def utcnow(cls) -> Any:
            return cls.now(module.timezone.utc).replace(tzinfo=None)

    Datetime.__module__, Datetime.__name__, Datetime.__qualname__ = 3 * ("datetime",)
    module.datetime = Datetime


def refusing(what: str, instead: str) -> Callable[..., Any]:
    """Return a function that raises, in place of what cannot run in the flight's time."""

    def refuse(*_: Any, **__: Any) -> Any:
        raise RuntimeError(
            f"the program {what}, which cannot run in the flight's time; use {instead}"
        )

    return refuse


def _install_threads(turns: Turns) -> None:
    changes: Any = threading.Thread

    def start_new_thread(run: Any, arguments: Any = (), options: Any = None, **_: Any) -> int:
        turns.spawn(lambda: run(*arguments, **(options or {})), "thread")
        return id(run)

    def start(self: Any) -> None:
        if getattr(self, "_garl_task", None) is not None:
            raise RuntimeError("threads can only be started once")
        with threading._active_limbo_lock:  # type: ignore[attr-defined]
            threading._limbo[self] = self  # type: ignore[attr-defined]
        self._garl_task = turns.spawn(self._bootstrap, self.name)
        self._started.wait()

    def join(self: Any, timeout: float | None = None) -> None:
        task = getattr(self, "_garl_task", None)
        if task is None and self is not threading.main_thread():
            raise RuntimeError("cannot join thread before it is started")
        if task is turns.current or task is None:
            raise RuntimeError("cannot join current thread")
        turns.join(task, None if timeout is None else turns.now_s + max(timeout, 0.0))

    def is_alive(self: Any) -> bool:
        task = getattr(self, "_garl_task", None)
        return (self is threading.main_thread()) if task is None else not task.done

    changes.start, changes.join, changes.is_alive = start, join, is_alive
    _thread.start_new_thread = start_new_thread
    threading._start_new_thread = start_new_thread  # type: ignore[attr-defined]
