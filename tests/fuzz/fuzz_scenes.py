"""Scene files of every format, changed at random: each is read, or refused in one line; nothing crashes or hangs.

    python -m tests.fuzz.fuzz_scenes [--minutes 2] [--seed 1] [--first 0] [--count N] [--formats ifc,usda] [--real]

Change number i of a seed is always the same: `--first i --count 1 --keep FOLDER` makes it again and keeps its file. The
files that are changed are small buildings of the tests, with `--real` also small ones of ../shared/data; what campaigns
found (`known_files`) comes first. Exit code 1 where a file crashed the process that loads it,
took more than 20 s of the processor or 200 s in all, or ended in an internal error or a message of many lines.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, Queue

from planner_core.errors import LONGEST_LINE, PlannerError
from planner_core.scene.load import LoadOptions, load_scene
from tests.scene import broken_ifc, conftest

HANGS_AFTER_CPU_S, HANGS_AFTER_S = 20.0, 200.0
"""Time of processors, as other work on them is no hang; and time on the clock, for what sleeps."""
FAULTS = ("crash", "hang", "internal error")
REAL = Path(__file__).resolve().parents[2].parent / "shared" / "data"
_LARGEST_REAL_BYTES = 300_000
"""Larger ones take longer than a hang when they are sound."""
_TEXT_FORMATS = (".ifc", ".obj", ".usda", ".gltf")
_TOKEN = re.compile(rb"#\d+|'[^']*'|\"[^\"]*\"|-?\d+\.?\d*(?:[eE][-+]?\d+)?|\.\w+\.|[A-Za-z_:]\w*|[$*]|@[^@]*@|<[^>]*>")
_ODD = (
    b"$", b"*", b"#1", b"#0", b"#99999999", b"''", b"'x'", b"()", b"((", b".T.", b".EXA.", b"-1", b"0", b"nan",
    b"1e999", b"-1e308", b"1e-320", b"99999999999999999999", b"[]", b"{}", b"null", b"true", b"</>", b"@./a.usda@",
    b"\0", b"\xff",
)  # fmt: skip

Change = Callable[[bytes, random.Random], bytes]


@dataclass(frozen=True)
class Result:
    """What became of one file. detail : the message, or what was raised."""

    outcome: str
    detail: str


# ------------------------------------------------------------------------------------------------ files
def sound_files(folder: Path, *, real: bool) -> list[Path]:
    """Small buildings in every format; those of ../shared/data after them."""
    boxes = {
        "Slab": conftest.box_corners((0, 0, -0.25), (8, 6, 0)),
        "Wall": conftest.box_corners((0, 0, 0), (8, 0.25, 2.75)),
        "Roof": conftest.box_corners((0, 0, 2.75), (8, 6, 3)),
    }
    house = conftest.House(boxes)
    (folder / "house.obj").write_text(conftest.obj_text(house))
    (folder / "binary.stl").write_bytes(conftest.stl_bytes(house))
    (folder / "text.stl").write_text(conftest.stl_text(house))
    for name, order in {"little.ply": "<", "big.ply": ">", "text.ply": ""}.items():
        (folder / name).write_bytes(conftest.ply_bytes(house, order))
    for name in ("house.glb", "house.gltf"):
        conftest.write_glb(house, folder / name)
    for name in ("house.usda", "house.usdc"):
        conftest.write_usd(house, folder / name)
    for name, schema in {"two.ifc": "IFC2X3", "four.ifc": "IFC4"}.items():
        conftest.write_ifc_house(house, folder / name, schema=schema)
    conftest.write_ifc_building(folder / "building.ifc")
    conftest.write_ifc_building(folder / "building2x3.ifc", schema="IFC2X3")
    own = sorted(path for path in folder.iterdir() if path.stem != "library" and path.suffix != ".bin")
    return own + sorted(
        path
        for path in REAL.rglob("*.*")
        if real and path.suffix in (".ifc", ".glb") and path.stat().st_size < _LARGEST_REAL_BYTES
    )


def known_files(folder: Path) -> Iterator[Path]:
    """What a campaign found, made anew."""
    building = (folder / "building.ifc").read_text()
    recipes = {name: change for name, (change, _) in broken_ifc.REFUSED.items()} | broken_ifc.READ
    for number, change in enumerate(recipes.values()):
        yield _written(folder / f"known-{number}.ifc", change(building).encode())
    cube = b'def Cube "C"\n{\n}\n'
    for name, text in {
        "prims": b'def Xform "a"\n{\n' * 200_000 + cube + b"}\n" * 200_000,
        "metadata": b"(customLayerData = " + b"{ dictionary a = " * 200_000 + b"{}" + b"}" * 200_000 + b")\n" + cube,
        "itself": b'def Xform "A" (references = @./known-itself.usda@</A>)\n{\n' + cube + b"}\n",
    }.items():
        yield _written(folder / f"known-{name}.usda", b"#usda 1.0\n" + text)


def _written(path: Path, contents: bytes) -> Path:
    path.write_bytes(contents)
    return path


# ------------------------------------------------------------------------------------------------ changes
def changed(contents: bytes, suffix: str, rng: random.Random) -> bytes:
    """A copy with one to three changes."""
    kinds: list[Change] = [_flipped, _cut, _overwritten, _number_replaced]
    if suffix in _TEXT_FORMATS:
        kinds = [_token_replaced, _token_replaced, _token_copied, _token_copied, _line_dropped, _line_moved, *kinds]
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        contents = rng.choice(kinds)(contents, rng) or b"x"
    return contents


def _flipped(contents: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(contents))
    return contents[:at] + bytes([contents[at] ^ 1 << rng.randrange(8)]) + contents[at + 1 :]


def _cut(contents: bytes, rng: random.Random) -> bytes:
    at, length = rng.randrange(len(contents)), rng.randrange(1, 200)
    return contents[:at] + contents[at + length :]


def _overwritten(contents: bytes, rng: random.Random) -> bytes:
    at, length = rng.randrange(len(contents)), rng.randrange(1, 9)
    return contents[:at] + rng.randbytes(length) + contents[at + length :]


def _number_replaced(contents: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(contents))
    found = re.compile(rb"\d+").search(contents, start)
    return contents if found is None else contents[: found.start()] + rng.choice(_ODD) + contents[found.end() :]


def _token(contents: bytes, rng: random.Random) -> re.Match[bytes] | None:
    return _TOKEN.search(contents, rng.randrange(len(contents)))


def _token_replaced(contents: bytes, rng: random.Random) -> bytes:
    found = _token(contents, rng)
    return contents if found is None else contents[: found.start()] + rng.choice(_ODD) + contents[found.end() :]


def _token_copied(contents: bytes, rng: random.Random) -> bytes:
    """One name, reference or number in the place of another one, mostly of its kind."""
    found = _token(contents, rng)
    for _ in range(20):
        other = _token(contents, rng)
        if found is None or other is None:
            return contents
        if other.group()[:1] == found.group()[:1] or rng.random() < 0.1:
            break
    assert found is not None
    assert other is not None
    return contents[: found.start()] + other.group() + contents[found.end() :]


def _line_dropped(contents: bytes, rng: random.Random) -> bytes:
    lines = contents.split(b"\n")
    del lines[rng.randrange(len(lines))]
    return b"\n".join(lines)


def _line_moved(contents: bytes, rng: random.Random) -> bytes:
    lines = contents.split(b"\n")
    lines.insert(rng.randrange(len(lines)), lines[rng.randrange(len(lines))])
    return b"\n".join(lines)


# ------------------------------------------------------------------------------------------------ loading
def work() -> None:
    """Load the files whose names come in by standard input, one after the other; what became of each goes out."""
    for line in sys.stdin:
        path, skip_bad_faces = json.loads(line)
        begin_s = _cpu_s()
        answer = _loaded(Path(path), skip_bad_faces)
        print(json.dumps([*answer, _cpu_s() - begin_s]), flush=True)


def _cpu_s() -> float:
    used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def is_odd(message: str) -> bool:
    """Whether a message is no line that a terminal can show."""
    without_joiners = message.translate({0x200C: None, 0x200D: None})
    return len(message) > LONGEST_LINE or not without_joiners.isprintable()


def _loaded(path: Path, skip_bad_faces: bool) -> list[str]:
    try:
        load_scene(path, options=LoadOptions(skip_bad_faces=skip_bad_faces))
    except PlannerError as error:
        message = str(error)
        return ["internal error", f"odd message {message!r}"] if is_odd(message) else ["refused", message]
    except Exception as error:  # noqa: BLE001 (they are what is looked for)
        return ["internal error", f"{type(error).__name__}: {error}"]
    return ["read", ""]


class Loader:
    """A process that loads files, begun anew where one ended or hung."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._answers: Queue[str] = Queue()

    def load(self, path: Path, *, skip_bad_faces: bool) -> Result:
        """Have it load one file."""
        if self._process is None:
            command = [sys.executable, "-m", "tests.fuzz.fuzz_scenes", "--work"]
            root = Path(__file__).resolve().parents[2]
            pipe = subprocess.PIPE
            self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, cwd=root)
            self._answers = Queue()
            threading.Thread(target=self._listen, args=(self._process, self._answers), daemon=True).start()
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps([str(path), skip_bad_faces]) + "\n")
        self._process.stdin.flush()
        try:
            answer = self._answers.get(timeout=HANGS_AFTER_S)
        except Empty:
            answer = None
        if answer:
            outcome, detail, cpu_s = json.loads(answer)
            return Result("hang" if cpu_s > HANGS_AFTER_CPU_S else outcome, f"{cpu_s:.0f} s: {detail}")
        code = self._process.poll() if answer is None else self._process.wait()
        self.close()
        return Result("hang" if code is None else "crash", f"exit code {code}")

    @staticmethod
    def _listen(process: subprocess.Popen[str], answers: Queue[str]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            answers.put(line)
        answers.put("")

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._process = None


# ------------------------------------------------------------------------------------------------ campaign
def campaign(arguments: argparse.Namespace, folder: Path) -> tuple[Counter[tuple[str, str]], list[str]]:
    """Counts by format and outcome, and a line on each fault."""
    counts: Counter[tuple[str, str]] = Counter()
    faults: list[str] = []
    sound = sound_files(folder, real=arguments.real)
    formats = set(arguments.formats.split(",")) if arguments.formats else {path.suffix[1:] for path in sound}
    sound = [path for path in sound if path.suffix[1:] in formats]
    loader = Loader()
    end = time.monotonic() + 60.0 * arguments.minutes

    def tell(path: Path, title: str, *, skip_bad_faces: bool = False) -> None:
        result = loader.load(path, skip_bad_faces=skip_bad_faces)
        counts[path.suffix[1:], result.outcome] += 1
        if lost := re.search(r"(?:IfcOpenShell|USD library) (crashed|hung|took more|made no progress)", result.detail):
            counts[path.suffix[1:], f"child {lost.group(1)}"] += 1
            if arguments.verbose:
                print(f"{title}: {result.outcome}: {result.detail}", flush=True)
        if result.outcome in FAULTS:
            faults.append(f"{title}: {result.outcome}: {result.detail}")
            print(faults[-1], flush=True)

    try:
        if not arguments.first:
            for path in known_files(folder):
                if path.suffix[1:] in formats:
                    tell(path, path.name)
        number = arguments.first
        while number < arguments.first + arguments.count and time.monotonic() < end:
            rng = random.Random(f"{arguments.seed} {number}")
            base = rng.choice(sound)
            keep = Path(arguments.keep) if arguments.keep else folder
            path = _written(keep / f"changed-{number % 50}{base.suffix}", changed(base.read_bytes(), base.suffix, rng))
            tell(path, f"seed {arguments.seed} number {number} ({base.name})", skip_bad_faces=bool(number % 2))
            number += 1
    finally:
        loader.close()
    return counts, faults


def campaign_parser(title: str | None, *, minutes: float) -> argparse.ArgumentParser:
    """Say which changes are tried, for how long, and where they are kept; what fuzzers have in common."""
    parser = argparse.ArgumentParser(description=(title or "").partition("\n")[0])
    parser.add_argument("--minutes", type=float, default=minutes)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=10**9)
    parser.add_argument("--keep", default="")
    return parser


def main(words: list[str] | None = None) -> int:
    """Run a campaign, and print what came of it."""
    parser = campaign_parser(__doc__, minutes=2.0)
    parser.add_argument("--formats", default="")
    parser.add_argument("--real", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--work", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args(words)
    if arguments.work:
        work()
        return 0
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        counts, faults = campaign(arguments, Path(folder))
    for name in sorted({file_format for file_format, _ in counts}):
        of_format = {outcome: n for (of, outcome), n in sorted(counts.items()) if of == name}
        print(f"{name:5s} {sum(n for o, n in of_format.items() if not o.startswith('child')):6d}  {of_format}")
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
