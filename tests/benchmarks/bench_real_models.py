"""Public models of many programs, planned one by one: floors, stations, cost, a map of each, and a verdict by eye.

    python -m tests.benchmarks.bench_real_models FOLDER [--write docs/benchmarks/real-buildings.md]

real_models.csv names where each file is published, its SHA-256, the options that its plan needs, and what was found by
looking at its floors and maps. FOLDER holds those files that were fetched, by their names in the manifest. Each plan is
a process of its own with a limit of processor time and memory, so that a bad file costs its row; plans that were made
are kept below build/, and made once. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import os
import re
import resource
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image

from tests.benchmarks.bench_real_buildings import REPOSITORY, put

MANIFEST = Path(__file__).with_name("real_models.csv")
STORE = REPOSITORY / "build" / "real-models"
PICTURES = REPOSITORY / "docs" / "images" / "real-models"
SETTINGS = ("--scanner", "rtc360", "--effort", "quick", "--grid", "0.8m", "--verify", "0")
#: Of each process of a plan. The clock only ends what waits for ever: the machine may be in use by others.
CPU_S, MEMORY_BYTES, CLOCK_S = 240, 8 * 2**30, 3600
#: Of a map on the page, before it is reduced to the colours that a map has.
MAP_WIDTH, MAP_HEIGHT, MAPS_OF_A_ROW = 400, 300, 4


@dataclass(frozen=True)
class Model:
    """A building of the manifest, of one file or several; verdict: empty until its maps were looked at."""

    name: str
    files: tuple[Path, ...]
    program: str
    options: tuple[str, ...]
    floors_right: str
    verdict: str

    @property
    def slug(self) -> str:
        return re.sub("[^a-z0-9]+", "-", self.name.lower()).strip("-")


def models(folder: Path) -> Iterator[Model]:
    """Buildings whose files all lie in the folder as they were published; the others are named."""
    with MANIFEST.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for name in dict.fromkeys(row["model"] for row in rows):
        own = [row for row in rows if row["model"] == name]
        bad = [why for row in own if (why := _missing(folder / row["file"], row["sha256"]))]
        if bad:
            print(f"{name}: {'; '.join(bad)}", flush=True)
            continue
        first = own[0]
        yield Model(
            name,
            tuple(folder / row["file"] for row in own),
            first["program"],
            tuple(shlex.split(first["options"])),
            first["floors_right"],
            first["verdict"],
        )


def _missing(path: Path, sha256: str) -> str:
    if not path.is_file():
        return f"{path.name} is missing"
    return "" if hashlib.sha256(path.read_bytes()).hexdigest() == sha256 else f"{path.name} is another version"


# ------------------------------------------------------------------------------------------------- plans
def planned(model: Model) -> dict[str, Any]:
    """Figures of its plan; made in a process of its own unless they are there, with the same options."""
    store, folder = STORE / f"{model.slug}.json", STORE / model.slug
    options = [*SETTINGS, *model.options]
    if store.is_file():
        found: dict[str, Any] = json.loads(store.read_text())
        if found["options"] == options:
            return found
    command = [sys.executable, "-m", "tlsplan", "plan", *map(str, model.files), "-o", str(folder), "--overwrite"]
    code, used, words = _limited([*command, *options])
    figures: dict[str, Any] = {
        "options": options,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss / 1024,
        "warnings": [line for line in words if line.startswith("warning:")],
    }
    if code == -signal.SIGXCPU:
        figures["ended"] = f"stopped after {CPU_S} s of processor time"
    elif code:
        figures["ended"] = next((line for line in reversed(words) if line.startswith("tlsplan:")), f"ended with {code}")
    else:
        document = json.loads((folder / "plan.json").read_text())
        ordered = {word for at, word in enumerate(options) if options[at - 1] == "--floor"}
        figures["floors"] = [
            (f["name"], f["elevation_m"], f["ground_area_m2"])
            for f in document["floors"]
            if not ordered or ordered & {f["id"], f["name"]}
        ]
        figures["stations"] = len(document["stations"])
        figures["coverage"] = document["coverage"]["fraction_of_achievable"]
        figures["groups"] = len(document["registration"]["networks"])
        draw(model, folder)
    store.write_text(json.dumps(figures, ensure_ascii=False))
    return figures


def _limited(command: list[str]) -> tuple[int, resource.struct_rusage, list[str]]:
    """Exit code, what the process used and what it wrote to standard error; ended where it passes a limit."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 10))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))

    log = STORE / "log.txt"
    with log.open("w+", encoding="utf-8") as file:
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=file, preexec_fn=limit, start_new_session=True
        )
        ends = time.monotonic() + CLOCK_S
        while not (ended := os.wait4(process.pid, os.WNOHANG))[0]:
            if time.monotonic() > ends:
                os.killpg(process.pid, signal.SIGKILL)
            time.sleep(0.2)
        file.seek(0)
        return os.waitstatus_to_exitcode(ended[1]), ended[2], file.read().splitlines()


def draw(model: Model, folder: Path) -> None:
    """All maps of its floors side by side."""
    maps = [Image.open(path).convert("RGB") for path in sorted((folder / "report").glob("map_F*.png"))]
    for picture in maps:
        picture.thumbnail((MAP_WIDTH, MAP_HEIGHT), Image.Resampling.LANCZOS)
    width = max(sum(p.width for p in maps[at : at + MAPS_OF_A_ROW]) for at in range(0, len(maps), MAPS_OF_A_ROW))
    sheet = Image.new("RGB", (width, MAP_HEIGHT * -(-len(maps) // MAPS_OF_A_ROW)), "white")
    for at in range(0, len(maps), MAPS_OF_A_ROW):
        x = 0
        for picture in maps[at : at + MAPS_OF_A_ROW]:
            sheet.paste(picture, (x, at // MAPS_OF_A_ROW * MAP_HEIGHT))
            x += picture.width
    PICTURES.mkdir(parents=True, exist_ok=True)
    sheet.quantize(24).save(PICTURES / f"{model.slug}.png", optimize=True)


# -------------------------------------------------------------------------------------------------- page
def row_of(model: Model, plan: dict[str, Any]) -> str:
    size = sum(file.stat().st_size for file in model.files) / 2**20
    formats = ", ".join(sorted({file.suffix[1:].lower() for file in model.files}))
    own = f"{model.program} | {formats} {size:.1f}"
    cost = f"{plan['cpu_s']:.0f} | {plan['peak_mb']:.0f}"
    if "ended" in plan:
        return f"| {model.name} | {own} | {model.floors_right} | | | | | | {cost} | {plan['ended']} {model.verdict} |"
    ground_m2 = sum(area for _, _, area in plan["floors"])
    floors = "; ".join(f"{name} {z:.2f} m" for name, z, _ in plan["floors"])
    right = "" if model.floors_right in ("", "yes") else f" **{model.floors_right}**"
    return (
        f"| [{model.name}](../images/real-models/{model.slug}.png) | {own} | {floors}{right} | {ground_m2:.0f} | "
        f"{plan['stations']} | {1000 * plan['stations'] / ground_m2:.0f} | {100 * plan['coverage']:.1f} | "
        f"{plan['groups']} | {cost} | {model.verdict or '**not looked at**'} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    STORE.mkdir(parents=True, exist_ok=True)
    rows = [
        "| model | program | MB | floors | ground m² | stations | per 1000 m² | covered % | groups | processor s | "
        "memory MB | verdict |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for model in models(asked.folder):
        rows.append(row_of(model, planned(model)))
        print(rows[-1], flush=True)
        if asked.write:
            put(asked.write, "models", rows)


if __name__ == "__main__":
    main()
