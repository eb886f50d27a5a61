"""What a glTF file holds: the chunks of a GLB, buffers in it or beside it, Draco-compressed ones too, and the JSON.

What breaks glTF 2.0 ends in one line that names its place. Every value of the JSON is checked where it is read and not
before: what nobody reads may be wrong. Exceptions of any other kind out of a reader that asks here are its own bugs,
and are not taken for faults of the file.

What a glTF material does to beams: see `planner_core.scene.materials`.

Sources: Khronos Group, glTF 2.0 Specification, 2021, and its extensions KHR_draco_mesh_compression and
KHR_materials_transmission. Draco is undone by DracoPy (Apache-2.0).
"""

from __future__ import annotations

import base64
import binascii
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from planner_core.errors import MissingPackageError, SceneError, grouped, one_line, readable, reason_of
from planner_core.model import FloatArray, Int64Array, Optics
from planner_core.scene.materials import optics_of_material, optics_of_name
from planner_core.scene.raw import exact

_MOST = 2**53
"""Whole numbers beyond this are not exact in JSON, and no file has so many of anything."""
_GLB_HEADER = struct.Struct("<4sII")
_CHUNK_HEADER = struct.Struct("<II")
_JSON_CHUNK, _BIN_CHUNK = 0x4E4F534A, 0x004E4942
DRACO = "KHR_draco_mesh_compression"
_BLOCK_BYTES = 2**24


@dataclass(frozen=True)
class JsonObject:
    """An object of the tree. place: where it is, such as `meshes/0`; empty: the root."""

    file_name: str
    place: str
    members: dict[str, Any]

    def has(self, key: str) -> bool:
        """The member is there."""
        return key in self.members

    def object(self, key: str) -> JsonObject:
        """Return a member that has to be an object."""
        return self._as_object(key, self._member(key))

    def objects(self, key: str) -> list[JsonObject]:
        """Return a member that has to be a list of objects; empty where it is not there."""
        return [self._as_object(f"{key}/{i}", value) for i, value in enumerate(self._list(key))]

    def required_objects(self, key: str) -> list[JsonObject]:
        """Return a member that has to be there, and a list of objects."""
        self._member(key)
        return self.objects(key)

    def whole(self, key: str, default: int | None = None, *, below: int = _MOST) -> int:
        """Return a whole number from 0 to `below` (exclusive); `default` where it is not there, None: it has to be."""
        if default is not None and key not in self.members:
            return default
        return self._as_whole(key, self._member(key), below)

    def wholes(self, key: str, *, below: int) -> list[int]:
        """Return a list of whole numbers from 0 to `below` (exclusive); empty where it is not there."""
        return [self._as_whole(f"{key}/{i}", value, below) for i, value in enumerate(self._list(key))]

    def number(self, key: str, default: float) -> float:
        """Return a number; `default` where it is not there."""
        value = self.members.get(key, default)
        if not _is_number(value):
            raise self._fault(key, value, "a number")
        return float(value)

    def numbers(self, key: str, default: tuple[float, ...]) -> list[float]:
        """Return as many numbers as `default` has, which holds where the member is not there."""
        if key not in self.members:
            return list(default)
        values = self._list(key)
        if len(values) != len(default) or not all(_is_number(value) for value in values):
            raise self._fault(key, self.members[key], f"{len(default)} numbers")
        return [float(value) for value in values]

    def text(self, key: str) -> str:
        """Return a text, empty where it is not there."""
        value = self.members.get(key, "")
        if not isinstance(value, str):
            raise self._fault(key, value, "text")
        return readable(value)

    def texts(self, key: str) -> list[str]:
        """Return a list of texts; empty where it is not there."""
        values = self._list(key)
        if not all(isinstance(value, str) for value in values):
            raise self._fault(key, values, "a list of texts")
        return [readable(value) for value in values]

    def _member(self, key: str) -> Any:
        if key not in self.members:
            raise self._does_not_follow(f"{self._at(key)} is missing")
        return self.members[key]

    def _list(self, key: str) -> list[Any]:
        values = self.members.get(key, [])
        if not isinstance(values, list):
            raise self._fault(key, values, "a list")
        return values

    def _as_object(self, key: str, value: Any) -> JsonObject:
        if not isinstance(value, dict):
            raise self._fault(key, value, "an object")
        return JsonObject(self.file_name, self._at(key), value)

    def _as_whole(self, key: str, value: Any, below: int) -> int:
        is_whole = _is_number(value) and value == value // 1
        if not (is_whole and 0 <= value < below):
            raise self._fault(key, value, f"a whole number from 0 to {below - 1}" if below else "none")
        return int(value)

    def _at(self, key: str) -> str:
        return f"{self.place}/{key}" if self.place else key

    def _fault(self, key: str, got: Any, expected: str) -> SceneError:
        shown = "a list" if isinstance(got, list) else "an object" if isinstance(got, dict) else repr(got)[:40]
        return self._does_not_follow(f"{self._at(key)} is {shown}, expected {expected}")

    def _does_not_follow(self, detail: str) -> SceneError:
        return SceneError(
            f"{self.file_name}: its contents do not follow glTF 2.0 ({detail}); validate it and export it again."
        )


