from __future__ import annotations

import itertools

import pytest

from pytest_garl.npcs.training import rewards


@pytest.mark.parametrize(
    ("expected", "seen", "collided", "reward"),
    [
        (400, 400, False, 0.0),  # nothing is hidden
        (400, 399, False, 400 / 399),  # the first hidden pixel is worth more than 1
        (400, 200, False, 2.0),
        (400, 1, False, 5.0),  # bounded; the equation says 400
        (400, 0, False, 0.0),  # all is hidden
        (0, 0, False, 0.0),  # the marker is out of the frame
        (400, 200, True, 3.0),
        (400, 400, True, 1.0),
    ],
)
def test_the_papers_reward_follows_its_equation(
    expected: int, seen: int, collided: bool, reward: float
) -> None:
    assert rewards.paper(expected, seen, collided=collided) == pytest.approx(reward)


def test_shaping_keeps_the_return_of_an_episode() -> None:
    """Discounted, all shaping telescopes to the first potential, whatever the way."""
    discount = 0.9
    for way in ([12.0, 9.0, 9.5, 2.0, 0.3], [12.0, 40.0, 3.0, 0.1, 0.1]):
        total = 0.0
        for index, (before, after) in enumerate(itertools.pairwise(way)):
            last = index == len(way) - 2
            total += discount**index * rewards.collision_first(
                before, after, collided=last, ended=last, discount=discount
            )
        assert total == pytest.approx(discount**3 - rewards.potential(12.0))


def test_the_potential_grows_towards_the_column() -> None:
    assert rewards.potential(0) == 0 > rewards.potential(5) > rewards.potential(10)
    assert rewards.potential(30) == rewards.potential(50)
