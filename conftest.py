"""Pytest configuration of this repository: the plugin is tested with ``pytester``."""

from __future__ import annotations

import importlib
import os
import signal

from pytest_garl import cpu_dispatch

# Before a test module loads NumPy: what is flown inside pytest is flown as in a child.
cpu_dispatch.pin()
# ``pytester`` forgets modules that a test loads, and NumPy cannot be loaded twice in a process.
importlib.import_module("numpy")

pytest_plugins = ["pytester"]

# Where CI is set a search writes patches instead of cases, and pytest prints its summary
# otherwise; the sessions that the tests start are a developer's, but for those that set it.
for name in ("CI", "BUILD_NUMBER"):
    os.environ.pop(name, None)

# A session in the background of a shell ignores Ctrl-C, and so would those that tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
