"""The folder for static hosts: what is in it, what is not, and that it says no to what would do harm."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest
from click.testing import CliRunner
from tlsplan.commands import export as export_command

from planner_core.errors import MissingPackageError, OutputExistsError, PlanFolderError
from planner_core.review.changes import MoveStation
from planner_core.review.store import ReviewStore
from viewer_web import static_export
from viewer_web.static_export import export_viewer

PAGE = """<!doctype html>
<html lang="en"><head>
<meta charset="utf-8" />
<title>tlsplan</title>
<script type="module" src="./assets/index-abc123.js"></script>
</head><body></body></html>
"""
PLAN_FILES = {"plan/plan.json", "plan/viewer/clouds/S001.u16", "plan/report/index.html"}
APP_FILES = {"index.html", "assets/index-abc123.js"}
ADDED = {"manifest.webmanifest", "offline.js"}
BESIDE = {"worker.js", "export.json", "README.txt"}


@pytest.fixture
def app_folder(built_app: Path) -> Path:
    (built_app / "index.html").write_text(PAGE)
    return built_app


def names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def kept(folder: Path) -> dict[str, str]:
    """Files that the worker keeps, and their SHA-256."""
    first, _, _ = (folder / "worker.js").read_text().partition("\n")
    found = re.fullmatch(r"const EXPORTED = (\{.*\});", first)
    assert found is not None
    return dict(json.loads(found[1])["files"])


def test_the_export_holds_the_application_and_what_it_shows_of_the_plan_and_no_more(
    plan_folder: Path, app_folder: Path, tmp_path: Path
) -> None:
    (plan_folder / "viewer" / "achievable.u8").write_bytes(b"only for the server")
    (plan_folder / "report" / "notes of ours.txt").write_text("foreign")
    (plan_folder / "runs" / "R001" / "plan").mkdir(parents=True)
    (plan_folder / "runs" / "R001" / "plan" / "plan.json").write_text("{}")
    (plan_folder / "report" / "map_F0.png").symlink_to(tmp_path / "secret.txt")
    shutil.copytree(plan_folder / "viewer" / "clouds", tmp_path / "elsewhere" / "seen")
    (plan_folder / "viewer" / "seen").symlink_to(tmp_path / "elsewhere" / "seen")
    exported = export_viewer(plan_folder, tmp_path / "web", built_app=app_folder)
    assert names(exported.folder) == PLAN_FILES | APP_FILES | ADDED | BESIDE
    assert exported.n_files == len(PLAN_FILES | APP_FILES | ADDED | BESIDE)
    for name in PLAN_FILES:
        assert (exported.folder / name).read_bytes() == (plan_folder / name.removeprefix("plan/")).read_bytes()


def test_the_worker_keeps_every_file_by_its_hash(plan_folder: Path, app_folder: Path, tmp_path: Path) -> None:
    folder = export_viewer(plan_folder, tmp_path / "web", built_app=app_folder).folder
    assert kept(folder) == {
        name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in PLAN_FILES | APP_FILES | ADDED
    }


def test_the_same_plan_gives_the_same_bytes_and_another_one_another_worker(
    plan_folder: Path, app_folder: Path, tmp_path: Path
) -> None:
    one, two = (export_viewer(plan_folder, tmp_path / name, built_app=app_folder).folder for name in ("one", "two"))
    assert {name: (one / name).read_bytes() for name in names(one)} == {
        name: (two / name).read_bytes() for name in names(two)
    }
    (plan_folder / "viewer" / "clouds" / "S001.u16").write_bytes(b"other")
    export_viewer(plan_folder, two, overwrite=True, built_app=app_folder)
    assert (one / "worker.js").read_bytes() != (two / "worker.js").read_bytes()


class Head(HTMLParser):
    """The tags of a page, in order."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))


