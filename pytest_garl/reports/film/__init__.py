"""One recorded flight as a video: what the camera saw, the map from above, the height."""

from pytest_garl.reports.film.encoder import write
from pytest_garl.reports.film.flight_video import frames, rate_hz, save_video

__all__ = ["frames", "rate_hz", "save_video", "write"]
