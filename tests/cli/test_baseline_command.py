from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pytest_garl.cli import main
from pytest_garl.gate.baseline_file import load_baseline
from pytest_garl.scenarios.files import load as load_scenario
from tests.support import tiny_simulator

SYSTEM = """
try:
    import only_in_head
except ImportError:
    only_in_head = None

from pytest_garl import Abort, Land
from stack.helper import decide


class Lander:
    def reset(self, mission):
        assert only_in_head is None or __file__.find("head") > 0

    def step(self, observation):
        return decide(observation)


class GivesUp(Lander):
    def step(self, observation):
        return Abort()
"""
FINE = "from pytest_garl import Land\ndef decide(observation):\n    return Land()\n"
WRONG = "def decide(observation):\n    raise ValueError('no plan')\n"
TINY = ("--maps=lawn", "--workers=1", "--simulator=tiny_simulator:fly")


def write_checkout(folder: Path, helper: str) -> Path:
    (folder / "stack").mkdir(parents=True)
    (folder / "stack" / "__init__.py").touch()
    (folder / "stack" / "system.py").write_text(SYSTEM)
    (folder / "stack" / "helper.py").write_text(helper)
    shutil.copy(tiny_simulator.__file__, folder / "tiny_simulator.py")
    return folder


@pytest.fixture
def checkouts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a base and a head that are alike; the head is the working directory."""
    write_checkout(tmp_path / "base", FINE)
    (write_checkout(tmp_path / "head", FINE) / "only_in_head.py").touch()
    monkeypatch.chdir(tmp_path / "head")
    return tmp_path


def garl(*words: str) -> Result:
    return CliRunner().invoke(main, [*words], env={"COLUMNS": "120"})


def diff(*options: str) -> Result:
    return garl("diff", "../base", ".", "--system=stack.system:Lander", *TINY, *options)


def test_diff_passes_two_equal_checkouts(checkouts: Path) -> None:
    result = diff("--count=12")
    assert result.exit_code == 0, result.output
    assert "Lander-lawn: gate passed" in result.output
    assert "12 pairs compared, 12 of them the same flight to the byte" in result.output


def test_diff_flies_each_checkout_with_its_own_modules_and_lists_broken_pairs(
    checkouts: Path,
) -> None:
    (checkouts / "head" / "stack" / "helper.py").write_text(WRONG)
    result = diff("--count=24", "--domain=paper")
    assert result.exit_code == 1, result.output
    assert re.search(r"lawn-\d+ +broke +landed +V:ValueError@helper.decide", result.output)
    assert re.search(r"lawn-\d+ +changed +IV:dog:last-metre:unseen +V:", result.output)
    assert "gate FAILED: significantly more violations: p " in result.output
    assert re.search(r"; new type of violation: V in lawn-0 and 23 more, in 9 of 9", result.output)


def test_diff_refuses_a_system_that_one_checkout_lacks(checkouts: Path) -> None:
    shutil.rmtree(checkouts / "base" / "stack")
    result = diff("--count=1")
    assert result.exit_code == 1
    assert "system 'stack.system:Lander' of ../base: ModuleNotFoundError" in result.output
    assert "Expected MODULE:CLASS" in result.output


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--system=stack.system:Other",), "AttributeError: "),
        (("--system=stack.helper:decide",), "expected a class or a program, found function"),
        (("--system=stack",), "found 'stack'"),
        ((), "found neither --system nor --from-ledger"),
        (("--system=stack.system:Lander", "--maps=moon"), "unknown map 'moon'"),
        (("--system=stack.system:Lander", "--maps=,"), "found ',', expected names such as"),
        (("--system=stack.system:Lander", "--npcs=cats"), "unknown NPC policy 'cats'"),
        (("--system=stack.system:Lander", "--simulator=mine"), "expected MODULE:FUNCTION"),
        (("--from-ledger=.garl/ledger.sqlite",), "there is no ledger"),
    ],
)
def test_save_refuses_wrong_options(checkouts: Path, words: tuple[str, ...], expected: str) -> None:
    result = garl("baseline", "save", *words, "--out=base.toml")
    assert result.exit_code == 1
    assert expected in result.output
    assert not Path("base.toml").exists()


def test_equal_options_save_equal_bytes_and_scenario_prints_one_scenario(
    checkouts: Path,
) -> None:
    save = ("baseline", "save", "--system=stack.system:Lander", *TINY, "--count=4")
    first = garl(*save, "--out=one/base.toml")
    assert first.exit_code == 0, first.output
    assert "Lander-lawn: 4 flown; limits distance 0.75 m, time 120 s, " in first.output
    garl(*save, "--out=two.toml", "--workers=2")
    assert Path("two.toml").read_bytes() == Path("one/base.toml").read_bytes()
    (saved,) = load_baseline(Path("two.toml")).sets
    printed = garl("baseline", "scenario", "two.toml", "lawn-3")
    Path("one.toml").write_text(printed.output)
    assert load_scenario(Path("one.toml")) == saved.flights[3].scenario
    several = garl(*save, "--system=stack.system:GivesUp", "--out=three.toml")
    assert "GivesUp-lawn: 4 flown; " in several.output
    assert [each.title for each in load_baseline(Path("three.toml")).sets] == [
        "Lander-lawn",
        "GivesUp-lawn",
    ]
    shown = garl("baseline", "show", "two.toml").output
    assert shown == "".join(first.output.splitlines(keepends=True)[:-1])
    assert re.search(r"landed +violations +blocked +excused +needless\n +[0-4] \(\d+ %\) ", shown)
    assert "distance of " in shown
    missing = garl("baseline", "scenario", "two.toml", "lawn-4")
    assert "found no scenario 'lawn-4'" in missing.output


@pytest.mark.sim
def test_save_records_real_flights(checkouts: Path) -> None:
    save = (
        "baseline",
        "save",
        "--system=stack.system:GivesUp",
        "--maps=lawn",
        "--count=1",
        "--workers=1",
    )
    result = garl(*save, "--out=base.toml", "--npcs=dqn", "--abort=violation")
    assert result.exit_code == 0, result.output
    assert "GivesUp-lawn: 1 flown; " in result.output
    assert "0 (0 %)     1           0" in result.output
    (saved,) = load_baseline(Path("base.toml")).sets
    assert saved.npcs_sha256
    assert {flight.summary.signature.partition(":")[0] for flight in saved.flights} == {"II"}
    assert all(flight.summary.sha256 for flight in saved.flights)
