"""Files that many tests read, read by a child process once in each worker: the same bytes are the same answer.

Starting a child and importing a native library in it take longer than most of what tests do with a building. Tests of
readers and of children read anew. What fails is never kept, nor what reads other files than the one it is given.
"""

from __future__ import annotations

import copy
import os
from collections import OrderedDict
from hashlib import sha256
from pathlib import Path
from typing import Any

from planner_core import child_process
from planner_core.progress import ProgressEvent

_FUNCTIONS = ("planner_core.scene.isolated_readers:read", "planner_core.export.sheets.building:read_meshes")
_ANEW = ("tests/scene/test_scene_", "tests/scene/test_ifc_", "tests/scene/test_gltf_", "tests/test_child_process.py")
_MOST_KEPT = 24
_run_isolated = child_process.run_isolated
_kept: OrderedDict[Any, tuple[Any, list[ProgressEvent]]] = OrderedDict()


def keep_what_children_read() -> None:
    """Let `run_isolated` answer from memory from now on, in this process, progress included."""
    child_process.run_isolated = _run_once


def _run_once(function: str, arguments: Any, **options: Any) -> Any:
    path, progress = Path(arguments.get("path", "")), options["progress"]
    is_kept = function in _FUNCTIONS and arguments.get("file_format", "ifc") == "ifc" and path.is_file()
    if not is_kept or os.environ.get("PYTEST_CURRENT_TEST", "").startswith(_ANEW):
        return _run_isolated(function, arguments, **options)
    others = {name: value for name, value in (arguments | options).items() if name not in ("path", "progress")}
    key = function, path.name, sha256(path.read_bytes()).digest(), repr(sorted(others.items()))
    if key in _kept:
        _kept.move_to_end(key)
        for event in _kept[key][1]:
            progress(event)
    else:
        events: list[ProgressEvent] = []

        def tell(event: ProgressEvent) -> None:
            events.append(event)
            progress(event)

        _kept[key] = _run_isolated(function, arguments, **options | {"progress": tell}), events
        while len(_kept) > _MOST_KEPT:
            _kept.popitem(last=False)
    return copy.deepcopy(_kept[key][0])  # who asked may write to it
