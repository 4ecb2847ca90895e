from tests.support.videos import video

__all__ = ["video"]
