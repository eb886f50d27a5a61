"""The folder of the library: its list with digests, instances, certificates, and what solvers made of them.

    library.json          per instance: class, kind, sizes, digest, stations of the best plan, proven bound
    instances/            files of all but large plans and those from the art-gallery set, which are made on demand
    certificates/         plan, bound and proof of every instance
    results.json          what solvers found, and how long they took

Every step is resumable: what is there and holds is not made again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from planner_core.errors import PlannerError, SceneError
from planner_core.plan_folder.atomic import staged_file

from . import checker
from .catalogue import Entry, class_of, entries, make
from .instance import Instance, from_raw, packed, path_of
from .proof import certify
from .solvers import LARGE, SOLVERS, Outcome, solve

#: CPU time of the general solvers, work of ours, nodes and CPU time of a proof, by class.
LIMITS = {"small": (3.0, 6.0, 250, 15.0), "medium": (6.0, 12.0, 120, 10.0), "large": (10.0, 6.0, 60, 10.0)}
#: Work of prices that certificates of large instances begin with, and CPU time of cuts that they go on with.
LARGE_PROOF: dict[str, float] = {"work_limit": 6.0, "root_limit_s": 8.0}
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Library:
    """folder : with library.json. gallery : the art-gallery set, where the user has it."""

    folder: Path
    gallery: Path | None = None

    # ------------------------------------------------------------------------------------------ files
    def listed(self) -> dict[str, dict[str, Any]]:
        """Content of library.json, by name; empty before there is one."""
        return self._read("library.json")

    def results(self) -> dict[str, dict[str, Any]]:
        """Content of results.json, by name and solver."""
        return self._read("results.json")

    def _read(self, name: str) -> dict[str, dict[str, Any]]:
        path = self.folder / name
        if not path.exists():
            return {}
        found: dict[str, dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
        return found

    def _write(self, name: str, entries: dict[str, dict[str, Any]]) -> None:
        # One line an instance, so that changes are seen.
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(entries[key])}" for key in entries)
        write_atomically(self.folder / name, ("{\n" + lines + "\n}\n").encode())

    # ------------------------------------------------------------------------------------------ generate
    def _here(self, names: Sequence[str]) -> list[Entry]:
        """Entries that can be had: those from the art-gallery set only where its folder is known."""
        return [entry for entry in chosen(names) if self.gallery is not None or not entry.needs_gallery]

    def n_left_out(self, names: Sequence[str]) -> int:
        """How many of the named ones cannot be had."""
        return len(chosen(names)) - len(self._here(names))

    def instance(self, entry: Entry) -> Instance:
        """The instance, read where the library holds it, else made; of the digest that library.json names.

        Raises
        ------
        SceneError
            It cannot be made here, or came out differently.
        """
        kept = path_of(self.folder / "instances", entry.name)
        if entry.is_kept and kept.exists():
            instance = from_raw(checker.unpacked(kept.read_bytes()))
        else:
            instance = make(entry, gallery=self.gallery)
        self._check_digest(entry, instance)
        return instance

    def _check_digest(self, entry: Entry, instance: Instance) -> None:
        row = self.listed().get(entry.name)
        if row is not None and row["sha256"] != instance.sha256:
            raise SceneError(
                f"{entry.name}: got an instance of digest {instance.sha256[:12]}, expected {row['sha256'][:12]}; "
                "its source is another one, or the file was changed: get them anew"
            )

    def generate(self, names: Sequence[str], into: Path) -> Iterator[tuple[str, bool]]:
        """Write instances to a folder; yields the name and whether it was there already."""
        into.mkdir(parents=True, exist_ok=True)
        for entry in self._here(names):
            path = path_of(into, entry.name)
            row = self.listed().get(entry.name)
            there = path.exists() and row is not None and _digest(path) == row["sha256"]
            if not there:
                # Scans are copied: made anew, they are the same on the same version alone.
                instance = self.instance(entry) if entry.scan is not None else make(entry, gallery=self.gallery)
                self._check_digest(entry, instance)
                write_atomically(path, packed(instance.raw))
            yield entry.name, there

    def enlist(self, entry: Entry, instance: Instance | None) -> dict[str, Any]:
        """Line of library.json, made where there is none, from the instance; for who adds one."""
        listed = self.listed()
        if instance is not None:
            listed[entry.name] = {
                "class": class_of(instance),
                "kind": instance.kind,
                "candidates": instance.n_candidates,
                "rows": int(instance.ticks.size),
                "constraints": len(instance.needs),
                "links": 0 if instance.links is None else int(instance.links.sum()) // 2,
                "sha256": instance.sha256,
            }
            if entry.is_kept:
                (self.folder / "instances").mkdir(parents=True, exist_ok=True)
                write_atomically(path_of(self.folder / "instances", entry.name), packed(instance.raw))
            self._write("library.json", {e.name: listed[e.name] for e in entries() if e.name in listed})
        return listed[entry.name]

    # ------------------------------------------------------------------------------------------ solve
    def solve(self, names: Sequence[str], solvers: Sequence[str], *, again: bool, tell: Tell) -> None:
        """Run solvers, and certify the best plan that any of them found."""
        for entry in self._here(names):
            instance = None if entry.name in self.listed() else self.instance(entry)
            row = self.enlist(entry, instance)
            limit_s, work, most_nodes, proof_s = LIMITS[row["class"]]
            results = self.results()
            mine = results.setdefault(entry.name, {})
            fit = [name for name in solvers if name != LARGE or row["class"] == LARGE]
            left = [name for name in fit if again or name not in mine]
            certified = self._certified(entry.name)
            if not left and certified is not None:
                continue
            instance = instance or self.instance(entry)
            best = list(certified or ())
            for name in left:
                found = solve(name, instance, limit_s=limit_s, work=work)
                mine[name] = _record(found)
                self._write("results.json", results)
                tell(f"{entry.name}: {name}: {_line(found)}")
                if found.valid and (not best or len(found.chosen) < len(best)):
                    best = list(found.chosen)
            if best and (certified is None or len(best) < len(certified)):
                more = LARGE_PROOF if row["class"] == "large" else {}
                certificate = certify(instance, best, most_nodes=most_nodes, time_limit_s=proof_s, **more)
                self.keep(instance, certificate)
                tell(f"{entry.name}: certificate: {len(certificate['plan'])} stations, at least {certificate['bound']}")

    def keep(self, instance: Instance, certificate: dict[str, Any]) -> None:
        """Check a certificate, write it, and note in library.json what it proves."""
        raw = json.dumps(certificate, separators=(",", ":")).encode("ascii")
        _, stations, bound = checker.check(instance.raw, raw)
        (self.folder / "certificates").mkdir(parents=True, exist_ok=True)
        write_atomically(path_of(self.folder / "certificates", instance.name), packed(raw))
        listed = self.listed()
        listed[instance.name] |= {"stations": stations, "bound": bound}
        self._write("library.json", listed)

    def _certified(self, name: str) -> list[int] | None:
        path = path_of(self.folder / "certificates", name)
        if not path.exists():
            return None
        plan: list[int] = json.loads(checker.unpacked(path.read_bytes()))["plan"]
        return plan

    # ------------------------------------------------------------------------------------------ check
    def check(self, names: Sequence[str]) -> Iterator[tuple[str, int, int]]:
        """Check certificates by the checker alone.

        Raises
        ------
        PlannerError
            One does not hold, or proves something else than library.json.
        """
        listed = self.listed()
        for entry in self._here(names):
            path = path_of(self.folder / "certificates", entry.name)
            row = listed.get(entry.name, {})
            if "bound" not in row or not path.exists():
                raise PlannerError(f"{entry.name}: got no certificate, expected {path}; run `tlsplan tlsplib solve`")
            try:
                found = checker.check(self.instance(entry).raw, checker.unpacked(path.read_bytes()))
            except checker.RefusedError as error:
                raise PlannerError(f"{entry.name}: refused: {error}") from None
            if found[1:] != (row["stations"], row["bound"]):
                raise PlannerError(
                    f"{entry.name}: got {found[1]} stations, at least {found[2]}, expected {row['stations']} and "
                    f"{row['bound']} as in library.json"
                )
            yield found


def write_atomically(path: Path, raw: bytes) -> None:
    """Write a file beside its place and rename it."""
    with staged_file(path) as staged:
        staged.write_bytes(raw)


def chosen(names: Sequence[str]) -> list[Entry]:
    """Entries by name, or by what their names begin with; all where none are named.

    Raises
    ------
    SceneError
        A name that fits none.
    """
    every = entries()
    if not names:
        return every
    for name in names:
        if not any(entry.name.startswith(name) for entry in every):
            raise SceneError(f"instance {name!r}: got a name that fits none; `tlsplan tlsplib rank` lists them")
    return [entry for entry in every if entry.name.startswith(tuple(names))]


def known_solvers(names: Sequence[str]) -> list[str]:
    """Names of solvers, all where none are named."""
    unknown = [name for name in names if name not in SOLVERS]
    if unknown:
        raise SceneError(f"solver {unknown[0]!r} is not known; expected one of {', '.join(SOLVERS)}")
    return list(names) or list(SOLVERS)


def _digest(path: Path) -> str:
    return hashlib.sha256(checker.unpacked(path.read_bytes())).hexdigest()


def _record(found: Outcome) -> dict[str, Any]:
    document = asdict(found)
    document["stations"] = len(document.pop("chosen"))
    document["cpu_s"] = round(found.cpu_s, 3)
    return document


def _line(found: Outcome) -> str:
    valid = "" if found.valid else ", not valid"
    return f"{len(found.chosen)} stations{valid}, at least {found.bound}, {found.cpu_s:.2f} s, {found.ended}"
