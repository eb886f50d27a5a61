"""Jobs of a batch: a building or a storey each, known by a hash of all that its plan depends on.

Sites -> jobs, each with the words of its command line. Same files, same options, same version: same key, and the job
is not done again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any
from urllib.parse import quote

import click

from .sites_file import OPTIONS, BatchSite

#: Formats that may refer to other files beside them.
_REFERRING = frozenset({".obj", ".gltf", ".usd", ".usda", ".usdc"})
_MOST_BESIDE = 2000


@dataclass(frozen=True, eq=False)
class Job:
    """A command in a process of its own. name : of the job, and of its plan folder. floor : id, empty: the building.

    finds_floors : it lists the storeys of a site, which are jobs then, and plans nothing.
    """

    name: str
    site: BatchSite
    key: str
    floor: str = ""
    finds_floors: bool = False

    def words(self, folder: Path, *, engine: Sequence[str] = ()) -> tuple[str, ...]:
        """Return the words of the command line behind `tlsplan`."""
        scenes = map(str, self.site.scenes)
        if self.finds_floors:
            return ("floors", *scenes, "--json", *self.site.reading)
        floor = (f"--floor={self.floor}",) if self.floor else ()
        return ("plan", *scenes, "-o", str(folder), "--overwrite", *engine, *self.site.arguments, *floor)


def first_jobs(sites: Sequence[BatchSite], *, engine: Sequence[str] = ()) -> list[Job]:
    """Return the jobs that a batch begins with: those of sites that are there."""
    return [_job(site, site.name, engine, finds_floors=site.each_floor) for site in sites if not site.missing]


def floor_jobs(site: BatchSite, floors: Sequence[tuple[str, str]], *, engine: Sequence[str] = ()) -> list[Job]:
    """Return a job for each storey, (id, name), that the site's options ask for; all where they ask for none."""
    wanted = {str(each).casefold() for each in site.values["floors"]}
    alone = replace(site, arguments=tuple(word for word in site.arguments if not word.startswith("--floor=")))
    return [
        _job(alone, f"{site.name}-{floor}", engine, floor=floor)
        for floor, name in floors
        if not wanted or wanted & {floor.casefold(), name.casefold()}
    ]


def files_of(site: BatchSite) -> tuple[Path, ...]:
    """Return all files that a site's plan is made from: its scene's, those that they refer to, those of its options.

    Of OBJ, glTF and USD text, files count that lie in their folder or below and are named in them.
    """
    found = dict.fromkeys((*site.scenes, *site.files))
    for scene in site.scenes:
        if scene.suffix.casefold() in _REFERRING:
            found |= dict.fromkeys(_named_in(scene))
    return tuple(found)


def _job(site: BatchSite, name: str, engine: Sequence[str], **more: Any) -> Job:
    job = Job(name, site, "", **more)
    options = {key: site.values[str(option.name)] for key, option in OPTIONS.items()}
    named = {str(file): digest_of(file) for file in site.files}
    held = {
        "version": version("tlsplan"),
        "does": "floors" if job.finds_floors else "plan",
        "files": [[file.name, digest_of(file)] for file in files_of(site)],
        "options": {key: _plain(option, options[key], named) for key, option in OPTIONS.items()},
        "engine": list(engine),
        "floor": job.floor,
    }
    return replace(job, key=hashlib.sha256(json.dumps(held, sort_keys=True).encode()).hexdigest())


def _plain(option: click.Option, value: Any, named: dict[str, str]) -> Any:
    """The value as it is hashed: files by what is in them, wherever they lie."""
    if isinstance(value, tuple | list):
        return [_plain(option, each, named) for each in value]
    text = value if value is None or isinstance(value, bool | int | float) else str(value)
    if isinstance(text, str):
        for file, digest in named.items():
            text = text.replace(file, digest)
    return text


@cache
def digest_of(file: Path) -> str:
    """SHA-256 of a file; empty where it can't be read: the job will say so."""
    try:
        with file.open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except OSError:
        return ""


@cache
def _named_in(file: Path) -> tuple[Path, ...]:
    try:
        text = file.read_bytes()
        beside = sorted(path for path in file.parent.rglob("*") if path.is_file())[:_MOST_BESIDE]
    except OSError:
        return ()
    return tuple(
        path for path in beside if path != file
        and any(name.encode("utf-8", "surrogateescape") in text for name in (path.name, quote(path.name)))
    )  # fmt: skip
