"""One recorded flight as a film: what the camera saw, the map from above, the height."""

from pytest_garl.video.encoder import write
from pytest_garl.video.film import frames, rate_hz, save_video

__all__ = ["frames", "rate_hz", "save_video", "write"]
