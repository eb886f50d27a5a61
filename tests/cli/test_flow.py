"""The commands on a real file, as a user runs them, and what goes wrong with bad ones."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import small_pictures
from tlsplan.commands import plan as plan_command

import scenes_synthetic

DROPPABLE = ("timings_s", "versions", "device")
COARSE = ("--grid", "1.0", "--height", "1.5", "--patch-area", "0.2", "--coverage", "80")
#: Of the plans themselves little is asked here.
QUICK = (*COARSE, "--set", "work_limit=0.1", "--no-refine")
#: Nor of the proof.
GREEDY = (*COARSE, "--method", "greedy")

Tlsplan = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def room(tlsplan: Tlsplan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "box.ifc"
    done = tlsplan("scene", "box", "-o", path)
    assert done.returncode == 0, done.stderr
    return path


@pytest.fixture(scope="module")
def planned(tlsplan: Tlsplan, room: Path) -> tuple[Path, dict[str, Any]]:
    folder = room.parent / "plan"
    done = tlsplan("plan", room, "-o", folder, "--json", *QUICK)
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def without_droppable(document: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in document.items() if key not in DROPPABLE}


def snapshot(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_plan_json_on_stdout_is_the_file_in_the_folder(planned: tuple[Path, dict[str, Any]]) -> None:
    folder, document = planned
    on_disk = json.loads((folder / "plan.json").read_text())
    assert without_droppable(on_disk) == without_droppable(document)


def test_evaluate_of_the_plan_itself_gives_the_same_coverage(
    tlsplan: Tlsplan, room: Path, planned: tuple[Path, dict[str, Any]]
) -> None:
    folder, document = planned
    for stations in (folder / "plan.json", folder / "stations.csv"):
        done = tlsplan("evaluate", room, "--stations", stations, "--json", *COARSE)
        assert done.returncode == 0, done.stderr
        again = json.loads(done.stdout)
        now, then = again["coverage"], document["coverage"]
        # Stations off the grid see what no candidate does: achievable once they are given, and covered by them.
        more_m2 = now["achievable_area_m2"] - then["achievable_area_m2"]
        assert -0.01 <= more_m2 <= 0.01 * then["achievable_area_m2"]
        assert now["covered_area_m2"] == pytest.approx(then["covered_area_m2"] + more_m2, abs=0.01)
        assert not any("no valid tripod position" in line or "instrument height" in line for line in again["warnings"])
        assert set(document) == set(again)


@pytest.mark.slow
def test_same_input_gives_the_same_bytes_in_a_process_of_its_own_with_one_core(
    room: Path, planned: tuple[Path, dict[str, Any]]
) -> None:
    folder, _ = planned
    again = folder.with_name("plan-one-core")
    done = subprocess.run(
        [
            sys.executable, small_pictures.__file__, "--none", "tlsplan", "plan", str(room), "-o", str(again),
            "--quiet", *QUICK,
        ],
        env={**os.environ, "POCL_MAX_PTHREAD_COUNT": "1", "OMP_NUM_THREADS": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    first, second = snapshot(folder), snapshot(again)
    assert set(first) == set(second)

    assert without_droppable(json.loads(first["plan.json"])) == without_droppable(json.loads(second["plan.json"]))
    assert [name for name in first if name != "plan.json" and first[name] != second[name]] == []


def test_plan_refuses_to_overwrite_and_says_how(
    tlsplan: Tlsplan, room: Path, planned: tuple[Path, dict[str, Any]]
) -> None:
    folder, _ = planned
    before = snapshot(folder)
    done = tlsplan("plan", room, "-o", folder, *QUICK)
    assert done.returncode == 5
    assert "--overwrite" in done.stderr
    assert done.stderr.count("\n") == 1
    assert snapshot(folder) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stage", "grid_m"),
    [("load", "1.0"), ("scan", "0.4"), ("export", "1.0")],
)
def test_interrupted_plan_leaves_nothing_half_written(
    stage: str, grid_m: str, tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    house = scenes_synthetic.write(scenes_synthetic.build("house"), tmp_path_factory.mktemp("scene") / "house.ifc")
    process = subprocess.Popen(
        [
            sys.executable, "-m", "tlsplan", "plan", str(house), "-o", str(tmp_path / "plan"), "--grid", grid_m,
            "--height", "1.5", "--patch-area", "0.2", "--method", "greedy",
        ],
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith(stage):
            break
    else:
        pytest.fail(f"no progress of {stage} was shown")
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=240)
    assert process.returncode == 130
    assert "interrupted" in rest
    assert "Traceback" not in rest
    assert list(tmp_path.iterdir()) == []


def test_unknown_floor_ends_with_the_floors_there_are(tlsplan: Tlsplan, room: Path, tmp_path: Path) -> None:
    done = tlsplan("plan", room, "-o", tmp_path / "plan", "--floor", "Attic", *QUICK)
    assert done.returncode == 4
    last = done.stderr.splitlines()[-1]
    assert "Attic" in last
    assert "F0" in last
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("empty.obj", b"", "empty"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "--skip-bad-faces"),
        ("picture.ifc", b"\x89PNG\r\n\x1a\n" + bytes(64), "picture.ifc"),
        ("plan.dwg", b"AC1027", "save it as DXF"),
    ],
)
def test_bad_scene_ends_with_one_line(tlsplan: Tlsplan, name: str, content: bytes, word: str, tmp_path: Path) -> None:
    scene = tmp_path / name
    scene.write_bytes(content)
    done = tlsplan("plan", scene, "-o", tmp_path / "plan", "--quiet")
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1, done.stderr
    assert name in done.stderr
    assert word in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == [name]


def test_bad_station_list_ends_with_the_line_number(tlsplan: Tlsplan, room: Path, tmp_path: Path) -> None:
    stations = tmp_path / "mine.csv"
    stations.write_text("id,x_m,y_m,z_m\nA,1,2,3\nB,1,two,3\n")
    done = tlsplan("evaluate", room, "--stations", stations, *COARSE)
    assert done.returncode == 3
    assert "mine.csv" in done.stderr
    assert "line 3" in done.stderr
    assert "Traceback" not in done.stderr


def test_simulate_writes_a_range_image_and_a_cloud_a_station(
    tlsplan: Tlsplan, room: Path, planned: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    stations = tmp_path / "one.csv"
    rows = (planned[0] / "stations.csv").read_text().splitlines()[:2]
    stations.write_text("\n".join(rows) + "\n")
    few_beams = ("--scanner", "hdl-64e")
    done = tlsplan("simulate", room, "--stations", stations, "-o", tmp_path / "scans", "--json", *few_beams)
    assert done.returncode == 0, done.stderr
    written = sorted(path.name for path in (tmp_path / "scans").iterdir())
    assert written == ["S001.exr", "S001.ply", "S001.png"]
    report = json.loads(done.stdout)
    assert report["scans"][0]["n_returns"] > 100_000
    refused = tlsplan("simulate", room, "--stations", stations, "-o", tmp_path / "scans")
    assert refused.returncode == 5
    few = (*few_beams, "--format", "png")
    fewer = tlsplan("simulate", room, "--stations", stations, "-o", tmp_path / "scans", "--overwrite", *few)
    assert fewer.returncode == 0, fewer.stderr
    assert [path.name for path in (tmp_path / "scans").iterdir()] == ["S001.png"]


def test_simulate_keeps_its_hands_off_a_folder_with_other_files(tlsplan: Tlsplan, room: Path, tmp_path: Path) -> None:
    stations = tmp_path / "mine.csv"
    stations.write_text("id,x_m,y_m,z_m\nA,1,1,1.5\n")
    done = tlsplan("simulate", room, "--stations", stations, "-o", tmp_path, "--overwrite")
    assert done.returncode == 5
    assert "mine.csv" in done.stderr
    assert list(tmp_path.iterdir()) == [stations]


def test_an_obj_in_millimetres_is_refused_with_the_unit_to_pass(tlsplan: Tlsplan, tmp_path: Path) -> None:
    scene = tmp_path / "mm.obj"
    done = tlsplan("scene", "box", "-o", scene)
    assert done.returncode == 0, done.stderr
    lines = scene.read_text().splitlines()
    big = [
        " ".join(["v", *(str(1000 * float(x)) for x in line.split()[1:])]) if line[:2] == "v " else line
        for line in lines
    ]
    scene.write_text("\n".join(big) + "\n")
    wrong = tlsplan("plan", scene, "-o", tmp_path / "plan", *GREEDY)
    assert wrong.returncode == 3
    said = wrong.stderr.splitlines()
    assert said[-1].startswith("tlsplan: mm.obj: read in metres it measures 6400 x 4400 x 3100 m, ")
    assert "--units mm" in said[-1]
    assert not any(line.startswith("survey:") and "floors" not in line for line in said)
    assert not (tmp_path / "plan").exists()
    right = tlsplan("plan", scene, "-o", tmp_path / "plan", "--units", "mm", "--json", *GREEDY)
    assert right.returncode == 0, right.stderr
    assert json.loads(right.stdout)["scene"]["metres_per_unit"] == 0.001


@pytest.mark.opencl
@pytest.mark.parametrize("name", ["nonsense", "99"])
def test_a_device_that_is_not_there_is_an_error_however_it_was_asked_for(
    tlsplan: Tlsplan, name: str, room: Path, tmp_path: Path
) -> None:
    by_option = tlsplan("plan", room, "-o", tmp_path / "plan", "--device", name, *GREEDY)
    by_variable = tlsplan("plan", room, "-o", tmp_path / "plan", *GREEDY, env={"TLSPLAN_DEVICE": name})
    assert (by_option.returncode, by_variable.returncode) == (6, 6)
    assert name in by_variable.stderr.splitlines()[-1]


def test_view_of_a_broken_plan_says_so(tlsplan: Tlsplan, planned: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_bytes((planned[0] / "plan.json").read_bytes()[:500])
    done = tlsplan("view", tmp_path, "--no-browser")
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("is_there", [False, True])
def test_view_of_another_building_says_so_before_it_serves(
    tlsplan: Tlsplan, is_there: bool, planned: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    scene = tmp_path / "other.ifc"
    if is_there:
        scene.write_text("another building")
    done = tlsplan("view", planned[0], "--scene", scene, "--no-browser")
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1 and "other.ifc" in done.stderr


def test_view_of_a_folder_that_is_no_plan_says_so(tlsplan: Tlsplan, tmp_path: Path) -> None:
    done = tlsplan("view", tmp_path, "--no-browser")
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert "plan.json" in done.stderr


def test_demo_keeps_a_file_of_the_name_its_building_would_get(tlsplan: Tlsplan, tmp_path: Path) -> None:
    mine = tmp_path / "house.ifc"
    mine.write_text("my own building")
    done = tlsplan("demo", "-o", tmp_path / "house", *COARSE)
    assert done.returncode == 5
    assert "--overwrite" in done.stderr
    assert mine.read_text() == "my own building"
    assert list(tmp_path.iterdir()) == [mine]


@pytest.mark.slow
def test_demo_goes_on_where_an_interrupted_one_left_its_building(
    tlsplan: Tlsplan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned: list[Path] = []
    monkeypatch.setattr(plan_command, "run", lambda scene, folder, **_: planned.append(scene))
    left = scenes_synthetic.write(scenes_synthetic.build("house"), tmp_path / "house.ifc")
    done = tlsplan("demo", "-o", tmp_path / "house")
    assert done.returncode == 0, done.stderr
    assert planned == [[left]]


def test_a_height_in_millimetres_is_refused_in_one_line(tlsplan: Tlsplan, room: Path, tmp_path: Path) -> None:
    done = tlsplan("plan", room, "-o", tmp_path / "plan", "--height", "1600")
    assert done.returncode == 4
    assert "1600" in done.stderr.splitlines()[-1]
