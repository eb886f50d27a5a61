"""Results that are kept between commands: what the same inputs gave before is read, and not computed again.

A result is a file below `results` in the cache folder, named by a hash of all that it depends on: the kind of result,
its inputs by their contents, the sources of this package and its kernels, and the versions of the packages that it
computes with. So one of other inputs, or of another version, is never found. A file is written beside and renamed, so
that it is whole or not there whoever is killed and however many write, and it is checked by a hash when it is read: one
that is damaged counts as none. Nor is a folder that can't be read or written, or a full disk, an error.

All files together take as many bytes as `SIZE_VARIABLE` allows; those that were not used for longest go first.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
import struct
import tempfile
import time
import weakref
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import planner_core
from planner_core.cache import cache_folder
from planner_core.encoding import encoded, parts_of_value, read_tree, read_value
from planner_core.environment_variables import memory_from_env
from planner_core.progress import Progress, ProgressEvent, silent

if TYPE_CHECKING:
    from planner_core.model import Scene, Survey

#: Bytes that all kept results may take, such as `5GB`; 0: nothing is kept.
SIZE_VARIABLE = "TLSPLAN_CACHE_SIZE"
USUAL_BYTES = 2_000_000_000
#: The files are counted again once this share of the bytes that they may take was written.
_COUNTED_SHARE = 1 / 64
#: One result takes at most this share of them: the others are worth more.
_MOST_SHARE = 1 / 4
#: Writing takes so many seconds of a process at most, and this share of its time: a home folder across a network takes
#: tens of milliseconds for a file, and a building has thousands.
_LONGEST_S, _LONGEST_SHARE = 1.0, 0.1
_LOADED_S = time.monotonic()
_written_s = 0.0
_MAGIC = b"tlsplan kept 1\n\0"
_N_HASH = 32
_PACKAGES = ("numpy", "scipy", "numba", "ifcopenshell", "open3d-cpu", "open3d", "pyopencl")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class KeptUse:
    """What is kept. folder : None: there is no cache folder. most_bytes : 0: nothing is kept."""

    folder: Path | None
    n_files: int
    n_bytes: int
    most_bytes: int


class Shelf:
    """Results of one kind, of inputs that are the same for all of them.

    inputs : values as `planner_core.encoding` has them, by their contents. classes : dataclasses that results are made
    of.
    """

    def __init__(self, kind: str, inputs: Sequence[object], *, classes: Sequence[type] = ()) -> None:
        self._kind, self._classes = kind, classes
        self._most_bytes = most_bytes()
        folder = cache_folder()
        self._folder = None if folder is None or not self._most_bytes else folder / "results"
        if self._folder is not None:
            of_all = hashlib.sha256("\n".join((kind, code_hash(), *(hash_of(each) for each in inputs))).encode())
            self._of_all = of_all.digest()

    @property
    def is_open(self) -> bool:
        """Whether anything is kept at all."""
        return self._folder is not None

    def find(self, detail: bytes = b"") -> Any:
        """Read the result of a further input; None where there is none that is sound."""
        if self._folder is None:
            return None
        key, path = self._place(detail)
        try:
            with path.open("rb") as file:
                if file.read(len(_MAGIC)) != _MAGIC:
                    return None
                expected, first = file.read(_N_HASH), file.tell()
                if hashlib.file_digest(file, lambda: hashlib.sha256(key)).digest() != expected:
                    return None
                file.seek(first)
                found = read_value(read_tree(file), file, self._classes)
        except (OSError, ValueError, KeyError, TypeError, struct.error):
            return None
        with contextlib.suppress(OSError):  # the folder of another user, or of a disk that can't be written
            os.utime(path)
        return found

    def put(self, result: object, detail: bytes = b"") -> None:
        """Keep the result of a further input, where there is room, and time: see `_LONGEST_S`."""
        global _written_s
        began_s = time.monotonic()
        if self._folder is None or _written_s > _LONGEST_S + _LONGEST_SHARE * (began_s - _LOADED_S):
            return
        key, path = self._place(detail)
        arrays: list[NDArray[Any]] = []
        text = json.dumps(encoded(result, arrays)).encode()
        n_bytes = len(text) + sum(each.nbytes for each in arrays)
        # Sums depend on how arrays lie in memory, and what is read lies row by row.
        if n_bytes > _MOST_SHARE * self._most_bytes or not all(each.flags.c_contiguous for each in arrays):
            return
        digest = hashlib.sha256(key)
        for part in parts_of_value(text, arrays):
            digest.update(part)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            _write(path, [memoryview(_MAGIC + digest.digest()), *parts_of_value(text, arrays)])
        except OSError:
            return
        finally:
            _written_s += time.monotonic() - began_s
        _make_room(self._folder, n_bytes, self._most_bytes)

    def _place(self, detail: bytes) -> tuple[bytes, Path]:
        assert self._folder is not None
        key = hashlib.sha256(self._of_all + detail)
        return key.digest(), self._folder / f"{self._kind}-{key.hexdigest()[:40]}"


def kept(
    kind: str,
    inputs: Sequence[object],
    compute: Callable[[], _Result],
    *,
    classes: Sequence[type] = (),
    progress: Progress = silent,
    done: ProgressEvent | None = None,
) -> _Result:
    """Return what `compute` gave for the same inputs before, or gives now. See `Shelf`.

    done : reported to `progress` where nothing is computed.
    """
    shelf = Shelf(kind, inputs, classes=classes)
    found: _Result | None = shelf.find()
    if found is None:
        found = compute()
        shelf.put(found)
    elif done is not None:
        progress(done)
    return found


def most_bytes() -> int:
    """Bytes that kept results may take; 0: nothing is kept. Raises EnvironmentVariableError where it is no size."""
    given = memory_from_env(SIZE_VARIABLE, or_none=True)
    return USUAL_BYTES if given is None else given


def use_of_kept() -> KeptUse:
    """Say how much is kept, and where."""
    folder = cache_folder()
    if folder is None:
        return KeptUse(None, 0, 0, most_bytes())
    sizes = [size for _, size, _ in _files(folder / "results")]
    return KeptUse(folder / "results", len(sizes), sum(sizes), most_bytes())


def forget_kept() -> None:
    """Remove all that is kept. Raises OSError where a file can't be removed."""
    folder = cache_folder()
    for _, _, path in _files(folder / "results") if folder is not None else ():
        path.unlink(missing_ok=True)


