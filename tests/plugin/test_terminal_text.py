from __future__ import annotations

import pytest

from pytest_garl.plugin.terminal_text import wrapped


@pytest.mark.parametrize("amount", ["12.5 %", "2 s", "21.8 m", "2.7 m/s", "12 % [0.3, 53]"])
def test_wrapping_keeps_a_number_with_its_unit(amount: str) -> None:
    text = f"It took {amount}. The rest"
    width = text.index(amount) + len(amount) - 1
    assert f"{amount}." in wrapped(text, width)


def test_wrapping_splits_between_words() -> None:
    assert wrapped("3 small", 4) == "3\nsmall"
