from __future__ import annotations

import gc
import subprocess
import sys
import weakref
from pathlib import Path

import pytest

from pytest_garl.execution import worker


def test_worker_imports_neither_pymoo_nor_torch_nor_pytest() -> None:
    code = (
        "import sys\n"
        "import pytest_garl.execution.worker, pytest_garl.execution.job\n"
        "import pytest_garl.simulation.fly\n"
        "import landing_systems.opencv_mls\n"
        "print(sorted({'pymoo', 'torch', 'hypothesis', 'scipy', 'pytest'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


class Pictures:
    """Some 100 MB in a cycle, in pieces that lie between others."""

    def __init__(self) -> None:
        self.itself = self
        self.pieces = [b"." * (100_000 + number) for number in range(1000)]
        self.between = [bytearray(1000) for _ in range(1000)]


def resident_mb() -> float:
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024


def test_memory_that_a_flight_leaves_in_cycles_goes_back_to_the_system_if_it_is_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # What other tests have freed goes back first, or the pictures would lie there.
    monkeypatch.setattr(worker, "MOST_KEPT_BYTES", 0)
    worker.give_back_memory()
    monkeypatch.setattr(worker, "MOST_KEPT_BYTES", 2**20 * resident_mb() + 30 * 2**20)
    gc.disable()
    try:
        before, pictures = resident_mb(), Pictures()
        left = weakref.ref(pictures)
        del pictures
        assert left() is not None
        assert resident_mb() > before + 50
        worker.give_back_memory()
        assert left() is None
        assert resident_mb() < before + 20
    finally:
        gc.enable()
