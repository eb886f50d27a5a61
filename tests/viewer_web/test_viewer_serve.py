"""`serve` on a real socket: the address it announces answers, and an interrupt ends it."""

import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from planner_core.errors import RequirementError
from viewer_web.server import serve

SERVE = """
import sys
from pathlib import Path
from viewer_web.server import serve
try:
    serve(Path(sys.argv[1]), built_app=Path(sys.argv[2]), on_ready=lambda address: print(address, flush=True))
except KeyboardInterrupt:
    sys.exit(130)
"""


def test_serve_announces_an_address_that_answers_and_stops_on_interrupt(plan_folder: Path, built_app: Path) -> None:
    command = [sys.executable, "-c", SERVE, str(plan_folder), str(built_app)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            address = process.stdout.readline().strip()
            assert address.startswith("http://127.0.0.1:")
            with urllib.request.urlopen(address + "plan/plan.json", timeout=20) as answer:
                assert b"tlsplan/plan/1" in answer.read()
                assert "server" not in answer.headers
            process.send_signal(2)
            _, said = process.communicate(timeout=20)
        finally:
            process.kill()
    assert process.returncode == 130
    assert said == ""


def test_serve_refuses_a_port_in_use(plan_folder: Path, built_app: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(RequirementError, match=f"port {port}.*another port"):
            serve(plan_folder, port=port, on_ready=lambda _: None, built_app=built_app)


def test_serve_refuses_a_port_that_does_not_exist(plan_folder: Path, built_app: Path) -> None:
    with pytest.raises(RequirementError, match="can't listen"):
        serve(plan_folder, port=70000, on_ready=lambda _: None, built_app=built_app)
