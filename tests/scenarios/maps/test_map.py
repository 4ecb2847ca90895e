"""Maps are found by name, among the user's and the package's."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.maps.loading import load_map, map_names


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("title", "title = ", "not valid TOML"),
        ('texture = "grass"', 'texture = "lava"', "'ground.texture': found 'lava'"),
        ('kind = "tree"', 'kind = "ufo"', "'bodies[0].kind': found 'ufo'"),
        ("person = 2", "whale = 2", "'objects.whale': unknown key"),
        ("seed = 2029", "", "'ground.seed': missing"),
        ("height_m = 5.5", "height_m = -1", "'bodies[0].height_m': found -1"),
        ("bounds_m = [-10.0", "bounds_m = [-5.0", "'bounds_m': the disc of 7.5 m"),
    ],
)
def test_a_broken_map_names_file_and_key(tmp_path: Path, old: str, new: str, expected: str) -> None:
    import pytest_garl.scenarios.maps.map as maps

    text = (Path(maps.__file__).parent / "lawn.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(ScenarioError) as caught:
        load_map("mine", [tmp_path])
    assert "mine.toml" in str(caught.value)
    assert expected in str(caught.value)


def test_a_users_map_is_found_by_name(tmp_path: Path) -> None:
    import pytest_garl.scenarios.maps.map as maps

    text = (Path(maps.__file__).parent / "lawn.toml").read_text()
    (tmp_path / "garden.toml").write_text(text)
    assert load_map("garden", [tmp_path]).name == "garden"
    assert map_names([tmp_path]) == tuple(sorted({*map_names(), "garden"}))


def test_an_unknown_map_lists_the_known() -> None:
    with pytest.raises(ScenarioError, match=r"unknown map 'moon'; expected one of court, .*lawn"):
        load_map("moon")
