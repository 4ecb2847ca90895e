"""Take from every Python that starts what Windows does not have: a test cannot run there.

Put this folder on PYTHONPATH.
"""

import os
import signal
import sys
from typing import Any

modules: dict[str, Any] = sys.modules
for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    modules[name] = None
for module, names in (
    (signal, ("SIGRTMAX", "SIGALRM", "SIGUSR1", "SIGUSR2", "setitimer", "getitimer")),
    (os, ("fork", "killpg", "memfd_create", "pidfd_open", "sched_getaffinity", "setsid", "waitid")),
):
    for name in names:
        vars(module).pop(name, None)
