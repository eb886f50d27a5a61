"""`serve` on a real socket: the address it announces answers, and an interrupt ends it."""

import http.client
import socket
import subprocess
import sys
import urllib.parse
import urllib.request
from pathlib import Path

import pytest

from planner_core.errors import RequirementError
from viewer_web.server.serve import own_names, serve

#: For what takes milliseconds on a machine that has nothing else to do.
WAIT_S = 120
SERVE = """
import sys
from pathlib import Path
from viewer_web.server.serve import serve
try:
    serve(
        Path(sys.argv[1]),
        host=sys.argv[3],
        built_app=Path(sys.argv[2]),
        live=False,
        on_ready=lambda address: print(address, flush=True),
    )
except KeyboardInterrupt:
    sys.exit(130)
"""


@pytest.mark.slow
def test_serve_announces_an_address_that_answers_and_an_interrupt_ends_it_while_pages_listen(
    plan_folder: Path, built_app: Path
) -> None:
    command = [sys.executable, "-c", SERVE, str(plan_folder), str(built_app), "127.0.0.1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            address = process.stdout.readline().strip()
            assert address.startswith("http://127.0.0.1:")
            browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
            with browser.open(address, timeout=WAIT_S) as answer:  # which hands the token in
                page = answer.geturl()
                assert "token" not in page
            with browser.open(f"{page}plan/plan.json", timeout=WAIT_S) as answer:
                assert b"tlsplan/plan/1" in answer.read()
                assert "server" not in answer.headers
            with browser.open(f"{page}api/events", timeout=WAIT_S) as events:
                assert events.readline() == b"retry: 1000\n"
                process.send_signal(2)
                assert events.read() == b"\n"  # the stream ends as streams do, not by a broken connection
            _, said = process.communicate(timeout=WAIT_S)
        finally:
            process.kill()
    assert process.returncode == 130
    assert said == ""


def own_address() -> str:
    """An address of this machine that is no loopback one; no packet is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            asked.connect(("192.0.2.254", 9))
        except OSError:
            pytest.skip("this machine has no network")
        return str(asked.getsockname()[0])


@pytest.mark.slow
def test_serve_on_all_addresses_answers_to_each_and_to_its_name_and_to_no_other(
    plan_folder: Path, built_app: Path
) -> None:
    own = own_address()
    command = [sys.executable, "-c", SERVE, str(plan_folder), str(built_app), "0.0.0.0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            address = urllib.parse.urlsplit(process.stdout.readline().strip())
            port, token = address.port, address.query.removeprefix("token=")
            statuses = {}
            for host in (own, "localhost", socket.gethostname(), "evil.example", "192.0.2.253"):
                link = http.client.HTTPConnection(own, port, timeout=WAIT_S)
                link.request("GET", "/plan/plan.json", headers={"Host": f"{host}:{port}", "x-tlsplan-token": token})
                statuses[host] = link.getresponse().status
                link.close()
            process.send_signal(2)
            process.wait(timeout=WAIT_S)
        finally:
            process.kill()
    assert statuses == {
        own: 200, "localhost": 200, socket.gethostname(): 200, "evil.example": 421, "192.0.2.253": 421,
    }  # fmt: skip


def test_own_names_are_the_host_name_in_its_usual_spellings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "survey-pc.example.org")
    assert own_names() == ("survey-pc", "survey-pc.example.org", "survey-pc.local")
    monkeypatch.setattr(socket, "gethostname", lambda: "")
    assert own_names() == ()


def test_serve_refuses_a_port_in_use(plan_folder: Path, built_app: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(RequirementError, match=f"port {port}: Address already in use. Choose another port"):
            serve(plan_folder, port=port, on_ready=lambda _: None, built_app=built_app)


def test_serve_refuses_a_port_that_does_not_exist(plan_folder: Path, built_app: Path) -> None:
    with pytest.raises(RequirementError, match="can't listen"):
        serve(plan_folder, port=70000, on_ready=lambda _: None, built_app=built_app)
