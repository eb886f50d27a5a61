"""The real buildings of the shared folder, loaded once for all tests and workers: reading one takes seconds.

Tests of loading itself load them anew.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from made_once import MadeOnce

from planner_core.model import Scene

FOLDER = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "ifc"
RealScene = Callable[[str], Scene]


def real_scenes(made_once: MadeOnce) -> RealScene:
    """What loads `duplex` or `fzk-haus` with default options, or skips the test where the file is absent."""

    def load(folder: Path) -> None:
        from planner_core.scene.load import load_scene  # a while to import, for tests that load nothing

        (folder / "scene.pickle").write_bytes(pickle.dumps(load_scene(FOLDER / f"{folder.name}.ifc")))

    @cache
    def scene_of(name: str) -> Scene:
        if not (FOLDER / f"{name}.ifc").is_file():
            pytest.skip(f"{name}.ifc is not beside the repository (../shared/data/ifc)")
        scene = pickle.loads((made_once(name, load) / "scene.pickle").read_bytes())
        assert isinstance(scene, Scene)
        return scene

    return scene_of
