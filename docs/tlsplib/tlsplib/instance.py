"""An instance: which stations see what, what is required, and which of them can be linked; and its file.

All numbers are whole: areas are ticks of 1 cm2, coordinates are centimetres. docs/tlsplib/formats.md is the format.
"""

from __future__ import annotations

import hashlib
import json
import lzma
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.model import BoolArray, Int64Array
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem

TICKS_PER_M2 = 10_000


@dataclass(frozen=True)
class Need:
    """What is required: so many ticks of `rows`, (R,) bool, where at least `seen_from` stations see them."""

    title: str
    rows: BoolArray
    required: int
    seen_from: int = 1


@dataclass(frozen=True)
class Instance:
    """candidates_cm : (N, 3) int64. ticks : (R,) int64. sees : (N, R) bool. links : (N, N) bool, symmetric, or None.

    about : what it was made from, as JSON holds it.
    """

    name: str
    kind: str
    about: dict[str, Any]
    candidates_cm: Int64Array
    ticks: Int64Array
    sees: BoolArray
    needs: tuple[Need, ...]
    links: BoolArray | None = None

    @property
    def n_candidates(self) -> int:
        """Number of candidates."""
        return len(self.sees)

    @cached_property
    def problem(self) -> CoverProblem:
        """The same for the planner's selection."""
        required = np.array([need.required for need in self.needs], dtype=np.int64)
        return CoverProblem(
            starts=np.concatenate([[0], np.cumsum(self.sees.sum(axis=1))]).astype(np.int64),
            row=np.nonzero(self.sees)[1].astype(np.int32),
            ticks=self.ticks,
            counts_for=np.array([need.rows for need in self.needs], dtype=bool),
            required=required,
            least=required.copy(),
            seen_from=np.array([need.seen_from for need in self.needs], dtype=np.int64),
        )

    @cached_property
    def network(self) -> Network | None:
        """The graph of links, all of one part; None where the plan needs no links."""
        if self.links is None:
            return None
        starts = np.concatenate([[0], np.cumsum(self.links.sum(axis=1))]).astype(np.int64)
        neighbour = np.nonzero(self.links)[1].astype(np.int32)
        return Network(starts, neighbour, np.zeros(self.n_candidates, dtype=np.int32))

    def is_solved_by(self, chosen: list[int]) -> bool:
        """Whether these stations meet everything, links too."""
        meets = bool((self.problem.covered(chosen) >= self.problem.required).all())
        return meets and (self.network is None or self.network.n_violations(chosen) == 0)

    @cached_property
    def raw(self) -> bytes:
        """The file's text: the same instance, the same bytes."""
        document = {
            "format": "tlsplib instance 1",
            "name": self.name,
            "kind": self.kind,
            "about": self.about,
            "candidates_cm": self.candidates_cm.tolist(),
            "ticks_per_m2": TICKS_PER_M2,
            "ticks": self.ticks.tolist(),
            "constraints": [
                {
                    "title": need.title,
                    "rows": hex_of(need.rows),
                    "required": need.required,
                    "seen_from": need.seen_from,
                }
                for need in self.needs
            ],
            "links": None if self.links is None else [hex_of(row) for row in self.links],
            "sees": [hex_of(row) for row in self.sees],
        }
        return (json.dumps(document, indent=0, separators=(",", ":")) + "\n").encode("ascii")

    @property
    def sha256(self) -> str:
        """Digest of the file's text, not of the packed file."""
        return hashlib.sha256(self.raw).hexdigest()


def hex_of(members: BoolArray) -> str:
    """A set as bits of one hexadecimal number, the first member's the lowest."""
    return f"{int.from_bytes(np.packbits(members, bitorder='little').tobytes(), 'little'):x}"


def _members(text: str, size: int) -> BoolArray:
    packed = np.frombuffer(int(text or "0", 16).to_bytes(-(-size // 8), "little"), dtype=np.uint8)
    members: BoolArray = np.unpackbits(packed, count=size, bitorder="little").astype(bool)
    return members


def from_raw(raw: bytes) -> Instance:
    """Read the text of an instance's file; `checker.Instance` is the reader that trusts nothing."""
    document = json.loads(raw)
    ticks = np.array(document["ticks"], dtype=np.int64)
    n = len(document["sees"])
    return Instance(
        name=document["name"],
        kind=document["kind"],
        about=document["about"],
        candidates_cm=np.array(document["candidates_cm"], dtype=np.int64),
        ticks=ticks,
        sees=np.array([_members(text, ticks.size) for text in document["sees"]]),
        needs=tuple(
            Need(c["title"], _members(c["rows"], ticks.size), c["required"], c["seen_from"])
            for c in document["constraints"]
        ),
        links=None if document["links"] is None else np.array([_members(text, n) for text in document["links"]]),
    )


def packed(raw: bytes) -> bytes:
    """Compress a file's text."""
    return lzma.compress(raw, preset=9 | lzma.PRESET_EXTREME)


def path_of(folder: Path, name: str) -> Path:
    """Where a folder keeps the file of an instance, or the certificate of one."""
    return folder / f"{name}.json.xz"
