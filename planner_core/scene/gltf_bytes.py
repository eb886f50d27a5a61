"""The bytes of a glTF file: the chunks of a GLB, and buffers embedded in it or in files beside it.

Source: Khronos Group, glTF 2.0 Specification, 2021.
"""

from __future__ import annotations

import base64
import binascii
import struct
from pathlib import Path
from urllib.parse import unquote

from planner_core.errors import SceneError, grouped, one_line

_GLB_HEADER = struct.Struct("<4sII")
_CHUNK_HEADER = struct.Struct("<II")
_JSON_CHUNK, _BIN_CHUNK = 0x4E4F534A, 0x004E4942


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


def _place_beside(path: Path, uri: str) -> Path | None:
    """Where a file is that `path` refers to; None where that is neither its folder nor below."""
    relative, folder = Path(unquote(uri)), path.parent.resolve()
    file = (folder / relative).resolve()
    is_inside = "://" not in uri and not relative.is_absolute() and file.is_relative_to(folder)
    return file if is_inside else None
