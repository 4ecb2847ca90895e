"""Flights are equal to the byte in every Python: nothing that flies sums floats by ``sum``.

Since Python 3.12 the built-in ``sum`` compensates the rounding of floats.  Its result differs in
the last digit from that of Python 3.11, and a flight that depends on it goes elsewhere.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = (
    "landing_systems",
    "pytest_garl/cases",
    "pytest_garl/companion",
    "pytest_garl/external",
    "pytest_garl/flight",
    "pytest_garl/npcs",
    "pytest_garl/scenarios",
    "pytest_garl/search",
    "pytest_garl/simulation",
    "pytest_garl/vehicle",
    "pytest_garl/verdicts",
)
"""What flies, and what decides what is flown."""
WHOLE = {"all", "any", "bool", "count_publishers", "endswith", "int", "isinstance", "len"} | {
    "most_flights",
    "startswith",
}
"""Functions and methods that return whole numbers, or whether something is so."""
WHOLE |= {"collided", "count", "counts", "decided", "flights", "met", "npcs", "seen", "struck"}
WHOLE |= {"unspent", "violated"}
"""Names of values and attributes that are whole numbers wherever they are summed."""
WHOLE_NUMBERS = {
    "map(self._is_bred, range(plan.population))",
    "step.ravel() * stride for step, stride in zip(steps, self.strides, strict=True)",
}
"""What else is summed: whole numbers, as a reader of the code sees."""


def are_whole(summed: ast.expr) -> bool:
    """Whether code can only be whole numbers, or an iterable of them."""
    match summed:
        case ast.GeneratorExp(elt=each) | ast.ListComp(elt=each):
            return are_whole(each)
        case ast.Compare() | ast.UnaryOp(op=ast.Not()) | ast.Constant(value=int()):
            return True
        case ast.BoolOp(values=parts):
            return all(map(are_whole, parts))
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult(), right=right):
            return are_whole(left) and are_whole(right)
        case ast.Call(func=ast.Name(id="map"), args=[called, *_]):
            return are_whole(called)
        case ast.Call(func=called):
            return are_whole(called)
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name in WHOLE
    return False


def sums_of_other_values(text: str) -> Iterator[str]:
    """Return what ``sum`` is given in a text, where that may be floats."""
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Call(func=ast.Name(id="sum"), args=[summed, *_]) if not are_whole(summed):
                found = ast.unparse(summed)
                yield found[1:-1] if isinstance(summed, ast.GeneratorExp) else found


@pytest.mark.parametrize("room", ROOMS)
def test_nothing_that_flies_sums_floats(room: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}: sum({summed})"
        for path in sorted((ROOT / room).rglob("*.py"))
        for summed in sums_of_other_values(path.read_text())
        if summed not in WHOLE_NUMBERS
    ]
    assert not found, (
        "add floats one after the other, or by math.fsum where no flight changes; whole numbers "
        "that this test does not know as such it takes from WHOLE"
    )


@pytest.mark.parametrize(
    ("code", "may_be_floats"),
    [
        ("sum(weights)", True),
        ("sum(w * v for w, v in terms)", True),
        ("sum(value for value in values if value > 0)", True),
        ("sum(value > 0 for value in values)", False),
        ("sum(not each.done() for each in started)", False),
        ("sum([2 * len(seen.corners) for seen in detections])", False),
        ("sum(map(len, texts))", False),
        ("values.sum()", False),
    ],
)
def test_rule_tells_counts_from_other_sums(code: str, *, may_be_floats: bool) -> None:
    assert bool([*sums_of_other_values(code)]) is may_be_floats
