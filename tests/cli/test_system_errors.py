"""What the command line makes of a system that refuses: full disks, missing permission, being asked to end."""

import errno
import importlib
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from tlsplan.exit_codes import exit_code_of, line_of
from tlsplan.group import cli
from tlsplan.output import materials

import scenes_synthetic
from planner_core.errors import ExportError, PlanFolderError
from planner_core.operating_system import not_written


@pytest.mark.parametrize(
    ("number", "part"),
    [
        (errno.ENOSPC, "the disk is full; free some or give another path"),
        (errno.EACCES, "permission is denied; give another path"),
        (errno.EROFS, "the disk is read-only"),
        (errno.ENOENT, "there is no such file or folder"),
        (errno.ENOTDIR, "part of the path is a file"),
    ],
)
def test_errors_of_the_system_are_told_in_words_of_the_users_path(number: int, part: str) -> None:
    line = line_of(OSError(number, os.strerror(number), "/data/out/.plan.partial-1f/.usd-2"))
    assert line.startswith("tlsplan: /data/out: ")
    assert part in line
    assert "Errno" not in line
    assert exit_code_of(OSError(number, "")) == (9 if number == errno.ENOSPC else 3)


def test_a_full_disk_is_known_by_its_number_whatever_the_language_and_whoever_tells_of_it() -> None:
    """Also what went through another process, as errors of workers do."""
    number = OSError(errno.EDQUOT, "Der zugewiesene Plattenplatz ist überschritten", "plan")
    assert exit_code_of(pickle.loads(pickle.dumps(number))) == 9
    told = PlanFolderError("plan: kann nicht geschrieben werden")
    assert exit_code_of(told) == 3
    told.__cause__ = ExportError("wolken")
    told.__cause__.__cause__ = number
    assert exit_code_of(told) == 9
    assert exit_code_of(OSError(os.strerror(errno.ENOSPC))) == 3, "words alone say nothing"


def test_what_a_library_could_not_write_to_a_full_disk_is_told_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert exit_code_of(not_written(tmp_path / "a.exr", "unknown error")) == 3

    class Full:
        free = 100

    monkeypatch.setattr(shutil, "disk_usage", lambda path: Full)
    assert exit_code_of(not_written(tmp_path / "a.exr", "unknown error")) == 9


def test_an_error_of_the_system_without_a_path_still_says_what_to_do() -> None:
    line = line_of(OSError(errno.ENOSPC, "x"))
    assert line == "tlsplan: a file can't be read or written: the disk is full; free some or give another path"


@pytest.mark.parametrize("suffix", [".ifc", ".usdc", ".ply"])
def test_a_writer_that_fails_leaves_nothing_and_tells_of_a_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    writer = importlib.import_module("scenes_synthetic.write")

    def fails(synthetic: object, path: Path, suffix: str) -> None:
        path.write_bytes(b"half")
        path.with_name(f"{path.name}.123.tmp").write_bytes(b"of a library")
        raise RuntimeError("An unknown error occurred")

    class Full:
        free = 100

    monkeypatch.setattr(writer, "_fill", fails)
    with pytest.raises(RuntimeError, match="unknown"):
        scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / f"a{suffix}")
    monkeypatch.setattr(shutil, "disk_usage", lambda path: Full)
    with pytest.raises(OSError, match="No space left") as full:
        scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / f"a{suffix}")
    assert full.value.filename == str(tmp_path / f"a{suffix}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_being_must_end_leaves_nothing(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "tlsplan",
        "scene",
        "campus",
        "--triangles",
        "20000000",
        "-o",
        str(tmp_path / "c.ply"),
    ]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        limit = time.monotonic() + 240
        while not list(tmp_path.iterdir()) and time.monotonic() < limit:
            time.sleep(0.05)
        assert list(tmp_path.iterdir()), "nothing was begun within four minutes"
        process.send_signal(signal.SIGTERM)
        _, told = process.communicate(timeout=240)
    assert process.returncode == 130
    assert "interrupted; nothing was left half-written" in told
    assert list(tmp_path.iterdir()) == []


def test_scene_without_a_name_but_with_an_output_is_refused() -> None:
    outcome = CliRunner().invoke(cli, ["scene", "-o", "x.ifc"])
    assert outcome.exit_code == 2
    assert "which scene?" in outcome.output


@pytest.mark.parametrize(
    ("glass", "part"), [("stop", "ends beams"), ("pass", "lets beams pass"), ("return", "counts as a wall")]
)
def test_summary_tells_how_much_glass_there_is_whatever_it_does(glass: str, part: str) -> None:
    lines = materials(12.34, 0.5, glass=glass)
    assert lines[0].startswith("glass         12.3 m2") and part in lines[0]
    assert lines[1].startswith("mirrors       0.5 m2")
    assert materials(0.0, 0.0, glass=glass) == ()
