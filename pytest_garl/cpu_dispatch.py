"""One baseline of CPU instructions for all that flies: asked for, and read back.

NumPy, OpenCV and OpenBLAS choose their code by the CPU they meet, and another choice rounds
differently, so that the same flight has other bytes on the next machine.  They read what they may
choose from the environment when they are loaded: a process that flies gets ``environment()``
before that, and ``check()`` looks afterwards at what they chose.
"""

from __future__ import annotations

import ctypes
import functools
import os
import platform
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pytest_garl.errors import DispatchError

BASELINE = "x86_64-avx2-haswell"
"""The class of every x86-64 machine with AVX2, and of nothing else."""
THREADS: Mapping[str, str] = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"), "1"
)
"""One flight is one thread."""
_TUNABLES, _HUGE_PAGES = "GLIBC_TUNABLES", "glibc.malloc.hugetlb=1"
"""A flight in huge pages takes 4 % less time.  Older C libraries do not know the word."""
_NEEDED = {"avx", "avx2", "fma", "f16c", "bmi1", "bmi2", "movbe", "abm"}
"""What a CPU must have for the baseline (x86-64-v3), as Linux calls it."""
_KERNELS = {
    "OPENBLAS_CORETYPE": "Haswell",
    "OPENCV_IPP": "avx2",
    "ATEN_CPU_CAPABILITY": "avx2",
    "ONEDNN_MAX_CPU_ISA": "AVX2",
    # The only kernels of MKL that CPUs of all makes are given.
    "MKL_CBWR": "COMPATIBLE",
    # NumPy takes no two lists.
    "NPY_ENABLE_CPU_FEATURES": "",
}
_WITH_512 = {"avx512f", "avx512cd", "avx512vl", "avx512bw", "avx512dq"}
_ICE_LAKE = {"avx512ifma", "avx512vbmi", "avx512_vbmi2", "avx512_bitalg", "avx512_vnni"} | {
    "avx512_vpopcntdq"
}
_NUMPY_GROUPS = {
    "X86_V4": _WITH_512,
    "AVX512_ICL": _WITH_512 | _ICE_LAKE,
    "AVX512_SPR": _WITH_512 | _ICE_LAKE | {"avx512_fp16"},
}
"""What NumPy 2.4 and later compile above the baseline, and by which flags they choose it."""
_NUMPY_GROUPS_THEN = {
    "AVX512F": {"avx512f"},
    "AVX512CD": {"avx512f", "avx512cd"},
    "AVX512_SKX": _WITH_512,
    "AVX512_CLX": _WITH_512 | {"avx512_vnni"},
    "AVX512_CNL": _WITH_512 | {"avx512ifma", "avx512vbmi"},
    "AVX512_ICL": _WITH_512 | _ICE_LAKE,
    "AVX512_SPR": _WITH_512 | _ICE_LAKE | {"avx512_fp16"},
}
"""The same of NumPy before 2.4."""
_ONLY_LOADED = 0x4
"""RTLD_NOLOAD of Linux: to look at a library is not to load it."""


def environment() -> dict[str, str]:
    """Return what a process must have in its environment before it loads what it flies with."""
    general = {**THREADS, _TUNABLES: os.environ.get(_TUNABLES, _HUGE_PAGES)}
    if not has_baseline():
        return general
    return {
        **general,
        **_KERNELS,
        # Only what this CPU has: of the rest NumPy and OpenCV would say that it is not there.
        "NPY_DISABLE_CPU_FEATURES": " ".join(_above_the_baseline()),
        "OPENCV_CPU_DISABLE": "AVX512-SKX" if _flags() >= _WITH_512 else "",
    }


def environment_of_programs() -> dict[str, str]:
    """Return what a program that flies gets: its own libraries may be of other versions.

    NumPy passes over names of instructions that it does not know.
    """
    groups = {**_NUMPY_GROUPS_THEN, **_NUMPY_GROUPS} if has_baseline() else {}
    known = " ".join(name for name, needed in groups.items() if _flags() >= needed)
    numpy = {"NPY_DISABLE_CPU_FEATURES": known} if known else {}
    return {**environment(), **numpy, "PYTHONHASHSEED": "0"}


def was_started_for_flights() -> bool:
    """Whether this process was started with that environment; asked before ``pin``."""
    return environment().items() <= os.environ.items()


def pin() -> bool:
    """Give this process that environment; return whether it flies by it.

    It does not where a library was loaded earlier and has chosen something else.
    """
    os.environ.update(environment())
    return not libraries_off_baseline()


def check() -> None:
    """Raise DispatchError where a library that is loaded has not chosen the baseline."""
    wrong = libraries_off_baseline()
    if wrong:
        raise DispatchError(
            f"this process would not fly as others do: found {', '.join(wrong)}, expected "
            f"{BASELINE} on one thread. The libraries read that from the environment when they are "
            "loaded: nothing may load them before pytest-garl sets it (look for a .pth file or "
            "sitecustomize.py that imports NumPy), and they must be builds that read it, as the "
            "wheels on PyPI do"
        )


