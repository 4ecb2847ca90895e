"""``garl risk``: how often landings fail in use, and in which conditions."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path

import click

from pytest_garl.cases.corpus import Corpus
from pytest_garl.cli.shared import FOLDER, LEDGER, say
from pytest_garl.reports.failure_probability import FailureProbability, SamplePart
from pytest_garl.reports.failure_regions import FailureRegion
from pytest_garl.reports.risk_reading import SearchRisk, read_risks

_DRAWS = {
    "use": "plain draws",
    "inside": "in the predicted region",
    "outside": "outside of it",
}
NO_SAMPLE = (
    "how often landings fail: unknown, no flights are a sample of use. `garl domain use field "
    ">use.toml` prints a model of use to edit, `pytest --garl-budget=400 --garl-method=use -o "
    "garl_use=use.toml` flies the sample"
)


@click.command()
@click.argument("ledger", type=click.Path(path_type=Path, dir_okay=False), default=LEDGER)
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@FOLDER
def risk(ledger: Path, as_json: bool, folder: Path) -> None:
    """Estimate how often landings fail in your use.

    The run is that of LEDGER (default .garl/ledger.sqlite), flown with --garl-method=use. The
    estimate is worth as much as the model of use that you stated.

    For each kind of failure with enough flights it prints a rule that says in which conditions it
    occurs, learned from half of the flights, and how the rule did on the other half. These rules
    need no model of use: they come from a run of any search method.
    """
    risks = read_risks(ledger, Corpus(folder, (Path.cwd() / "scenarios" / "maps",)))
    if as_json:
        click.echo(json.dumps([dataclasses.asdict(each) for each in risks], indent=2))
    else:
        lines = [line for each in risks for line in risk_lines(each)]
        say("\n".join(lines) if lines else "no flights yet")


def risk_lines(risk: SearchRisk) -> Iterator[str]:
    """Yield the risk of a search in words."""
    yield f"{risk.name}: {risk.failing} of {risk.flights} flights fail"
    if risk.inconclusive:
        yield f"  {risk.inconclusive} flights are inconclusive, and count neither way"
    if risk.probability is None:
        yield f"  {NO_SAMPLE}"
    else:
        yield f"  in use {_often(risk.probability, risk.parts)}"
        yield from (f"    {_part_text(each)}" for each in risk.parts)
    for each in risk.kinds:
        yield f"  {each.kind}: {_rule_text(each)}"


def _often(found: FailureProbability, parts: tuple[SamplePart, ...]) -> str:
    flights = sum(each.flights for each in parts)
    if not any(each.failing for each in parts):
        return f"0 of {flights} landings fail: at most {100 * found.high:.2g} % do (95 %)"
    return (
        f"{100 * found.share:.3g} % of landings fail [{100 * found.low:.2g} to "
        f"{100 * found.high:.2g} %] (95 %), from {flights} flights"
    )


def _part_text(part: SamplePart) -> str:
    share = "" if part.share == 1 else f", {100 * part.share:.1f} % of landings"
    return f"{part.failing} of {part.flights} fail: {_DRAWS[part.how]}{share}"


def _rule_text(region: FailureRegion) -> str:
    if not region.rule:
        return f"no rule found ({region.failing} of {region.held_out} held-out flights)"
    return (
        f"{region.rule} (of the held-out flights with that {region.hits} of {region.covered} show "
        f"it, of all {region.failing} of {region.held_out})"
    )
