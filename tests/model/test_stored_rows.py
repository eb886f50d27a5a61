"""Rows on disk: the same entries, however they came and are read, and one line where the disk is full."""

import errno
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic
from planner_core.coverage import coverage as c
from planner_core.errors import RequirementError
from planner_core.model import (
    Greedy,
    PlanSettings,
    Proven,
    Requirements,
    Visibility,
    VisibilityMode,
    scans,
    stored_rows,
)
from planner_core.model.stored_rows import VISIBILITY_VARIABLE, PatchColumn, StoredVisibility
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.select.problem import Constraint, cover_problem

N_PATCHES = 5000


@pytest.fixture(autouse=True)
def short_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks that end within rows, and rows longer than a block."""
    for module in (scans, stored_rows):
        monkeypatch.setattr(module, "ENTRIES_A_PIECE", 300)


def both_kinds(seed: int, n: int = 40) -> tuple[Visibility, StoredVisibility]:
    """Random rows, some empty, gaps of all widths, in memory and on disk."""
    rng = np.random.default_rng(seed)
    rows = [np.sort(rng.choice(N_PATCHES, rng.integers(0, 700), replace=False)) for _ in range(n)]
    rows[3] = rows[-1] = np.empty(0, dtype=np.int64)
    rows[7] = np.arange(0, N_PATCHES, 256)
    rows[8] = np.array([0, 255, 511, N_PATCHES - 1])
    starts = np.cumsum([0, *(row.size for row in rows)]).astype(np.int64)
    plain = Visibility(starts, np.concatenate(rows).astype(np.int32), N_PATCHES)
    column = PatchColumn(100)
    for row in rows:
        column.add(row.astype(np.int32))
    stored = column.rows(starts, N_PATCHES)
    assert isinstance(stored, StoredVisibility)
    return plain, stored


@pytest.mark.parametrize("seed", range(3))
def test_what_is_read_is_what_was_written(seed: int) -> None:
    plain, stored = both_kinds(seed)
    for position in np.random.default_rng(seed).permutation(plain.n_positions).tolist():
        assert stored.row(position).tolist() == plain.row(position).tolist()
    assert np.concatenate([patch for _, patch in stored.pieces()]).tolist() == plain.patch.tolist()
    owner = np.concatenate([stored.positions_of(at, patch.size) for at, patch in stored.pieces()])
    assert owner.tolist() == np.repeat(np.arange(plain.n_positions), np.diff(plain.starts)).tolist()
    assert stored.patch.tolist() == plain.patch.tolist()
    assert stored.n_seers().tolist() == np.bincount(plain.patch, minlength=N_PATCHES).tolist()
    again = pickle.loads(pickle.dumps(stored))
    assert (again.patch == plain.patch).all()
    assert (again.starts == plain.starts).all()


def test_rows_taken_and_stacked_are_those_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, stored = both_kinds(5)
    order = np.random.default_rng(1).permutation(plain.n_positions)[:25]
    wanted = [plain.row(i).tolist() for i in order] + [plain.row(i).tolist() for i in range(plain.n_positions)]
    monkeypatch.setattr(stored_rows, "memory_from_env", lambda _: 100)
    both = c.stacked_rows(c.take_rows(stored, order), stored)
    assert isinstance(both, StoredVisibility)
    assert [both.row(i).tolist() for i in range(both.n_positions)] == wanted


@pytest.mark.parametrize("seed", range(3))
def test_the_problem_is_the_same_and_its_rows_are_never_unpacked(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    plain, stored = both_kinds(seed)
    rng = np.random.default_rng(seed)
    targets = (Constraint(rng.random(N_PATCHES) < 0.7, 0.9), Constraint(rng.random(N_PATCHES) < 0.3, 0.8, 2))
    area_m2 = rng.random(N_PATCHES)
    wanted = cover_problem(plain, area_m2, targets)

    def fail(_: StoredVisibility) -> None:
        raise AssertionError("all rows at once")

    monkeypatch.setattr(StoredVisibility, "_unpacked", fail)
    got = cover_problem(stored, area_m2, targets)
    for name in ("starts", "row", "ticks", "counts_for", "required", "least", "seen_from"):
        assert (getattr(got, name) == getattr(wanted, name)).all(), name
    # And against sets: patches are one row just where the same positions see and the same targets count them.
    seers: list[list[int]] = [[] for _ in range(N_PATCHES)]
    for position in range(plain.n_positions):
        for patch in plain.row(position).tolist():
            seers[patch].append(position)
    alike = {(tuple(who), *(bool(t.part[p]) for t in targets)) for p, who in enumerate(seers) if who}
    assert got.n_rows == sum(any(key[1:]) for key in alike)
    counted = targets[0].part | targets[1].part
    ticks = np.rint(area_m2 * 1e9).astype(np.int64)
    for position in range(plain.n_positions):
        patch = plain.row(position)
        assert got.ticks[got.rows_of(position)].sum() == ticks[patch[counted[patch]]].sum()


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_is_one_line(error: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(error, "full")

    monkeypatch.setattr(stored_rows.tempfile, "TemporaryFile", full)
    column = PatchColumn(100)
    with pytest.raises(RequirementError, match=rf"got .* expected room .*{VISIBILITY_VARIABLE}; free some"):
        column.add(np.arange(1000, dtype=np.int32))


def test_a_disk_that_fills_up_meanwhile_is_the_same_line() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    with Path("/dev/full").open("wb", buffering=0) as file, pytest.raises(RequirementError, match="No space left"):
        stored_rows._written(file, b"x")


@pytest.mark.parametrize("said", ["much", "0MB", "-1GB"])
def test_a_budget_that_is_no_size_is_told(said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VISIBILITY_VARIABLE, said)
    with pytest.raises(RequirementError, match=f"{VISIBILITY_VARIABLE}: got '{said}', expected a size"):
        stored_rows.visibility_budget()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "mode"),
    [
        pytest.param(Greedy(), VisibilityMode.BEAMS, marks=pytest.mark.slow),
        (Proven(work_limit=0.1), VisibilityMode.PATCHES),
    ],
    ids=["greedy", "proven"],
)
def test_a_plan_is_the_same_with_all_on_disk(
    method: Greedy | Proven, mode: VisibilityMode, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scene = scenes_synthetic.build("two-rooms").scene
    settings = PlanSettings(
        replace(load_scanner("hdl-64e"), n_azimuths=90),
        Requirements(coverage=0.8),
        method=method,
        scan_mode=mode,
        grid_step_m=1.0,
        instrument_heights_m=(1.5,),
        max_patch_area_m2=1.0,
        refine=method != Greedy(),
    )
    plain = make_plan(scene, settings)
    monkeypatch.setenv(VISIBILITY_VARIABLE, "0.001MB")
    monkeypatch.setattr(stored_rows.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr("planner_core.requirements.observe_candidates._AT_A_TIME", 7)
    stored: list[int] = []
    write = stored_rows._PackedFile.write

    def noted(self: stored_rows._PackedFile, patch: np.ndarray) -> None:
        stored.append(patch.size)
        write(self, patch)

    monkeypatch.setattr(stored_rows._PackedFile, "write", noted)
    packed = make_plan(scene, settings)
    assert sum(stored) > 1000
    assert list(tmp_path.iterdir()) == []
    # Every array, figure and word of it, but for the time that it took.
    assert pickle.dumps(replace(packed, timings_s={})) == pickle.dumps(replace(plain, timings_s={}))
