"""What runs on workers: they take arrays and questions once, build the engine once per scene, and look around.

State of the worker's process: arrays by their hashes, the questions that were asked last, their engines. A worker that
is started anew has none, says so (`LackingError`), and is sent it again.
"""

from __future__ import annotations

import hashlib
import platform
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

import planner_core
from planner_core.cluster.parcels import pack_looked, unpacked, unsqueezed
from planner_core.engine.scan_engine import ScanEngine, open_engine
from planner_core.model import FloatArray, Survey
from planner_core.progress import silent
from planner_core.requirements.goals import Goals
from planner_core.requirements.look_around import look_around_here

#: Questions, engines and arrays beyond these are forgotten, the oldest first.
_MOST_QUESTIONS, _MOST_ENGINES = 4, 2

_lock = Lock()
_arrays: dict[str, NDArray[Any]] = {}
_questions: dict[str, tuple[frozenset[str], Question]] = {}
_engines: dict[str, ScanEngine] = {}


class LackingError(Exception):
    """A worker has not been sent what it is asked about, or has forgotten it."""


@dataclass(frozen=True)
class Identity:
    """What a process is: plans are the same bytes where this is the same, and the scans of a probe are."""

    version: str
    sources: str
    """Hash of all modules and kernels of the library."""
    python: str
    """Version of Python, major and minor: what is pickled in one is read in another."""


@dataclass(frozen=True)
class Question:
    """What positions are looked from for. engine_of : hash of scene and patches. engine : its kind."""

    survey: Survey
    goals: Goals
    notes_needed: bool
    engine: str
    engine_of: str


@cache
def identity() -> Identity:
    """Return what this process is."""
    root, digest = Path(planner_core.__file__).parent, hashlib.sha256()
    sources = {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*.py")}
    kernels = resources.files("planner_core.kernels")  # in a checkout they lie elsewhere
    sources |= {file.name: file.read_bytes() for file in kernels.iterdir() if file.name.endswith((".cl", ".h"))}
    for name, content in sorted(sources.items()):
        digest.update(name.encode() + b"\0" + content)
    return Identity(version("tlsplan"), digest.hexdigest(), ".".join(platform.python_version_tuple()[:2]))


def greet() -> dict[str, str]:
    """Return what this worker is, in words that any version understands."""
    return asdict(identity())


def lacks(digest: str, names: list[str]) -> tuple[bool, list[str]]:
    """Return whether this worker lacks a question, and which of its arrays."""
    with _lock:
        return digest not in _questions, [name for name in names if name not in _arrays]


def take_array(name: str, content: bytes) -> None:
    """Keep an array."""
    array = unsqueezed(content)
    with _lock:
        _arrays[name] = array


def take_question(digest: str, body: bytes, names: list[str]) -> None:
    """Keep a question; of the arrays those alone that questions need.

    Raises
    ------
    LackingError
        An array of it is not here.
    """
    with _lock:
        try:
            question = unpacked(body, _arrays)
        except KeyError as error:
            raise LackingError(str(error)) from None
        _questions.pop(digest, None)
        _questions[digest] = frozenset(names), question
        while len(_questions) > _MOST_QUESTIONS:
            del _questions[next(iter(_questions))]
        needed = frozenset().union(*(of for of, _ in _questions.values()))
        for name in [name for name in _arrays if name not in needed]:
            del _arrays[name]


def look(digest: str, positions_m: FloatArray) -> bytes:
    """Look around from positions (N, 3), local frame.

    Raises
    ------
    LackingError
        The question is not here.
    DeviceError
        This worker has no engine of the kind that is asked for.
    """
    with _lock:  # one engine, one device: threads of a worker wait for each other
        if digest not in _questions:
            raise LackingError(digest)
        question = _questions[digest][1]
        engine = _engine(question)
        looked = look_around_here(
            question.survey,
            engine,
            np.asarray(positions_m),
            question.goals,
            notes_needed=question.notes_needed,
            progress=silent,
        )
        return pack_looked(looked)


def _engine(question: Question) -> ScanEngine:
    if question.engine_of not in _engines:
        while len(_engines) >= _MOST_ENGINES:
            del _engines[next(iter(_engines))]
        patches = replace(question.survey.patches, counted=None)
        _engines[question.engine_of] = open_engine(question.survey.scene, patches, engine=question.engine)
    return _engines[question.engine_of]
