"""A plan folder to a folder that any static web host shows, and a tablet without network: read-only.

Output: the built application, what it shows of the plan, and a service worker that keeps both on the device. All paths
are relative. docs/howto/hand-over-the-viewer.md says how it is used.
"""

from __future__ import annotations

import hashlib
import html
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from planner_core.errors import MissingPackageError, OutputExistsError, PlanFolderError, PlannerError
from planner_core.plan_folder.atomic import staged_folder
from planner_core.plan_folder.carry_over import foreign_entries
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.review.store import ReviewStore

STAGE = "export"
SCHEMA = "tlsplan/web/1"
MARKER = "export.json"
WORKER = "worker.js"
PAGE_SCRIPT = "offline.js"
BUILT_APP = Path(__file__).resolve().parent / "dist"
_OFFLINE = Path(__file__).resolve().parent / "offline"
_MANIFEST = "manifest.webmanifest"
#: What of a plan the viewer shows, or links to. Scans and layers for USD programs are handed over with the plan folder.
_SHOWN = ("plan.json", "stations.csv", "viewer", "report")
#: What only a server that simulates needs.
_OF_SERVER = frozenset({"viewer/achievable.u8"})
# As the server's, but for what a page can't say of itself.
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "worker-src 'self'; manifest-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'"
)
#: What comes first in the head of the built page; scripts come after.
_CHARSET = '<meta charset="utf-8" />'
_README = """\
This folder shows a plan of laser scanner stations in a browser: {title}.

Put it on any web host, or on this machine run

    python3 -m http.server 8000

in it and open http://localhost:8000/. It can't be opened as a file: browsers run no applications from files.
Once it was opened over https, or from localhost, it is kept on the device and opens there without network.
"""


@dataclass(frozen=True)
class Exported:
    """What was written. remarks : one line each, for the user."""

    folder: Path
    n_files: int
    n_bytes: int
    remarks: tuple[str, ...] = ()


def export_viewer(
    plan_folder: Path,
    folder: Path,
    *,
    overwrite: bool = False,
    built_app: Path | None = None,
    progress: Progress = silent,
) -> Exported:
    """Write the folder; it appears whole or not at all.

    Parameters
    ----------
    plan_folder
        Written by `write_plan_folder`. What people put into it stays there, links too.
    folder
        A free name, or, with `overwrite`, an earlier export.
    built_app
        The folder that `npm run build` wrote; None: the one of this installation.

    Raises
    ------
    PlanFolderError
        `plan_folder` holds no plan, or something can't be read or written.
    OutputExistsError
        `folder` is there, and is not to be replaced.
    MissingPackageError
        The application is not built.
    """
    document = read_plan_json(plan_folder)
    built = built_app or BUILT_APP
    page = _page_of(built)
    _check_output(folder, overwrite=overwrite)
    title = str((document.get("scene") or {}).get("file") or plan_folder.name).replace("\\", "/").rpartition("/")[2]
    files = {**dict(_app_files(built)), **dict(_plan_files(plan_folder))}
    texts = {"index.html": _static_page(page, title), _MANIFEST: _manifest(title), PAGE_SCRIPT: _offline("page.js")}
    try:
        with staged_folder(folder, replace=overwrite) as staging:
            n_bytes = _write(staging, files, texts, title, progress)
    except OutputExistsError:
        raise
    except OSError as error:
        raise PlanFolderError(
            f"{folder}: can't be written ({error.strerror or error}), nothing was changed; check the free space and "
            "the permissions"
        ) from error
    n_files = sum(path.is_file() for path in folder.rglob("*"))
    return Exported(folder, n_files, n_bytes, _remarks(plan_folder))


