"""What runs on workers: they take arrays and jobs once, build the engine once per scene, and answer.

State of the worker's process: arrays by their hashes, the jobs that came last, what is kept for them. A
worker that is started anew has none, reports that (`LackingError`), and is sent it again.
"""

from __future__ import annotations

import hashlib
import platform
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import Any

from numpy.typing import NDArray

from planner_core.cluster.payloads import unpacked, unsqueezed
from planner_core.errors import PlannerError
from planner_core.executor import NotWantedError
from planner_core.progress import Progress, ProgressEvent

#: Of other versions plans may differ: readers of files, links, selection, pictures.
_LIBRARIES = ("numpy", "scipy", "numba", "highspy", "shapely", "ifcopenshell", "usd-core", "vtk", "matplotlib")
#: What is raised where a machine lacks something, or a device failed: another one may not. All else is a bug.
FAULTS = (PlannerError, OSError, MemoryError, ImportError)
#: Jobs, engines and arrays beyond these are forgotten, the oldest first.
_MOST_JOBS, _MOST_KEPT = 4, 2

_lock = Lock()
_arrays: dict[str, NDArray[Any]] = {}
_jobs: dict[str, tuple[frozenset[str], Any]] = {}
_kept: dict[str, Any] = {}


class LackingError(Exception):
    """A worker has not been sent what its task needs, or has forgotten it."""


def bug_of(error: BaseException, trace: TracebackType | None) -> str:
    """Return what an error that nobody foresaw is, and where in our code it came from."""
    frames = [(str(frame.f_globals.get("__name__")), line, frame.f_code.co_name) for frame, line in
              traceback.walk_tb(trace)]  # fmt: skip
    own = [each for each in frames if each[0].partition(".")[0] in ("planner_core", "tlsplan")]
    where = "".join(f" ({module}:{line}, in {name})" for module, line, name in (own or frames)[-1:])
    return f"{type(error).__name__}: {error}{where}"


@dataclass(frozen=True)
class Identity:
    """What a process is: plans are the same bytes where this is the same, and the scans of a probe are."""

    version: str
    sources: str
    """Hash of all modules and kernels of the library, and of the command."""
    python: str
    """Version of Python, major and minor: what is pickled in one is read in another."""
    system: str
    """Operating system and kind of processor."""
    libraries: str
    """Those that figures are made with, and their versions."""


@cache
def identity() -> Identity:
    """Return what this process is."""
    digest, sources = hashlib.sha256(), dict[str, bytes]()
    for name in ("planner_core", "tlsplan"):  # workers run the command, too
        spec = find_spec(name)
        for root in map(Path, () if spec is None else spec.submodule_search_locations or ()):
            sources |= {f"{name}/{path.relative_to(root).as_posix()}": path.read_bytes() for path in root.rglob("*.py")}
    kernels = resources.files("planner_core.kernels")  # in a checkout they lie elsewhere
    sources |= {file.name: file.read_bytes() for file in kernels.iterdir() if file.name.endswith((".cl", ".h"))}
    for name, content in sorted(sources.items()):
        digest.update(name.encode() + b"\0" + content)
    return Identity(
        version("tlsplan"),
        digest.hexdigest(),
        ".".join(platform.python_version_tuple()[:2]),
        f"{platform.system()} {platform.machine()}",
        ", ".join(f"{name} {_version(name)}" for name in _LIBRARIES),
    )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def greet() -> dict[str, str]:
    """Return what this worker is, in words that any version understands."""
    return asdict(identity())


def lacks(digest: str, names: list[str]) -> tuple[bool, list[str]]:
    """Return whether this worker lacks a job, and which of its arrays."""
    with _lock:
        return digest not in _jobs, [name for name in names if name not in _arrays]


def take_array(name: str, content: bytes) -> None:
    """Keep an array."""
    array = unsqueezed(content)
    with _lock:
        _arrays[name] = array


def take_job(digest: str, body: bytes, names: list[str]) -> None:
    """Keep a job; of the arrays those alone that jobs need.

    Raises
    ------
    LackingError
        An array of it is not here.
    """
    with _lock:
        if not _arrays.keys() >= set(names):
            raise LackingError(digest)
        job = unpacked(body, _arrays)
        _jobs.pop(digest, None)
        _jobs[digest] = frozenset(names), job
        while len(_jobs) > _MOST_JOBS:
            del _jobs[next(iter(_jobs))]
        needed = frozenset().union(*(of for of, _ in _jobs.values()))
        for name in [name for name in _arrays if name not in needed]:
            del _arrays[name]


def answer(digest: str, task: Any) -> bytes:
    """Do one task of a job.

    Raises
    ------
    LackingError
        The job is not here.
    DeviceError
        This worker has no engine of the kind required.
    NotWantedError
        The caller does not wait any more, or is gone.
    """
    hear = _ends_with_its_task()
    with _lock:  # one engine, one device: threads of a worker wait for each other
        found: bytes = job_of(digest).answer(task, kept, hear)
        return found


def _ends_with_its_task() -> Progress:
    """Give what ends the work at hand once Dask has taken its task back, which it can't end itself."""
    from distributed import get_worker

    tasks, key = get_worker().state.tasks, get_worker().get_current_task()

    def hear(event: ProgressEvent) -> None:
        task = tasks.get(key)
        if task is None or task.state == "cancelled":
            raise NotWantedError

    return hear


def job_of(digest: str) -> Any:
    """Return a job that was sent; raises `LackingError`."""
    if digest not in _jobs:
        raise LackingError(digest)
    return _jobs[digest][1]


def kept(key: str, make: Callable[[], Any]) -> Any:
    """Return what is kept by a key, made now where it is not."""
    if key not in _kept:
        while len(_kept) >= _MOST_KEPT:
            del _kept[next(iter(_kept))]
        _kept[key] = make()
    return _kept[key]
