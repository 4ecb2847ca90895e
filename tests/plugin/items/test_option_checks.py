from __future__ import annotations

import pytest

from tests.support.landing_project import (
    project,
    run,
)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--garl-map=curt",), "*--garl-map: found curt, expected one or more of court, *lawn*"),
        (("--garl-map=curt", "--garl-budget=4"), "*--garl-map: found curt*"),
        (("--garl-map=court", "--garl-budget=4"), "*--garl-map=court: none of the selected*"),
        (("--garl-resume",), "*--garl-resume has no effect without --garl-budget*"),
        (("--garl-shrink=20",), "*--garl-shrink has no effect without --garl-budget*"),
        (("--garl-seed=4",), "*--garl-seed has no effect without --garl-budget*"),
        (("--garl-npcs=stand",), "*--garl-npcs has no effect without*"),
        (("--garl-repeat=lawn-g00-s00",), "*there is no ledger at*run a search first*"),
    ],
)
def test_an_option_without_effect_is_a_usage_error(
    pytester: pytest.Pytester, args: tuple[str, ...], words: str
) -> None:
    project(pytester)
    result = run(pytester, *args)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([words])


def test_a_repeat_of_an_unknown_slot_is_a_usage_error(pytester: pytest.Pytester) -> None:
    project(pytester)
    run(pytester, "--garl-budget=2", "--garl-workers=0")
    for args, words in (
        (("--garl-repeat=lawn-g77-s00",), "*no such slot in *; it holds lawn-g00-s00 to *-s01"),
        (("--garl-repeat=lawn-g00-s00", "--garl-budget=4"), "*--garl-budget has no effect beside*"),
        (
            ("--garl-repeat=lawn-g00-s00", "--garl-shrink=20"),
            "*--garl-shrink has no effect beside*",
        ),
    ):
        result = run(pytester, *args)
        assert result.ret == pytest.ExitCode.USAGE_ERROR
        result.stderr.fnmatch_lines([words])


def test_an_ini_key_may_have_no_effect(pytester: pytest.Pytester) -> None:
    project(pytester)
    pytester.makeini("[pytest]\ngarl_seed = 3\ngarl_level = 0.1\ngarl_shrink = 20\n")
    assert run(pytester).ret == 0
