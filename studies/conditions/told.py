"""Picture of the told coordinate: where it lies about the marker in the built-in domains."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.names import BUILT_IN
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.placement import marker_position_m, told_position_m
from pytest_garl.search.methods.random import random_scenarios
from studies.conditions._frames import plots, save
from tests.support.flights import LAWN

COUNT = 600


def draw(folder: Path) -> None:
    """Draw ``told.png``."""
    figure, axes = plots().subplots(
        1, len(BUILT_IN), figsize=(9.0, 3.7), constrained_layout=True, sharex=True, sharey=True
    )
    for axis, name in zip(axes, BUILT_IN, strict=True):
        genome = genome_of(domain_named(name), LAWN)
        drawn = random_scenarios(LAWN, genome, 0, 0, COUNT)
        off = np.array(
            [
                np.subtract(told_position_m(each, LAWN), marker_position_m(each, LAWN))
                for each in drawn
            ]
        )
        far = np.hypot(*off.T)
        axis.plot(off[:, 0], off[:, 1], ".", markersize=2)
        axis.plot(0, 0, "ks", markersize=5, fillstyle="none")
        axis.set(title=f"{name}: {np.mean(far < 0.01):.0%} exact", xlabel="east (m)")
        axis.set_aspect("equal")
        print(f"{name}: off by {far.max():.2f} m at most, exact in {np.mean(far < 0.01):.2f}")
    axes[0].set_ylabel("north (m)")
    save(figure, folder / "told.png")
