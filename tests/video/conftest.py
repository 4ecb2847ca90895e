from tests.support.films import film

__all__ = ["film"]
