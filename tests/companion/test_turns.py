"""Python's clocks, threads, locks and loops in simulated time."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.companion.processes import gradient, running


def test_clocks_tell_the_flights_time_and_sleep_waits_for_it(tmp_path: Path) -> None:
    text = """
        import time, datetime
        began = time.monotonic()
        time.sleep(0.5)
        print("slept %.2f %.2f" % (time.monotonic() - began, time.perf_counter() - began))
        print(time.strftime("%Y", time.gmtime()), time.time() > 1.6e9, time.time_ns() > 1e18)
        last = time.time()
        print(all(time.time() > last for _ in range(5)))
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(0.45).printed == ""
        assert simulator.fly(0.2).printed == "slept 0.50 0.50\n2023 True True\nTrue\n"
        assert simulator.answer is not None
        assert simulator.answer.status == 0


def test_threads_take_turns_in_the_order_of_their_times(tmp_path: Path) -> None:
    text = """
        import threading, time
        def work(name, every):
            for _ in range(3):
                time.sleep(every)
                print(name, "%.2f" % time.monotonic())
        threads = [threading.Thread(target=work, args=pair) for pair in (("a", 0.2), ("b", 0.25))]
        for each in threads: each.start()
        print(threads[0].is_alive(), threading.active_count())
        for each in threads: each.join()
        print("joined %.2f" % time.monotonic(), threads[0].is_alive())
    """
    with running(tmp_path, text) as simulator:
        printed = simulator.fly(1.2).printed
    assert printed.splitlines() == [
        "True 3",
        "a 0.20",
        "b 0.25",
        "a 0.40",
        "b 0.50",
        "a 0.60",
        "b 0.75",
        "joined 0.75 False",
    ]


def test_locks_events_and_queues_hand_over_in_order(tmp_path: Path) -> None:
    text = """
        import queue, threading, time
        lock, event, jobs = threading.Lock(), threading.Event(), queue.Queue(maxsize=1)
        def hold(number):
            with lock:
                print("holds", number)
                time.sleep(0.1)
        def consume():
            while (job := jobs.get()) is not None:
                print("job", job, "%.1f" % time.monotonic())
            event.set()
        for number in range(3): threading.Thread(target=hold, args=(number,)).start()
        threading.Thread(target=consume, daemon=True).start()
        for job in (1, 2, None):
            time.sleep(0.2)
            jobs.put(job)
        print(event.wait(5), lock.acquire(timeout=0.1), lock.acquire(timeout=0.1))
        print("%.1f" % time.monotonic())
        condition = threading.Condition()
        with condition:
            print(condition.wait(0.2), threading.Semaphore(0).acquire(timeout=0.1))
        simple = queue.SimpleQueue()
        simple.put(1)
        print(simple.get())
    """
    with running(tmp_path, text) as simulator:
        printed = simulator.fly(2).printed
    assert printed.splitlines() == [
        "holds 0",
        "holds 1",
        "holds 2",
        "job 1 0.2",
        "job 2 0.4",
        "True True False",
        "0.7",
        "False False",
        "1",
    ]


def test_asyncio_waits_in_the_flights_time_with_executors_too(tmp_path: Path) -> None:
    text = """
        import asyncio, time
        async def tick(name, every):
            for _ in range(2):
                await asyncio.sleep(every)
                print(name, "%.2f" % asyncio.get_running_loop().time())
        def work():
            time.sleep(0.35)
            return 5
        async def main():
            await asyncio.gather(tick("a", 0.1), tick("b", 0.15))
            print(await asyncio.get_running_loop().run_in_executor(None, work))
            try:
                await asyncio.wait_for(asyncio.Event().wait(), 0.1)
            except asyncio.TimeoutError:
                print("%.1f" % time.monotonic())
        asyncio.run(main())
    """
    with running(tmp_path, text) as simulator:
        printed = simulator.fly(2).printed
    assert printed.splitlines() == ["a 0.10", "b 0.15", "a 0.20", "b 0.30", "5", "0.8"]


