"""Files under one folder as HTTP responses: confined, ETag by content, with byte ranges, text compressed."""

import gzip
import hashlib
import re
from functools import lru_cache
from pathlib import Path
from stat import S_ISREG

from starlette.requests import Request
from starlette.responses import FileResponse, Response

# Not the `mimetypes` module: its answers depend on the machine.
MEDIA_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".csv": "text/csv; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".jpg": "image/jpeg",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".pdf": "application/pdf",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
}
# Clouds are packed in their files.
COMPRESSED_SUFFIXES = frozenset(
    {".bits", ".css", ".csv", ".html", ".i32", ".js", ".json", ".svg", ".u32", ".u8", ".usdc"}
)
# Below, the headers cost more than is gained; above, compressing would hold up the first byte and fill the cache.
COMPRESSED_BYTES = range(1024, 8 * 1024 * 1024)
# Hashing holds up the first byte of the first answer by a millisecond a megabyte; what is larger has its time and size.
LARGEST_HASHED_BYTES = 64 * 1024 * 1024
# No empty, hidden or parent segment, no backslash, no drive or stream colon, no control character.
SEGMENT = re.compile(r"[^./\\:\x00-\x1f\x7f][^/\\:\x00-\x1f\x7f]*")


def find_file(root: Path, relative: str) -> Path | None:
    """Return the regular file at `relative` below `root`; None where there is none or it may not be seen.

    Hidden names, parent steps and symbolic links that lead out of `root` count as not there.
    """
    segments = relative.split("/")
    if not all(SEGMENT.fullmatch(segment) for segment in segments):
        return None
    try:
        real_root = root.resolve(strict=True)
        real = real_root.joinpath(*segments).resolve(strict=True)
        is_regular = S_ISREG(real.stat().st_mode)
    except (OSError, RuntimeError):  # absent, unreadable, too long a name, a loop of links
        return None
    inside = real.is_relative_to(real_root) and not any(
        part.startswith(".") for part in real.relative_to(real_root).parts
    )
    return real if inside and is_regular else None


def send_file(file: Path, request: Request) -> Response:
    """Return `file` as the answer to a GET or HEAD: 304 where the browser has it, 206 for a range, else 200."""
    found = file.stat()
    stamp = f"{found.st_mtime_ns:x}-{found.st_size:x}-{found.st_ino:x}"
    tag = _digest(file, stamp) if found.st_size <= LARGEST_HASHED_BYTES else stamp
    is_packed = _is_packed(file, found.st_size, request)
    headers = {
        "etag": f'"{tag}-gzip"' if is_packed else f'"{tag}"',
        # Names of built assets carry a hash of their content; everything else may change under its name.
        "cache-control": "public, max-age=31536000, immutable" if file.parent.name == "assets" else "no-cache",
        "vary": "accept-encoding",
    }
    if etag_matches(request, headers["etag"]):
        return Response(status_code=304, headers=headers)
    media_type = MEDIA_TYPES.get(file.suffix.lower(), "application/octet-stream")
    if is_packed:
        body = _gzipped(file, tag)
        headers |= {"content-encoding": "gzip", "content-length": str(len(body))}
        return Response(b"" if request.method == "HEAD" else body, headers=headers, media_type=media_type)
    return FileResponse(file, headers=headers, media_type=media_type, stat_result=found)


def _is_packed(file: Path, size_bytes: int, request: Request) -> bool:
    wanted = "gzip" in request.headers.get("accept-encoding", "") and "range" not in request.headers
    return wanted and file.suffix.lower() in COMPRESSED_SUFFIXES and size_bytes in COMPRESSED_BYTES


def etag_matches(request: Request, tag: str) -> bool:
    """Whether the browser has what bears this tag."""
    sent = request.headers.get("if-none-match", "").split(",")
    return tag in {each.strip().removeprefix("W/") for each in sent}


def packed(content: bytes) -> bytes:
    """`content` compressed: the same bytes always."""
    return gzip.compress(content, compresslevel=6, mtime=0)


@lru_cache(maxsize=4096)
def _digest(file: Path, stamp: str) -> str:
    """Hash of the content; `stamp` only makes the cache forget a file that changed."""
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()[:32]


@lru_cache(maxsize=32)
def _gzipped(file: Path, tag: str) -> bytes:
    """`file` compressed; `tag` only makes the cache forget a file that changed."""
    return packed(file.read_bytes())
