"""Plan every synthetic scene with the real commands, each in a process of its own, and say how each ended.

    python tests/scenes_synthetic/plan_all_scenes.py [--only NAME ...] [--folder build/plan-scenes]
        [--write docs/benchmarks/scenes.md]

`tlsplan scene` writes each scene and `tlsplan plan` plans it: the small ones twice, as IFC and as another format. What
can't be planned has to be refused, with the documented exit code. Files, plan folders and a record of each job stay in
the folder, so that a run which was interrupted goes on where it was: the record of a job that ended as it should is
taken over where the scene's file has the same bytes and the commands are the same. Delete the folder after changing the
planner. The exit status is 1 where any job ended otherwise than it should; the table is then not written.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import scenes_synthetic

OTHER_FORMATS = ("obj", "glb", "usdc", "ply")
#: Scenes that are planned once, with the options that let them end in minutes on two cores.
LARGE = {"basement": (), "school": ("--grid", "1", "--height", "1.3"), "office": ("--grid", "1")}
CAMPUS, CAMPUS_SIZE, CAMPUS_OPTIONS = "campus", ("--triangles", "300000"), ("--grid", "2", "--height", "1.3")
#: Formats of scenes whose difficulty not every format has.
FORMATS = {"millimetres-y-up": ("ifc", "obj"), "broken-faces": ("ifc", "obj", "ply", "glb")}
MILLIMETRES, SKIP = ("--units", "mm", "--up", "y"), ("--skip-bad-faces",)


HEAD = """\
# Every synthetic scene, planned
Written by `make plan-scenes`: `tlsplan scene` writes each scene and `tlsplan plan` plans it, with the options named and
defaults else: HDL-64E, which reaches 5 m and sees from -25 to 2 degrees of elevation; candidates every 0.5 m at heights
from 0.5 to 1.7 m; 95 % of the achievable area. All in the first table ended with exit code 0 and a whole plan folder.

Candidates: admissible positions. Bound: as many stations any plan on these candidates needs. Best: fewest stations of a
scanner that looks everywhere and far enough, where that is known; this one needs more. Coverage is of the area that any
candidate sees. Loading IFC cuts openings into walls anew, so the same scene has other triangles there, and other
patches, than in other formats.
"""


@dataclass(frozen=True)
class Job:
    """One scene in one format; `refused_by` is the command that has to refuse it, with `exit`."""

    scene: str
    format: str
    scene_options: tuple[str, ...] = ()
    plan_options: tuple[str, ...] = ()
    refused_by: str = ""
    exit: int = 0

    @property
    def key(self) -> str:
        """Name of the job's files: no two jobs have the same."""
        options = "".join(f"-{option.removeprefix('--')}" for option in self.plan_options)
        return f"{self.scene}{options}.{self.format}"


REFUSALS = (
    Job("georeferenced", "stl", refused_by="scene", exit=4),
    Job("broken-faces", "obj", refused_by="plan", exit=3),
)


@dataclass(frozen=True)
class Record:
    """How a job ended, with figures of plan.json where it planned."""

    job: Job
    sha256: str
    """Of the scene's file; empty where there is none."""
    refused_by: str
    exit: int
    said: str
    """Last line of standard error of the command that refused."""
    triangles: int = 0
    candidates: int = 0
    stations: int = 0
    lower_bound: int | None = None
    coverage: float = 0.0

    @property
    def is_right(self) -> bool:
        """Whether it ended as it should, with the coverage that was asked for."""
        ended = (self.refused_by, self.exit) == (self.job.refused_by, self.job.exit)
        return ended and (self.exit != 0 or (self.stations > 0 and self.coverage >= 0.95 - 1e-9))


def jobs() -> list[Job]:
    """All jobs, in the order of `tlsplan scene`; the large scenes last."""
    found: list[Job] = []
    small = [name for name in scenes_synthetic.names() if name not in LARGE]
    for index, name in enumerate(small):
        for suffix in FORMATS.get(name, ("ifc", OTHER_FORMATS[index % len(OTHER_FORMATS)])):
            found.append(Job(name, suffix, plan_options=_told(name, suffix)))
        found += [job for job in REFUSALS if job.scene == name]
    found += [Job(name, "ifc", plan_options=options) for name, options in LARGE.items()]
    return [*found, Job(CAMPUS, "ply", CAMPUS_SIZE, CAMPUS_OPTIONS)]


