"""A crew's day on one building, from the model to the last scan: every command, with its default settings.

Each step checks what the crew would. `make test` has the demo house, `make test-slow` a real building. The first plan
is made as `tlsplan demo` makes it; later ones are quick, and find what is kept. Pictures of reports are blank.
"""

from __future__ import annotations

import csv
import json
import re
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import pytest
import small_pictures
from in_process import run_here
from real_buildings import FOLDER
from shared_plans import KEPT_IN_A_DAY
from tlsplan import start_time
from tlsplan.batch import runner
from tlsplan.group import cli
from waiting import PATIENCE_S, until

from planner_core.export.formats import FORMATS
from planner_core.plan_folder.stations_csv import COLUMNS
from tests.reality_files import reality

TLSPLIB = Path(__file__).resolve().parents[1] / "docs" / "tlsplib"
#: Of what is computed after the first plan.
QUICK = ("--effort", "quick")
ON_EARTH = ("--crs", "EPSG:25832", "--origin", "458870,5438260,110")
DEMO, REAL = "demo house", "fzk-haus"
pytestmark = pytest.mark.xdist_group("crew's day")  # one worker walks it, once


@dataclass
class Day:
    """A building, its plan, and what was used: commands (`plan`, `tlsplib check`) and formats.

    scene, plan : paths in the folder, which is the current one while the day goes on.
    """

    scene: Path
    plan: Path
    folder: Path = field(default_factory=Path.cwd)
    commands: set[str] = field(default_factory=set)
    formats: set[str] = field(default_factory=set)

    def tlsplan(self, *words: str | Path, code: int = 0) -> subprocess.CompletedProcess[str]:
        """Run a command in this process, which ends with `code`, and no bug."""
        done = run_here(*words)
        self.commands.add(named(*words))
        assert done.returncode == code, f"{words}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
        assert not re.search("Traceback|internal error", done.stdout + done.stderr), done.stderr
        return done

    def document(self) -> dict[str, Any]:
        """Return the plan's plan.json."""
        return read_json(self.plan / "plan.json")

    def rows(self) -> list[str]:
        """Return the lines of the plan's stations.csv, without its header."""
        return (self.plan / "stations.csv").read_text().splitlines()[1:]


def named(*words: str | Path) -> str:
    """Return the command that words of a command line begin with."""
    command, path = cli.get_command(click.Context(cli), str(words[0])), str(words[0])
    return f"{path} {words[1]}" if isinstance(command, click.Group) else path


def all_commands() -> Iterator[str]:
    """Yield what `tlsplan --help` lists, and what the help of its groups does."""
    for name in cli.list_commands(click.Context(cli)):
        command = cli.get_command(click.Context(cli), name)
        yield from (f"{name} {sub}" for sub in command.commands) if isinstance(command, click.Group) else (name,)


def read_json(file: Path) -> Any:
    return json.loads(file.read_text(encoding="utf-8"))


def write_list(file: Path, rows: list[str]) -> Path:
    """Write a station list with the header of stations.csv."""
    file.write_text("\n".join([",".join(COLUMNS), *rows, ""]))
    return file