def _write(staging: Path, files: dict[str, Path], texts: dict[str, str], title: str, progress: Progress) -> int:
    """Write everything; return the bytes that a device keeps."""
    sha256: dict[str, str] = {}
    n_bytes = 0
    for n_done, name in enumerate(sorted((*files, *texts)), start=1):
        content = texts[name].encode() if name in texts else files[name].read_bytes()
        path = staging / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        sha256[name] = hashlib.sha256(content).hexdigest()
        n_bytes += len(content)
        progress(ProgressEvent(STAGE, n_done, len(files) + len(texts), name))
    kept = [[name, sha256[name]] for name in sorted(sha256)]
    digest = hashlib.sha256(json.dumps(kept).encode()).hexdigest()
    exported = json.dumps({"digest": digest, "files": kept}, separators=(",", ":"))
    (staging / WORKER).write_text(f"const EXPORTED = {exported};\n{_offline('worker.js')}", encoding="utf-8")
    marker = {"schema": SCHEMA, "plan_sha256": sha256["plan/plan.json"], "n_files": len(kept), "n_bytes": n_bytes}
    (staging / MARKER).write_text(json.dumps(marker, indent=1) + "\n", encoding="utf-8")
    (staging / "README.txt").write_text(_README.format(title=title), encoding="utf-8")
    return n_bytes


def _check_output(folder: Path, *, overwrite: bool) -> None:
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise OutputExistsError(f"{folder}: is no folder, expected one to write; give another name")
    if not folder.is_dir() or not any(folder.iterdir()):
        return
    if not (folder / MARKER).is_file():
        raise OutputExistsError(
            f"{folder}: holds files but no export of a plan; give another name or empty it yourself"
        )
    if not overwrite:
        raise OutputExistsError(f"{folder}: exists, expected a free name; give another or pass --overwrite")


def _page_of(built_app: Path) -> str:
    try:
        page = (built_app / "index.html").read_text(encoding="utf-8")
    except OSError as error:
        raise MissingPackageError(
            f"{built_app}: the viewer is not built. Run `make viewer`, or install the wheel."
        ) from error
    if page.count(_CHARSET) != 1:
        raise MissingPackageError(f"{built_app / 'index.html'}: is not the viewer's page. Run `make viewer`.")
    return page


def _static_page(page: str, title: str) -> str:
    """The application's page, which says that there is no server, what it may load, and how it is kept."""
    head = f"""{_CHARSET}
    <meta http-equiv="Content-Security-Policy" content="{_POLICY}" />
    <meta name="tlsplan-mode" content="static" />
    <meta name="referrer" content="no-referrer" />
    <meta name="application-name" content="{html.escape(title, quote=True)}" />
    <link rel="manifest" href="{_MANIFEST}" />
    <script defer src="{PAGE_SCRIPT}"></script>"""
    return page.replace(_CHARSET, head)


def _manifest(title: str) -> str:
    document = {
        "name": f"{title} - tlsplan",
        "short_name": title[:12],
        "start_url": "./",
        "scope": "./",
        "display": "standalone",
        "background_color": "#ffffff",
        "icons": [{"src": "icon.svg", "sizes": "any", "type": "image/svg+xml"}],
        "shortcuts": [{"name": "Field view", "url": "./#view=field"}],
    }
    return json.dumps(document, ensure_ascii=False, indent=1) + "\n"


def _offline(name: str) -> str:
    return (_OFFLINE / name).read_text(encoding="utf-8")


def _app_files(built_app: Path) -> Iterator[tuple[str, Path]]:
    for path in sorted(built_app.rglob("*")):
        if path.is_file() and path.name != "index.html":
            yield path.relative_to(built_app).as_posix(), path


def _plan_files(plan_folder: Path) -> Iterator[tuple[str, Path]]:
    """The plan's own files that are shown, by their names in the export."""
    foreign = frozenset(foreign_entries(plan_folder)) | _OF_SERVER
    for entry in (entry for entry in _SHOWN if entry not in foreign):  # a folder that is a link is
        top = plan_folder / entry
        for path in sorted((top, *top.rglob("*"))):
            name = path.relative_to(plan_folder).as_posix()
            if path.is_file() and not path.is_symlink() and name not in foreign:
                yield f"plan/{name}", path


def _remarks(plan_folder: Path) -> tuple[str, ...]:
    """What the export does not show though somebody may expect it to."""
    try:
        review = ReviewStore(plan_folder).current()
    except PlannerError as error:
        return (f"the review is not looked at: {error}",)
    if not review.stations:
        return ()
    n = len(review.stations)
    stations = "1 station" if n == 1 else f"{n} stations"
    return (
        f"review.usda changes {stations}: the export shows the plan as it was made; plan again with the review to hand "
        "that over",
    )
