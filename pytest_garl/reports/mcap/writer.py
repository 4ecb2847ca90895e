"""Writes a flight as one MCAP file, whole or not at all."""

from __future__ import annotations

import heapq
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import foxglove
from foxglove import Channel, Context
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from pytest_garl.errors import SavingError
from pytest_garl.reports.film.flight_video import check_scenario
from pytest_garl.reports.mcap.camera_topics import IMAGE, camera_topics
from pytest_garl.reports.mcap.export import Export
from pytest_garl.reports.mcap.log_topic import events
from pytest_garl.reports.mcap.path_topics import flown_path, plans
from pytest_garl.reports.mcap.scene import ground, scene
from pytest_garl.reports.mcap.shown_pictures import ShownPictures
from pytest_garl.reports.mcap.state import sights, states
from pytest_garl.reports.mcap.transforms import transforms
from pytest_garl.reports.mcap.values import Logged
from pytest_garl.verdicts.judge import judge


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenFile:
    """A file that was written: the number of its messages and pictures, and its size."""

    messages: int
    pictures: int
    bytes: int


def write_mcap(export: Export, path: Path) -> WrittenFile:
    """Write a flight to ``path`` (.mcap); the same flight gives the same bytes.

    The file appears once it is complete.  Raises GarlError where the flight is not one of its
    scenario, SavingError where the file cannot be written.
    """
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with scratch.open("wb") as file:
            messages, pictures = _write(in_order(export), file)
        size = scratch.stat().st_size
        scratch.replace(path)
    except OSError as error:
        raise SavingError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        scratch.unlink(missing_ok=True)
    return WrittenFile(messages=messages, pictures=pictures, bytes=size)


def in_order(export: Export) -> Iterator[Logged]:
    """Yield all messages of a flight in the order of time."""
    flight, place = export.flight, export.place
    streams: list[Iterable[Logged]] = [scene(flight, place), flown_path(flight)]
    pictures = None
    if place is not None:
        check_scenario(flight, place.placed)
        streams.append(ground(place))
        if place.camera is not None:
            pictures = ShownPictures(flight, place, place.camera)
    if pictures is None:
        streams.append(transforms(flight, (), None))
    else:
        # Before the pictures of the same time, which need them.
        streams += [
            transforms(flight, pictures.times_s, pictures.turn, pictures.camera.offset_m),
            camera_topics(pictures),
        ]
    streams += [states(flight, export.limits), sights(flight), plans(flight)]
    streams.append(events(export, judge(flight, export.limits)))
    return heapq.merge(*streams, key=lambda logged: logged.time_ns)


def _write(stream: Iterator[Logged], file: BinaryIO) -> tuple[int, int]:
    """Write messages; return their number, and that of the pictures among them."""
    context, output = Context(), _Output(file)
    # One thread: nothing else may decide where a compressed block ends.
    options = MCAPWriteOptions(compression=MCAPCompression.Zstd, compression_threads=0)
    channels: dict[str, Channel] = {}
    messages = pictures = 0
    try:
        with foxglove.open_mcap(output, context=context, writer_options=options):
            for each in stream:
                channel = channels.get(each.topic)
                if channel is None:
                    channel = channels[each.topic] = Channel(
                        each.topic,
                        schema=each.message.get_schema(),
                        message_encoding="protobuf",
                        context=context,
                    )
                channel.log(each.message.encode(), log_time=each.time_ns)
                # The SDK itself only reports a full disk when the file is closed.
                output.check()
                messages += 1
                pictures += each.topic == IMAGE
    except RuntimeError as error:
        output.check()
        raise SavingError(f"the MCAP file cannot be written: {error}") from error
    finally:
        for channel in channels.values():
            channel.close()
    output.check()
    return messages, pictures


class _Output:
    """A file that remembers the first error, which the SDK does not pass on."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the error of an earlier call."""
        if self._error is not None:
            raise self._error

    def write(self, content: bytes | bytearray) -> int:
        """Write bytes."""
        try:
            return self._file.write(content)
        except OSError as error:
            self._error = self._error or error
            raise

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to a place of the file."""
        return self._file.seek(offset, whence)

    def flush(self) -> None:
        """Hand all bytes to the system."""
        try:
            self._file.flush()
        except OSError as error:
            self._error = self._error or error
            raise