# ------------------------------------------------------------------------------------------------- the day
@pytest.fixture(scope="session", params=[DEMO, pytest.param(REAL, marks=pytest.mark.slow)])
def day(request: pytest.FixtureRequest, needs_opencl: None, tmp_path_factory: pytest.TempPathFactory) -> Day:
    """The day on a building, from the first command to the last, in a folder of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("day"))
        patch.setenv("TLSPLAN_CACHE_SIZE", KEPT_IN_A_DAY)
        if request.param == DEMO:
            today = start_on_demo_house(patch, request.getfixturevalue("demo_folder"))
        else:
            today = start_on_real_building(request.param)
        list_floors(today)
        refuse_folders_that_take_no_files(today)
        look_at_the_plan_and_take_in_the_field_file(today)
        export_every_format(today)
        compare_scans_with_the_plan(today)
        simulate_a_scan(today)
        plan_again_for_new_requirements_and_a_locked_room(today)
        return today


def test_the_day_ends_with_a_plan_of_what_to_scan_again(day: Day, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(day.folder)
    again = read_json(Path("scan-again", "plan.json"))
    scanned = {each["id"] for each in again["stations"] if each["fixed"]}
    assert scanned == {each["id"] for each in day.document()["stations"]} - {missing_of(day)}
    assert {each["id"] for each in again["stations"]} > scanned
    assert [each["name"] for each in again["requirements"]["results"] if not each["met"]] == []


def test_every_format_has_its_place_in_the_day(day: Day) -> None:
    assert day.formats == {*FORMATS, "web"}


@pytest.mark.parametrize("day", [DEMO], indirect=True)
def test_every_command_has_its_place_in_the_day(day: Day) -> None:
    assert day.commands == set(all_commands())


# --------------------------------------------------------------------------------------------- in the office
def start_on_demo_house(patch: pytest.MonkeyPatch, demo: Path) -> Day:
    """Set up a machine, look at what comes with tlsplan, and plan the demo house, as the run in `demo` did."""
    today = Day(Path("demo.ifc"), Path("demo"))
    patch.setattr(start_time, "first_use_s", lambda: 12.3)  # compiling all kernels takes that long
    assert "the test scan of a box is correct" in today.tlsplan("doctor").stdout
    with pytest.MonkeyPatch.context() as own:
        own.setenv("TLSPLAN_CACHE", str(today.folder / "cache"))  # other tests go by the shape that is shipped
        assert "default from now on: " in today.tlsplan("tune", "--quick").stdout
    assert re.search(r"^rtc360 .*Leica RTC360", today.tlsplan("scanners").stdout, re.MULTILINE)
    assert re.search(r"^house\b", today.tlsplan("scene").stdout, re.MULTILINE)
    today.tlsplan("reproduce", "fig06")
    assert Path("reproduction", "fig06.md").is_file()
    prove_an_instance(today)
    plan_several_buildings(today)
    shutil.copytree(demo, ".", dirs_exist_ok=True)
    check_summary(Path("printed.txt").read_text(), today.plan)
    today.commands.add("demo")
    return today


def start_on_real_building(name: str) -> Day:
    if not (FOLDER / f"{name}.ifc").is_file():
        pytest.skip(f"{name}.ifc is not beside the repository (../shared/data/ifc)")
    today = Day(Path(f"{name}.ifc"), Path("plan"))
    shutil.copy(FOLDER / today.scene, today.scene)
    check_summary(today.tlsplan("plan", today.scene, "-o", today.plan, "--set", "work_limit=10").stdout, today.plan)
    plan_a_cellar(today)
    return today


def plan_a_cellar(day: Day) -> None:
    """Plan a cellar of 1.9 m: the tripod is lowered there, and the plan has the height of each station."""
    cellar = reality("low_cellar.ifc")
    told = day.tlsplan("plan", cellar, "--floor", "Keller", "-o", "cellar", *QUICK).stderr
    assert "too little headroom in 'cellar' for the usual instrument height of 1.70 m, so the tripod is lowered" in told
    stations = read_json(Path("cellar", "plan.json"))["stations"]
    assert stations
    assert all(1.4 <= each["instrument_height_m"] < 1.7 for each in stations)


def prove_an_instance(day: Day) -> None:
    """Solve, check and rank a problem of the library, in a copy of it."""
    shutil.copytree(TLSPLIB, "library", ignore=shutil.ignore_patterns("tlsplib"))
    of = ("--library", "library")
    assert "1 written" in day.tlsplan("tlsplib", "generate", "hall-06", *of, "-o", "instances").stdout
    day.tlsplan("tlsplib", "solve", "hall-06", *of, "--solver", "greedy", "--again")
    assert "1 " in day.tlsplan("tlsplib", "check", "hall-06", *of).stdout
    assert "greedy" in day.tlsplan("tlsplib", "rank", *of).stdout


def plan_several_buildings(day: Day) -> None:
    """Plan two buildings, one of which is not there; in a process of its own, which draws no pictures."""
    day.tlsplan("scene", "box", "-o", "box.ifc")
    Path("sites.yaml").write_text("sites: [{scene: box.ifc, effort: quick, grid: 1}, {scene: absent.ifc}]\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "_PROGRAM", (sys.executable, small_pictures.__file__, "--none", "tlsplan.batch.child"))
        done = day.tlsplan("batch", "sites.yaml", "-o", "portfolio", code=8)
    assert re.search(r"^warning: absent: failed: .*absent\.ifc: there is no such file", done.stderr, re.MULTILINE)
    assert f"summary       {Path('portfolio', 'index.html')}" in done.stdout
    with Path("portfolio", "summary.csv").open(newline="") as file:
        box, absent = csv.DictReader(file)
    assert (box["state"], absent["state"]) == ("planned", "failed")
    assert int(box["stations"]) == len(read_json(Path("portfolio", "plans", "box", "plan.json"))["stations"])


def check_summary(summary: str, folder: Path) -> dict[str, Any]:
    """Check that summary, plan.json and stations.csv agree; returns plan.json's document."""
    plan: dict[str, Any] = read_json(folder / "plan.json")
    with (folder / "stations.csv").open(newline="") as file:
        listed = list(csv.DictReader(file))
    assert [row["id"] for row in listed] == [each["id"] for each in plan["stations"]]
    for row, station in zip(listed, plan["stations"], strict=True):
        assert [float(row[axis]) for axis in ("x_m", "y_m", "z_m")] == pytest.approx(station["position"], abs=1e-4)
    assert re.search(rf"^stations +{len(listed)}\b", summary, re.MULTILINE), summary
    area_m2, planned = plan["coverage"]["achievable_area_m2"], {row["floor"] for row in listed}
    percent = re.search(rf"^coverage +([0-9.]+) % of the {area_m2:.0f} m2 scannable", summary, re.MULTILINE)
    assert percent and float(percent[1]) == pytest.approx(100 * plan["coverage"]["fraction_of_achievable"], abs=0.1)
    for floor in planned:
        n_there = sum(row["floor"] == floor for row in listed)
        assert re.search(rf"^  {floor} +.* {n_there} stations ", summary, re.MULTILINE), summary
    missed = [each["name"] for each in plan["requirements"]["results"] if not each["met"]]
    assert re.findall(r"^NOT MET +(.+): [0-9.]+ %, ", summary, re.MULTILINE) == missed
    n_groups = len(plan["registration"]["networks"])
    assert ("all stations are connected" if n_groups == 1 else f"{n_groups} unconnected groups") in summary
    return plan


