"""MAVLink over HTTP, as the program mavlink2rest of BlueOS offers it to extensions.

A message that is posted as JSON is sent to the vehicle; there is no gimbal to ask for.
"""

from __future__ import annotations

import importlib
import json
import os
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

os.environ["MAVLINK20"] = "1"  # A LANDING_TARGET of version 1 has no place in metres.
mavutil: Any = importlib.import_module("pymavlink.mavutil")

PORT = 6040
RENAMED = {"position_type": "type"}
"""Fields that JSON has under another name, since ``type`` is the message's."""


def serve() -> None:
    """Answer requests in a thread."""
    link = mavutil.mavlink_connection("udpout:127.0.0.1:14550")

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            message = json.loads(self.rfile.read(int(self.headers["Content-Length"])))["message"]
            kind = message.pop("type").lower()
            fields = {RENAMED.get(name, name): _number(each) for name, each in message.items()}
            link.mav.send(getattr(mavutil.mavlink, f"MAVLink_{kind}_message")(**fields))
            self.send_response(200)
            self.end_headers()

        def do_GET(self) -> None:
            self.send_error(404)

        def log_message(self, *_: Any) -> None:
            """Write nothing: requests are not worth a note."""

    threading.Thread(target=HTTPServer(("", PORT), Handler).serve_forever, daemon=True).start()


def _number(value: Any) -> Any:
    """Return a field as pymavlink takes it: constants are written by name."""
    return getattr(mavutil.mavlink, value["type"]) if isinstance(value, dict) else value
