from __future__ import annotations

from pathlib import Path

import pytest

from lab.experiment.campaign import check_experiment
from lab.experiment.spec import Experiment, read_experiment
from pytest_garl.errors import ExperimentError, ScenarioError

ROOT = Path(__file__).parents[3]
SHIPPED = sorted(ROOT.glob("docs/results/experiments/*.toml"))
TEXT = """
title = "Mine"
budget = 40
maps = ["court", "lawn"]
seeds = [3, 4]

[systems]
One = "test_one.py"
Two = "test_two.py"

[[grids]]
name = "RQ1"
methods = ["garl", "random"]
seeds = [3]

[[grids]]
name = "RQ2"
systems = ["Two"]
maps = ["lawn"]
methods = ["garl", "ga"]
"""


def plan(folder: Path, text: str = TEXT) -> Experiment:
    file = folder / "mine.toml"
    file.write_text(text)
    return read_experiment(file)


def test_every_run_is_flown_once_first_seeds_first(tmp_path: Path) -> None:
    found = plan(tmp_path).runs
    assert [(run.system, run.method, run.seed, run.maps) for run in found] == [
        ("One", "garl", 3, ("court", "lawn")),
        ("One", "random", 3, ("court", "lawn")),
        ("Two", "garl", 3, ("court", "lawn")),
        ("Two", "random", 3, ("court", "lawn")),
        ("Two", "ga", 3, ("lawn",)),
        ("Two", "garl", 4, ("lawn",)),
        ("Two", "ga", 4, ("lawn",)),
    ]
    assert {run.budget for run in found} == {40}
    assert found[0].tests == "test_one.py"


def test_a_grid_may_have_a_domain_of_its_own(tmp_path: Path) -> None:
    text = TEXT.replace('name = "RQ2"', 'name = "RQ2"\ndomain = "calm"')
    found = plan(tmp_path, text).runs
    assert {run.domain for run in found if run.seed == 3 and run.maps == ("lawn",)} == {"calm"}
    assert {run.domain for run in found if run.system == "One"} == {"paper"}
    # The same search in another domain is another one.
    assert len({run.folder for run in found}) == len(found)
    calm = TEXT.replace("budget = 40", 'budget = 40\ndomain = "calm"')
    assert {run.domain for run in plan(tmp_path, calm).runs} == {"calm"}


def test_a_method_may_name_another_npc_policy(tmp_path: Path) -> None:
    found = plan(
        tmp_path, TEXT.replace('"garl", "ga"', '"garl", "ga", "random with dqn-paper"')
    ).runs
    assert [(run.search_method, run.npcs) for run in found if run.seed == 4] == [
        ("garl", ""),
        ("ga", ""),
        ("random", "dqn-paper"),
    ]
    assert len({run.folder for run in found}) == len(found)


@pytest.mark.parametrize(
    ("method", "words"),
    [
        ("gral with dqn", "search method 'gral'"),
        ("garl with dnq", "unknown NPC policy 'dnq'; expected one of"),
    ],
)
def test_unknown_methods_and_policies_are_refused_before_any_flight(
    tmp_path: Path, method: str, words: str
) -> None:
    for name in ("test_one.py", "test_two.py"):
        (tmp_path / name).touch()
    found = plan(tmp_path, TEXT.replace('"garl", "ga"', f'"garl", "ga", "{method}"'))
    with pytest.raises(ExperimentError) as caught:
        check_experiment(found, tmp_path)
    assert "key 'methods'" in str(caught.value)
    assert words in str(caught.value)


def test_different_runs_have_different_folders(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    one = plan(tmp_path / "a").runs
    other = plan(tmp_path / "b", TEXT.replace("test_one.py", "test_uno.py")).runs
    assert one[0].folder.startswith("One-garl-seed3-40-court-lawn-")
    assert len({run.folder for run in (*one, *other)}) == len(one) + 2


def test_rows_and_report_lie_beside_the_spec(tmp_path: Path) -> None:
    found = plan(tmp_path)
    assert found.rows == tmp_path / "mine.csv"
    assert found.report == tmp_path / "mine.md"
    assert plan(tmp_path, 'report = "../r.md"\n' + TEXT).report == tmp_path.parent / "r.md"


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (
            "budget = 40",
            "budget = 0",
            "'budget': found 0, expected a whole number from 1 to",
        ),
        ("budget = 40", "", "'budget': missing"),
        ("budget = 40", "budget = 40\nrepeat = 3", "'repeat': unknown key; expected one of budget"),
        ("seeds = [3, 4]", "seeds = [3, 3]", "'seeds': found [3, 3], expected whole numbers"),
        ("seeds = [3, 4]", "", "'seeds': missing"),
        ("seeds = [3]", "seeds = []", "'grids[0].seeds': found [], expected whole numbers"),
        ("seeds = [3]", "seeds = [-1]", "'grids[0].seeds': found [-1]"),
        ("seeds = [3]", "seeds = [true]", "'grids[0].seeds': found [True]"),
        ('["court", "lawn"]', "[]", "'maps': found [], expected names, each once"),
        ('["Two"]', '["Three"]', "'grids[1].systems': found 'Three', expected some of One, Two"),
        ('["garl", "random"]', '["garl", "garl"]', "'grids[0].methods': found ['garl', 'garl']"),
        ('"test_one.py"', "1", "'systems.One': found 1, expected a string"),
        ("One =", '"a/b" =', "'systems.a/b': expected a name of letters, digits"),
        ('name = "RQ2"', 'name = "RQ1"', "'grids': found RQ1 twice, expected each name once"),
        ("budget = 40", "budget = 40\nunavoidable = 2", "'unavoidable': unknown key; expected one"),
        ('title = "Mine"', "title = ", "not valid TOML"),
    ],
)
def test_the_error_of_a_bad_file_names_key_found_and_expected(
    tmp_path: Path, before: str, after: str, words: str
) -> None:
    assert before in TEXT
    with pytest.raises(ScenarioError) as caught:
        plan(tmp_path, TEXT.replace(before, after, 1))
    assert words in str(caught.value)
    assert str(tmp_path / "mine.toml") in str(caught.value)


def test_a_spec_without_grids_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="'grids': missing; expected at least one"):
        plan(tmp_path, TEXT.partition("[[grids]]")[0])


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_every_shipped_experiment_can_be_flown(file: Path) -> None:
    check_experiment(read_experiment(file), ROOT)
