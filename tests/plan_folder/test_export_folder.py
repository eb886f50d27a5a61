"""The plan folder as a whole: complete, the same every time, whole or not at all."""

import dataclasses
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import OutputExistsError, PlanFolderError
from planner_core.model import Plan
from planner_core.plan_folder import atomic
from planner_core.plan_folder.folder import check_output, write_plan_folder
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_source import source_of
from planner_core.plan_folder.report import report_files, report_page, write_report
from planner_core.plan_folder.sheet import floor_figures
from planner_core.plan_folder.stations_csv import read_station_list
from planner_core.progress import ProgressEvent


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_plan_folder_holds_the_files_of_the_contract_and_no_others(plan_folder: Path) -> None:
    names = ["S001", "S002", "S003"]
    expected = {
        "plan.json", "plan.usda", "review.usda", "stations.csv",
        "stage/building.usdc", "stage/heatmaps.usdc", "stage/results.usdc", "stage/stations.usda",
        "viewer/patches.u8", "viewer/stage.usdc",
        "report/map_F0.png", "report/map_F1.png", "report/overview.png", "report/coverage_curve.png",
        "report/links_F0.png", "report/links_F1.png",
        "report/picture_F0.png", "report/picture_F1.png", "report/unseen.csv", "report/index.html",
        *(f"stage/clouds/{name}.usdc" for name in names), *(f"viewer/clouds/{name}.cloud" for name in names),
        "viewer/layers.json", *(f"viewer/layers/{name}.u16" for name in ("range", "incidence", "spacing")),
        *(f"viewer/seen/{name}.bits" for name in names),
    }  # fmt: skip
    assert set(contents(plan_folder)) == expected


@pytest.mark.slow
@pytest.mark.usefixtures("thumbnails")
def test_plan_folder_written_twice_has_the_same_bytes(
    plan: Plan, engine: ScanEngine, plan_folder: Path, tmp_path: Path
) -> None:
    write_plan_folder(plan, tmp_path / "again", engine=engine)
    first, second = contents(plan_folder), contents(tmp_path / "again")
    assert [name for name in first if first[name] != second[name]] == []


def test_plan_folder_without_pictures_lacks_them_alone_and_progress_counts_its_files(
    plan: Plan, engine: ScanEngine, plan_folder: Path, tmp_path: Path
) -> None:
    events: list[ProgressEvent] = []
    write_plan_folder(plan, tmp_path / "plan", engine=engine, pictures=False, progress=events.append)
    whole, without = contents(plan_folder), contents(tmp_path / "plan")
    assert {event.stage for event in events} == {"export"}
    assert [event.done for event in events] == sorted(event.done for event in events)
    assert events[-1].done == events[-1].total == len(without)
    pictures = {name for name in whole if name.startswith("report/") and name.endswith(".png")}
    assert set(without) == set(whole) - pictures
    assert [name for name in without if without[name] != whole[name]] == ["report/index.html"]
    assert b"<img" in whole["report/index.html"]
    assert b"<img" not in without["report/index.html"]


def test_existing_folder_is_refused_with_the_remedy(plan: Plan, engine: ScanEngine, tmp_path: Path) -> None:
    folder = tmp_path / "plan"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    with pytest.raises(OutputExistsError, match="--overwrite"):
        write_plan_folder(plan, folder, engine=engine)
    with pytest.raises(OutputExistsError, match="no plan"):
        write_plan_folder(plan, folder, engine=engine, overwrite=True)
    assert contents(folder) == {"mine.txt": b"mine"}


