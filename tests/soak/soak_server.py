"""A long-running viewer's server, and one under attack: memory and open files stay flat, and users are answered.

    python tests/soak/soak_server.py [--write docs/benchmarks/server.md]

A synthetic scene is planned, and `tlsplan view` started on it as users do. Four parts, each in a process of its own:

- previews of stations, and pages that are opened;
- plans that are opened for live editing, one after the other, in one process;
- a day of events: two pages listen, one reconnects every minute, another process changes the review every quarter of an
  hour. The server's clocks run a thousand times as fast;
- attacks without the token: connections that say nothing, half a head, half a body, answers that nobody reads; asked
  meanwhile with the token, and after.

Flat: what a process holds after the last tenth of a part is not more than `MOST_MORE_MIB` above what it held after the
first, and no file more is open. Exit code 1 where it isn't, or where a request with the token is not answered.
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

MOST_MORE_MIB = 16.0
FASTER = 1000.0
DAY_S = 24 * 3600.0
RECOVERY_S = 5.0
SCENE = "l-room"
WAIT_S = 300.0

TLSPLAN = """
import sys
from tlsplan.main import main
faster = float(sys.argv.pop(1))
if faster != 1:
    from viewer_web.server import events
    events.LOOK_S, events.BEAT_S = events.LOOK_S / faster, events.BEAT_S / faster
main()
"""
OPEN_PLANS = """
import sys
from pathlib import Path
from planner_core.planning.live.opening import open_live
for _ in range(int(sys.argv[2])):
    live = open_live(Path(sys.argv[1]))
    live.figures(live.draft)
    print("opened", flush=True)
    sys.stdin.readline()
"""


ATTACK = """
import socket, sys
own, port = sys.argv[1], int(sys.argv[2])
host = f"host: 127.0.0.1:{port}"
kinds = (
    "", "GET / HTTP/1.1", f"GET / HTTP/1.1\\r\\n{host}\\r\\n\\r\\n",
    f"POST /api/review/changes HTTP/1.1\\r\\n{host}\\r\\ncontent-length: 1000\\r\\n"
    "content-type: application/json\\r\\n\\r\\n{",
)
kept = []
for number in range(10**9):
    try:
        kept.append(socket.create_connection(("127.0.0.1", port), timeout=1.0, source_address=(own, 0)))
        kept[-1].sendall(kinds[number % len(kinds)].encode())
    except OSError:
        pass
    if len(kept) > 900:
        kept.pop(0).close()
"""


@dataclass
class Part:
    """What a part did: how often, what the process held after each tenth of it, what was not answered."""

    name: str
    n: int
    mib: list[float] = field(default_factory=list)
    files: list[int] = field(default_factory=list)
    refused: int = 0
    seconds: float = 0.0

    @property
    def is_good(self) -> bool:
        flat = self.mib[-1] - self.mib[0] <= MOST_MORE_MIB and self.files[-1] <= self.files[0]
        return flat and self.refused == 0

    def row(self) -> str:
        return (
            f"| {self.name} | {self.n:,} | {self.mib[0]:.0f} | {self.mib[-1]:.0f} | {max(self.mib):.0f} | "
            f"{self.files[0]} | {self.files[-1]} | {self.refused} | {self.seconds:.0f} |"
        )


def held(pid: int) -> tuple[float, int]:
    """Resident memory, MiB, and open files of a process."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    kib = next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))
    return kib / 1024, len(list(Path(f"/proc/{pid}/fd").iterdir()))


def cpu_s_of(pid: int) -> float:
    """Processor time of a process."""
    words = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def in_tenths(part: Part, pid: int, step: Callable[[int], bool]) -> Part:
    """Do all steps, each says whether it was answered, and note what the process holds after each tenth."""
    start_s = time.monotonic()
    for number in range(part.n):
        part.refused += not step(number)
        if (number + 1) % max(part.n // 10, 1) == 0:
            time.sleep(0.2)  # connections that were closed are seen to be
            mib, files = held(pid)
            part.mib.append(mib)
            part.files.append(files)
    part.seconds = time.monotonic() - start_s
    return part


@dataclass(frozen=True)
class Viewer:
    """A running `tlsplan view`."""

    pid: int
    port: int
    token: str

    def line(self) -> http.client.HTTPConnection:
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)

    def ask(self, path: str, body: object = None, line: http.client.HTTPConnection | None = None) -> tuple[int, bytes]:
        """Ask with the token, on a connection of its own unless one is given."""
        used = line or self.line()
        headers = {"x-tlsplan-token": self.token, "content-type": "application/json"}
        used.request("GET" if body is None else "POST", path, None if body is None else json.dumps(body), headers)
        answer = used.getresponse()
        content = answer.read()
        if line is None:
            used.close()
        return answer.status, content


