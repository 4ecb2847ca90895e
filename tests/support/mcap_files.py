"""Reads MCAP files by the independent package ``mcap``, not by the SDK that wrote them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.simulation.camera.meshes import rotation_matrix

EXTRA = ("foxglove", "mcap", "mcap_protobuf")
"""What these tests need; the extra ``dev`` installs it."""


def needs_extra() -> None:
    """Skip the tests of a module where the extra is not installed."""
    for name in EXTRA:
        pytest.importorskip(name)


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """A file's messages: all times in the order of the file, (time, message) by topic."""

    times_ns: list[int]
    topics: dict[str, list[tuple[int, Any]]]
    schemas: dict[str, str]
    raw: list[bytes]

    def at(self, topic: str, time_ns: int) -> Any:
        """Return the only message of a topic at a time."""
        (found,) = [message for time, message in self.topics[topic] if time == time_ns]
        return found


def read_mcap(path: Path) -> Recording:
    """Return the content of a file whose checksums are right."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    topics: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    times, raw, schemas = [], [], {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            assert schema is not None
            assert message.publish_time == message.log_time
            times.append(message.log_time)
            raw.append(message.data)
            topics[channel.topic].append((message.log_time, decoded))
            schemas[channel.topic] = schema.name
    return Recording(times_ns=times, topics=dict(topics), schemas=schemas, raw=raw)


def picture_of(message: Any) -> NDArray[np.uint8]:
    """Return the picture of a CompressedImage, RGB."""
    bgr = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
    assert bgr is not None
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8)


def outline_of(message: Any, number: int = 0) -> NDArray[np.float64]:
    """Return the corners (n, 2) of an annotation, whole numbers at the centres of pixels."""
    points = message.points[number].points
    return np.array([(each.x, each.y) for each in points]) - 0.5


def matrix_to_world(message: Any, frame: str) -> NDArray[np.float64]:
    """Return the matrix (4, 4) that turns places of a frame into those of the world."""
    whole = np.eye(4)
    while frame != "world":
        (found,) = [each for each in message.transforms if each.child_frame_id == frame]
        turn, shift = found.rotation, found.translation
        step = np.eye(4)
        step[:3, :3] = rotation_matrix((turn.x, turn.y, turn.z, turn.w))
        step[:3, 3] = shift.x, shift.y, shift.z
        whole, frame = step @ whole, found.parent_frame_id
    return whole


def decoded(message: Any) -> Any:
    """Return a message of an export as protobuf reads it with the schema that a file holds."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    schema, pool = message.get_schema(), descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    return kind.FromString(message.encode())
