from __future__ import annotations

import html
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest

from tests.support.landing_project import project, run

SEARCH = ("--garl-budget=8", "--garl-workers=0")


def files(pytester: pytest.Pytester, folder: str) -> dict[str, bytes]:
    found = (pytester.path / folder).rglob("*.html")
    return {
        each.relative_to(pytester.path / folder).as_posix(): each.read_bytes() for each in found
    }


@pytest.mark.parametrize("workers", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
def test_a_search_writes_its_pages(pytester: pytest.Pytester, workers: tuple[str, ...]) -> None:
    project(pytester)
    result = run(pytester, *SEARCH, "--garl-report=pages", *workers)
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
    run(pytester, "--garl-budget=2", "--garl-workers=0")
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


def junit(pytester: pytest.Pytester) -> list[ET.Element]:
    """Return the test cases of JUnit XML that have a page."""
    cases = ET.parse(pytester.path / "junit.xml").iter("testcase")
    return [case for case in cases if "garl.page" in properties(case)]


def properties(case: ET.Element) -> dict[str, str]:
    return {each.attrib["name"]: each.attrib["value"] for each in case.iter("property")}


@pytest.mark.parametrize("workers", [(), ("-n2",)])
def test_junit_names_the_page_of_a_violation(
    pytester: pytest.Pytester, workers: tuple[str, ...]
) -> None:
    project(pytester)
    logging = ("-o", "junit_logging=system-out")
    run(pytester, *SEARCH, "--garl-report=out/pages", "--junitxml=junit.xml", *logging, *workers)
    found = junit(pytester)
    assert found
    for case in found:
        page = pytester.path / properties(case)["garl.page"]
        assert page.is_file()
        assert properties(case)["garl.signature"] in html.unescape(page.read_text())
        if case.find("failure") is not None:
            assert f"[[ATTACHMENT|{page}]]" in "".join(case.itertext())


def test_summary_and_junit_link_to_the_published_report(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    page, url = pytester.path / "summary.md", "https://example.org/nightly"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    published = ("--garl-report=pages", "-o", f"garl_report-url={url}/", "--junitxml=junit.xml")
    result = run(pytester, *SEARCH, *published)
    # Without a log JUnit has no attachment.
    assert "ATTACHMENT" not in (pytester.path / "junit.xml").read_text() + result.stdout.str()
    text = page.read_text()
    assert f"[The whole report]({url}/index.html)" in text
    found = junit(pytester)
    assert found
    for case in found:
        address = properties(case)["garl.page"]
        assert address.startswith(f"{url}/kinds/")
        assert f"[page]({address})" in text
        assert (pytester.path / "pages" / address.removeprefix(f"{url}/")).is_file()


def test_summary_names_the_files_of_a_report_that_is_published_nowhere(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    page = pytester.path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    run(pytester, *SEARCH, "--garl-report=pages")
    text = page.read_text()
    assert "The whole report is `pages/index.html`." in text
    pages = re.findall(r"`(pages/kinds/[^`]+)`", text)
    assert pages
    assert all((pytester.path / each).is_file() for each in pages)
    assert "| type | take-off |" in text
    assert "<details><summary>Cost</summary>" in text


@pytest.mark.parametrize("url", ["pages", "ftp://example.org", "https://a b", "https://a/)("])
def test_an_address_that_is_none_is_a_usage_error(pytester: pytest.Pytester, url: str) -> None:
    project(pytester)
    result = run(pytester, *SEARCH, "--garl-report=pages", "-o", f"garl_report-url={url}")
    result.stderr.fnmatch_lines(["*garl_report-url: found *expected an address such as*"])
    assert result.ret == pytest.ExitCode.USAGE_ERROR
