"""Commands under faults: a kill -9, a full disk, a broken one, one that can't be written, a clock that jumps.

    python -m tests.faults.campaign [--seed 1] [--each 3] [--minutes 3] [--work plan,export] [--kinds kill,ENOSPC]

Each piece of work is done once without a fault, which counts the changes it makes to files (`injected`); then with a
fault at changes drawn by the seed. Whatever happens: what it writes is whole or absent (of a replaced plan: the old one
or the new one), changes of the review that were acknowledged are there, the message is one line, never a traceback, and
the same work, done again, succeeds. Exit code 1 where that fails.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from planner_core.plan_folder.plan_source import open_plan
from planner_core.review.store import ReviewStore
from tests.faults.injected import VARIABLE, Fault

KINDS = ("kill", "ENOSPC", "EDQUOT", "EIO", "EROFS", "EACCES", "clock")
"""EDQUOT: the quota of the user is full. EROFS: a disk that is mounted to read, as systems do after errors."""
_PREFIX = "import sys; sys.path[:0] = [{here!r}]; import injected; injected.install(); "
_PLAIN = """
from pathlib import Path
from planner_core.plan_folder import folder, report
def write_report(plan, at, *, engine, pictures):
    at.mkdir()
    for name in (report.map_name(0), report.link_map_name(0), report.picture_name(0)):
        (at / name).write_bytes(bytes(300_000))
        yield name
folder.write_report = write_report
from tlsplan.main import main
main()
"""
COMMAND = _PREFIX + _PLAIN
"""The report's pictures, nine tenths of the time, are others."""
REVIEWER = (
    _PREFIX
    + """
from pathlib import Path
from planner_core.errors import PlannerError
from planner_core.review.changes import AddComment
from planner_core.review.store import ReviewStore
store = ReviewStore(Path(sys.argv[1]))
try:
    for number in range(4):
        store.commit(0, [AddComment(f"{sys.argv[2]} {number}")], "Ana")
        print(f"{sys.argv[2]} {number}", flush=True)
except PlannerError as error:
    sys.exit(f"Error: {error}")
"""
)
TINY = Path(__file__).resolve().parents[1] / "machines" / "tiny.json"
QUICK = "--method=greedy --no-refine --patch-area=1 --grid=1 --height=1.5 --verify=0 --preset=paper".split()  # noqa: SIM905
_HERE = str(Path(__file__).parent)
_TAKES_S = 300.0


class BrokenPromiseError(Exception):
    """What a fault broke."""


@dataclass(frozen=True)
class Done:
    """What a process did. code : negative where a signal ended it."""

    code: int
    out: str
    message: str


@dataclass(frozen=True)
class Work:
    """A piece of work in a folder of its own.

    make : puts into the folder what it needs. program : Python. words : its arguments, after the folder. check : raises
    BrokenPromiseError; gets the folder and what was done.
    """

    name: str
    make: Callable[[Path], None]
    program: str
    words: Callable[[Path], Sequence[str]]
    check: Callable[[Path, Done], None]


