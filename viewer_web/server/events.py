"""What the server sends its pages by itself: server-sent events, one stream a page.

Publishers may be any thread; a stream lives in the event loop. A page that reads too slowly is cut off: it comes back
by itself and asks for everything anew, which is what the browser's `EventSource` and ours do anyway.
"""

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from typing import Any

MOST_STREAMS = 128
"""Of all pages together: each holds a connection open."""
MOST_OF_ONE_CLIENT = 32
"""One machine, or all that come through one tunnel."""
MOST_WAITING = 256
LOOK_S = 1.0
"""How often a stream looks whether another process changed the review."""
BEAT_S = 15.0
"""Seconds between signs of life of an idle stream: proxies cut silent ones after 30 to 60 s."""

_END = None


class Stream:
    """What one page has not read yet. It lives in its event loop. name : who has the page open; empty: not known."""

    def __init__(self, client: str, name: str = "") -> None:
        self.client = client
        self.name = name
        self.loop = asyncio.get_running_loop()
        self.queue: asyncio.Queue[bytes | None] = asyncio.Queue(MOST_WAITING)
        self.is_behind = False

    def put(self, event: bytes | None) -> None:
        """Add an event; where there is no room, remember that one is missing."""
        if self.queue.full():
            self.is_behind = True
        else:
            self.queue.put_nowait(event)


class EventHub:
    """Hands events to all open streams. `look` is called once in `LOOK_S` while there is one, in a thread."""

    def __init__(self, look: Callable[[], None] = lambda: None) -> None:
        self._look = look
        self._lock = threading.Lock()
        self._streams: set[Stream] = set()
        self._is_closed = False

    @property
    def n_streams(self) -> int:
        """How many pages listen."""
        return len(self._streams)

    def publish(self, name: str, document: Mapping[str, Any]) -> None:
        """Tell all pages; returns at once. Without pages nothing happens."""
        text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        self._hand_out(f"event: {name}\ndata: {text}\n\n".encode())

    def close(self) -> None:
        """End all streams, and refuse new ones: the server stops."""
        self._is_closed = True
        self._hand_out(_END)

    def open(self, client: str, name: str = "") -> Stream | None:
        """Take room for one more page of a client; None where there is none. Whoever takes it calls `leave`.

        All pages get the names of who has one open, this one, too; once for all pages of a person.

        Counted and taken in one step: requests that come at once would all find room before one of them listens.
        """
        with self._lock:
            of_client = sum(stream.client == client for stream in self._streams)
            if self._is_closed or len(self._streams) >= MOST_STREAMS or of_client >= MOST_OF_ONE_CLIENT:
                return None
            stream = Stream(client, name)
            self._streams.add(stream)
        if self._names():
            self._publish_names()
        return stream

    def leave(self, stream: Stream) -> None:
        """Give the room of a page back; twice is once."""
        with self._lock:
            was_there = stream in self._streams
            self._streams.discard(stream)
        if was_there and stream.name and stream.name not in self._names():
            self._publish_names()

    async def events(self, stream: Stream) -> AsyncIterator[bytes]:
        """Yield events as they come, until the page goes, the server stops, or the page falls too far behind."""
        try:
            yield b"retry: 1000\n\n"
            idle_s = 0.0
            while not (self._is_closed or stream.is_behind):
                try:
                    event = await asyncio.wait_for(stream.queue.get(), LOOK_S)
                except TimeoutError:
                    await asyncio.to_thread(self._look)
                    idle_s += LOOK_S
                    if idle_s >= BEAT_S:
                        yield b": still here\n\n"
                        idle_s = 0.0
                    continue
                if event is _END:
                    return
                yield event
                idle_s = 0.0
        finally:
            self.leave(stream)

    def _names(self) -> list[str]:
        with self._lock:
            return sorted({stream.name for stream in self._streams if stream.name})

    def _publish_names(self) -> None:
        self.publish("people", {"names": self._names()})

    def _hand_out(self, event: bytes | None) -> None:
        with self._lock:
            streams = list(self._streams)
        for stream in streams:
            if not stream.loop.is_closed():
                stream.loop.call_soon_threadsafe(stream.put, event)
