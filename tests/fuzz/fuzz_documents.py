"""Documents that users write or bring, changed at random: each is read, or refused in one line.

    python -m tests.fuzz.fuzz_documents [--minutes 1] [--seed 1] [--first 0] [--count N] [--kinds requirements,reviews]

Requirements, scanners, station lists, control points, plan.json and reviews. All are read by Python, in this process,
so that thousands a minute are tried; what takes more than 15 s of its time is a hang. Change number i of a seed is
always the same: `--first i --count 1 --keep FOLDER` makes it again and keeps its file. What campaigns found is in
`KNOWN`, which `test_fuzz_documents.py` tries in every run of the tests. Exit code 1 where there are faults.
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from planner_core.coordinates.control_points import read_control_points
from planner_core.errors import PlannerError
from planner_core.plan_folder.plan_source import open_plan
from planner_core.plan_folder.stations_csv import read_station_list
from planner_core.plan_folder.usd_stage import empty_review
from planner_core.requirements.read import read_requirements
from planner_core.review.changes import AddComment, LockStation
from planner_core.review.store import ReviewStore
from planner_core.scanner.load_scanner import load_scanner, scan_modes
from tests.fuzz.fuzz_scenes import FAULTS, Change, Result, campaign_parser, changed, is_odd
from tests.oldest_plan import oldest_plan

HANGS_AFTER_S = 15.0
SCANNERS = Path(__file__).resolve().parents[2] / "planner_core" / "scanner"
REQUIREMENTS = b"""\
coverage: 95 %
spacing: 6 mm
range: 15 m
incidence: 70 deg
noise: 2 mm
reflectivity: 60 %
overlap: 30 %
network: redundant
classes:
  IfcWall*: {coverage: 95 %, spacing: 5 mm}
  "*column*": none
floors:
  Level 2: {coverage: 98 %, range: 15 m}
zones:
  - name: plant room
    outline: [[2.0, 1.0], [8.5, 1.0], [8.5, 6.0], [2.0, 6.0]]
    heights: [0.0, 3.2]
    spacing: 3 mm
    seen_from: 2
