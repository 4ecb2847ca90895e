"""In place of ROS's cv_bridge, of which there is no wheel: pictures of ROS as OpenCV has them."""

from __future__ import annotations

from typing import Any

import numpy as np


class CvBridge:
    """Takes pictures of the encoding rgb8."""

    def imgmsg_to_cv2(self, message: Any, encoding: str) -> Any:
        """Return a picture as an array (H, W, 3), blue first."""
        assert encoding == "bgr8"
        rgb = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width, 3)
        return np.ascontiguousarray(rgb[:, :, ::-1])
