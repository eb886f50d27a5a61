"""Draco-compressed glTF gives the surfaces of the plain one; damaged, it is refused. Oracle: Draco's own encoder."""

from __future__ import annotations

import base64
import json
import random

import DracoPy
import numpy as np
import pytest

from planner_core.child_process import LostChildError
from planner_core.errors import PlannerError, SceneError
from planner_core.scene.gltf_file import DRACO, names_draco
from planner_core.scene.load import LoadOptions, load_scene

ATTRIBUTE = 0
BITS = 16


def packed_house(house) -> bytes:
    return DracoPy.encode(house.vertices.astype(np.float32), house.triangles.astype(np.uint32), quantization_bits=BITS)


def write(path, contents: bytes, **extension):
    tree = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_draco_mesh_compression"],
        "extensionsRequired": ["KHR_draco_mesh_compression"],
        "buffers": [
            {"byteLength": len(contents), "uri": "data:a/b;base64," + base64.b64encode(contents).decode("ascii")}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(contents)}],
        "accessors": [
            {"componentType": 5126, "count": 32, "type": "VEC3"},
            {"componentType": 5125, "count": 144, "type": "SCALAR"},
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0},
                        "indices": 1,
                        "extensions": {
                            "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": ATTRIBUTE}}
                            | extension
                        },
                    }
                ]
            }
        ],
        "nodes": [{"mesh": 0, "name": "House"}],
    }
    path.write_text(json.dumps(tree))
    return path


def area_m2(corners) -> float:
    return float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    )


def test_compressed_house_has_the_surfaces_of_the_plain_one(tmp_path, house):
    """Positions within a step of the quantisation, 8 m / 65535; as many triangles, of the same area."""
    scene = load_scene(write(tmp_path / "a.gltf", packed_house(house)), options=LoadOptions(up_axis="Z"))
    assert scene.n_triangles == len(house.triangles)
    found, true = scene.vertices_m[scene.triangles] + scene.offset_m, house.vertices[house.triangles]
    step_m = 8 / (2**BITS - 1)
    gaps = np.abs(found.reshape(-1, 1, 3) - house.vertices).max(axis=2).min(axis=1)
    assert gaps.max() <= step_m
    assert area_m2(found) == pytest.approx(area_m2(true), rel=1e-3)


@pytest.mark.parametrize(
    ("extension", "expected"),
    [
        ({"attributes": {"POSITION": 9}}, "holds no triangles with positions"),
        ({"attributes": {}}, "POSITION is missing"),
        ({"bufferView": 3}, "bufferView is 3, expected a whole number from 0 to 0"),
    ],
)
def test_compression_that_names_nothing_is_refused(tmp_path, house, extension, expected):
    with pytest.raises(SceneError) as caught:
        load_scene(write(tmp_path / "a.gltf", packed_house(house), **extension))
    assert expected in str(caught.value)


@pytest.mark.filterwarnings("error")
def test_damaged_compression_is_read_or_refused(tmp_path, house):
    whole = packed_house(house)
    rng = random.Random(1)
    told = set()
    for number in range(60):
        damaged = bytearray(whole)
        for _ in range(1 + number % 3):
            damaged[rng.randrange(len(damaged))] = rng.randrange(256)
        if number % 5 == 0:
            del damaged[rng.randrange(len(damaged)) :]
        try:
            load_scene(write(tmp_path / "a.gltf", bytes(damaged)))
            told.add("loaded")
        except PlannerError as error:
            assert "\n" not in str(error)
            told.add("refused")
    assert told == {"loaded", "refused"}


def test_cloud_of_points_in_compression_is_refused(tmp_path, house):
    cloud = DracoPy.encode(house.vertices.astype(np.float32))
    with pytest.raises(SceneError, match="holds no triangles"):
        load_scene(write(tmp_path / "a.gltf", cloud))


def test_compressed_file_is_read_apart_and_a_plain_one_here(tmp_path, house, write_house, monkeypatch):
    def fail(*args, **options):
        raise LostChildError("crashed (segmentation fault)", "", ())

    monkeypatch.setattr("planner_core.child_process.run_isolated", fail)
    assert load_scene(write_house(tmp_path, "house.glb")).n_triangles == len(house.triangles)
    with pytest.raises(SceneError, match=r"^a\.gltf: the Draco library crashed \(segmentation fault\), exp"):
        load_scene(write(tmp_path / "a.gltf", packed_house(house)))


def test_name_of_the_extension_is_found_anywhere(tmp_path, monkeypatch):
    monkeypatch.setattr("planner_core.scene.gltf_file._BLOCK_BYTES", 29)
    for before in range(60):
        (tmp_path / "a").write_bytes(b"-" * before + DRACO.encode() + b"-" * 40)
        assert names_draco(tmp_path / "a"), before
        (tmp_path / "a").write_bytes(b"-" * before + DRACO[:-1].encode() + b"-" * 40)
        assert not names_draco(tmp_path / "a"), before
