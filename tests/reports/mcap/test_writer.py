"""The file: its topics and times, the same bytes each time, whole or not at all."""

from __future__ import annotations

import dataclasses
import getpass
import resource
from collections.abc import Iterator
from pathlib import Path

import pytest

from pytest_garl.errors import GarlError, SavingError
from pytest_garl.reports.mcap.export import Export, Place
from pytest_garl.scenarios.placed import Placed
from tests.reports.mcap.conftest import Exported
from tests.support.mcap_files import needs_extra, read_mcap
from tests.support.recorded_flights import hit_by_dog, recorded, seen
from tests.support.videos import LAWN, SCENARIO, Hovers

needs_extra()
SCHEMAS = {
    "/camera/annotations": "foxglove.ImageAnnotations",
    "/camera/calibration": "foxglove.CameraCalibration",
    "/camera/image": "foxglove.CompressedImage",
    "/events": "foxglove.Log",
    "/map": "foxglove.Grid",
    "/margins": "pytest_garl.Margins",
    "/path": "foxglove.PosesInFrame",
    "/plan": "foxglove.PosesInFrame",
    "/scene": "foxglove.SceneUpdate",
    "/sight": "pytest_garl.Sight",
    "/state": "pytest_garl.State",
    "/target": "foxglove.PoseInFrame",
    "/tf": "foxglove.FrameTransforms",
}
WITHOUT_PLACE = {
    topic: name
    for topic, name in SCHEMAS.items()
    if not topic.startswith("/camera/") and topic not in ("/map", "/plan", "/target")
}


def hovering(exported: Exported) -> Export:
    place = Place(placed=Placed(SCENARIO, LAWN), camera=Hovers.airframe.camera)
    return Export(name="lawn-g00-s00", flight=exported.flight, place=place)


def test_the_topics_have_foxgloves_schemas(exported: Exported) -> None:
    assert exported.recording.schemas == SCHEMAS


def test_the_page_lists_the_topics() -> None:
    page = (Path(__file__).parents[3] / "docs" / "export.md").read_text()
    rows = [line.split("|")[1:3] for line in page.splitlines() if line.startswith("| `/")]
    listed = {topic.strip(" `"): schema.strip(" `") for topic, schema in rows}
    assert listed == {topic: name.rpartition(".")[2] for topic, name in SCHEMAS.items()}


def test_times_are_simulated_and_in_order(exported: Exported) -> None:
    times_ns = exported.recording.times_ns
    assert times_ns == sorted(times_ns)
    assert times_ns[0] == 0
    assert times_ns[-1] == round(exported.flight.elapsed_s * 1e9)
    for topic, messages in exported.recording.topics.items():
        for time_ns, message in messages:
            if "timestamp" in message.DESCRIPTOR.fields_by_name:
                assert message.timestamp.ToNanoseconds() == time_ns, topic


def test_the_same_flight_gives_the_same_bytes(exported: Exported, tmp_path: Path) -> None:
    from pytest_garl.reports.mcap.writer import write_mcap

    again = tmp_path / "new folder" / "other name.mcap"
    written = write_mcap(hovering(exported), again)
    assert again.read_bytes() == exported.path.read_bytes()
    assert (written.messages, written.pictures) == (len(exported.recording.times_ns), 30)
    assert written.bytes == again.stat().st_size


def test_no_message_names_a_folder_of_this_machine(exported: Exported) -> None:
    content = b"".join(exported.recording.raw)
    for name in (Path.cwd(), Path.home(), exported.path.parent):
        assert str(name).encode() not in content
    assert f"/{getpass.getuser()}/".encode() not in content


def test_a_flight_without_a_place_has_poses_and_events_only(tmp_path: Path) -> None:
    from pytest_garl.reports.mcap.writer import write_mcap

    flight = recorded(
        steps=seen(range(20)), outcome="collision", contacts=(hit_by_dog(10.0),), end_s=10.0
    )
    level = dataclasses.replace(flight.uav, attitude=0 * flight.uav.attitude)
    path = tmp_path / "flight.mcap"
    written = write_mcap(Export(name="it", flight=dataclasses.replace(flight, uav=level)), path)
    assert written.pictures == 0
    found = read_mcap(path)
    assert found.schemas == WITHOUT_PLACE
    turn = found.topics["/tf"][0][1].transforms[0].rotation
    assert (turn.x, turn.y, turn.z, turn.w) == (0, 0, 0, 1)


def test_a_flight_of_another_scenario_is_refused(exported: Exported, tmp_path: Path) -> None:
    from pytest_garl.reports.mcap.writer import write_mcap

    elsewhere = SCENARIO.replace({"marker.x": -SCENARIO["marker.x"]})
    export = hovering(exported)
    assert export.place is not None
    place = dataclasses.replace(export.place, placed=Placed(elsewhere, LAWN))
    with pytest.raises(GarlError, match="not of this scenario"):
        write_mcap(dataclasses.replace(export, place=place), tmp_path / "flight.mcap")
    assert list(tmp_path.iterdir()) == []


def test_an_error_leaves_the_earlier_file(
    exported: Exported, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pytest_garl.reports.mcap import writer

    path = tmp_path / "flight.mcap"
    path.write_bytes(b"earlier")
    in_order = writer.in_order

    def breaks(export: Export) -> Iterator[object]:
        stream = in_order(export)
        for _ in range(100):
            yield next(stream)
        raise KeyboardInterrupt

    monkeypatch.setattr(writer, "in_order", breaks)
    with pytest.raises(KeyboardInterrupt):
        writer.write_mcap(hovering(exported), path)
    assert [each.name for each in tmp_path.iterdir()] == ["flight.mcap"]
    assert path.read_bytes() == b"earlier"


@pytest.fixture
def little_space() -> Iterator[None]:
    """Let no file of this process become larger than a hundred kilobytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.usefixtures("little_space")
def test_a_full_disk_is_one_clear_error(exported: Exported, tmp_path: Path) -> None:
    from pytest_garl.reports.mcap.writer import write_mcap

    with pytest.raises(SavingError, match=r"flight\.mcap: cannot be written \(File too large\)"):
        write_mcap(hovering(exported), tmp_path / "flight.mcap")
    assert list(tmp_path.iterdir()) == []