def refuse_folders_that_take_no_files(day: Day) -> None:
    """Before the model is read: a file in the way, and a name that is too long once it is staged."""
    for folder in (day.scene / "plan", Path("x" * 245)):
        for words in (
            ("plan", day.scene, "-o", folder),
            ("evaluate", day.scene, "--stations", day.plan, "-o", folder),
            ("simulate", day.scene, "--stations", day.plan, "-o", folder),
            ("compare", day.plan, "--stations", day.plan, "-o", folder),
        ):
            said = day.tlsplan(*words, code=3).stderr
            assert said.count("\n") == 1 and "can't be written" in said


def list_floors(day: Day) -> None:
    rows = day.tlsplan("floors", day.scene).stdout.splitlines()[1:]
    floors = day.document()["floors"]
    assert [row.split()[0] for row in rows[: len(floors)]] == [floor["id"] for floor in floors]
    assert all(f" {floor['ground_area_m2']:.1f} " in row for floor, row in zip(floors, rows, strict=False))


def look_at_the_plan_and_take_in_the_field_file(day: Day) -> None:
    """Serve the plan, and take in what the crew's phone has: the first station stands 10 cm from its mark."""
    day.tlsplan("export", day.plan, "--format", "field", "-o", "field.html")
    data = re.search(r'<script id="plan" type="application/json">(.*?)</script>', Path("field.html").read_text(), re.S)
    assert data is not None
    of_crew = json.loads(data[1])
    first = of_crew["stations"][0]
    x, y, z = first["position"]
    process = subprocess.Popen(
        [sys.executable, "-m", "tlsplan", "view", str(day.plan), "--no-browser"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    day.commands.add("view")
    try:
        assert process.stdout is not None
        address = re.search(r" is shown at (http://127\.0\.0\.1:\d+/)\?token=(\S+)", process.stdout.readline())
        assert address
        ask = Client(address[1], address[2])
        assert b"<title>" in ask("")
        assert json.loads(ask("plan/plan.json"))["stations"] == day.document()["stations"]
        for stranger, path in ((Client(address[1], ""), "plan/plan.json"), (ask, "plan/../../etc/passwd")):
            with pytest.raises(urllib.error.HTTPError, match=r"40\d"):
                stranger(path)
        assert until(lambda: live_state(ask)) == "ready"
        moved = {"kind": "move_station", "station": first["id"], "position_m": [x + 0.1, y, z]}
        said = {"kind": "add_comment", "target": first["id"], "text": "Moved on site."}
        result = {"base_revision": of_crew["revision"], "plan_sha256": of_crew["plan_sha256"], "author": "Crew",
                  "changes": [moved, said]}  # fmt: skip
        assert json.loads(ask("api/review/changes", result))["revision"] == of_crew["revision"] + 1
        with pytest.raises(urllib.error.HTTPError, match="409"):
            ask("api/review/changes", result)
    finally:
        process.send_signal(signal.SIGINT)
        rest, said_last = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert rest.endswith("stopped\n") and "Traceback" not in said_last
    day.tlsplan("export", day.plan, "--format", "field", "-o", "field.html", "--overwrite")
    assert f'"revision": {of_crew["revision"] + 1}' in Path("field.html").read_text().replace('":', '": ')


@dataclass(frozen=True)
class Client:
    """A browser, as far as the day needs one. token : of the address that `tlsplan view` prints."""

    address: str
    token: str

    def __call__(self, path: str, document: dict[str, Any] | None = None) -> bytes:
        """GET a path, or POST a document to it."""
        headers = {
            "x-tlsplan-token": self.token,
            "content-type": "application/json",
            "origin": self.address.rstrip("/"),
        }
        data = None if document is None else json.dumps(document).encode()
        with urllib.request.urlopen(
            urllib.request.Request(self.address + path, data, headers), timeout=PATIENCE_S
        ) as answer:
            return bytes(answer.read())


def live_state(ask: Client) -> str:
    """Return how far live figures are, empty while they start."""
    state = str(json.loads(ask("api/session"))["live"]["state"])
    return "" if state == "starting" else state


def formats_in(pack: str) -> set[str]:
    """Return the formats that a pack says it holds, each of which is there and not empty."""
    files = read_json(Path(pack, "pack.json"))["formats"]
    for file in (Path(pack, name) for name in files.values()):
        assert file.stat().st_size > 0 if file.is_file() else any(file.iterdir()), file
    return set(files)


def export_every_format(day: Day) -> None:
    """Export a list that its format can't hold, the pack, then the other formats: of clouds few points, of issues few.

    Formats in longitude and latitude are refused until they know where on earth the building is.
    """
    day.tlsplan("export", day.plan, "--format", "all", "-o", "pack")
    too_long = day.tlsplan("export", day.plan, "--format", "gsi8,csv", "-o", "lists", *ON_EARTH, code=8)
    assert "not written: gsi8: " in too_long.stderr and formats_in("lists") == {"csv"}
    rest = [name for name in FORMATS if name not in {*formats_in("pack"), "geojson", "kml"}]
    few = ("--max-points", "1000", "--max-topics", "5")
    day.tlsplan("export", day.plan, "--format", ",".join(rest), "-o", "rest", *few)
    words = ("export", day.plan, "--format", "geojson,kml", "-o", "on-earth")
    assert "give --crs and --origin" in day.tlsplan(*words, code=3).stderr
    day.tlsplan(*words, *ON_EARTH)
    day.tlsplan("export", day.plan, "--format", "web", "-o", "web")
    day.formats |= {*formats_in("pack"), *formats_in("rest"), *formats_in("on-earth"), "web"}
    ids = {each["id"] for each in day.document()["stations"]}
    assert {row.split(",")[0] for row in Path("pack", "stations.csv").read_text().splitlines()} >= ids
    assert set(re.findall(r'name="(S\d+)"', Path("pack", "stations.xml").read_text())) == ids
    assert {path.stem for path in Path("rest", "ply").iterdir()} >= ids
    assert json.loads(Path("web", "plan", "plan.json").read_text())["stations"] == day.document()["stations"]


# -------------------------------------------------------------------------------------------------- on site
def missing_of(day: Day) -> str:
    """Id of the station that the crew forgets: the one that the plan needs most."""
    return str(max(day.document()["stations"], key=lambda each: float(each["own_area_m2"]))["id"])


def compare_scans_with_the_plan(day: Day) -> None:
    """Compare a CSV and an E57 in which one station is missing, one moved by 30 cm, and one stands about its mark."""
    rows = [row.split(",") for row in day.rows() if row.split(",")[0] != missing_of(day)]
    rows[0][3] = f"{float(rows[0][3]) + 0.3:.4f}"
    rows[1][4] = f"{float(rows[1][4]) + 0.08:.4f}"
    actual = write_list(Path("actual.csv"), [",".join(row) for row in rows])
    words = day.tlsplan("compare", day.plan, "--stations", actual, "-o", "scan-again", code=7).stdout
    within = f"within 10 cm of their planned positions\n  at most 0.08 m off: {rows[1][0]}"
    assert f"\nas planned    {len(rows) - 1}, {within}\nmoved         1\n  {rows[0][0]} " in words
    assert ", by 0.30 m in plan, +0.00 m in height" in words
    assert f"\nmissing       1\n  {missing_of(day)} " in words
    listed = [line for line in words.partition("SCAN AGAIN")[2].splitlines()[1:] if line.startswith("  ")]
    further = [each["id"] for each in read_json(Path("scan-again", "plan.json"))["stations"] if not each["fixed"]]
    assert [line.split()[0] for line in listed[0::2]] == further
    assert all(" adds " in line and " m2 on floor F" in line for line in listed[1::2])

    evaluated = check_summary(day.tlsplan("evaluate", day.scene, "--stations", actual, "-o", "scanned").stdout,
                              Path("scanned"))  # fmt: skip
    day.tlsplan("export", "scanned", "--format", "e57", "-o", "scans.e57", "--max-points", "1000")
    poses = day.tlsplan("compare", day.plan, "--stations", "scans.e57", "--no-scan-again", "--json", code=7)
    found = json.loads(poses.stdout)
    assert found["scan_again"] is None
    counts = {"as planned": len(rows) - 1, "moved": 1, "missing": 1, "additional": 0}
    assert {fate: found["counts"][fate] for fate in counts} == counts
    for result in found["requirements"]:
        assert re.search(rf" {re.escape(result['name'])} .* {100 * result['actual']:.1f} % as scanned", words), words
    covered_m2 = evaluated["coverage"]["covered_area_m2"]
    assert found["coverage"]["actual_area_m2"] == pytest.approx(covered_m2, rel=0.005)


def simulate_a_scan(day: Day) -> None:
    one = write_list(Path("one.csv"), day.rows()[:1])
    done = day.tlsplan("simulate", day.scene, "--stations", one, "-o", "scans", "--scanner", "rtc360:40mm")
    station, n_beams, n_returns = done.stdout.splitlines()[1].split()[:3]
    assert 0.5 * int(n_beams) < int(n_returns) <= int(n_beams)
    assert {path.name for path in Path("scans").iterdir()} == {f"{station}.{kind}" for kind in ("exr", "png", "ply")}


# --------------------------------------------------------------------------------------------- the next morning
def plan_again_for_new_requirements_and_a_locked_room(day: Day) -> None:
    """Plan again, into the folder named after the file: half of the stations are scanned, the room of the last one is
    locked, and the client wants more of walls, and less of the lowest floor, which is named by its id."""
    stations = day.document()["stations"]
    first, last = stations[0], stations[-1]
    x, y, z = first["position"]
    middle_x, middle_y, _ = last["position"]
    outline = [(middle_x + dx, middle_y + dy) for dx, dy in ((-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (-0.6, 0.6))]
    room = {"name": "locked room", "floor": last["floor"], "outline": outline}
    entrance = [x, y, z - first["instrument_height_m"]]
    contract = {
        "coverage": "90 %",
        "incidence": "70 deg",
        "classes": {"IfcWall*": {"coverage": "97 %"}},
        "floors": {"F0": "85 %"},
        "site": {"entrances": [entrance], "returns": True, "keep_out": [room]},
    }
    Path("contract.yaml").write_text(json.dumps(contract))  # which is YAML, too
    done = day.rows()[: len(stations) // 2]
    told = day.tlsplan(
        "plan", day.scene, "--requirements", "contract.yaml", "--scanned", write_list(Path("done.csv"), done),
        "--keep", day.plan, *QUICK, "--set", "work_limit=0.5",
    )  # fmt: skip
    assert f"station {last['id']} of the earlier plan is dropped" in told.stderr
    plan = check_summary(told.stdout, Path(f"{day.scene.stem}-plan"))
    asked = {each["name"]: each["required"] for each in plan["requirements"]["results"]}
    assert (asked["F0"], asked["IfcWall*"], asked["overall"]) == (0.85, 0.97, 0.9)
    assert plan["route"]["returns"]
    fixed = {each["id"]: each["position"] for each in plan["stations"] if each["fixed"]}
    assert fixed == {each["id"]: pytest.approx(each["position"], abs=1e-3) for each in stations[: len(done)]}
    with Path(f"{day.scene.stem}-plan", "stations.csv").open(newline="") as file:
        assert {row["id"] for row in csv.DictReader(file) if row["status"] == "scanned"} == set(fixed)
    others = [each["position"] for each in plan["stations"] if not each["fixed"] and each["floor"] == last["floor"]]
    assert [at for at in others if abs(at[0] - middle_x) < 0.6 and abs(at[1] - middle_y) < 0.6] == []
