from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.simulation.npc_policy import Move, PolicySpec, Situation, decision
from tests.support.situations import being, situation


class Eastward:
    def __init__(self, share: float = 1.0) -> None:
        self.share = share

    def decide(self, situation: Situation) -> Move:
        return Move(x=self.share, y=0.0)


def spec(attribute: str, **arguments: str | float) -> PolicySpec:
    return PolicySpec(
        name="mine", factory=f"{__name__}:{attribute}", arguments=tuple(arguments.items())
    )


def test_a_specification_makes_a_policy_with_its_arguments() -> None:
    assert decision(spec("Eastward", share=0.5).make(), situation(being((0.0, 0.0)))) == Move(
        x=0.5, y=0.0
    )


@pytest.mark.parametrize("factory", ["nowhere:Policy", f"{__name__}:Nobody"])
def test_a_policy_that_cannot_be_loaded_is_an_error(factory: str) -> None:
    with pytest.raises(PolicyError, match=r"'mine': .* cannot be loaded .*'module:attribute'"):
        PolicySpec(name="mine", factory=factory).make()


def test_a_policy_module_that_raises_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "raising_policy.py").write_text("1 / 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(PolicyError, match="importing 'raising_policy' raised ZeroDivisionError"):
        PolicySpec(name="mine", factory="raising_policy:Policy").make()


def test_arguments_that_the_policy_does_not_take_are_an_error() -> None:
    with pytest.raises(PolicyError, match=r"'mine': .*'colour': 'red'.* raised TypeError"):
        spec("Eastward", colour="red").make()


def test_a_move_longer_than_the_speed_is_an_error() -> None:
    with pytest.raises(PolicyError, match="deciding for it: found Move"):
        decision(spec("Eastward", share=1.5).make(), situation(being((0.0, 0.0))))


def test_only_learned_policies_have_a_hash() -> None:
    assert spec("Eastward").sha256 == ""
    assert spec("Eastward", sha256="abc").sha256 == "abc"
