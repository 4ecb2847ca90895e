from __future__ import annotations

import shutil
import subprocess
import sys

import pytest

from tests.support.landing_project import project, run


def files(pytester: pytest.Pytester, folder: str) -> dict[str, bytes]:
    found = (pytester.path / folder).rglob("*.html")
    return {
        each.relative_to(pytester.path / folder).as_posix(): each.read_bytes() for each in found
    }


@pytest.mark.parametrize("workers", [(), ("-n2",)])
def test_a_search_writes_its_pages(pytester: pytest.Pytester, workers: tuple[str, ...]) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", "--garl-workers=1", "--garl-report=pages", *workers)
    result.stdout.fnmatch_lines(["*garl: report*", "pages/index.html: 2 pages, 0 films"])
    found = files(pytester, "pages")
    assert len(found) == 3
    assert b"of 8 flights violate something" in found["index.html"]
    assert b"not come to its end" not in found["index.html"]
    again = "import sys; from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", again, "report", "--out=again", "--workers=1"]
    subprocess.run(command, cwd=pytester.path, check=True)
    assert files(pytester, "again") == found


def test_the_ini_key_names_a_folder_below_the_root(pytester: pytest.Pytester) -> None:
    project(pytester)
    ini = pytester.path / "pytest.ini"
    ini.write_text(ini.read_text() + "garl_report = pages\n")
    run(pytester, "--garl-budget=2", "--garl-workers=1")
    assert "index.html" in files(pytester, "pages")
    shutil.rmtree(pytester.path / "pages")
    # Saved cases alone have nothing to report.
    run(pytester)
    assert not (pytester.path / "pages").exists()


def test_a_folder_of_somebody_else_is_found_before_the_search(pytester: pytest.Pytester) -> None:
    project(pytester)
    (pytester.path / "mine").mkdir()
    (pytester.path / "mine" / "notes.txt").write_text("mine")
    result = run(pytester, "--garl-budget=8", "--garl-report=mine")
    result.stderr.fnmatch_lines(["*--garl-report: mine: found a folder with 'notes.txt'*"])
    assert result.ret == pytest.ExitCode.USAGE_ERROR


def test_a_report_without_a_search_is_a_usage_error(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-report=pages")
    result.stderr.fnmatch_lines(["*--garl-report has no effect without --garl-budget*"])