def test_random_numbers_and_the_order_of_sets_are_the_same_in_each_process(tmp_path: Path) -> None:
    text = """
        import os, random, secrets, uuid
        import numpy
        print(random.random(), uuid.uuid4(), os.urandom(4), {"a", "b", "c"}, numpy.random.rand())
        random.seed()
        print(random.random(), random.Random().random(), random.SystemRandom().random())
        print(secrets.token_hex(), numpy.random.default_rng().random())
    """
    printed = []
    for _ in range(2):
        with running(tmp_path, text) as simulator:
            printed.append(simulator.fly(0.1).printed)
    assert printed[0] == printed[1] != ""


def test_nothing_that_reads_a_clock_is_loaded_before_the_program(tmp_path: Path) -> None:
    """What is loaded before keeps real clocks and locks, and shifts when the program begins."""
    text = """
        import sys
        print({"asyncio", "concurrent.futures", "datetime", "logging"} & {*sys.modules})
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(0.1).printed == "set()\n"


def test_a_loop_that_polls_the_clock_ends(tmp_path: Path) -> None:
    text = """
        import time, threading
        done = []
        threading.Timer(0.05, lambda: done.append(1)).start()
        while time.time() < 1_700_000_000.1: pass
        print(done)
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(0.3).printed == "[1]\n"


def test_an_error_is_told_with_its_line_and_the_status_of_an_exit(tmp_path: Path) -> None:
    with running(tmp_path, "def f():\n    return {}['id']\nf()\n") as simulator:
        simulator.fly(0.1)
        assert simulator.failure == "KeyError: 'id'"
        assert simulator.answer is not None
        assert simulator.answer.failure is not None
        assert simulator.answer.failure["line"] == "lander.py, line 2"
        assert simulator.answer.failure["where"] == "lander.f"
        assert "start.py" not in simulator.answer.failure["trace"]
    with running(tmp_path, "import sys\nsys.exit('no camera')\n") as simulator:
        simulator.fly(0.1)
        assert simulator.answer is not None
        assert (simulator.answer.status, simulator.printed) == (1, "no camera")


def test_another_program_runs_at_one_moment_of_the_flight(tmp_path: Path) -> None:
    text = """
        import subprocess, time
        print(subprocess.run(["echo", "out"], capture_output=True, text=True).stdout.strip())
        began = time.monotonic()
        child = subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        print(child.communicate(b"in")[0], child.returncode, time.monotonic() - began < 0.1)
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(0.3).printed == "out\nb'in' 0 True\n"


def test_a_python_program_that_it_starts_runs_in_the_same_time(tmp_path: Path) -> None:
    (tmp_path / "child.py").write_text(
        "import sys, time, cv2\n"
        "from socket import socket, AF_INET, SOCK_DGRAM\n"
        "print('child', sys.argv[1], '%.2f' % time.monotonic())\n"
        "image = cv2.VideoCapture(0).read()[1]\n"
        "time.sleep(0.3)\n"
        "socket(AF_INET, SOCK_DGRAM).sendto(b'hello', ('127.0.0.1', 14550))\n"
        "print('saw', image[5, 0, 0], '%.2f' % time.monotonic())\n"
        "sys.exit(3)\n"
    )
    text = """
        import subprocess, sys, time
        time.sleep(0.1)
        command = [sys.executable, "-u", "child.py", "a"]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        print(child.poll(), child.stdout.readline().strip())
        for line in child.stdout:
            print(line.strip(), "%.1f" % time.monotonic())
        print(child.wait(), child.poll())
        endless = subprocess.Popen("python child.py b", shell=True)
        try:
            endless.wait(0.1)
        except subprocess.TimeoutExpired:
            endless.kill()
        print(endless.wait())
    """
    with running(tmp_path, text) as simulator:
        simulator.picture = gradient
        simulator.fly(1.0, frames=True)
        assert simulator.failure == ""
        assert simulator.printed.splitlines() == [
            "None child a 0.10",
            "saw 5 0.40 0.4",
            "3 3",
            "child b 0.42",
            "-9",
        ]
        assert simulator.sent == b"hello"


def test_threads_that_are_no_daemons_run_on_and_functions_at_exit_are_called(
    tmp_path: Path,
) -> None:
    text = """
        import atexit, threading, time
        atexit.register(lambda: print("at exit %.1f" % time.monotonic()))
        threading.Timer(0.3, lambda: print("late")).start()
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(1).printed == "late\nat exit 0.3\n"


