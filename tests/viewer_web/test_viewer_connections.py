"""Attacks on the server's connections, on real sockets: whoever has the token is answered nevertheless."""

import contextlib
import http.client
import socket
import subprocess
import sys
import time
import urllib.parse
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from threading import Barrier
from types import SimpleNamespace
from typing import Any

import pytest

from viewer_web.server import connections
from viewer_web.server.connections import client_of, make_room

from .conftest import write_app, write_plan

#: For what takes seconds at most on a machine that has nothing else to do.
WAIT_S = 120
SERVE = """
import sys
from pathlib import Path
from viewer_web.server import connections
from viewer_web.server.serve import serve
for told in sys.argv[3:]:
    name, _, value = told.partition("=")
    setattr(connections, name, float(value))
serve(Path(sys.argv[1]), built_app=Path(sys.argv[2]), live=False, on_ready=lambda address: print(address, flush=True))
"""


@dataclass(frozen=True)
class Served:
    """A server in a process of its own."""

    port: int
    token: str
    process: subprocess.Popen[str]

    def open(self, sent: str = "") -> socket.socket:
        line = socket.create_connection(("127.0.0.1", self.port), timeout=WAIT_S)
        line.sendall(sent.encode())
        return line

    def head(self, path: str, *, token: bool = True, more: str = "") -> str:
        told = f"x-tlsplan-token: {self.token}\r\n" if token else ""
        return f"GET {path} HTTP/1.1\r\nhost: 127.0.0.1:{self.port}\r\n{told}{more}\r\n"

    def status(self, path: str = "/plan/plan.json") -> int:
        link = http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)
        try:
            link.request("GET", path, headers={"x-tlsplan-token": self.token})
            answer = link.getresponse()
            answer.read()
            return answer.status
        finally:
            link.close()


def serving(plan_folder: Path, built_app: Path, *settings: str) -> Iterator[Served]:
    command = [sys.executable, "-c", SERVE, str(plan_folder), str(built_app), *settings]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            address = urllib.parse.urlsplit(process.stdout.readline().strip())
            yield Served(address.port, address.query.removeprefix("token="), process)
        finally:
            process.kill()