@contextlib.contextmanager
def viewing(plan: Path, *, live: bool = True, faster: float = 1.0) -> Iterator[Viewer]:
    command = [sys.executable, "-c", TLSPLAN, f"{faster}", "view", str(plan), "--no-browser"]
    with subprocess.Popen(
        command + ([] if live else ["--no-live"]), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdout is not None
        try:
            printed = process.stdout.readline().partition("http://")[2].split()[0]
            address = urllib.parse.urlsplit(f"http://{printed}")
            assert address.port is not None
            viewer = Viewer(process.pid, address.port, address.query.removeprefix("token="))
            until_s = time.monotonic() + WAIT_S
            while live and json.loads(viewer.ask("/api/session")[1])["live"]["state"] != "ready":
                if time.monotonic() > until_s:
                    raise TimeoutError("the live side did not start")
                time.sleep(0.5)
            yield viewer
            process.send_signal(signal.SIGINT)
            process.wait(WAIT_S)
        finally:
            process.kill()


def previews_and_pages(plan: Path, n_previews: int, n_pages: int) -> list[Part]:
    """Previews on one connection, as a page has it; pages as browsers open them."""
    station = json.loads((plan / "plan.json").read_text())["stations"][0]
    x, y, z = station["position"]
    with viewing(plan) as viewer:
        line = viewer.line()

        def preview(number: int) -> bool:
            question = {
                "station": station["id"], "floor": station["floor"], "position": [x + 0.001 * (number % 400), y, z],
                "instrument_height_m": station["instrument_height_m"], "sequence": number, "client": "soak",
            }  # fmt: skip
            return viewer.ask("/api/live/preview", question, line)[0] == 200

        def page(_: int) -> bool:
            events = viewer.line()
            events.request("GET", "/api/events", headers={"x-tlsplan-token": viewer.token})
            answer = events.getresponse()
            paths = ("/", "/api/session", "/api/review", "/api/runs", "/plan/plan.json", "/api/live/figures")
            answered = [viewer.ask(path)[0] == 200 for path in paths]
            answer.close()
            events.close()
            return answer.status == 200 and all(answered)

        return [
            in_tenths(Part("previews", n_previews), viewer.pid, preview),
            in_tenths(Part("pages opened", n_pages), viewer.pid, page),
        ]


def plans_opened(plan: Path, n: int) -> Part:
    command = [sys.executable, "-c", OPEN_PLANS, str(plan), str(n)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True) as process:
        reads, writes = process.stdout, process.stdin
        assert reads is not None and writes is not None

        def opened(number: int) -> bool:
            if number:
                writes.write("\n")
                writes.flush()
            return reads.readline() == "opened\n"

        try:
            return in_tenths(Part("plans opened for live editing", n), process.pid, opened)
        finally:
            process.kill()


def day_of_events(plan: Path, hours: int) -> Part:
    """A step is a quarter of an hour of the server's clock."""
    from planner_core.review.changes import AddComment
    from planner_core.review.store import ReviewStore

    store = ReviewStore(plan)
    quarter_s = 900.0 / FASTER
    ends = threading.Event()
    heard = [0, 0]
    listening = [threading.Event(), threading.Event()]

    def listen(index: int, viewer: Viewer, for_s: float) -> None:
        while not ends.is_set():
            line = viewer.line()
            line.request("GET", "/api/events", headers={"x-tlsplan-token": viewer.token})
            answer, until_s = line.getresponse(), time.monotonic() + for_s
            listening[index].set()
            while not ends.is_set() and time.monotonic() < until_s and (told := answer.readline()):
                heard[index] += told.startswith(b"event: review")
            answer.close()
            line.close()

    with viewing(plan, live=False, faster=FASTER) as viewer, ThreadPoolExecutor(2) as pages:
        pages.submit(listen, 0, viewer, DAY_S)
        pages.submit(listen, 1, viewer, 60.0 / FASTER)
        for each in listening:
            each.wait(WAIT_S)

        def quarter(number: int) -> bool:
            before = heard[0]
            store.commit(store.current().revision, [AddComment(f"at {number}")], "soak")
            time.sleep(quarter_s)
            until_s = time.monotonic() + 30.0
            while heard[0] == before and time.monotonic() < until_s:
                time.sleep(0.01)
            return heard[0] > before

        try:
            return in_tenths(Part(f"{hours} h of events, by the quarter", 4 * hours), viewer.pid, quarter)
        finally:
            ends.set()


@dataclass
class Waits:
    """Of one attack: the longest wait for an answer; after its end, until all was as before, on the clock and in the
    server's own processor time."""

    longest_s: float = 0.0
    recovered_s: float = 0.0
    recovered_cpu_s: float = 0.0


def attacked(plan: Path, for_s: float, of: str) -> tuple[Part, Waits]:
    """Attack a server twice, and return the part and the waits.

    `of` is the attackers' address: a Linux machine has all of 127.0.0.0/8.
    """
    with viewing(plan, live=False) as viewer, ThreadPoolExecutor(200) as users:

        def ask(_: int) -> tuple[int, float]:
            asked_s = time.monotonic()
            try:
                status = viewer.ask("/plan/plan.json")[0]
            except (OSError, http.client.HTTPException):
                status = 0
            return status, time.monotonic() - asked_s

        list(users.map(ask, range(200)))  # what users themselves take is not the attack's
        time.sleep(2.0)
        mib, n_files = held(viewer.pid)
        part = Part(f"requests under attack from {of}, twice", 0, [mib], [n_files])
        waits = Waits()
        start_s = time.monotonic()
        for _ in range(2):
            with subprocess.Popen([sys.executable, "-c", ATTACK, of, str(viewer.port)]) as attacker:
                try:
                    until_s = time.monotonic() + WAIT_S
                    while held(viewer.pid)[1] < n_files + 200 and time.monotonic() < until_s:
                        time.sleep(0.1)
                    until_s = time.monotonic() + for_s / 2
                    while time.monotonic() < until_s:
                        for status, took_s in users.map(ask, range(200)):
                            part.n += 1
                            part.refused += status != 200
                            waits.longest_s = max(waits.longest_s, took_s)
                finally:
                    attacker.kill()
            ended_s, cpu_s = time.monotonic(), cpu_s_of(viewer.pid)
            while held(viewer.pid)[1] > n_files and time.monotonic() - ended_s < 60.0:
                time.sleep(0.05)
            waits.recovered_s = max(waits.recovered_s, time.monotonic() - ended_s)
            waits.recovered_cpu_s = max(waits.recovered_cpu_s, cpu_s_of(viewer.pid) - cpu_s)
            part.refused += viewer.ask("/api/session")[0] != 200
            time.sleep(0.5)
            mib, files = held(viewer.pid)
            part.mib.append(mib)
            part.files.append(files)
        part.seconds = time.monotonic() - start_s
        return part, waits


def planned(folder: Path) -> Path:
    """Make the scene and its plan, by the commands."""
    scene, plan = folder / f"{SCENE}.obj", folder / "plan"
    for command in (
        ["scene", SCENE, "-o", str(scene)],
        ["plan", str(scene), "-o", str(plan), "--preset", "paper", "--effort", "quick"],
    ):
        subprocess.run([sys.executable, "-c", TLSPLAN, "1", *command, "-q"], check=True)
    return plan


def main() -> int:
    """Do all parts, print them, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--previews", type=int, default=10_000)
    parser.add_argument("--pages", type=int, default=400)
    parser.add_argument("--plans", type=int, default=200)
    parser.add_argument("--hours", type=int, default=24)
    parser.add_argument("--attack", type=float, default=30.0, metavar="SECONDS")
    told = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        plan = planned(Path(folder))
        parts = [
            *previews_and_pages(plan, told.previews, told.pages),
            plans_opened(plan, told.plans),
            day_of_events(plan, told.hours),
        ]
        attacks = [attacked(plan, told.attack, of) for of in ("127.0.0.2", "127.0.0.1")]
    shorter = told != parser.parse_args(["--write", str(told.write)] if told.write else [])
    page = page_of(parts, attacks, " ".join(sys.argv[1:]) if shorter else "")
    print(page)
    if told.write:
        told.write.write_text(page, encoding="utf-8")
    others, own = attacks
    good = (
        all(each.is_good for each in (*parts, others[0]))
        and max(others[1].recovered_s, own[1].recovered_s) <= RECOVERY_S
    )
    print("good" if good else "NOT GOOD")
    return 0 if good else 1


def page_of(parts: list[Part], attacks: list[tuple[Part, Waits]], shorter: str) -> str:
    """Return the page of figures. shorter : the words of a run that is not the whole one."""
    rows = "\n".join(each.row() for each in (*parts, *(part for part, _ in attacks)))
    waits = "\n".join(
        f"| {part.name} | {each.longest_s:.1f} | {each.recovered_s:.1f} | {each.recovered_cpu_s:.1f} |"
        for part, each in attacks
    )
    length = f" A run shorter than the whole one: `{shorter}`." if shorter else ""
    machine = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, scene {SCENE}"
    return f"""\
# The server over time, and under attack
Written by `tests/soak/soak_server.py` (`make soak-server`), which says what is done and measured. What is promised:
[reliability](../reliability.md).

{machine}. Load average at the end {os.getloadavg()[0]:.0f}.{length}

Resident memory and open files of the process after the first and the last tenth of a part; of attacks, before the
first and after the second.

| part | how often | MiB, first | last | most | files, first | last | not answered | seconds |
|---|---|---|---|---|---|---|---|---|
{rows}

An attacker without the token opens connections as fast as the machine makes them, and holds up to 900, while 200 users
at a time ask with the token from 127.0.0.1. From the users' own address (a tunnel) the server can't tell them apart
before they have spoken: there one may lose its connection, and browsers ask again.

| part | longest wait, s | all as before after, s | of that, the server's processor time, s |
|---|---|---|---|
{waits}
"""


if __name__ == "__main__":
    sys.exit(main())