def libraries_off_baseline() -> list[str]:
    """Return what is loaded and has chosen something else than the baseline, in words."""
    if not has_baseline():
        return []
    levels = {name: level for name, level in _levels() if level != "avx2"}
    wrong = [f"{name} with {level}" for name, level in levels.items()]
    for library in _openblas():
        core, threads = library.core, library.threads
        if core != "haswell":
            wrong.append(f"{library.name} with kernels for {core}")
        if threads != 1:
            wrong.append(f"{library.name} on {threads} threads")
    return wrong


def dispatched() -> str:
    """Name the class of machines on which equal flights have equal bytes: by what was chosen."""
    levels = dict(_levels())
    one = set(levels.values())
    words = [*one] if len(one) == 1 else [f"{name}_{level}" for name, level in levels.items()]
    cores = sorted({library.core for library in _openblas()})
    return "-".join([platform.machine(), *words, *cores])


def expected() -> str:
    """Name what this machine's flights will be flown by, before anything is loaded."""
    return BASELINE if has_baseline() else f"{platform.machine()} without AVX2"


def cpu_class_of_flights() -> str:
    """Return the CPU class of this machine's worker processes; this process's may differ."""
    return BASELINE if has_baseline() else dispatched()


def has_baseline() -> bool:
    """Whether this machine can fly by the baseline."""
    return platform.machine() == "x86_64" and _flags() >= _NEEDED


@functools.cache
def _flags() -> frozenset[str]:
    """Return what the CPU can do, as Linux says."""
    try:
        text = Path("/proc/cpuinfo").read_text(errors="replace")
    except OSError:
        return frozenset()
    found = re.search(r"^flags\s*:(.*)$", text, re.MULTILINE)
    return frozenset(found[1].split()) if found else frozenset()


def _above_the_baseline() -> list[str]:
    """Return the groups of instructions of the installed NumPy that this CPU has."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        numbers = [int(part) for part in version("numpy").split(".")[:2]]
    except (PackageNotFoundError, ValueError):
        numbers = [2, 4]
    groups = _NUMPY_GROUPS if numbers >= [2, 4] else _NUMPY_GROUPS_THEN
    return [name for name, needed in groups.items() if _flags() >= needed]


def _levels() -> Iterator[tuple[str, str]]:
    """Yield the instructions that each loaded library has chosen: avx512, avx2 or base."""
    numpy = sys.modules.get("numpy._core._multiarray_umath")
    if numpy is not None:
        yield "numpy", _numpy_level(numpy)
    cv2 = sys.modules.get("cv2")
    # A module that is being imported by another thread, or failed, has no functions yet.
    if cv2 is not None and hasattr(cv2, "getCPUFeaturesLine"):
        yield "opencv", _opencv_level(cv2.getCPUFeaturesLine())
        if cv2.ipp.useIPP():
            yield "ipp", _level(cv2.ipp.getIppVersion())
    torch = sys.modules.get("torch")
    if torch is not None and hasattr(torch, "backends"):
        yield "torch", torch.backends.cpu.get_cpu_capability().lower()


def _numpy_level(module: Any) -> str:
    there = {name for name in module.__cpu_dispatch__ if module.__cpu_features__.get(name)}
    there.update(module.__cpu_baseline__)
    if any(name.startswith(("AVX512", "X86_V4")) for name in there):
        return "avx512"
    return "avx2" if "X86_V3" in there or {"AVX2", "FMA3"} <= there else "base"


def _opencv_level(features: str) -> str:
    """Read OpenCV's list, in which "?" follows what the CPU lacks or what was switched off."""
    return _level(" ".join(word for word in features.split() if not word.endswith("?")))


def _level(text: str) -> str:
    for name in ("AVX-512", "AVX512", "AVX2"):
        if name in text:
            return name.replace("-", "").lower()
    return "base"


class _OpenBlas:
    """One of the OpenBLAS that are loaded: NumPy, SciPy and OpenCV each bring their own."""

    def __init__(self, path: str) -> None:
        self.name = Path(path).name
        library = ctypes.CDLL(path, mode=_ONLY_LOADED)
        self.core = _call(library, "get_corename", ctypes.c_char_p, b"unknown").decode().lower()
        self.threads = int(_call(library, "get_num_threads", ctypes.c_int, 1))


def _call(library: ctypes.CDLL, name: str, kind: Any, otherwise: Any) -> Any:
    for prefix in ("scipy_openblas_", "openblas_"):
        for suffix in ("64_", ""):
            function = getattr(library, f"{prefix}{name}{suffix}", None)
            if function is not None:
                function.restype = kind
                return function()
    return otherwise


def _openblas() -> list[_OpenBlas]:
    try:
        lines = Path("/proc/self/maps").read_text(errors="replace").splitlines()
    except OSError:
        return []
    paths = sorted({line.split(maxsplit=5)[5] for line in lines if "openblas" in line})
    found = []
    for path in paths:
        # Such as a file of that name that is no library, or one whose file is gone.
        try:
            found.append(_OpenBlas(path))
        except OSError:
            continue
    return found
