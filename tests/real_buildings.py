"""The real buildings of the shared folder, loaded once for all tests and workers: reading one takes seconds.

Tests of loading itself load them anew.
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from pathlib import Path

import pytest

from planner_core.model import Scene

FOLDER = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "ifc"
RealScene = Callable[[str], Scene]


def real_scenes(folder: Path) -> RealScene:
    """What loads `duplex` or `fzk-haus` with default options, or skips the test where the file is absent.

    Scenes loaded are kept in `folder`, which processes may share.
    """
    loaded: dict[str, Scene] = {}

    def scene_of(name: str) -> Scene:
        path = FOLDER / f"{name}.ifc"
        if not path.is_file():
            pytest.skip(f"{path.name} is not beside the repository (../shared/data/ifc)")
        if name not in loaded:
            loaded[name] = _kept(path, folder / f"{name}.pickle")
        return loaded[name]

    return scene_of


def _kept(path: Path, kept: Path) -> Scene:
    from planner_core.scene.load import load_scene  # a while to import, for tests that load nothing

    if kept.is_file():
        scene = pickle.loads(kept.read_bytes())
        assert isinstance(scene, Scene)
        return scene
    scene = load_scene(path)
    own = kept.with_suffix(f".{os.getpid()}")
    own.write_bytes(pickle.dumps(scene))
    own.replace(kept)  # whole, for whoever reads it meanwhile
    return scene
