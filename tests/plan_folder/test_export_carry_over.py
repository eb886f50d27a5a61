"""What people put into a plan folder outlives the plan's replacement; where it can't, the old plan stays."""

import dataclasses
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from oldest_plan import oldest_plan

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import OutputExistsError, PlanFolderError
from planner_core.model import Plan
from planner_core.plan_folder.carry_over import carry_over, foreign_entries
from planner_core.plan_folder.folder import check_output, write_plan_folder
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.progress import ProgressEvent

MINE = {
    "field-notes.docx": b"notes",
    ".hidden": b"",
    "photos/2026/crane.jpg": b"jpg" * 1000,
    "scans/S001.e57": b"the real scan",
    "scans/S1000.exr": b"of another crew",
    "report/comments.txt": b"why?",
    "stage/clouds/own/points.usda": b"#usda 1.0",
    "plan.json.bak": b"{}",
}


def put_mine(folder: Path) -> None:
    for name, content in MINE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    (folder / "empty").mkdir()
    (folder / "latest").symlink_to("photos/2026")
    (folder / "dangling").symlink_to("nowhere")
    os.utime(folder / "field-notes.docx", ns=(1, 2_000_000_000))


def stopping_at(name: str, action: Callable[[], object]) -> Callable[[ProgressEvent], None]:
    """Progress that does something once the file `name` is there."""

    def progress(event: ProgressEvent) -> None:
        if event.note == name:
            action()

    return progress


@pytest.mark.slow
def test_nothing_that_is_written_counts_as_foreign(plan_folder: Path) -> None:
    assert foreign_entries(plan_folder) == ()


@pytest.mark.slow
def test_files_of_people_outlive_overwriting(small: Plan, engine: ScanEngine, folder: Path) -> None:
    put_mine(folder)
    changed = dataclasses.replace(small, settings=dataclasses.replace(small.settings, seed=7))
    write_plan_folder(changed, folder, engine=engine, overwrite=True)
    assert read_plan_json(folder)["seed"] == 7
    assert {name: (folder / name).read_bytes() for name in MINE} == MINE
    assert (folder / "empty").is_dir()
    assert (folder / "latest").readlink() == Path("photos/2026")
    assert (folder / "dangling").readlink() == Path("nowhere")
    assert (folder / "field-notes.docx").stat().st_mtime_ns == 2_000_000_000
    assert [path.name for path in folder.parent.iterdir()] == ["plan"]


@pytest.mark.slow
def test_files_of_stations_that_are_no_more_go(
    small: Plan, engine: ScanEngine, plan_folder: Path, tmp_path: Path
) -> None:
    shutil.copytree(plan_folder, tmp_path / "plan")
    (tmp_path / "plan" / "scans").mkdir()
    for name in ("mine.txt", "S002.exr", "S002.png"):  # older versions wrote the last two
        (tmp_path / "plan" / "scans" / name).write_text("of a scan")
    write_plan_folder(small, tmp_path / "plan", engine=engine, overwrite=True)
    left = {str(path.relative_to(tmp_path / "plan")) for path in (tmp_path / "plan").rglob("*")}
    assert "scans/mine.txt" in left
    assert [name for name in left if "S00" in name or "_F" in name] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["field-notes.docx", "photos/new.jpg"])
def test_file_that_comes_while_the_export_runs_is_kept(
    small: Plan, engine: ScanEngine, folder: Path, name: str
) -> None:
    def add() -> None:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("late")

    write_plan_folder(small, folder, engine=engine, overwrite=True, progress=stopping_at("plan.json", add))
    assert (folder / name).read_text() == "late"


def test_copies_are_taken_where_there_are_no_hard_links(
    small: Plan, engine: ScanEngine, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    put_mine(folder)
    monkeypatch.setattr(os, "link", refuse)
    write_plan_folder(small, folder, engine=engine, overwrite=True)
    assert {name: (folder / name).read_bytes() for name in MINE} == MINE
    assert (folder / "dangling").readlink() == Path("nowhere")
    assert (folder / "field-notes.docx").stat().st_mtime_ns == 2_000_000_000


@pytest.mark.slow
def test_review_that_is_written_while_the_export_runs_is_kept_and_the_run_refused(
    small: Plan, engine: ScanEngine, folder: Path
) -> None:
    review = folder / "review.usda"
    changed = dataclasses.replace(small, settings=dataclasses.replace(small.settings, seed=7))
    progress = stopping_at("plan.json", lambda: review.write_text('#usda 1.0\nover "Plan" {}\n'))
    with pytest.raises(OutputExistsError, match=r"review\.usda"):
        write_plan_folder(changed, folder, engine=engine, overwrite=True, progress=progress)
    assert 'over "Plan"' in review.read_text()
    assert read_plan_json(folder)["seed"] == small.settings.seed
    assert [path.name for path in folder.parent.iterdir()] == ["plan"]


@pytest.mark.slow
def test_other_folder_that_takes_the_name_while_the_export_runs_is_not_replaced(
    small: Plan, engine: ScanEngine, folder: Path
) -> None:
    def take_the_name() -> None:
        folder.rename(folder.with_name("moved"))
        folder.mkdir()
        (folder / "thesis.tex").write_text("mine")

    progress = stopping_at("plan.json", take_the_name)
    with pytest.raises(OutputExistsError, match="no plan"):
        write_plan_folder(small, folder, engine=engine, overwrite=True, progress=progress)
    assert (folder / "thesis.tex").read_text() == "mine"


def test_file_whose_name_the_new_plan_needs_is_not_replaced(plan: Plan, engine: ScanEngine, folder: Path) -> None:
    (folder / "viewer" / "clouds").mkdir(parents=True, exist_ok=True)
    (folder / "viewer" / "clouds" / "S002.cloud").write_text("my own cloud")
    with pytest.raises(OutputExistsError, match=r"S002\.cloud.*move yours"):
        write_plan_folder(plan, folder, engine=engine, overwrite=True, pictures=False)
    assert (folder / "viewer" / "clouds" / "S002.cloud").read_text() == "my own cloud"
    assert read_plan_json(folder)["stations"] == []


@pytest.mark.parametrize("stations", [None, 3, [{"name": "A"}], ["A"]])
def test_plan_without_station_ids_is_not_replaced(tmp_path: Path, stations: object) -> None:
    (tmp_path / "plan").mkdir()
    (tmp_path / "plan" / "plan.json").write_text(json.dumps(oldest_plan(stations=stations)))
    with pytest.raises(OutputExistsError, match="no plan of this version"):
        check_output(tmp_path / "plan", overwrite=True)
    with pytest.raises(PlanFolderError):
        carry_over(tmp_path / "plan", tmp_path)