def test_the_page_says_that_it_is_static_and_what_it_may_load_before_it_loads_anything(
    plan_folder: Path, app_folder: Path, tmp_path: Path
) -> None:
    document = json.loads((plan_folder / "plan.json").read_text())
    document["scene"]["file"] = 'C:\\jobs\\<b>"house".ifc'
    (plan_folder / "plan.json").write_text(json.dumps(document))
    folder = export_viewer(plan_folder, tmp_path / "web", built_app=app_folder).folder
    tags = Head((folder / "index.html").read_text()).tags
    metas = {told.get("name") or told.get("http-equiv"): told.get("content") for tag, told in tags if tag == "meta"}
    assert metas["tlsplan-mode"] == "static"
    assert metas["application-name"] == '<b>"house".ifc'
    policy = dict(part.strip().split(" ", 1) for part in str(metas["Content-Security-Policy"]).split(";"))
    assert (policy["default-src"], policy["script-src"], policy["connect-src"]) == ("'none'", "'self'", "'self'")
    assert "unsafe" not in str(policy)
    order = [told.get("http-equiv") or tag for tag, told in tags if tag in ("meta", "script", "link")]
    assert order.index("Content-Security-Policy") < min(order.index("script"), order.index("link"))
    links = [told.get("src") or told.get("href") for tag, told in tags if tag in ("script", "link")]
    assert all(not str(link).startswith(("/", "http")) for link in links)
    manifest = json.loads((folder / "manifest.webmanifest").read_text())
    assert (manifest["start_url"], manifest["scope"]) == ("./", "./")


def test_only_a_free_name_or_an_earlier_export_is_written(plan_folder: Path, app_folder: Path, tmp_path: Path) -> None:
    folder = export_viewer(plan_folder, tmp_path / "web", built_app=app_folder).folder
    with pytest.raises(OutputExistsError, match="--overwrite"):
        export_viewer(plan_folder, folder, built_app=app_folder)
    for taken in (plan_folder, plan_folder / "plan.json", tmp_path):
        before = names(plan_folder)
        with pytest.raises(OutputExistsError):
            export_viewer(plan_folder, taken, overwrite=True, built_app=app_folder)
        assert names(plan_folder) == before
    (tmp_path / "free").mkdir()
    export_viewer(plan_folder, tmp_path / "free", built_app=app_folder)


def test_what_is_no_plan_or_no_viewer_is_refused(plan_folder: Path, app_folder: Path, tmp_path: Path) -> None:
    with pytest.raises(PlanFolderError):
        export_viewer(tmp_path / "nothing", tmp_path / "web", built_app=app_folder)
    with pytest.raises(MissingPackageError, match="make viewer"):
        export_viewer(plan_folder, tmp_path / "web", built_app=tmp_path / "nothing")
    (app_folder / "index.html").write_text("<p>hello</p>")
    with pytest.raises(MissingPackageError, match="make viewer"):
        export_viewer(plan_folder, tmp_path / "web", built_app=app_folder)
    assert not (tmp_path / "web").exists()


def test_stations_that_the_review_moved_are_remarked_on(plan_folder: Path, app_folder: Path, tmp_path: Path) -> None:
    assert export_viewer(plan_folder, tmp_path / "one", built_app=app_folder).remarks == ()
    move = MoveStation("S001", (500001.5, 4000002.0, 101.5), floor="F0")
    ReviewStore(plan_folder).commit(0, [move], "Ana")
    (remark,) = export_viewer(plan_folder, tmp_path / "two", built_app=app_folder).remarks
    assert "1 station" in remark


@pytest.mark.slow
def test_scripts_of_the_export_are_ones_that_a_browser_can_read(
    plan_folder: Path, app_folder: Path, tmp_path: Path
) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    folder = export_viewer(plan_folder, tmp_path / "web", built_app=app_folder).folder
    for name in ("worker.js", "offline.js"):
        subprocess.run([node, "--check", str(folder / name)], check=True)


def test_the_command_tells_the_size_and_lists_the_formats(
    plan_folder: Path, app_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(static_export, "BUILT_APP", app_folder)
    call = CliRunner().invoke
    told = call(export_command.command, [str(plan_folder), "--format", "web", "-o", str(tmp_path / "web"), "--json"])
    assert told.exit_code == 0, told.output
    document = json.loads(told.stdout)
    assert document["n_files"] == len(names(tmp_path / "web"))
    assert document["n_bytes"] == sum((tmp_path / "web" / name).stat().st_size for name in kept(tmp_path / "web"))
    listed = call(export_command.command, ["--list"])
    assert (listed.exit_code, "web" in listed.output) == (0, True)
    assert call(export_command.command, [str(plan_folder), "--format", "no-such", "-o", "x"]).exit_code == 2
