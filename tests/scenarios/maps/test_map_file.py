"""A hostile or oversized map is one short error, and costs neither memory nor time."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import pytest_garl.scenarios.maps.map as maps
from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.files import dumps, load
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map

LAWN = (Path(maps.__file__).parent / "lawn.toml").read_text()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("person = 2", "person = 10000000", "'objects.person': found 10000000, .* from 0 to 50$"),
        (
            "height_m = 5.5",
            "branches = 1000000000",
            r"'bodies\[0\].branches': found 1000000000, expected a whole number from 1 to 50$",
        ),
        (
            "bounds_m = [-10.0, 10.0, -20.0, 20.0]",
            "bounds_m = [-50.5, 50.0, -50.0, 50.0]",
            "'bounds_m': found 10050 square metres, expected at most 10000",
        ),
        (
            "bounds_m = [-10.0, 10.0, -20.0, 20.0]",
            "bounds_m = [-1e6, 1e6, -1e6, 1e6]",
            "'bounds_m': found -1000000.0, expected a number from -300 to 300$",
        ),
        ("position_m = [4.6", "position_m = [1e300", r"'bodies\[0\].position_m': found 1e\+300"),
        ("yaw_deg = ", "yaw_deg = 1e9 # ", r"yaw_deg': found 1000000000.0, .* from -360 to 360$"),
        ("seed = 2029", f"seed = 0x{'f' * 20}", "'ground.seed': found"),
        ("colour = [", "colour = [true, 1, 1] # [", "three whole numbers from 0 to 255"),
    ],
)
def test_a_map_too_large_for_the_machine_is_refused(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    text = LAWN + "\nyaw_deg = 0.0\n"
    assert old in text
    (tmp_path / "mine.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(ScenarioError, match=words):
        load_map("mine", [tmp_path])


def test_a_negative_zero_is_a_size_like_zero(tmp_path: Path) -> None:
    layer = LAYER.format(kind="patches", points="[[0, 0]]") + "size_m = -0.0\nwidth_m = -0.0\n"
    (tmp_path / "mine.toml").write_text(LAWN + layer)
    found = load_map("mine", [tmp_path]).ground.layers[-1]
    assert (str(found.size_m), str(found.width_m)) == ("0.0", "0.0")


def test_the_largest_area_and_count_are_taken(tmp_path: Path) -> None:
    text = LAWN.replace("[-10.0, 10.0, -20.0, 20.0]", "[-50.0, 50.0, -50.0, 50.0]")
    (tmp_path / "mine.toml").write_text(text.replace("person = 2", "person = 50"))
    found = load_map("mine", [tmp_path])
    assert found.bounds_m == (-50.0, 50.0, -50.0, 50.0)
    assert ("person", 50) in found.objects


LAYER = """
[[layers]]
kind = "{kind}"
points_m = {points}
"""


@pytest.mark.parametrize(
    ("kind", "points", "words"),
    [
        ("rectangle", "[[0, 0]]", r"points_m': found 1 points, expected exactly 2"),
        ("polygon", "[[0, 0], [1, 1]]", "found 2 points, expected 3 to 1000"),
        ("line", "[[0, 0]]", "found 1 points, expected 2 to 1000"),
        ("circle", "[]", "found 0 points, expected exactly 1"),
        ("line", str([[0, 0]] * 1001), "found 1001 points, expected 2 to 1000"),
        ("line", "[[0, 0], [301, 0]]", "found 301, expected a number from -300 to 300"),
        ("marker", "[[0, 0]]\nmarker_id = 50", "marker_id': found 50, .* from 1 to 49$"),
    ],
)
def test_a_layer_that_cannot_be_painted_is_refused(
    tmp_path: Path, kind: str, points: str, words: str
) -> None:
    (tmp_path / "mine.toml").write_text(LAWN + LAYER.format(kind=kind, points=points))
    with pytest.raises(ScenarioError, match=words):
        load_map("mine", [tmp_path])


@pytest.mark.parametrize(("table", "most"), [("layers", 200), ("bodies", 200)])
def test_a_map_has_no_more_tables_than_can_be_painted(
    tmp_path: Path, table: str, most: int
) -> None:
    one = {
        "layers": LAYER.format(kind="circle", points="[[0, 0]]"),
        "bodies": '\n[[bodies]]\nkind = "post"\nposition_m = [9.0, 9.0]\n',
    }[table]
    (tmp_path / "mine.toml").write_text(LAWN + one * 201)
    words = rf"mine.toml: key '{table}': found 20\d tables, expected at most {most}$"
    with pytest.raises(ScenarioError, match=words):
        load_map("mine", [tmp_path])


@pytest.mark.parametrize("name", ["la\nwn", "la\twn", "la\x1bwn", "la\u202ewn"])
def test_a_map_with_an_invisible_name_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / f"{name}.toml").write_text(LAWN)
    with pytest.raises(ScenarioError, match="characters that cannot be seen") as caught:
        load_map(name, [tmp_path])
    assert str(caught.value).isprintable()


def test_a_map_with_a_long_name_is_refused(tmp_path: Path) -> None:
    for length in (50, 51):
        (tmp_path / f"{'m' * length}.toml").write_text(LAWN)
    assert load_map("m" * 50, [tmp_path])
    with pytest.raises(ScenarioError, match="has 51 characters, expected at most 50"):
        load_map("m" * 51, [tmp_path])


@pytest.mark.parametrize("name", ['la"wn', "la\\wn", "la wn", "ländle"])
def test_a_map_with_a_strange_name_is_written_so_that_it_can_be_read(
    tmp_path: Path, name: str
) -> None:
    (tmp_path / f"{name}.toml").write_text(LAWN)
    map = load_map(name, [tmp_path])
    scenario = decode(genome_for(map).nominal, genome_for(map), map=name, seed=1)
    (tmp_path / "one").write_text(dumps(scenario, map))
    assert load(tmp_path / "one", (tmp_path,)) == scenario


@pytest.mark.parametrize(
    ("target", "words"),
    [("/dev/zero", "found a device"), ("nowhere", "No such file"), ("mine.toml", "Too many")],
)
def test_a_map_behind_a_bad_link_is_refused(tmp_path: Path, target: str, words: str) -> None:
    (tmp_path / "mine.toml").symlink_to(target)
    with pytest.raises(ScenarioError, match=f"mine.toml: cannot be read: {words}"):
        load_map("mine", [tmp_path])


def test_a_map_in_a_pipe_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "mine.toml")
    with pytest.raises(ScenarioError, match="found a pipe"):
        load_map("mine", [tmp_path])
