"""Which connections the server keeps, and how long it waits for them.

uvicorn waits for ever for what a connection sends, and counts every connection alike. Here a request has to arrive, and
its answer has to be read, in time; and where there is no more room, a connection without the token goes, the oldest of
the client that has most. So whoever has the token is answered, whatever others hold open.
"""

import asyncio
import time
from collections import Counter
from collections.abc import Collection, Iterable
from ipaddress import IPv6Address, ip_address
from typing import cast

import h11
from starlette.types import Scope
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_S = 4.0
"""For the head of a request, from its first byte on, or from the opening of the connection; without the token for all
of the request."""
BODY_S = 30.0
"""For the body of a request with the token: 1 MiB at most, of a drawing 16."""
UNREAD_S = 30.0
"""For reading the next tens of kilobytes of an answer."""
MOST_OF_ONE_CLIENT = 512
MOST_CONNECTIONS = 640
"""Of all clients together, streams of events apart: each is an open file, and processes may have 1024."""
GO_AT_ONCE = 32
"""Connections without the token that are closed together: to find out which takes milliseconds."""
ACCEPTED_AT_ONCE = 64
"""A small part of what one client may have: a request is read some rounds after its connection was accepted, and those
accepted meanwhile must not have pushed it out."""
MOST_WAITING = 2048
"""To be accepted: whom the system finds no room for there asks again after 1, 3, 7, 15 s."""

_ADMITTED = "is_admitted"
_STREAMS = "is_stream"


def note_admitted(scope: Scope) -> None:
    """Remember of a request that it has the token."""
    scope.setdefault("state", {})[_ADMITTED] = True


def is_admitted(scope: Scope) -> bool:
    """Whether a request was noted to have the token."""
    return _ADMITTED in scope.get("state", {})


def note_stream(scope: Scope) -> None:
    """Remember of a request that its answer is a stream of events, which are counted apart."""
    scope.setdefault("state", {})[_STREAMS] = True


def client_of(host: str) -> str:
    """Return who has an address: of IPv6 the /64, of which a machine has all addresses."""
    try:
        address = ip_address(host.partition("%")[0])
    except ValueError:
        return host
    if not isinstance(address, IPv6Address):
        return host
    mapped = address.ipv4_mapped
    return str(mapped) if mapped is not None else address.packed[:8].hex()


class Connection(H11Protocol):
    """A connection of uvicorn's that knows since when it waits for the other side."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Make room where there is none; else uvicorn answers 503."""
        super().connection_made(transport)
        self.name = client_of(self.client[0]) if self.client else ""
        self.opened_s = time.monotonic()
        self._receives_since_s: float | None = self.opened_s
        self._unread_since_s: float | None = None
        if not make_room(self, cast(Collection[Connection], self.connections)):
            self.limit_concurrency = 0

    def data_received(self, data: bytes) -> None:
        """Note when a request begins, when its head is complete, and when all of it is here."""
        if self._receives_since_s is None:
            self._receives_since_s = time.monotonic()
        before = self.conn.their_state
        super().data_received(data)
        now = self.conn.their_state
        if now not in (h11.IDLE, h11.SEND_BODY):
            self._receives_since_s = None
        elif now is not before:
            self._receives_since_s = time.monotonic()

    def resume_writing(self) -> None:
        """Note that the other side reads."""
        self._unread_since_s = None
        super().resume_writing()

    @property
    def is_admitted(self) -> bool:
        """Whether its last request has the token."""
        return _ADMITTED in self._state()

    @property
    def is_stream(self) -> bool:
        """Whether it is a stream of events."""
        return self._is_answering() and _STREAMS in self._state()

    @property
    def may_go(self) -> bool:
        """Whether it may be closed for others' sake: it has no token, or nothing to do."""
        return not (self.is_admitted and self._is_answering())

    def is_overdue(self, now_s: float) -> bool:
        """Whether the other side had its time to send, or to read; ask it every second or so."""
        if self.transport.get_write_buffer_size() == 0:
            self._unread_since_s = None
        elif self._unread_since_s is None:
            self._unread_since_s = now_s
        reads_body = self.is_admitted and self.conn.their_state is h11.SEND_BODY
        return _is_over(self._receives_since_s, BODY_S if reads_body else HEAD_S, now_s) or _is_over(
            self._unread_since_s, UNREAD_S, now_s
        )

    def _is_answering(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    def _state(self) -> dict[str, object]:
        return self.scope.get("state", {}) if self.scope is not None else {}


def make_room(new: Connection, connections: Collection[Connection]) -> bool:
    """Have room for a new connection, which is among all, closing others where need be; False where none may go."""
    if len(connections) <= MOST_OF_ONE_CLIENT or not _is_full(new, connections):  # quick: thousands a second may come
        return True
    counted = [each for each in connections if not (each.transport.is_closing() or each.is_stream)]
    if not _is_full(new, counted):
        return True
    of_client = Counter(each.name for each in counted)
    if of_client[new.name] > MOST_OF_ONE_CLIENT:
        counted = [each for each in counted if each.name == new.name]
    may_go = sorted(
        (each for each in counted if each.may_go and each is not new),
        key=lambda each: (each.is_admitted, -of_client[each.name], each.opened_s),
    )
    for each in [each for each in may_go if not each.is_admitted][:GO_AT_ONCE] or may_go[:1]:
        each.transport.abort()
    return bool(may_go)


def _is_full(new: Connection, connections: Collection[Connection]) -> bool:
    of_client = sum(each.name == new.name for each in connections)
    return of_client > MOST_OF_ONE_CLIENT or len(connections) > MOST_CONNECTIONS


def close_overdue(connections: Iterable[object]) -> None:
    """Close those whose other side had its time."""
    now_s = time.monotonic()
    for each in list(connections):
        if isinstance(each, Connection) and each.is_overdue(now_s):
            each.transport.abort()


def _is_over(since_s: float | None, limit_s: float, now_s: float) -> bool:
    return since_s is not None and now_s - since_s > limit_s
