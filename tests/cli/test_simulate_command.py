"""`tlsplan simulate` interrupted in the middle of a large scan, as a process of its own."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

import scenes_synthetic

SCANNER = """{"name": "fine", "title": "Fine", "source": "made up", "range_min_m": 0.1, "range_max_m": 50,
"n_azimuths": 8000, "elevation_deg": {"first": 90, "last": -60, "count": 8000},
"instrument_height_min_m": 1, "instrument_height_max_m": 2}"""


def test_interrupted_simulation_leaves_nothing_half_written(tmp_path: Path) -> None:
    scene = scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / "box.ifc")
    (tmp_path / "fine.json").write_text(SCANNER)
    (tmp_path / "mine.csv").write_text("id,x_m,y_m,z_m\nA,3,2,1.5\n")
    before = sorted(tmp_path.iterdir())
    process = subprocess.Popen(
        [
            sys.executable, "-m", "tlsplan", "simulate", str(scene), "--stations", str(tmp_path / "mine.csv"),
            "-o", str(tmp_path / "scans"), "--scanner", str(tmp_path / "fine.json"), "--format", "ply",
        ],
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith("clouds"):
            break
    else:
        pytest.fail("no progress of clouds was shown")
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in rest
    assert "Traceback" not in rest
    assert sorted(tmp_path.iterdir()) == before