def _told(name: str, suffix: str) -> tuple[str, ...]:
    """Options for what the file can't say itself."""
    if (name, suffix) == ("millimetres-y-up", "obj"):
        return MILLIMETRES
    return SKIP if name == "broken-faces" and suffix != "ifc" else ()


def carry_out(job: Job, folder: Path) -> Record:
    """Write the scene and plan it, or take over the record of an earlier run."""
    path = folder / job.key
    written = _tlsplan("scene", job.scene, "-o", path, "--overwrite", *job.scene_options)
    if written.returncode != 0:
        return Record(job, "", "scene", written.returncode, _last_line(written.stderr))
    with path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    kept = folder / f"{job.key}.json"
    if kept.exists():
        old = Record(**{**json.loads(kept.read_text(encoding="utf-8")), "job": job})
        if old.sha256 == sha256 and old.is_right:
            return old
    record = _planned(job, path, sha256)
    kept.write_text(json.dumps(asdict(record), indent=1), encoding="utf-8")
    return record


def _planned(job: Job, path: Path, sha256: str) -> Record:
    plan_folder = path.with_name(f"{path.name}-plan")
    done = _tlsplan("plan", path, "-o", plan_folder, "--overwrite", "--json", *job.plan_options)
    if done.returncode != 0:
        return Record(job, sha256, "plan", done.returncode, _last_line(done.stderr))
    document = json.loads(done.stdout)
    return Record(
        job, sha256, "", 0, "",
        triangles=document["scene"]["n_triangles"],
        candidates=document["settings"]["n_candidates"],
        stations=len(document["stations"]),
        lower_bound=document["optimality"]["lower_bound"],
        coverage=document["coverage"]["fraction_of_achievable"],
    )  # fmt: skip


def _tlsplan(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tlsplan", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1] if lines else ""


# ------------------------------------------------------------------------------------------------ table
def as_markdown(records: Sequence[Record]) -> str:
    """Return the page."""
    planned = [record for record in records if record.exit == 0]
    refused = [record for record in records if record.exit != 0]
    lines = [
        HEAD,
        "| scene | format | options | triangles | candidates | stations | bound | best | coverage |",
        "|---|---|---|---|---|---|---|---|---|",
        *map(_row, planned),
        "",
        "## Refused, as they should be",
        "| scene | format | command | exit code | what it says |",
        "|---|---|---|---|---|",
        *map(_refusal_row, refused),
    ]
    return "\n".join([*lines, ""])


def _refusal_row(record: Record) -> str:
    said = record.said.removeprefix("tlsplan: ")
    return f"| `{record.job.scene}` | {record.job.format} | `tlsplan {record.refused_by}` | {record.exit} | {said} |"


def _row(record: Record) -> str:
    job = record.job
    best = _known_best(job.scene)
    options = " ".join((*job.scene_options, *job.plan_options))
    cells = [
        f"`{job.scene}`",
        job.format,
        f"`{options}`" if options else "",
        f"{record.triangles:,}".replace(",", " "),
        f"{record.candidates:,}".replace(",", " "),
        str(record.stations),
        "" if record.lower_bound is None else str(record.lower_bound),
        "" if best is None else str(best),
        f"{100 * record.coverage:.1f} %",
    ]
    return f"| {' | '.join(cells)} |"


def _known_best(name: str) -> int | None:
    return None if name == CAMPUS else scenes_synthetic.build(name).truth.n_stations


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these scenes alone")
    parser.add_argument("--folder", type=Path, default=Path("build/plan-scenes"), help="where everything goes")
    parser.add_argument("--write", type=Path, metavar="FILE", help="write the table to this Markdown file")
    options = parser.parse_args()
    if options.only and options.write:
        parser.error("--write needs all scenes, got --only")
    options.folder.mkdir(parents=True, exist_ok=True)
    records = []
    for job in jobs():
        if options.only and job.scene not in options.only:
            continue
        record = carry_out(job, options.folder)
        records.append(record)
        state = "as it should" if record.is_right else "WRONG"
        print(
            f"{job.key}: {state}; exit {record.exit} {record.said}, {record.triangles} triangles, {record.candidates} "
            f"candidates, {record.stations} stations, at least {record.lower_bound}, {100 * record.coverage:.2f} %",
            flush=True,
        )
    if not all(record.is_right for record in records):
        return 1
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(as_markdown(records), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
