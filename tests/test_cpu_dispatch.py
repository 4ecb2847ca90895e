from __future__ import annotations

import importlib.util
import os
import platform
import subprocess
import sys

import pytest

from pytest_garl import cpu_dispatch

OLD = frozenset({"sse2", "avx"})
AVX2 = frozenset({"avx", "avx2", "fma", "f16c", "bmi1", "bmi2", "movbe", "abm"})
SKYLAKE = AVX2 | {"avx512f", "avx512cd", "avx512vl", "avx512bw", "avx512dq"}
ICE_LAKE = (
    SKYLAKE
    | {"avx512ifma", "avx512vbmi", "avx512_vbmi2", "avx512_bitalg"}
    | {
        "avx512_vnni",
        "avx512_vpopcntdq",
    }
)
ABOVE_AVX2 = cpu_dispatch.environment().get("NPY_DISABLE_CPU_FEATURES", "")
"""What this machine's NumPy would choose above the baseline."""
needs_avx2 = pytest.mark.skipif(not cpu_dispatch.has_baseline(), reason="this CPU has no AVX2")


def cpu(monkeypatch: pytest.MonkeyPatch, flags: frozenset[str], machine: str = "x86_64") -> None:
    monkeypatch.setattr(cpu_dispatch, "_flags", lambda: flags)
    monkeypatch.setattr(platform, "machine", lambda: machine)


@pytest.mark.parametrize(
    ("flags", "numpy", "opencv"),
    [
        (AVX2, "", ""),
        (SKYLAKE, "X86_V4", "AVX512-SKX"),
        (ICE_LAKE, "X86_V4 AVX512_ICL", "AVX512-SKX"),
        (ICE_LAKE | {"avx512_fp16"}, "X86_V4 AVX512_ICL AVX512_SPR", "AVX512-SKX"),
    ],
)
def test_only_features_of_the_cpu_are_switched_off(
    flags: frozenset[str], numpy: str, opencv: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    cpu(monkeypatch, flags)
    monkeypatch.setattr("importlib.metadata.version", lambda name: "2.4.6")
    found = cpu_dispatch.environment()
    assert found["NPY_DISABLE_CPU_FEATURES"] == numpy
    assert found["OPENCV_CPU_DISABLE"] == opencv
    assert found["OPENBLAS_CORETYPE"] == "Haswell"


def test_numpy_before_2_4_names_its_groups_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    cpu(monkeypatch, SKYLAKE)
    monkeypatch.setattr("importlib.metadata.version", lambda name: "2.3.5")
    names = cpu_dispatch.environment()["NPY_DISABLE_CPU_FEATURES"]
    assert names == "AVX512F AVX512CD AVX512_SKX"


@pytest.mark.parametrize(("flags", "machine"), [(OLD, "x86_64"), (AVX2, "aarch64")])
def test_a_machine_without_avx2_is_left_as_it_is(
    flags: frozenset[str], machine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    cpu(monkeypatch, flags, machine)
    assert cpu_dispatch.environment().keys() == {*cpu_dispatch.THREADS, "GLIBC_TUNABLES"}
    assert cpu_dispatch.expected() != cpu_dispatch.BASELINE
    assert not cpu_dispatch.libraries_off_baseline()
    cpu_dispatch.check()


@needs_avx2
def test_this_process_flies_by_the_baseline() -> None:
    import cv2  # noqa: F401 (loaded to be looked at)
    import numpy  # noqa: F401

    assert cpu_dispatch.pin()
    assert cpu_dispatch.dispatched() == cpu_dispatch.expected() == cpu_dispatch.BASELINE
    cpu_dispatch.check()


@needs_avx2
@pytest.mark.parametrize(
    ("outside", "found"),
    [
        ({"OPENBLAS_CORETYPE": "Nehalem"}, "with kernels for nehalem"),
        ({"NPY_DISABLE_CPU_FEATURES": f"X86_V3 {ABOVE_AVX2}"}, "numpy with base"),
        ({"OPENCV_CPU_DISABLE": "AVX512-SKX,AVX2"}, "opencv with base"),
    ],
)
def test_a_library_loaded_too_early_is_named(outside: dict[str, str], found: str) -> None:
    code = (
        "import cv2\n"
        "from pytest_garl import cpu_dispatch, errors\n"
        "assert not cpu_dispatch.pin()\n"
        "try:\n    cpu_dispatch.check()\n"
        "except errors.DispatchError as error:\n    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **cpu_dispatch.environment(), **outside},
        capture_output=True,
        text=True,
        check=True,
    )
    assert found in done.stdout
    assert "expected x86_64-avx2-haswell" in done.stdout


@needs_avx2
def test_libraries_are_loaded_without_a_word() -> None:
    code = "from pytest_garl import cpu_dispatch; assert cpu_dispatch.pin()"
    code += "; import cv2, scipy.linalg; cpu_dispatch.check(); print(cpu_dispatch.dispatched())"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, "NPY_ENABLE_CPU_FEATURES": "X86_V3"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout, done.stderr) == ("x86_64-avx2-haswell\n", "")


def test_flying_processes_are_of_the_class_that_was_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cpu(monkeypatch, ICE_LAKE)
    assert cpu_dispatch.cpu_class_of_flights() == cpu_dispatch.BASELINE
    cpu(monkeypatch, OLD)
    assert cpu_dispatch.cpu_class_of_flights() == cpu_dispatch.dispatched()


@pytest.mark.long
@needs_avx2
@pytest.mark.skipif(importlib.util.find_spec("torch") is None, reason="PyTorch is not installed")
def test_training_computes_by_the_baseline() -> None:
    code = (
        "from pytest_garl.cli import main\n"
        "assert main.get_command(None, 'train')\n"
        "from pytest_garl import cpu_dispatch\n"
        "import pytest_garl.npcs.training.train, torch\n"
        "print(torch.backends.cpu.get_cpu_capability(), cpu_dispatch.dispatched())\n"
    )
    outside = {"ATEN_CPU_CAPABILITY": "default", "OPENBLAS_CORETYPE": "Nehalem"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **outside},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["AVX2", cpu_dispatch.BASELINE]


def test_tunables_of_the_user_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GLIBC_TUNABLES", "glibc.malloc.check=3")
    assert cpu_dispatch.environment()["GLIBC_TUNABLES"] == "glibc.malloc.check=3"
