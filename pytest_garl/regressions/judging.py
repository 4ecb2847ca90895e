"""Let the tests that found a case judge it: pytest flies this one case in a process of its own."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pytest_garl.errors import GarlError
from pytest_garl.files.atomic import write_text_atomically
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_file import dump_case
from pytest_garl.regressions.corpus import folder_of

NAME = "judged"
"""Name of the file that pytest flies, and so part of its items' ids."""
Outcome = Literal["passed", "failed", "skipped"]
_EMPTY = ("budget", "repeat", "baseline")
_FLOWN = (0, 1, 5)
"""Exit statuses of pytest that has come to its end; 5 says that no test flies the case."""
_TOLD = 20
"""Lines of pytest's output that are shown if it does not come to a report."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """What one test said of a case: its node id, outcome and message, and what was flown."""

    nodeid: str
    outcome: Outcome
    message: str
    facts: dict[str, str]


@contextmanager
def judged(case: Case, root: Path, *, live: bool) -> Iterator[tuple[tuple[Judged, ...], Path]]:
    """Give what each test says that flies the case, and the folder of the flight's record.

    pytest runs in ``root`` on the file of the test that found the case, or on all if none is known.
    The case is flown as a fixed one, so that no failure is expected.
    """
    with alone_in_a_folder(case, live=live) as folder:
        report = folder / "report.xml"
        done = subprocess.run(
            [
                *(sys.executable, "-m", "pytest", f"--junitxml={report}"),
                *arguments(case, folder, live=live),
            ],
            cwd=root,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        found = _read(report)
        if done.returncode not in _FLOWN:
            told = "\n".join((done.stdout + done.stderr).splitlines()[-_TOLD:])
            raise GarlError(f"pytest could not fly the case (status {done.returncode}):\n{told}")
        yield found, folder / "garl" / "flights"


@contextmanager
def alone_in_a_folder(case: Case, *, live: bool) -> Iterator[Path]:
    """Give a folder with a corpus of this one case, called fixed, so that it must pass."""
    with tempfile.TemporaryDirectory(prefix="garl-") as scratch:
        flown = dataclasses.replace(
            case,
            status="fixed",
            avoidable="live" if live else "recorded",
            # An edge case would fail nothing.
            evidence=dataclasses.replace(case.evidence, neighbours=0, neighbours_failed=0),
        )
        folder = folder_of(Path(scratch, "cases"), case.system)
        write_text_atomically(folder / f"{NAME}.toml", dump_case(flown))
        yield Path(scratch)


def arguments(case: Case, folder: Path, *, live: bool) -> list[str]:
    """Return pytest's arguments that select the tests of the case in ``folder``."""
    file = case.test.partition("::")[0] if "::" in case.test else ""
    ids = f"case-{NAME}-live" if live else f"case-{NAME} and not case-{NAME}-live"
    overrides = {
        "garl_cases": str(folder / "cases"),
        "garl_dir": str(folder / "garl"),
        "cache_dir": str(folder / "cache"),
        **{f"garl_{name}": "" for name in _EMPTY},
    }
    return [
        *filter(None, [file]),
        *("-k", ids, "--maxfail=0", "--garl-workers=1"),
        *(word for key, value in overrides.items() for word in ("-o", f"{key}={value}")),
    ]


def _read(report: Path) -> tuple[Judged, ...]:
    try:
        root = ElementTree.parse(report).getroot()
    except (OSError, ElementTree.ParseError):
        return ()
    return tuple(_judged(each) for each in root.iter("testcase"))


def _judged(element: ElementTree.Element) -> Judged:
    failure = element.find("failure")
    broken = failure if failure is not None else element.find("error")
    skipped = element.find("skipped")
    outcome: Outcome = "passed"
    told = broken if broken is not None else skipped
    if broken is not None or (skipped is not None and skipped.get("type") == "pytest.xfail"):
        outcome = "failed"
    elif skipped is not None:
        outcome = "skipped"
    name = element.get("name", "").partition("[")[0]
    return Judged(
        nodeid=f"{element.get('classname', '')}.{name}",
        outcome=outcome,
        message=_message(told) if told is not None else "",
        facts={each.get("name", ""): each.get("value", "") for each in element.iter("property")},
    )


def _message(told: ElementTree.Element) -> str:
    """Return the error as pytest shows it, or the first line of what was said."""
    shown = (line for line in (told.text or "").splitlines() if line.startswith("E  "))
    first = (told.get("message", "").splitlines() or [""])[0]
    return next(shown, "E")[1:].strip() or first


def is_test(found: Judged, test: str) -> bool:
    """Whether a report is of the test with a node id, or with a function's name."""
    path, _, rest = test.partition("::") if "::" in test else ("", "", test)
    dotted = path.removesuffix(".py").replace("/", ".")
    name = ".".join(filter(None, [dotted, *rest.split("::")]))
    return found.nodeid == name or found.nodeid.endswith(f".{name}")