# ---------------------------------------------------------------------------------------------------------------- keys
def hash_of(value: object, *, without: Collection[str] = ()) -> str:
    """Hash of a value's contents. Of a dataclass it is worked out once: these are frozen, and so are their arrays.

    without : fields of the dataclass that do not count.
    """
    parameters: Any = getattr(value, "__dataclass_params__", None)
    if not is_dataclass(value) or isinstance(value, type) or not parameters.frozen:
        return _hashed(value)
    at = id(value), tuple(without)
    known = _hashes.get(at)
    if known is None or known[0]() is not value:
        counted = [getattr(value, field.name) for field in fields(value) if field.name not in without]
        known = weakref.ref(value, lambda _: _hashes.pop(at, None)), _hashed([type(value).__name__, *counted])
        _hashes[at] = known
    return known[1]


_hashes: dict[tuple[int, tuple[str, ...]], tuple[Callable[[], object], str]] = {}


def hash_of_scene(scene: Scene) -> str:
    """Hash of a scene, wherever its files lie and whatever loading reported."""
    sources = [hash_of(each, without=("path", "sha256")) for each in scene.sources]
    return " ".join([hash_of(scene, without=("source", "further_sources", "report")), *sources])


def hash_of_survey(survey: Survey, *, without: Collection[str] = ()) -> str:
    """Hash of a survey but for its warnings; `without` further fields."""
    return f"{hash_of_scene(survey.scene)} {hash_of(survey, without=('scene', 'warnings', *without))}"


def _hashed(value: object) -> str:
    arrays: list[NDArray[Any]] = []
    digest = hashlib.sha256()
    for part in parts_of_value(json.dumps(encoded(value, arrays), default=_as_json).encode(), arrays):
        digest.update(part)
    return digest.hexdigest()


def _as_json(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"inputs of kept results: got {type(value)}, expected what planner_core.encoding has")


@cache
def code_hash() -> str:
    """Hash of the sources that compute, and of the versions of the packages that they compute with."""
    from planner_core.device.sources import kernels_hash

    digest = hashlib.sha256(f"{kernels_hash()} {platform.python_version()} {platform.machine()}".encode())
    for root in planner_core.__path__:
        for source in sorted(Path(root).rglob("*.py")):
            digest.update(source.relative_to(root).as_posix().encode())
            digest.update(source.read_bytes())
    for package in _PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            digest.update(f"{package} {metadata.version(package)}\n".encode())
    return digest.hexdigest()


# --------------------------------------------------------------------------------------------------------------- files
def _write(path: Path, parts: Sequence[memoryview]) -> None:
    """Write a file, whole or not at all."""
    handle, name = tempfile.mkstemp(prefix=".", dir=path.parent)
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            for part in parts:
                file.write(part)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


_n_written = float("inf")  # bytes since the files were counted: what other commands left is counted with the first


def _make_room(folder: Path, n_bytes: int, most: int) -> None:
    """Remove the files that were not used for longest, once all may be more than `most` bytes."""
    global _n_written
    _n_written += n_bytes
    if _n_written < _COUNTED_SHARE * most:
        return
    _n_written = 0
    files = sorted(_files(folder))
    total = sum(size for _, size, _ in files)
    for _, size, path in files:
        if total <= most * (1 - _COUNTED_SHARE):
            return
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
            total -= size


def _files(folder: Path) -> Iterator[tuple[float, int, Path]]:
    """When each file was used last, its bytes and its path; files of writers that were killed are among them."""
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                with contextlib.suppress(OSError):  # another command has removed it meanwhile
                    state = entry.stat()
                    yield state.st_mtime, state.st_size, Path(entry.path)
    except OSError:
        return