"""
STATIONS = b"id,x,y,ground_z,instrument_height,floor\nS001,1.5,2.5,0.0,1.7,F0\nS002,4.5,2.5,0.0,1.7,F0\n"
FEET = b'\xef\xbb\xbfPoint No;"X [ft]";Y [ft];z\r\n1;4,5;7,5;5,5\r\n2;14,5;7,5;5,5\r\n'
CONTROL = b"name,x,y,z,E,N,H\nA,0,0,0,500000,4000000,100\nB,10,0,0,500010,4000000,100\nC,0,8,0,500000,4000008,100\n"


class TooLongError(BaseException):
    """A document takes too long. No Exception, which code under test may catch."""


@dataclass(frozen=True)
class Kind:
    """Documents of one kind. sound : (name, contents) of some. read : raises PlannerError where it refuses a file."""

    sound: tuple[tuple[str, bytes], ...]
    read: Callable[[Path], object]


def _review(folder: Path) -> bytes:
    _plan_at(folder / "plan.json", json.dumps(oldest_plan()).encode())
    (folder / "review.usda").write_text(empty_review())
    ReviewStore(folder).commit(0, [LockStation("S001"), AddComment('say "no"\n#usda')], "Ana")
    return (folder / "review.usda").read_bytes()


def _plan_at(path: Path, contents: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(contents)


def _read_review(path: Path) -> object:
    _plan_at(path.parent / "plan.json", json.dumps(oldest_plan()).encode())
    return ReviewStore(path.parent).current()


def _read_scanner(path: Path) -> object:
    return load_scanner(path), scan_modes(path)


def kinds() -> dict[str, Kind]:
    """All kinds, by name."""
    with tempfile.TemporaryDirectory() as folder:
        review = _review(Path(folder))
    scanners = tuple((path.name, path.read_bytes()) for path in sorted(SCANNERS.glob("*.json"))[:4])
    as_json = json.dumps({"coverage": "95 %", "classes": {"IfcWall": {"spacing": "5 mm"}}}).encode()
    return {
        "requirements": Kind((("a.yaml", REQUIREMENTS), ("a.json", as_json)), read_requirements),
        "scanners": Kind(scanners, _read_scanner),
        "stations": Kind((("a.csv", STATIONS), ("feet.csv", FEET)), read_station_list),
        "control": Kind((("c.csv", CONTROL),), read_control_points),
        "plans": Kind((("plan.json", json.dumps(oldest_plan()).encode()),), lambda path: open_plan(path.parent)),
        "reviews": Kind((("review.usda", review),), _read_review),
    }


# ------------------------------------------------------------------------------------------------ changes
def _repeated(contents: bytes, rng: random.Random) -> bytes:
    """A few bytes, over and over: nesting, long numbers, long names."""
    at, length = rng.randrange(len(contents)), rng.choice((1, 1, 2, 5, 20))
    part = rng.choice((contents[at : at + length], b"[", b"{", b"(", b"9", b"- ", b"a: &a [*a", b'{"a":', b'"', b"\n"))
    return contents[:at] + part * rng.choice((2, 70, 300, 5000, 100_000)) + contents[at:]


def _made_odd(contents: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(contents))
    odd = (b"\0", b"\xff", b"\xe2\x80\xae", b"\x1b[2J", b"\r", b"\xe2\x80\xa8", b"\xed\xa0\x80", b"1e999", b"-.inf",
           b".nan", b"0x1F", b"1_000", b"12:30", b"2020-01-01", b"<<: *a", b"&a", b"!!python/object:os.system x",
           b"~", b"yes", b"%", b" mm", b"'", b"#")  # fmt: skip
    return contents[:at] + rng.choice(odd) + contents[at + rng.choice((0, 0, 1, 4)) :]


def damaged(contents: bytes, rng: random.Random) -> bytes:
    """A copy with some changes."""
    more: tuple[Change, ...] = (_repeated, _made_odd)
    for _ in range(rng.choice((1, 1, 2))):
        contents = rng.choice(more)(contents, rng) if rng.random() < 0.4 else changed(contents, ".gltf", rng)
        contents = contents or b"x"
    return contents


KNOWN: dict[str, tuple[str, str, bytes]] = {
    "brackets in a column's name": ("control", "c.csv", CONTROL.replace(b"y,z", b"y" + b"(" * 100_000 + b",z")),
    "a column's name of many words": (
        "stations",
        "a.csv",
        STATIONS.replace(b"ground_z", b"ground_z" + b"a: &a [*" * 5000),
    ),
    "a byte order mark in the middle": ("stations", "f.csv", b"#" + FEET),
    "a number that is no character in a column's name": ("control", "c.csv", b"A\xf2\x83\x9d\x9b" + CONTROL),
    "blanks in a column's name": ("stations", "a.csv", STATIONS.replace(b"ground_z", b"a" + b" _" * 30_000 + b"f")),
}
"""What campaigns found, made small: kind, name of the file, contents."""


# ------------------------------------------------------------------------------------------------ campaign
def tried(kind: Kind, path: Path) -> Result:
    """What becomes of one file."""

    def too_long(*_: object) -> None:
        raise TooLongError

    before = signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, HANGS_AFTER_S)
    try:
        kind.read(path)
    except TooLongError:
        return Result("hang", f"takes more than {HANGS_AFTER_S:.0f} s")
    except PlannerError as error:
        message = str(error)
        if is_odd(message):
            return Result("internal error", f"odd message {message!r}")
        return Result("refused", message)
    except Exception as error:  # noqa: BLE001 (they are what is looked for)
        return Result("internal error", f"{type(error).__name__}: {error}"[:300])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    return Result("read", "")


def campaign(told: argparse.Namespace, folder: Path) -> tuple[Counter[tuple[str, str]], list[str]]:
    """Counts by kind and outcome, and a line on each fault."""
    counts: Counter[tuple[str, str]] = Counter()
    faults: list[str] = []
    of_all = kinds()
    names = told.kinds.split(",") if told.kinds else sorted(of_all)
    end_s = time.monotonic() + 60.0 * told.minutes
    for number in range(told.first, told.first + told.count):
        if time.monotonic() > end_s:
            break
        rng = random.Random(f"{told.seed} {number}")
        name = names[number % len(names)]
        base, contents = rng.choice(of_all[name].sound)
        path = (Path(told.keep) if told.keep else folder) / f"{name}-{number % 20}" / base
        _plan_at(path, damaged(contents, rng))
        result = tried(of_all[name], path)
        counts[name, result.outcome] += 1
        if result.outcome in FAULTS:
            faults.append(f"seed {told.seed} number {number} ({name}, {base}): {result.outcome}: {result.detail}")
            print(faults[-1], flush=True)
    return counts, faults


def main(words: list[str] | None = None) -> int:
    """Run a campaign, and print what came of it."""
    parser = campaign_parser(__doc__, minutes=1.0)
    parser.add_argument("--kinds", default="")
    told = parser.parse_args(words)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        counts, faults = campaign(told, Path(folder))
    for name in sorted({kind for kind, _ in counts}):
        of_kind = {outcome: n for (of, outcome), n in sorted(counts.items()) if of == name}
        print(f"{name:13s} {sum(of_kind.values()):6d}  {of_kind}")
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
