"""Work on many triangles a chunk at a time, so that what is made on the way does not grow with the scene."""

from __future__ import annotations

from collections.abc import Iterator

#: Triangles at once: their corners are 19 MB in float64, and fit into most processors' caches.
_CHUNK = 2**18


def chunks(count: int) -> Iterator[slice]:
    """Slices of 0 .. count - 1, one after the other; none of nothing."""
    return (slice(first, min(first + _CHUNK, count)) for first in range(0, count, _CHUNK))
