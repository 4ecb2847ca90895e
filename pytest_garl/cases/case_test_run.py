"""Run the tests that found a case on this case alone, with pytest in a separate process."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pytest_garl.cases.case import Case
from pytest_garl.cases.case_file import dump_case
from pytest_garl.cases.corpus import folder_of
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import LIVE, OF_CASE
from pytest_garl.files.atomic import write_text_atomically

CASE_NAME = "judged"
"""Name of the case's file in the temporary corpus, and so part of the items' ids."""
TestOutcome = Literal["passed", "failed", "skipped"]
_CLEARED_OPTIONS = ("budget", "repeat", "baseline")
"""Options that a project's configuration may set, and that these runs reset."""
_COMPLETED_STATUSES = (0, 1, 5)
"""Exit statuses of a complete pytest run; 5 says that no test flies the case."""
_OUTPUT_LINES = 20
"""Number of last lines of pytest's output in the error of an incomplete run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseTestResult:
    """The result of one test: outcome, message, and the item's user properties about its flight."""

    nodeid: str
    outcome: TestOutcome
    message: str
    properties: dict[str, str]

    def is_result_of(self, test: str) -> bool:
        """Return whether this is the result of a test with this node id or function name."""
        path, _, rest = test.partition("::") if "::" in test else ("", "", test)
        dotted = path.removesuffix(".py").replace("/", ".")
        name = ".".join(filter(None, [dotted, *rest.split("::")]))
        return self.nodeid == name or self.nodeid.endswith(f".{name}")


@contextmanager
def run_case_tests(
    case: Case, root: Path, *, live: bool
) -> Iterator[tuple[tuple[CaseTestResult, ...], Path]]:
    """Yield the results of the tests that fly the case, and the folder of the flight's record.

    pytest runs in ``root`` on the file of the test that found the case, or on all files if no test
    is known.  The case counts as fixed, so that no failure is expected.  ``live`` lets the policy
    steer the objects; otherwise they repeat their recorded moves.  Raises GarlError if pytest
    itself fails, as for an error of usage.
    """
    with single_case_corpus(case, live=live) as folder:
        report = folder / "report.xml"
        arguments = pytest_arguments(case, folder, live=live)
        done = run_pytest([f"--junitxml={report}", *arguments], root)
        found = _read(report)
        if done.returncode not in _COMPLETED_STATUSES:
            raise GarlError(f"pytest could not fly the case {end_of(done)}")
        yield found, folder / "garl" / "flights"


@contextmanager
def single_case_corpus(case: Case, *, live: bool) -> Iterator[Path]:
    """Yield a folder with a corpus of this one case, marked as fixed, so that it must pass."""
    with tempfile.TemporaryDirectory(prefix="garl-") as scratch:
        fixed = dataclasses.replace(
            case,
            status="fixed",
            live=live,
            # A case that gates nothing would fail no test.
            reason="",
        )
        folder = folder_of(Path(scratch, "cases"), case.system)
        write_text_atomically(folder / f"{CASE_NAME}.toml", dump_case(fixed))
        yield Path(scratch)


def pytest_arguments(case: Case, folder: Path, *, live: bool) -> list[str]:
    """Return pytest's arguments that select the tests of the case in ``folder``."""
    file = case.test.partition("::")[0] if "::" in case.test else ""
    name = f"{OF_CASE}{CASE_NAME}"
    ids = f"{name}{LIVE}" if live else f"{name} and not {name}{LIVE}"
    return [
        *filter(None, [file]),
        *("-k", ids, "--maxfail=0", "--garl-workers=1"),
        *ini_options(folder, folder / "cases"),
    ]


def ini_options(scratch: Path, cases: Path | None) -> list[str]:
    """Return pytest's arguments for a run that searches nothing and leaves its files in a folder.

    ``cases`` is the folder of the saved cases; None for that of the ini key.
    """
    values = {f"garl_{name}": "" for name in _CLEARED_OPTIONS}
    values |= {"cache_dir": f"{scratch / 'cache'}", "garl_dir": f"{scratch / 'garl'}"}
    values |= {"garl_cases": f"{cases.absolute()}"} if cases is not None else {}
    return [word for key, value in values.items() for word in ("-o", f"{key}={value}")]


def run_pytest(arguments: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run pytest in a process of its own, and return what it wrote."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", *arguments],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )


def end_of(done: subprocess.CompletedProcess[str]) -> str:
    """Return how a run of pytest ended: its status, and its last lines."""
    output = "\n".join((done.stdout + done.stderr).splitlines()[-_OUTPUT_LINES:])
    return f"(status {done.returncode}):\n{output}"


def _read(report: Path) -> tuple[CaseTestResult, ...]:
    try:
        root = ElementTree.parse(report).getroot()
    except (OSError, ElementTree.ParseError):
        return ()
    return tuple(_result(each) for each in root.iter("testcase"))


def _result(element: ElementTree.Element) -> CaseTestResult:
    failure = element.find("failure")
    broken = failure if failure is not None else element.find("error")
    skipped = element.find("skipped")
    outcome: TestOutcome = "passed"
    reason = broken if broken is not None else skipped
    if broken is not None or (skipped is not None and skipped.get("type") == "pytest.xfail"):
        outcome = "failed"
    elif skipped is not None:
        outcome = "skipped"
    name = element.get("name", "").partition("[")[0]
    return CaseTestResult(
        nodeid=f"{element.get('classname', '')}.{name}",
        outcome=outcome,
        message=_message(reason) if reason is not None else "",
        properties={
            each.get("name", ""): each.get("value", "") for each in element.iter("property")
        },
    )


def _message(reason: ElementTree.Element) -> str:
    """Return the error as pytest shows it, or the first line of the message."""
    shown = (line for line in (reason.text or "").splitlines() if line.startswith("E  "))
    first = (reason.get("message", "").splitlines() or [""])[0]
    return next(shown, "E")[1:].strip() or first
