from __future__ import annotations

import dataclasses

from pytest_garl.regressions.case_comparison import is_simpler, no_worse, simplicity
from tests.regressions.samples import LAWN, OBJECT_NAMES, case

SAVED = case()


def test_case_with_fewer_runs_is_simpler() -> None:
    shorter = dataclasses.replace(SAVED, moves=((OBJECT_NAMES[-1], ((0.0, 0.0),)),))
    assert is_simpler(shorter, SAVED, LAWN, outdated=False)
    assert not is_simpler(SAVED, shorter, LAWN, outdated=False)
    assert not is_simpler(SAVED, SAVED, LAWN, outdated=False)


def test_case_that_is_worse_in_one_respect_is_not_simpler() -> None:
    shorter = dataclasses.replace(SAVED, moves=((OBJECT_NAMES[-1], ((0.0, 0.0),)),), avoidable="no")
    assert not no_worse(simplicity(shorter, LAWN), simplicity(SAVED, LAWN))
    assert not is_simpler(shorter, SAVED, LAWN, outdated=False)


def test_case_with_new_evidence_is_simpler_than_an_outdated_one() -> None:
    assert is_simpler(SAVED, SAVED, LAWN, outdated=True)
