from __future__ import annotations

import numpy as np

from pytest_garl.search.seeding import seed_sequence


def test_method_map_seed_and_key_each_give_other_numbers() -> None:
    searches = [
        seed_sequence("garl", "court", 0),
        seed_sequence("ga", "court", 0),
        seed_sequence("garl", "lawn", 0),
        seed_sequence("garl", "court", 1),
        seed_sequence("garl", "court", 0, 1),
    ]
    drawn = {int(np.random.default_rng(each).integers(2**62)) for each in searches}
    assert len(drawn) == len(searches)


def test_the_numbers_of_a_search_never_change() -> None:
    rng = np.random.default_rng(seed_sequence("garl", "court", 0))
    assert int(rng.integers(2**32)) == 53769788
