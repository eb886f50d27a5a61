"""Compiled code where its cache can be written, and where not."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

_CALL = """
import os, sys
import numpy as np
assert not any(name.split(".")[0] == "numba" for name in sys.modules)
from planner_core.select import annealing
print(*annealing._philox(1, 2, 3, 4, np.uint64(5)))
"""
#: Of planner_core.paper.genetic.philox.
_EXPECTED = "4114628917 2135731996 799165354 1208994298"


def call(**variables: str) -> str:
    kept = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "TLSPLAN_CACHE")}
    done = subprocess.run(
        [sys.executable, "-c", _CALL], capture_output=True, text=True, check=True, env={**kept, **variables}
    )
    return done.stdout.strip()


@pytest.mark.slow
def test_code_is_kept_in_our_cache_folder(tmp_path: Path) -> None:
    for _ in range(2):
        assert call(TLSPLAN_CACHE=str(tmp_path)) == _EXPECTED
    kept = [path.name for path in (tmp_path / "numba").rglob("*.nbc")]
    assert len(kept) == 1
    assert "_philox" in kept[0]


@pytest.mark.slow
def test_whoever_names_a_folder_for_numba_is_obeyed(tmp_path: Path) -> None:
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    assert call(TLSPLAN_CACHE=str(ours), NUMBA_CACHE_DIR=str(theirs)) == _EXPECTED
    assert not ours.exists()
    assert list(theirs.rglob("*.nbc"))


@pytest.mark.slow
@pytest.mark.parametrize("variable", ["TLSPLAN_CACHE", "NUMBA_CACHE_DIR"])
def test_a_folder_that_cannot_be_made_does_not_matter(tmp_path: Path, variable: str) -> None:
    (tmp_path / "file").touch()
    assert call(**{variable: str(tmp_path / "file" / "folder")}) == _EXPECTED