def test_file_and_link_in_the_way_are_refused(plan_folder: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(plan_folder)
    for name in ("file", "link"):
        with pytest.raises(OutputExistsError):
            check_output(tmp_path / name, overwrite=True)


def test_plan_without_stations_and_floors_is_written_into_an_empty_folder(
    small: Plan, engine: ScanEngine, tmp_path: Path
) -> None:
    (tmp_path / "plan").mkdir()
    write_plan_folder(small, tmp_path / "plan", engine=engine)
    assert read_plan_json(tmp_path / "plan")["stations"] == []


@pytest.mark.parametrize("can_exchange", [True, False])
def test_overwriting_replaces_the_plan_and_leaves_nothing_beside(
    small: Plan, engine: ScanEngine, folder: Path, monkeypatch: pytest.MonkeyPatch, can_exchange: bool
) -> None:
    if not can_exchange:
        monkeypatch.setattr(atomic, "exchange", lambda one, other: False)
    changed = dataclasses.replace(small, settings=dataclasses.replace(small.settings, seed=7))
    write_plan_folder(changed, folder, engine=engine, overwrite=True)
    assert read_plan_json(folder)["seed"] == 7
    assert [path.name for path in folder.parent.iterdir()] == ["plan"]


def test_overwriting_reviewers_changes_is_refused(folder: Path) -> None:
    check_output(folder, overwrite=True)
    review = folder / "review.usda"
    review.write_text(review.read_text() + 'over "Plan" {}\n')
    with pytest.raises(OutputExistsError, match=r"review\.usda"):
        check_output(folder, overwrite=True)


def test_exception_while_writing_leaves_the_old_plan_and_nothing_beside(
    small: Plan, engine: ScanEngine, folder: Path
) -> None:
    before = contents(folder)

    def stop(event: ProgressEvent) -> None:
        if event.note == "plan.json":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_plan_folder(small, folder, engine=engine, overwrite=True, progress=stop)
    assert contents(folder) == before
    assert [path.name for path in folder.parent.iterdir()] == ["plan"]


def test_failed_second_rename_puts_the_old_plan_back(
    small: Plan, engine: ScanEngine, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = contents(folder)
    rename = Path.rename

    def failing(self: Path, target: Path) -> Path:
        if ".partial-" in self.name and not target.exists():
            raise OSError(28, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(atomic, "exchange", lambda one, other: False)
    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(PlanFolderError, match="No space left"):
        write_plan_folder(small, folder, engine=engine, overwrite=True)
    assert contents(folder) == before
    assert [path.name for path in folder.parent.iterdir()] == ["plan"]


KILLED = """
import os, signal, sys
from pathlib import Path
from planner_core.plan_folder import atomic

moment, folder = sys.argv[1], Path(sys.argv[2])
def die(*_, **__): os.kill(os.getpid(), signal.SIGKILL)
def dying_after(function):
    def call(*arguments, **options):
        function(*arguments, **options)
        die()
    return call

if moment == "after exchange":
    atomic._confirm = die
elif moment == "between renames":
    atomic.exchange = lambda one, other: False
    Path.rename = dying_after(Path.rename)
elif moment == "before exchange":
    atomic._install = die
with atomic.staged_folder(folder, replace=True) as staging:
    (staging / "plan.json").write_text("new")
    if moment == "while writing":
        die()
"""


@pytest.mark.parametrize(
    ("moment", "expected"),
    [("while writing", "old"), ("before exchange", "old"), ("after exchange", "new"), ("between renames", "old")],
)
def test_killed_run_leaves_the_old_folder_or_the_new_one(tmp_path: Path, moment: str, expected: str) -> None:
    folder = tmp_path / "plan"
    folder.mkdir()
    (folder / "plan.json").write_text("old")
    done = subprocess.run([sys.executable, "-c", KILLED, moment, str(folder)], check=False)
    assert done.returncode == -signal.SIGKILL
    atomic.recover(folder)
    assert (folder / "plan.json").read_text() == expected
    assert [path.name for path in tmp_path.iterdir()] == ["plan"]


def test_staging_folder_of_a_running_writer_is_left_alone(tmp_path: Path) -> None:
    with atomic.staged_folder(tmp_path / "plan", replace=False) as staging:
        (staging / "file").write_text("x")
        atomic.recover(tmp_path / "plan")
        assert (staging / "file").exists()
        (tmp_path / ".plan.lock-abcdefgh").touch()
        (tmp_path / ".plan.partial-abcdefgh").mkdir()
        atomic.recover(tmp_path / "plan")
        assert [path.name for path in tmp_path.iterdir() if path.name.endswith("-abcdefgh")] == []


def test_folder_that_appears_meanwhile_is_not_replaced(tmp_path: Path) -> None:
    def write() -> None:
        with atomic.staged_folder(tmp_path / "plan", replace=False) as staging:
            (staging / "file").write_text("mine")
            (tmp_path / "plan").mkdir()
            (tmp_path / "plan" / "file").write_text("theirs")

    with pytest.raises(OutputExistsError, match="appeared"):
        write()
    assert (tmp_path / "plan" / "file").read_text() == "theirs"


@pytest.mark.slow
def test_importing_the_writer_loads_no_graphics() -> None:
    look = "print([m for m in sys.modules if m.startswith(('vtk', 'pyvista'))])"
    code = f"import sys, planner_core.plan_folder.folder; {look}"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_station_of_odd_id_unknown_height_and_no_floor_is_written(
    plan: Plan, engine: ScanEngine, tmp_path: Path
) -> None:
    """What a crew's own list may hold: `evaluate` writes a folder of it too."""
    odd = dataclasses.replace(plan.stations[0], id="Punkt 1/a", floor="", instrument_height_m=float("nan"))
    write_plan_folder(
        dataclasses.replace(plan, stations=(odd,), links=()), tmp_path / "plan", engine=engine, pictures=False
    )
    (row,) = read_plan_json(tmp_path / "plan")["stations"]
    assert (row["id"], row["instrument_height_m"]) == ("Punkt 1/a", None)
    for name in ("plan.json", "stations.csv"):
        (station,) = read_station_list(tmp_path / "plan" / name)
        assert (station.id, station.instrument_height_m, station.floor) == ("Punkt 1/a", None, None)
        np.testing.assert_allclose(station.position_m, plan.survey.scene.offset_m + odd.position_m)
    assert (tmp_path / "plan" / "viewer" / "clouds" / "Punkt_1_a_0.cloud").is_file()


@pytest.mark.usefixtures("thumbnails")
def test_floors_that_are_not_planned_have_neither_maps_nor_figures(
    plan: Plan, engine: ScanEngine, tmp_path: Path
) -> None:
    survey = dataclasses.replace(plan.survey, planned=(0,))
    required = dataclasses.replace(plan.settings.requirements, floors=("F0",))
    plan = dataclasses.replace(plan, settings=dataclasses.replace(plan.settings, requirements=required))
    below = dataclasses.replace(plan, survey=survey, stations=plan.stations[:2])
    made = list(write_report(below, tmp_path / "below", engine=engine))
    assert made == list(report_files(below))
    assert [name for name in made if "F1" in name] == []
    page = (tmp_path / "below" / "index.html").read_text(encoding="utf-8")
    assert "F1.png" not in page and ">not planned<" in page
    # A station that was given on another floor has its map, without a share of what nobody asked for.
    given = dataclasses.replace(plan, survey=survey)
    assert {"map_F1.png", "links_F1.png", "picture_F1.png"} <= set(report_files(given))
    assert floor_figures(source_of(given), "F1") == (("1", "station"), ("not planned", "this floor"))
    assert '>1</td><td class="n" data-name="Seen, %">not planned<' in report_page(given)
