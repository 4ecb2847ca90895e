from __future__ import annotations

import pytest

from pytest_garl.plugin.terminal_text import wrapped


@pytest.mark.parametrize("amount", ["12.5 %", "2 s", "21.8 m", "2.7 m/s"])
def test_a_number_is_not_parted_from_its_unit(amount: str) -> None:
    text = f"It took {amount}. The rest"
    width = text.index(amount) + len(amount) - 1
    assert f"{amount}." in wrapped(text, width)


def test_words_are_parted() -> None:
    assert wrapped("3 small", 4) == "3\nsmall"
