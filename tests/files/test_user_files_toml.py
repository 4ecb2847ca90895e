"""TOML that costs too much is one short error."""

from __future__ import annotations

import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.files.user_files import parse


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seed = " + "[" * 3000, "nested too deeply"),
        ("seed = " + "{a=" * 3000, "nested too deeply"),
        ("seed = " + "9" * 5000, "Exceeds the limit"),
        ("a." * 400_000 + "a = 1", "more than 32 parts with dots between"),
        ("[" + "a . " * 200_000 + "a]", "more than 32 parts with dots between"),
        ('"a b" . ' * 100_000 + "a = 1", "more than 32 parts with dots between"),
        ("seed = ", "Invalid value"),
    ],
    ids=["lists", "tables", "digits", "dots", "header", "quoted", "plain"],
)
def test_costly_toml_is_one_short_error(text: str, words: str) -> None:
    with pytest.raises(ScenarioError, match=words) as caught:
        parse(text, "case.toml")
    assert str(caught.value).startswith("case.toml: not valid TOML: ")
    assert len(str(caught.value)) < 300


def test_names_with_dots_in_a_text_are_no_deep_key() -> None:
    story = "a.b " * 100 + "0.5, 1.25, " * 100
    assert parse(f'story = "{story}"', "case.toml") == {"story": story}