IN_THE_FLIGHTS_TIME: dict[str, tuple[str, str]] = {
    "datetime": (
        """
        import datetime, pickle
        from datetime import date, datetime as when, timedelta, timezone
        time.sleep(0.5)
        moments = when.now(), when.utcnow(), when.today(), when.now(timezone.utc)
        print({each.strftime("%F %T") for each in moments}, date.today())
        later = pickle.loads(pickle.dumps(moments[0])) + timedelta(hours=1)
        print(isinstance(later, when), isinstance(later, date), isinstance(date.today(), when))
        class Mine(when): pass
        print(isinstance(Mine.now(), Mine), isinstance(later, Mine), issubclass(Mine, when))
        """,
        "{'2023-11-14 22:13:20'} 2023-11-14\nTrue True False\nTrue False True",
    ),
    "time": (
        """
        import os
        time.sleep(0.5)
        real = time.CLOCK_REALTIME, time.CLOCK_MONOTONIC
        counts = [f() for f in (time.time_ns, time.monotonic_ns, time.perf_counter_ns)]
        counts += [f() for f in (time.process_time_ns, time.thread_time_ns)]
        counts += [time.clock_gettime_ns(each) for each in real]
        seconds = [time.clock_gettime(each) for each in real] + [os.times().elapsed]
        seconds += [time.time(), time.perf_counter(), time.process_time(), time.thread_time()]
        print({round(each / 1e9 % 100, 1) for each in counts})
        print({round(each % 100, 1) for each in seconds})
        print({time.ctime(), time.asctime(), time.strftime("%a %b %d %T %Y")})
        print({time.localtime()[:5], time.gmtime()[:5], time.localtime(1.7e9)[:5]})
        """,
        "{0.5}\n{0.5}\n{'Tue Nov 14 22:13:20 2023'}\n{(2023, 11, 14, 22, 13)}",
    ),
    "a clock in a class": (
        """
        import logging, sys
        class Rate:
            clock, sleep = time.time, time.sleep
        Rate().sleep(0.5)
        print("%.1f" % (Rate().clock() % 100))
        logging.basicConfig(format="%(asctime)s %(message)s", stream=sys.stdout)
        logging.warning("late")
        """,
        "0.5\n2023-11-14 22:13:20,500 late",
    ),
    "timeouts": (
        """
        import asyncio, queue, sched, threading
        def say(*what): print(*what, "%.1f" % time.monotonic())
        threading.Timer(0.1, say, ("timer",)).start()
        say(threading.Event().wait(0.2))
        for each in (queue.Queue(), queue.SimpleQueue()):
            try: each.get(timeout=0.1)
            except queue.Empty: say("empty")
        barrier = threading.Barrier(2)
        threading.Timer(0.1, barrier.wait).start()
        barrier.wait()
        plan = sched.scheduler()
        plan.enter(0.1, 1, say, ("plan",))
        plan.run()
        async def main():
            try: await asyncio.wait_for(asyncio.sleep(9), 0.1)
            except asyncio.TimeoutError: say("over")
            await asyncio.to_thread(time.sleep, 0.1)
            await asyncio.wait([asyncio.ensure_future(asyncio.sleep(9))], timeout=0.1)
            say("waited")
        asyncio.run(main())
        """,
        "timer 0.1\nFalse 0.2\nempty 0.3\nempty 0.4\nplan 0.6\nover 0.7\nwaited 0.9",
    ),
    "select, poll and epoll": (
        """
        import select, selectors, socket
        def say(found): print(bool(found), "%.1f" % time.monotonic())
        one, other = socket.socketpair()
        waits = select.poll()
        waits.register(one, select.POLLIN)
        say(waits.poll(100))
        with select.epoll() as epoll:
            epoll.register(one.fileno(), select.EPOLLIN)
            say(epoll.poll(0.1))
            say(select.select([one], [], [], 0.1)[0])
            for kind in (selectors.DefaultSelector, selectors.SelectSelector):
                selector = kind()
                selector.register(one, selectors.EVENT_READ)
                say(selector.select(0.1))
            other.send(b"x")
            say(epoll.poll(1, maxevents=1) == [(one.fileno(), select.EPOLLIN)])
        """,
        "False 0.1\nFalse 0.2\nFalse 0.3\nFalse 0.4\nFalse 0.5\nTrue 0.5",
    ),
    "pipes and pools of threads": (
        """
        import multiprocessing, os, queue, select, threading
        from multiprocessing.pool import ThreadPool
        end, other = os.pipe()
        threading.Timer(0.1, os.write, (other, b"x")).start()
        print(select.select([end], [], [], 1)[0] == [end], "%.1f" % time.monotonic())
        threading.Timer(0.1, os.write, (other, b"y")).start()
        print(os.read(end, 1), os.read(end, 1), "%.1f" % time.monotonic())
        with ThreadPool(2) as pool:
            print(pool.map(lambda each: (time.sleep(0.1), each)[1], [1, 2, 3]))
        mail = multiprocessing.Queue()
        try: mail.get(timeout=0.1)
        except queue.Empty: print("%.1f" % time.monotonic())
        """,
        "True 0.1\nb'x' b'y' 0.2\n[1, 2, 3]\n0.5",
    ),
    "a loop with handlers of signals and another program": (
        """
        import asyncio, signal
        async def main():
            asyncio.get_running_loop().add_signal_handler(signal.SIGINT, print)
            pipe = asyncio.subprocess.PIPE
            child = await asyncio.create_subprocess_exec("echo", "out", stdout=pipe)
            print((await child.communicate())[0], await child.wait())
        asyncio.run(main())
        """,
        "b'out\\n' 0",
    ),
}


