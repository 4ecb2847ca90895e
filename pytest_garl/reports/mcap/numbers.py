"""Messages of numbers, for charts: a schema of protobuf whose fields are all doubles.

Foxglove has no schema for such messages.  The schema is written out here as the public
documentation of protobuf describes it (``descriptor.proto``), so that no compiler is needed.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass

from foxglove import Schema

_PACKAGE = "pytest_garl"
_LENGTH, _FIXED64 = 2, 1
"""Wire types of protobuf: bytes with their length, and eight bytes."""
_OPTIONAL, _DOUBLE = 1, 1
"""``FieldDescriptorProto.LABEL_OPTIONAL`` and ``TYPE_DOUBLE``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbers:
    """Named numbers at one time; NaN stands for what is not known then.

    All messages with a ``name`` have the same keys in the same order.
    """

    name: str
    values: Mapping[str, float]

    def get_schema(self) -> Schema:
        """Return the schema: one field of the type double for each number."""
        fields = b"".join(
            _bytes(
                2, _text(1, key) + _number(3, index) + _number(4, _OPTIONAL) + _number(5, _DOUBLE)
            )
            for index, key in enumerate(self.values, start=1)
        )
        message = _text(1, self.name) + fields
        file = _text(1, f"{_PACKAGE}/{self.name}.proto") + _text(2, _PACKAGE)
        file += _bytes(4, message) + _text(12, "proto3")
        return Schema(name=f"{_PACKAGE}.{self.name}", encoding="protobuf", data=_bytes(1, file))

    def encode(self) -> bytes:
        """Return the message in protobuf's encoding."""
        return b"".join(
            _varint(index << 3 | _FIXED64) + struct.pack("<d", value)
            for index, value in enumerate(self.values.values(), start=1)
        )


def _varint(value: int) -> bytes:
    """Return a whole number in groups of seven bits, the lowest first."""
    parts = bytearray()
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*parts, value])


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _bytes(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | _LENGTH) + _varint(len(content)) + content


def _text(field: int, text: str) -> bytes:
    return _bytes(field, text.encode())