# ------------------------------------------------------------------------------------------------ what is there
class Sound:
    """What is made once, without faults: a scene, two plans of it, their exports."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.scene = folder / "box.obj"
        tlsplan("scene", "box", "-o", str(self.scene))
        for name, words in {"old": ("--patch-area", "2"), "new": ()}.items():
            tlsplan(*_plan(self.scene, folder / name), *words)

    def whole_plan(self, folder: Path) -> str:
        """Which of the two plans a folder is, `old` or `new`, whole; raises where it is neither."""
        for name in ("old", "new"):
            other = self.folder / name
            if _names(folder) | {"review.usda"} == _names(other) | {"review.usda"} and _stations(folder) == _stations(
                other
            ):
                open_plan(folder)
                return name
        raise BrokenPromiseError(f"{folder.name} is neither of the plans: {sorted(_names(folder))[:9]}")


def _plan(scene: Path, folder: Path) -> tuple[str, ...]:
    return ("plan", str(scene), "-o", str(folder), "--scanner", str(TINY), *QUICK)


def _names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.name.startswith(".")}


def _stations(folder: Path) -> object:
    document = json.loads((folder / "plan.json").read_text())
    return document["stations"], document["coverage"]


def tlsplan(*words: str) -> None:
    """Run a command that must succeed, by itself."""
    subprocess.run([sys.executable, "-c", _PLAIN, *words, "-q"], check=True)


# ------------------------------------------------------------------------------------------------ work
EXPORTS = {"csv": "stations.csv", "html": "sheets.html", "gsi16": "stations-16.gsi", "dxf": "drawing.dxf"}


def works(sound: Sound) -> tuple[Work, ...]:
    """All of it."""
    exported = sound.folder / "exported"
    tlsplan("export", str(sound.folder / "new"), "--format", ",".join(EXPORTS), "-o", str(exported))

    def copied(folder: Path) -> None:
        shutil.copytree(sound.folder / "new", folder / "plan")

    def check_new(folder: Path, done: Done) -> None:
        if (folder / "plan").exists():
            sound.whole_plan(folder / "plan")
        elif done.code == 0:
            raise BrokenPromiseError("it says that it is done, and there is no plan")

    def check_replaced(folder: Path, done: Done) -> None:
        if not (folder / "plan").exists():  # two renames, where systems know no exchange: recovered by the next run
            raise BrokenPromiseError("the plan is gone")
        which = sound.whole_plan(folder / "plan")
        if done.code == 0 and which != "new":
            raise BrokenPromiseError("it says that it is done, and the plan is the old one")

    def check_exports(folder: Path, done: Done) -> None:
        out = folder / "out"
        if not out.exists():
            if done.code == 0:
                raise BrokenPromiseError("it says that it is done, and there is nothing")
            return
        if _names(out) != _names(exported):
            raise BrokenPromiseError(f"exported in part: {sorted(_names(out))}")
        for name in _names(exported) - {"sheets.html"}:  # whose date is today's
            if (out / name).read_bytes() != (exported / name).read_bytes():
                raise BrokenPromiseError(f"{name} is not whole")

    def check_review(folder: Path, done: Done) -> None:
        told, found = set(done.out.split("\n")) - {""}, _comments(folder / "plan")
        if not told <= found:
            raise BrokenPromiseError(f"acknowledged and lost: {told - found}")
        if done.code == 0 and len(told) != 4:
            raise BrokenPromiseError(f"only {told} were acknowledged")

    return (
        Work("plan", lambda folder: None, COMMAND, lambda f: (*_plan(sound.scene, f / "plan"), "-q"), check_new),
        Work(
            "plan --overwrite",
            lambda folder: shutil.copytree(sound.folder / "old", folder / "plan") and None,
            COMMAND,
            lambda f: (*_plan(sound.scene, f / "plan"), "--overwrite", "-q"),
            check_replaced,
        ),
        Work(
            "export",
            copied,
            COMMAND,
            lambda f: ("export", str(f / "plan"), "--format", ",".join(EXPORTS), "-o", str(f / "out"), "-q"),
            check_exports,
        ),
        Work("review", copied, REVIEWER, lambda f: (str(f / "plan"), "Ana"), check_review),
    )


def _comments(folder: Path) -> set[str]:
    return {comment.text for comment in ReviewStore(folder).current().comments.values()}


# ------------------------------------------------------------------------------------------------ faults
def do(work: Work, folder: Path, fault: Fault) -> Done:
    """Do a piece of work with a fault."""
    process = begin(work, folder, fault)
    out, message = process.communicate(timeout=_TAKES_S)
    return Done(process.returncode, out, message)


def begin(work: Work, folder: Path, fault: Fault) -> subprocess.Popen[str]:
    """Begin a piece of work with a fault."""
    return subprocess.Popen(
        [sys.executable, "-c", work.program.replace("{here!r}", repr(_HERE)), *work.words(folder)],
        env=os.environ | {VARIABLE: json.dumps(asdict(fault))},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def n_changes(work: Work, folder: Path) -> int:
    """How many changes to files a piece of work makes; it succeeds without a fault."""
    told = folder / ".told"
    done = do(work, _made(work, folder / "sound"), Fault(below=str(folder / "sound"), told=str(told)))
    _check(work, folder / "sound", done)
    if done.code != 0:
        raise BrokenPromiseError(f"{work.name} fails without a fault: {done.message}")
    return len(told.read_text().splitlines())


def try_fault(work: Work, folder: Path, fault: Fault) -> Done:
    """Do a piece of work with a fault, and then again without; raises BrokenPromiseError."""
    _made(work, folder)
    done = do(work, folder, fault)
    _check(work, folder, done)
    if fault.kind == "kill" and done.code != -9:
        raise BrokenPromiseError(f"it lived on, exit code {done.code}")
    if fault.kind == "clock" and done.code != 0:
        raise BrokenPromiseError(f"a clock that jumps ends it: {done.message}")
    again = do(work, folder, Fault(below=str(folder)))
    is_there = work.name in ("plan", "export") and again.code == 5  # the first one wrote it
    if again.code != 0 and not is_there:
        raise BrokenPromiseError(f"done again it fails: {again.message}")
    work.check(folder, again)
    return done


def _made(work: Work, folder: Path) -> Path:
    folder.mkdir(parents=True)
    work.make(folder)
    return folder


def _check(work: Work, folder: Path, done: Done) -> None:
    lines = [line for line in done.message.splitlines() if not line.startswith("Warning")]
    if "Traceback" in done.message or (done.code == 1 and work.program == COMMAND):
        raise BrokenPromiseError(f"exit code {done.code}: {done.message[-2000:]}")
    if done.code > 0 and len(lines) != 1:
        raise BrokenPromiseError(f"exit code {done.code}, not in one line: {done.message!r}")
    work.check(folder, done)


def drawn(n: int, kind: str, each: int, rng: random.Random, folder: Path) -> list[Fault]:
    """Faults of one kind at some of n changes; the last change is always among them, where most is at stake."""
    at = sorted({*rng.sample(range(1, n + 1), min(each - 1, n)), n - rng.randrange(min(3, n))})
    lasts = kind in ("ENOSPC", "EDQUOT", "EROFS", "clock") or bool(rng.randrange(2))
    return [Fault(below=str(folder), kind=kind, at=number, lasts=lasts) for number in at]


def main(words: list[str] | None = None) -> int:
    """Run a campaign, and print what came of it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--each", type=int, default=3, help="changes of each piece of work that get a fault of each kind"
    )
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--work", default="")
    parser.add_argument("--kinds", default=",".join(KINDS))
    told = parser.parse_args(words)
    counts: Counter[tuple[str, str, str]] = Counter()
    broken: list[str] = []
    until_s = time.monotonic() + 60.0 * told.minutes
    with tempfile.TemporaryDirectory(prefix="faults-") as name:
        Path(name, "made").mkdir()
        sound = Sound(Path(name, "made").resolve())
        jobs = []
        for work in works(sound):
            if told.work and work.name not in told.work.split(","):
                continue
            n = n_changes(work, Path(name).resolve() / f"counted {work.name}")
            print(f"{work.name}: {n} changes to files", flush=True)
            for kind in told.kinds.split(","):
                folder = Path(name).resolve() / "tried"
                rng = random.Random(f"{told.seed} {work.name} {kind}")
                jobs += [(work, fault) for fault in drawn(n, kind, told.each, rng, folder)]
        random.Random(told.seed).shuffle(jobs)
        for work, fault in jobs:
            if time.monotonic() > until_s:
                break
            folder = Path(fault.below)
            title = f"{work.name}, {fault.kind} at change {fault.at}{', and on' if fault.lasts else ''}"
            try:
                done = try_fault(work, folder, fault)
                outcome = "killed" if done.code < 0 else "done" if done.code == 0 else "refused in one line"
                counts[work.name, fault.kind, outcome] += 1
            except BrokenPromiseError as error:
                counts[work.name, fault.kind, "BROKEN"] += 1
                broken.append(f"{title}: {error}")
                print(broken[-1], flush=True)
            shutil.rmtree(folder, ignore_errors=True)
    for (of, kind, outcome), n in sorted(counts.items()):
        print(f"{of:16s} {kind:7s} {outcome:20s} {n:5d}")
    print(f"{sum(counts.values())} tried, {len(broken)} broken promises")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