@pytest.mark.parametrize("case", IN_THE_FLIGHTS_TIME)
def test_it_runs_in_the_flights_time(tmp_path: Path, case: str) -> None:
    text, expected = IN_THE_FLIGHTS_TIME[case]
    with running(tmp_path, f"        import time{text}") as simulator:
        printed = simulator.fly(1.2).printed
        assert simulator.failure == ""
    assert printed.strip() == expected


REFUSED = {
    "os.fork": "import os\nos.fork()",
    "os.execv": "import os\nos.execvp('ls', ['ls'])",
    "signal.alarm": "import signal\nsignal.alarm(1)",
    "signal.setitimer": "import signal\nsignal.setitimer(signal.ITIMER_REAL, 1)",
    "signal.sigwait": "import signal\nsignal.sigwait({signal.SIGINT})",
    "multiprocessing's Process.start": "from multiprocessing import get_context as g\n"
    "g('spawn').Process(target=print).start()",
    "multiprocessing's Process.start, in a pool": "import multiprocessing as m\nm.Pool(1)",
    "multiprocessing's Process.start, in an executor": "import concurrent.futures as c\n"
    "c.ProcessPoolExecutor(1).submit(print)",
    "multiprocessing's SharedMemory": "from multiprocessing.shared_memory import SharedMemory\n"
    "SharedMemory(create=True, size=9)",
    "a Python program by asyncio": "import asyncio\n"
    "asyncio.run(asyncio.create_subprocess_exec('python', 'lander.py'))",
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_has_no_place_in_the_flights_time_is_refused_with_its_line(
    tmp_path: Path, what: str
) -> None:
    with running(tmp_path, REFUSED[what]) as simulator:
        simulator.fly(0.2)
        assert what.partition(",")[0] in simulator.failure
        assert "which cannot run in the flight's time; use" in simulator.failure
        assert simulator.answer is not None
        assert simulator.answer.failure is not None
        assert simulator.answer.failure["line"] == "lander.py, line 2"