def glb_chunks(path: Path, contents: bytes) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB."""
    if len(contents) < _GLB_HEADER.size:
        raise SceneError(f"{path.name}: it ends inside its header: it is cut off; export it again.")
    _, version, length = _GLB_HEADER.unpack_from(contents)
    if version != 2:
        raise SceneError(f"{path.name}: it is binary glTF {version}, expected version 2; export it as glTF 2.0.")
    if length > len(contents):
        raise SceneError(
            f"{path.name}: it declares {grouped(length)} bytes and has {grouped(len(contents))}: it is cut off; "
            "copy or export it again."
        )
    chunks: dict[int, bytes] = {}
    at = _GLB_HEADER.size
    while at + _CHUNK_HEADER.size <= length:
        size, kind = _CHUNK_HEADER.unpack_from(contents, at)
        at += _CHUNK_HEADER.size
        if at + size > length:
            raise SceneError(f"{path.name}: a chunk of {grouped(size)} bytes runs past its end; export it again.")
        chunks.setdefault(kind, contents[at : at + size])
        at += size
    if _JSON_CHUNK not in chunks:
        raise SceneError(f"{path.name}: it has no JSON chunk, expected one; export it again.")
    return chunks[_JSON_CHUNK], chunks.get(_BIN_CHUNK)


def embedded(name: str, number: int, uri: str) -> bytes:
    """Bytes of a buffer that is in the JSON itself, in base64. name : of the file, for messages."""
    head, comma, body = uri.partition(",")
    if not comma or not head.endswith(";base64"):
        raise SceneError(f"{name}: buffer {number} is embedded as {head[:40]!r}, expected base64; export it again.")
    try:
        return base64.b64decode(body, validate=True)
    except (binascii.Error, ValueError) as error:  # the latter where it is not ASCII
        raise SceneError(f"{name}: buffer {number} is not valid base64 ({error}); export it again.") from error


def file_beside(path: Path, uri: str) -> bytes:
    """Bytes of a file that the one at `path` refers to, in its folder or below: one from elsewhere could name any."""
    shown = one_line(uri[:200])
    try:
        file = _place_beside(path, uri)
        is_other = file is not None and file.exists() and not file.is_file()
        contents = file.read_bytes() if file is not None and not is_other else b""
    except (OSError, ValueError, RuntimeError) as error:  # no file can have such a name; links that go in a circle
        reason = getattr(error, "strerror", None) or error
        raise SceneError(
            f"{path.name}: it refers to {shown}, which can't be read ({reason}); put that file beside it, "
            "or export the model as GLB."
        ) from error
    if file is None:
        raise SceneError(
            f"{path.name}: it refers to {shown}, expected a file beside it; export it with embedded buffers."
        )
    if is_other:  # reading a pipe waits for whoever writes into it
        raise SceneError(f"{path.name}: it refers to {shown}, which is no file, expected one; export it as GLB.")
    return contents


def names_draco(path: Path) -> bool:
    """A file names the extension, and so may hold what DracoPy, a native library, has to read."""
    with path.open("rb") as file:
        before = b""
        while block := file.read(_BLOCK_BYTES):
            if DRACO.encode() in before + block:
                return True
            before = block[-len(DRACO) :]
    return False


def decoded(file_name: str, contents: bytes, position: int) -> tuple[FloatArray, Int64Array]:
    """(V, 3) float64 and (T, 3) of a compressed primitive, whatever its mode.

    Parameters
    ----------
    contents : the bytes of the primitive's buffer view.
    position : Draco's number of the attribute that is POSITION.

    Raises
    ------
    SceneError
        It is damaged, or has no such attribute.
    MissingPackageError
        DracoPy is not installed.
    """
    try:
        import DracoPy
    except ImportError as error:
        raise MissingPackageError(
            f"{file_name}: reading Draco-compressed glTF needs the package dracopy, which is missing; "
            "run pip install dracopy."
        ) from error
    try:
        mesh = DracoPy.decode(contents)
    except (DracoPy.FileTypeException, DracoPy.EncodingFailedException, ValueError, RuntimeError, MemoryError) as error:
        reason = reason_of(error)
        raise SceneError(f"{file_name}: its Draco compression can't be undone ({reason}); export it again.") from error
    positions = next((a["data"] for a in getattr(mesh, "attributes", ()) if a["unique_id"] == position), None)
    triangles = getattr(mesh, "faces", None)
    if positions is None or triangles is None or positions.ndim != 2 or positions.shape[1] != 3:
        raise SceneError(f"{file_name}: its Draco compression holds no triangles with positions; export it again.")
    return exact(np.asarray(positions)), np.asarray(triangles).reshape(-1, 3).astype(np.int64)


def material_optics(material: JsonObject) -> Optics | None:
    """What a material's name, transmission, blended opacity, metal and roughness say; textures say nothing."""
    pbr = material.object("pbrMetallicRoughness") if material.has("pbrMetallicRoughness") else None
    metallic: float | None = None
    roughness: float | None = None
    if pbr is not None and not pbr.has("metallicRoughnessTexture"):
        metallic, roughness = pbr.number("metallicFactor", 1.0), pbr.number("roughnessFactor", 1.0)
    return optics_of_material(
        [material.text("name")], transparency=_transparency(material, pbr), metallic=metallic, roughness=roughness
    )


