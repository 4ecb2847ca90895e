from __future__ import annotations

import subprocess
import sys


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
