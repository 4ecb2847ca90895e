from __future__ import annotations

import shlex

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.errors import GarlError, ScenarioError
from pytest_garl.messages import SHOWN, command, listed, printable, shortened, shown


@pytest.mark.parametrize(
    ("found", "seen"),
    [
        ("\x1b[2J\x1b]0;owned\x07", "\\x1b[2J\\x1b]0;owned\\x07"),
        ("a\u202eb\u2066c", "a\\u202eb\\u2066c"),
        ("\x9b31m", "\\x9b31m"),
        ("lone \udcff half", "lone \\udcff half"),
        ("line\u2028line", "line\\u2028line"),
        ("back\rspace\x08", "back\\rspace\\x08"),
        ("two\nlines\tof text", "two\nlines\tof text"),
        ("größer, 中文, a\u00a0space", "größer, 中文, a\u00a0space"),
    ],
)
def test_control_characters_are_written_out_and_text_stays(found: str, seen: str) -> None:
    assert printable(found) == seen


@pytest.mark.parametrize(
    ("found", "seen"),
    [
        ("::error::no plan", "\\::error::no plan"),
        ("no plan\n  ::add-mask::a", "no plan\n  \\::add-mask::a"),
        # Wrapped, any word may begin a line.
        ("no plan ::stop-commands::x", "no plan \\::stop-commands::x"),
        ("so ##[error]no plan", "so #\\#[error]no plan"),
        ("##vso[task.complete]", "#\\#vso[task.complete]"),
        ("std::vector in test_it.py::test_x, ## 3", "std::vector in test_it.py::test_x, ## 3"),
    ],
)
def test_text_cannot_command_a_build_server(found: str, seen: str) -> None:
    assert printable(found) == seen
    assert printable(seen) == seen


def test_command_keeps_each_word_in_any_shell() -> None:
    words = ("pytest", "test_it.py::test[a b]", "--garl-repeat=$(touch x)`;`'\"!-g00-s00", "\x1b")
    text = command(*words)
    assert shlex.split(text) == [*words[:-1], "\\x1b"]
    assert command("garl", "cases", "show", "a/b-1.toml") == "garl cases show a/b-1.toml"


def test_one_line_is_one_line() -> None:
    assert printable("two\nlines\tof", keep="") == "two\\nlines\\tof"


@given(st.text())
def test_printable_text_stays_as_it_is(text: str) -> None:
    assert printable(printable(text)) == printable(text)
    assert all(char.isprintable() or char.isspace() for char in printable(text))


@given(st.text(), st.integers(5, 100))
def test_shortened_text_is_one_line_within_the_limit(text: str, limit: int) -> None:
    short = shortened(text * 30, limit)
    assert len(short) <= limit
    assert "\n" not in short
    if len(printable(text, keep="")) <= limit:
        assert shortened(text, limit) == printable(text, keep="")


def test_a_cut_text_shows_both_ends() -> None:
    short = shortened("begin" + "x" * 1_000_000 + "end")
    assert len(short) == SHOWN
    assert short.startswith("begin")
    assert short.endswith("end")


def _nested(depth: int) -> object:
    value: object = 1
    for _ in range(depth):
        value = [value]
    return value


@pytest.mark.parametrize(
    "value",
    [
        "x" * 1_000_000,
        list(range(100_000)),
        {str(index): index for index in range(1000)},
        _nested(50_000),
        int("f" * 50_000, 16),
        -(10**4000),
        1e308,
        "\x1b[31m" * 100,
    ],
    ids=["text", "list", "table", "nested", "hex", "digits", "float", "escape"],
)
def test_a_found_value_is_shown_in_one_short_line(value: object) -> None:
    assert 0 < len(shown(value)) <= SHOWN
    assert shown(value).isprintable()


def test_a_short_value_is_shown_as_it_is() -> None:
    assert shown([1, 0.5, "two"]) == "[1, 0.5, 'two']"


def test_a_list_of_names_is_cut_where_it_would_fill_a_screen() -> None:
    assert listed(["fog", "rain"]) == "fog, rain"
    assert len(listed(str(index) for index in range(10_000))) < 1000


@pytest.mark.parametrize("kind", [GarlError, ScenarioError])
def test_no_error_of_the_project_sends_escape_sequences_to_a_terminal(
    kind: type[GarlError],
) -> None:
    assert str(kind("cases/\x1b[31mred.toml:\nwrong")) == "cases/\\x1b[31mred.toml:\nwrong"
