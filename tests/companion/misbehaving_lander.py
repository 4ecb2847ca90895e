"""A companion program that does the one thing that its argument names, and then lands.

What returns a number flies at that speed instead.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from pymavlink import mavutil

link = mavutil.mavlink_connection("udp:0.0.0.0:14550")


def spins() -> None:
    while True:
        pass


def waits_in_c() -> None:
    while True:
        ctypes.CDLL(None).sleep(71)


def stops() -> None:
    os.kill(os.getpid(), signal.SIGSTOP)


def floods_stdout() -> None:
    while True:
        sys.stdout.write("x" * 10_000)


def floods_stderr() -> None:
    while True:
        os.write(2, bytes(10_000))


def floods_the_link() -> None:
    while True:
        link.port.sendto(bytes(60_000), ("127.0.0.1", 14550))


def kills_its_parent() -> None:
    os.kill(os.getppid(), signal.SIGKILL)


def kills_its_group() -> None:
    os.killpg(0, signal.SIGKILL)


def exits() -> None:
    sys.exit(3)


def exits_at_once() -> None:
    os._exit(0)


def reads_address_0() -> None:
    ctypes.string_at(0)


def closes_all_files() -> None:
    os.closerange(0, 256)
    time.sleep(1)


def forks() -> None:
    os.fork()


def eats_memory() -> None:
    eaten = []
    while True:
        eaten.append(bytes(2**28))


def raises() -> None:
    raise ZeroDivisionError


def recurses() -> None:
    recurses()


def wants_a_package() -> None:
    import picamera2  # type: ignore[import-not-found]

    picamera2.start()


def opens_a_window() -> None:
    import cv2
    import numpy as np

    cv2.imshow("frame", np.zeros((9, 9), np.uint8))


def sends_nan() -> None:
    place = float("nan"), 0.0, 0.0
    link.mav.set_position_target_local_ned_send(0, 1, 1, 1, 0xDF8, *place, *[0.0] * 8)
    time.sleep(1)


def writes_into_open_files() -> None:
    for number in range(3, 256):
        try:
            os.write(number, b"garbage" * 99)
        except OSError:
            continue
    time.sleep(1)


def ignores_signals() -> None:
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)


def patches_its_clock() -> None:
    time.time = time.monotonic = lambda: 0.0


def deletes_its_folder() -> None:
    os.chdir(tempfile.mkdtemp())
    shutil.rmtree(Path.cwd())


def sends_garbage() -> None:
    # Without the first byte of a message, after which the vehicle would wait for the rest of one.
    link.port.sendto(bytes(range(250)) * 9, ("127.0.0.1", 14550))


def prints_no_utf8() -> None:
    sys.stdout.buffer.write(b"\xff\xfe\n")
    os.write(1, b"\xff\xfe\n")
    sys.stdout.write("\udcff")


def raises_in_a_thread() -> None:
    threading.Thread(target=raises).start()


def leaves_threads() -> None:
    for _ in range(50):
        threading.Thread(target=time.sleep, args=(71.5,), daemon=True).start()


def leaves_a_daemon() -> None:
    subprocess.Popen(["sleep", "71.5"], start_new_session=True)


def leaves_nothing() -> None:
    return


def reads_a_clock_in_c() -> float:
    now = (ctypes.c_long * 2)()
    ctypes.CDLL(None).clock_gettime(0, now)
    return now[1] / 1e9


def hears_a_native_thread() -> float:
    heard: list[int] = []
    kind = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)
    call, thread = kind(lambda _: heard.append(1)), ctypes.c_ulong()
    ctypes.CDLL(None).pthread_create(ctypes.byref(thread), None, call, None)
    count = 0
    while not heard:
        count += 1
    return count % 9973 / 9973


def hashes() -> float:
    return hash("a") % 9973 / 9973


link.wait_heartbeat()
speed = globals()[sys.argv[1]]()
if speed is None:
    link.set_mode("LAND")
else:
    link.mav.set_position_target_local_ned_send(
        0, 1, 1, 1, 0xDC7, *[0.0] * 3, speed, 0.0, 0.0, *[0.0] * 5
    )
    time.sleep(9)
