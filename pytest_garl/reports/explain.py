"""What a failing item says: what happened, where and when, and how to see it again."""

from __future__ import annotations

import textwrap
from typing import Any

import pytest

from pytest_garl.fixtures import Landing
from pytest_garl.run import Run, Target


def crash_text(landing: Landing) -> str:
    """Return the landing system's own traceback, or the story where there is none."""
    crash: dict[str, Any] | None = landing.result["crash"]
    story = landing.verdict.story
    return f"{story}\n\n{crash['traceback']}" if crash and crash["traceback"] else story


def explain(report: pytest.TestReport, item: pytest.Item, run: Run, target: Target) -> None:
    """Add the story to a failing report; turn a known violation into an xfail."""
    result = run.ledger.result(target.search, target.slot.generation, target.slot.index)
    if result is None or result["verdict"]["primary"] is None:
        return
    verdict = result["verdict"]
    twin = run.twin(target, verdict["signature"])
    if twin and run.options.duplicates == "xfail":
        report.outcome = "skipped"
        report.wasxfail = f"same violation as {twin} ({verdict['signature']})"
        return
    told = [verdict["story"], *_unusual(run, target)]
    wrapped = [textwrap.fill(text, 98, subsequent_indent="  ") for text in told]
    lines = [verdict["signature"], *wrapped, repeat_line(item, run, target)]
    report.sections.append(("garl: what happened", "\n".join(lines)))


def repeat_line(item: pytest.Item, run: Run, target: Target) -> str:
    """Return the command that flies this scenario again."""
    return f'Repeat: pytest "{item.nodeid}" --garl-repeat={target.file or target.name}'


def _unusual(run: Run, target: Target) -> list[str]:
    from pytest_garl.scenarios.genes import EXTRAS, genome_for
    from pytest_garl.scenarios.maps import load_map
    from pytest_garl.search.job import load_scenario

    texts = run.ledger.scenarios(target.slot.generation, target.slot.index, target.map)
    text = texts.get(f"{target.system.__module__}:{target.system.__qualname__}")
    if text is None:
        return []
    scenario = load_scenario(text)
    map = load_map(target.map, run.options.map_folders)
    nominal = {
        item.key: item.nominal
        for item in genome_for(map, weather="full", extras=EXTRAS.values()).properties
    }
    words = [f"{key}={value:.3g}" for key, value in scenario.genes if value != nominal.get(key)]
    return [f"Scenario (seed {scenario.seed}): {', '.join(words)}"]