LARGE_BYTES = 64_000_000


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A plan folder with a large file, and the application."""
    root = tmp_path_factory.mktemp("shown")
    plan = write_plan(root)
    (plan / "viewer" / "clouds" / "S002.u16").write_bytes(bytes(LARGE_BYTES))
    return plan, write_app(root)


@pytest.fixture(scope="module")
def served(shown: tuple[Path, Path]) -> Iterator[Served]:
    """A server with the limits that users have, and less time."""
    yield from serving(*shown, "HEAD_S=1", "BODY_S=2", "UNREAD_S=2")


@pytest.fixture(scope="module")
def patient(shown: tuple[Path, Path]) -> Iterator[Served]:
    """A server that waits for ever, so that only its limits of numbers help."""
    yield from serving(*shown, "HEAD_S=1e9", "BODY_S=1e9", "UNREAD_S=1e9")


@pytest.mark.parametrize("sent", ["", "GET / HTTP/1.1\r\nhost: "])
def test_half_open_connections_shut_nobody_out(patient: Served, sent: str) -> None:
    with ExitStack() as attack:
        for _ in range(63):
            attack.enter_context(patient.open(sent))
        assert patient.status() == 200


def test_more_half_open_connections_than_there_is_room_for_shut_nobody_out(patient: Served) -> None:
    with ExitStack() as attack:
        for _ in range(connections.MOST_OF_ONE_CLIENT + 100):
            attack.enter_context(patient.open("GET /"))
        assert patient.status() == 200


def test_two_hundred_requests_at_once_are_all_answered_under_attack(patient: Served) -> None:
    n = 200
    together = Barrier(n)

    def ask(_: int) -> int:
        together.wait(WAIT_S)
        return patient.status()

    with ExitStack() as attack:
        for _ in range(400):
            attack.enter_context(patient.open("GET /"))
        with ThreadPoolExecutor(n) as threads:
            assert Counter(threads.map(ask, range(n))) == {200: n}


def is_closed_though_fed(line: socket.socket, fed: bytes) -> bool:
    """Whether the server closes a connection that is sent a byte every now and then."""
    line.settimeout(0.5)
    until_s = time.monotonic() + WAIT_S
    while time.monotonic() < until_s:
        try:
            line.sendall(fed)
            if not line.recv(65536):
                return True
        except TimeoutError:
            continue
        except ConnectionError:
            return True
    return False


def test_a_head_that_never_ends_is_not_waited_for(served: Served) -> None:
    with served.open("GET /") as line:
        assert is_closed_though_fed(line, b"a")


def test_a_connection_that_says_nothing_is_closed(served: Served) -> None:
    with served.open() as line:
        assert line.recv(1) == b""


def test_a_second_head_that_never_ends_is_not_waited_for(served: Served) -> None:
    with served.open(served.head("/plan/plan.json")) as line:
        assert line.recv(65536).startswith(b"HTTP/1.1 200")
        assert is_closed_though_fed(line, b"a")


def endless_body(server: Served, *, token: bool) -> socket.socket:
    more = "content-type: application/json\r\ncontent-length: 1000000\r\n"
    return server.open(server.head("/api/review/changes", token=token, more=more).replace("GET", "POST"))


def test_a_body_that_never_ends_is_not_waited_for(served: Served) -> None:
    with endless_body(served, token=True) as line:
        assert is_closed_though_fed(line, b" ")


@pytest.mark.slow
def test_without_the_token_no_body_is_waited_for(shown: tuple[Path, Path]) -> None:
    for served in serving(*shown, "BODY_S=1e9"):
        with endless_body(served, token=False) as line:
            assert is_closed_though_fed(line, b" ")


def test_a_body_that_is_longer_than_it_says_is_not_read_on(served: Served) -> None:
    head = served.head("/api/review/changes", more="content-type: application/json\r\ncontent-length: 4\r\n")
    answer = b""
    with served.open() as line:
        with contextlib.suppress(ConnectionError):  # it answers, and hangs up on what it has not read
            line.sendall(head.replace("GET", "POST").encode() + b"null" + b"x" * 100_000)
        with contextlib.suppress(ConnectionError):
            while part := line.recv(65536):
                answer += part
    assert answer.startswith(b"HTTP/1.1 422")  # of the four bytes: null is JSON, and no document
    assert b"valid dictionary" in answer


def test_an_answer_that_nobody_reads_is_given_up(served: Served) -> None:
    with served.open(served.head("/plan/viewer/clouds/S002.u16")) as line:
        assert line.recv(100)  # it is answered
        files = Path(f"/proc/{served.process.pid}/fd")
        n_open = n_sockets(files)
        until_s = time.monotonic() + WAIT_S
        while n_sockets(files) >= n_open and time.monotonic() < until_s:
            time.sleep(0.2)
        assert n_sockets(files) < n_open
        assert read_all(line) < LARGE_BYTES


def n_sockets(files: Path) -> int:
    found = 0
    for each in files.iterdir():
        try:
            found += str(each.readlink()).startswith("socket:")
        except FileNotFoundError:
            continue
    return found


def read_all(line: socket.socket) -> int:
    n_read = 0
    try:
        while part := line.recv(1 << 20):
            n_read += len(part)
    except ConnectionError:
        pass
    return n_read


def test_a_download_that_is_slow_but_read_is_not_given_up(served: Served) -> None:
    with served.open(served.head("/plan/viewer/clouds/S002.u16")) as line:
        n_read = 0
        while n_read < LARGE_BYTES:
            part = line.recv(1_000_000)
            assert part, f"closed after {n_read} bytes"
            n_read += len(part)
            time.sleep(0.05)


def test_streams_of_events_take_no_room_of_requests_and_have_limits_of_their_own(patient: Served) -> None:
    from viewer_web.server.events import MOST_OF_ONE_CLIENT

    with ExitStack() as pages:
        for _ in range(MOST_OF_ONE_CLIENT):
            line = pages.enter_context(patient.open(patient.head("/api/events")))
            assert line.recv(65536).startswith(b"HTTP/1.1 200")
        assert patient.status("/api/events") == 503
        assert patient.status() == 200


# ----------------------------------------------------------------------------------------------------- who has to go
def line(name: str, opened_s: float, *, admitted: bool = False, busy: bool = False, stream: bool = False) -> Any:
    closed: list[bool] = []
    return SimpleNamespace(
        name=name, opened_s=opened_s, is_admitted=admitted, may_go=not (admitted and busy), is_stream=stream,
        transport=SimpleNamespace(is_closing=lambda: bool(closed), abort=lambda: closed.append(True)),
    )  # fmt: skip


def gone(lines: list[Any]) -> list[float]:
    return [each.opened_s for each in lines if each.transport.is_closing()]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "MOST_OF_ONE_CLIENT", 3)
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 5)
    monkeypatch.setattr(connections, "GO_AT_ONCE", 1)


def comes(name: str, lines: list[Any]) -> bool:
    new = line(name, 100)
    return make_room(new, [*lines, new])


@pytest.mark.usefixtures("few")
def test_a_client_with_too_many_loses_its_oldest_without_the_token() -> None:
    lines = [line("a", 1, admitted=True), line("b", 2), line("a", 4), line("a", 3)]
    assert comes("a", lines)
    assert gone(lines) == [3]


@pytest.mark.usefixtures("few")
def test_where_all_is_full_the_client_with_most_loses_one() -> None:
    lines = [line("b", 1), line("a", 2), line("a", 3), line("c", 4, admitted=True), line("d", 5)]
    assert comes("e", lines)
    assert gone(lines) == [2]


@pytest.mark.usefixtures("few")
def test_who_has_the_token_and_nothing_to_do_goes_last_and_who_is_served_never() -> None:
    lines = [line("a", 1, admitted=True, busy=True), line("a", 2, admitted=True), line("a", 3)]
    assert comes("a", lines)
    assert gone(lines) == [3]
    lines[2] = line("a", 4, admitted=True, busy=True)
    assert comes("a", lines)
    assert gone(lines) == [2]
    lines[1] = line("a", 5, admitted=True, busy=True)
    assert not comes("a", lines)
    assert gone(lines) == []


@pytest.mark.usefixtures("few")
def test_those_without_the_token_go_together_and_those_with_it_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "GO_AT_ONCE", 2)
    lines = [line("a", 1, admitted=True), line("a", 2), line("a", 3), line("a", 4)]
    assert comes("a", lines)
    assert gone(lines) == [2, 3]
    lines = [line("a", each, admitted=True) for each in range(4)]
    assert comes("a", lines)
    assert gone(lines) == [0]


@pytest.mark.usefixtures("few")
def test_streams_of_events_are_not_counted() -> None:
    lines = [line("a", each, admitted=True, busy=True, stream=True) for each in range(9)]
    assert comes("a", lines)
    assert gone(lines) == []


def test_a_client_is_an_address_or_a_network_of_ipv6() -> None:
    assert client_of("192.0.2.7") == client_of("::ffff:192.0.2.7") != client_of("192.0.2.8")
    assert client_of("2001:db8::1") == client_of("2001:db8::ffff:1%eth0") != client_of("2001:db8:0:1::1")
    assert client_of("unix") == "unix"