def node_optics(node: JsonObject) -> Optics | None:
    """Optics of a node's mesh by `extras.material`, a text of our own that other tools keep."""
    extras = node.members.get("extras")
    named = extras.get("material") if isinstance(extras, dict) else None
    return optics_of_name(named) if isinstance(named, str) else None


def _is_number(value: Any) -> bool:
    """A number that a float64 holds; JSON's true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 1.7e308


def _place_beside(path: Path, uri: str) -> Path | None:
    """Where a file is that `path` refers to; None where that is neither its folder nor below."""
    relative, folder = Path(unquote(uri)), path.parent.resolve()
    file = (folder / relative).resolve()
    is_inside = "://" not in uri and not relative.is_absolute() and file.is_relative_to(folder)
    return file if is_inside else None


def _transparency(material: JsonObject, pbr: JsonObject | None) -> float | None:
    """The share of light that goes through, by whichever way lets more through; None where neither is used."""
    shares = []
    extensions = material.object("extensions") if material.has("extensions") else None
    if extensions is not None and extensions.has("KHR_materials_transmission"):
        shares.append(extensions.object("KHR_materials_transmission").number("transmissionFactor", 0.0))
    if material.text("alphaMode") == "BLEND" and pbr is not None:
        shares.append(1.0 - pbr.numbers("baseColorFactor", (1.0, 1.0, 1.0, 1.0))[3])
    return max(shares, default=None)
