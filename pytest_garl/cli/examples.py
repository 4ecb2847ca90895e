"""Two examples for the help of each command."""

from __future__ import annotations

import click

_CASE = "scenarios/regressions/my_landing/lawn-II-gave_up-f5e89c.toml"

EXAMPLES = {
    "baseline": (
        "garl baseline save --system=my_landing:MyLandingSystem --out=baseline.toml",
        "pytest --garl-baseline=baseline.toml",
    ),
    "baseline save": (
        "garl baseline save --system=my_landing:MyLandingSystem --out=baseline.toml",
        "garl baseline save --from-ledger=.garl/ledger.sqlite --out=baseline.toml",
    ),
    "baseline scenario": (
        "garl baseline scenario baseline.toml court-17 >court-17.toml",
        "pytest --garl-repeat=court-17.toml",
    ),
    "baseline show": (
        "garl baseline show baseline.toml",
        "garl baseline show baseline.toml | head -20",
    ),
    "cases": (
        "garl cases list",
        f"garl cases replay {_CASE}",
    ),
    "cases accept": (
        f"garl cases accept {_CASE}",
        "garl cases accept scenarios/regressions/my_landing/*.toml",
    ),
    "cases check": (
        "garl cases check",
        "garl cases --folder=other/cases check",
    ),
    "cases list": (
        "garl cases list",
        "garl cases --folder=.garl/cases list",
    ),
    "cases promote": (
        f"garl cases promote {_CASE}",
        "garl cases promote scenarios/regressions/my_landing/*.toml",
    ),
    "cases prune": (
        "garl cases prune",
        "garl cases prune --yes",
    ),
    "cases renew": (
        "garl cases renew --workers=2",
        f"garl cases renew {_CASE}",
    ),
    "cases replay": (
        f"garl cases replay {_CASE}",
        f"garl cases replay --video=case.mp4 {_CASE}",
    ),
    "cases show": (
        f"garl cases show {_CASE}",
        "garl cases --folder=.garl/cases show .garl/cases/my_landing/lawn-II-gave_up-f5e89c.toml",
    ),
    "cases shrink": (
        f"garl cases shrink {_CASE}",
        f"garl cases shrink --flights=100 {_CASE}",
    ),
    "check": (
        "garl check test_my_landing.py",
        "garl check --map=court --no-probes my_landing:MyLandingSystem",
    ),
    "client": (
        "garl client cpp",
        "garl client python ros2",
    ),
    "diff": (
        "garl diff --system=my_landing:MyLandingSystem ../main .",
        "garl diff --system=my_landing:MyLandingSystem --maps=lawn --count=40 ../main .",
    ),
    "domain": (
        "garl domain list",
        "garl domain show field",
    ),
    "domain list": (
        "garl domain list",
        "garl domain show calm",
    ),
    "domain show": (
        "garl domain show field",
        "garl domain show my_domain.toml",
    ),
    "domain use": (
        "garl domain use field >use.toml",
        "pytest --garl-budget=400 --garl-method=use -o garl_use=use.toml",
    ),
    "export": (
        "garl export --mcap=flight.mcap court-g03-s17",
        "garl export --mcap=case.mcap lawn-II-gave_up-f5e89c",
    ),
    "film": (
        "garl film court-g03-s17",
        "garl film --last=10 --out=case.gif lawn-II-gave_up-f5e89c",
    ),
    "init": (
        "garl init my_landing:MyLandingSystem",
        'garl init "python my_lander.py --connect udp:0.0.0.0:14550"',
    ),
    "report": (
        "garl report --out=report",
        "garl report --json --out=run.json",
    ),
    "risk": (
        "garl risk",
        "garl risk --json .garl/ledger.sqlite",
    ),
    "schema": (
        "garl schema",
        "garl schema --out=.vscode/schemas",
    ),
    "train": (
        "garl train --map=court --type=dog --out=scenarios/dogs.npz",
        "pytest --garl-budget=40 --garl-npcs=scenarios/dogs.npz",
    ),
}
"""By the words of a command after ``garl``."""


def add_examples(command: click.Command, words: str) -> None:
    """Give a command, and those below it, their examples as the end of their help."""
    # Click keeps the lines of a paragraph that begins with \b.
    command.epilog = "\n".join(["\b", "Examples:", *(f"  {each}" for each in EXAMPLES[words])])
    for name, below in getattr(command, "commands", {}).items():
        add_examples(below, f"{words} {name}")
