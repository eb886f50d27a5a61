"""The witness of the soak: some ten thousand beams leak nowhere, and a leak would be seen."""

from types import ModuleType

import numpy as np
import pytest

from planner_core.device import open_device
from planner_core.model import RayHits, ScanBatch

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def target(soak: ModuleType) -> object:
    sphere = soak.meshes.star("sphere", 8, 16, bumps=0.0, seed=1)
    return soak.Target(sphere, 2.0, 100.0, open_device())


def test_meshes_are_closed_and_their_points_lie_inside(soak: ModuleType) -> None:
    for mesh in soak.meshes.all_meshes(seed=3):
        assert soak.meshes.odd_edges(mesh.triangles) == 0, mesh.name
        placed = soak.Target(mesh, 1.0, 0.0, open_device())
        every_way = np.random.default_rng(1).normal(size=(500, 3))
        for point in placed.inside:
            rays = np.concatenate([np.broadcast_to(point, every_way.shape), every_way], axis=1).astype(np.float32)
            hit = placed.oracle.cast_rays(soak.open3d.core.Tensor(rays))["t_hit"].numpy()
            assert np.isfinite(hit).all(), f"{mesh.name}: {point} is not inside"


def test_nothing_leaks_and_every_disagreement_is_explained(soak: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every mesh, in a place where float32 is fine and in one where it is coarse, every way of casting."""
    monkeypatch.setattr(soak, "ROWS", 256)
    monkeypatch.setattr(soak, "BATCH", 4000)
    seed = 7
    for mesh in soak.meshes.all_meshes(seed=seed):
        for radius_m, distance_m in ((2.0, 1.0), (300.0, 10_000.0)):
            placed = soak.Target(mesh, radius_m, distance_m, open_device())
            if not placed.is_worth_it():
                continue
            for path in soak.PATHS:
                if path == "grid scan" and mesh.grid is None:
                    continue
                job = soak.Job(mesh.name, path, radius_m, distance_m, 4000 if path == "rays" else 1, seed)
                tally = soak.do(job, placed)
                assert tally.n_beams >= job.n_beams
                assert (tally.leaks, tally.wrong_ranges, tally.reasons[-1]) == (0, 0, 0), (job, tally)
                assert sum(tally.reasons) == tally.other_triangle


def test_jobs_are_the_same_beams_for_the_same_seed_and_others_for_another(soak: ModuleType, target: object) -> None:
    def triangles_other(seed: int) -> tuple[int, list[int]]:
        tally = soak.do(soak.Job("sphere", "rays", 2.0, 100.0, 4000, seed), target)
        return tally.other_triangle, tally.reasons

    assert triangles_other(1) == triangles_other(1) != triangles_other(2)


class Leaky:
    """An engine that lets some beams through, or ranges wrongly, or names any triangle."""

    def __init__(self, real: object, fault: str) -> None:
        self._real, self._fault = real, fault

    def cast_rays(self, origins_m: np.ndarray, directions: np.ndarray, *, range_max_m: float) -> RayHits:
        hits = self._real.cast_rays(origins_m, directions, range_max_m=range_max_m)
        range_m, triangle = self._spoil(hits.range_m, hits.triangle)
        return RayHits(range_m=range_m, triangle=triangle)

    def scan(self, template: object, positions_m: np.ndarray) -> ScanBatch:
        batch = self._real.scan(template, positions_m)
        range_m, triangle = self._spoil(batch.range_m.ravel(), batch.triangle.ravel())
        shape = batch.range_m.shape
        return ScanBatch(range_m.reshape(shape), triangle.reshape(shape), batch.patch, batch.cos_incidence)

    def _spoil(self, range_m: np.ndarray, triangle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        range_m, triangle = range_m.copy(), triangle.copy()
        some = np.flatnonzero(triangle >= 0)[::97]
        if self._fault == "miss":
            range_m[some], triangle[some] = np.nan, -1
        elif self._fault == "far side":
            range_m[some], triangle[some] = range_m[some] + 1.0, (triangle[some] + 60) % 200
        elif self._fault == "range":
            range_m[::8] *= np.float32(1.001)
        elif self._fault == "nearer":
            range_m[some], triangle[some] = 0.5 * range_m[some], (triangle[some] + 60) % 200
        return range_m, triangle


@pytest.mark.parametrize(
    ("path", "fault", "seen"),
    [
        ("rays", "miss", "leaks"),
        ("scan", "miss", "leaks"),
        ("grid scan", "miss", "leaks"),
        ("scan", "far side", "leaks"),
        ("grid scan", "range", "wrong_ranges"),
        ("rays", "nearer", "unexplained"),
    ],
)
def test_a_spoiled_engine_is_seen(
    soak: ModuleType, target: object, monkeypatch: pytest.MonkeyPatch, path: str, fault: str, seen: str
) -> None:
    monkeypatch.setattr(soak, "BATCH", 20_000)
    monkeypatch.setattr(target, "engine", Leaky(target.engine, fault))
    tally = soak.do(soak.Job("sphere", path, 2.0, 100.0, 10_000, 1), target)
    counts = {"leaks": tally.leaks, "wrong_ranges": tally.wrong_ranges, "unexplained": tally.reasons[-1]}
    assert counts[seen] > 10, counts
    assert tally.examples


def test_an_interrupted_run_goes_on_where_it_was(
    soak: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    sphere = soak.meshes.star("sphere", 8, 16, bumps=0.0, seed=1)
    monkeypatch.setattr(soak.meshes, "all_meshes", lambda seed: (sphere,))
    monkeypatch.setattr(soak, "RADII_M", (1.0, 3.0))
    monkeypatch.setattr(soak, "DISTANCES_M", (0.0,))
    monkeypatch.setattr(soak, "BATCH", 5000)
    store = tmp_path / "store.jsonl"
    whole = soak.run(20_000, 1, None)
    done: list[object] = []

    def interrupted(job: object, target: object) -> object:
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append(job)
        return real(job, target)

    real = soak.do
    monkeypatch.setattr(soak, "do", interrupted)
    with pytest.raises(KeyboardInterrupt):
        soak.run(20_000, 1, store)
    monkeypatch.setattr(soak, "do", lambda job, target: done.append(job) or real(job, target))
    again = soak.run(20_000, 1, store)
    assert len(done) == len(whole) == 8
    assert [(job, tally) for job, tally in again] == whole
    text = soak.as_markdown(again, 1)
    assert "**0 leaks, 0 wrong ranges, 0 unexplained" in text
    assert "| sphere |" in text
