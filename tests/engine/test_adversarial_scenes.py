"""Scenes, stations and templates made to break the walks: no beam lost, none stopped by nothing, the same bits always.

The oracle is every beam against every triangle in float64, of the float32 values that the kernels get.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner_core.device import Device
from planner_core.engine import opencl, tree
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.tuning import use_shape
from planner_core.model import BeamTemplate, ScanBatch, Scene
from planner_core.scanner.template import directions
from planner_core.scene.patches import make_patches

Floats = NDArray[np.float64]

#: Every packet width; tiles of one row, of groups of packets that are not full, and of no more than one packet a row.
SHAPES = [(8, 64, 8), (8, 32, 8), (4, 8, 1), (1, 64, 8), (16, 16, 4), (2, 64, 2), (5, 64, 8), (9, 32, 4), (8, 64, 16)]
#: Rounding of a plane's distance from the origin, as a share of the distance of the triangle's vertices.
PLANE_ROUNDING = 2e-6
#: What a hit in a triangle's margin is too far by (block.h, BESIDE), and some.
BESIDE = 2e-5


def soup(rng: np.random.Generator, n_triangles: int, large_m: float) -> Floats:
    """Corners (T, 3, 3), T at most `n_triangles`: tiny, large, slivers, plates along the axes, doubled, coplanar."""
    k = n_triangles // 6 + 1
    tiny = rng.uniform(-5, 5, (k, 1, 3)) + rng.normal(size=(k, 3, 3)) * rng.uniform(1e-3, 0.2, (k, 1, 1))
    large = rng.uniform(-5, 5, (k, 1, 3)) + rng.normal(size=(k, 3, 3)) * large_m
    along = rng.normal(size=(k, 3)) * rng.uniform(0.1, 10, (k, 1))
    start, width = rng.uniform(-5, 5, (k, 3)), 10.0 ** rng.uniform(-7, -2, (k, 1))
    middle = start + along * rng.uniform(0, 1, (k, 1)) + rng.normal(size=(k, 3)) * width
    slivers = np.stack([start, start + along, middle], axis=1)
    plates = rng.uniform(-5, 5, (k, 3, 3))
    axis = rng.integers(0, 3, k)
    plates[np.arange(k), :, axis] = plates[np.arange(k), :1, axis]
    one_of_each = np.concatenate([tiny, large, slivers, plates])
    doubled = one_of_each[rng.integers(0, len(one_of_each), k)][:, [1, 2, 0]]
    base = one_of_each[rng.integers(0, len(one_of_each), k)]
    weight = rng.uniform(-0.5, 1.5, (k, 3, 2))
    edges = base[:, 1:] - base[:, :1]
    coplanar = base[:, :1] + weight @ edges
    return rng.permutation(np.concatenate([one_of_each, doubled, coplanar]))[:n_triangles]


TEMPLATES = {
    "one beam": ([0.7], [0.3]),
    "one column": ([-2.0], np.linspace(1.5, -1.5, 300)),
    "one row": (np.arange(700) * (2 * np.pi / 700), [-0.4]),
    "sphere": (np.arange(60) * (2 * np.pi / 60), np.deg2rad(np.linspace(90, -90, 31))),
    "dome": (np.arange(90) * (2 * np.pi / 90), np.deg2rad(np.linspace(90, 0, 20))),
    "about the zenith": (np.arange(100) * (2 * np.pi / 100), np.deg2rad(np.linspace(90, 75, 16))),
    "sector": (np.linspace(-0.3, 0.3, 60), np.deg2rad(np.linspace(20, -20, 30))),
}


@dataclass(frozen=True)
class Case:
    """What a scene, stations on, in, near and far from its surfaces, and a template are made of."""

    seed: int
    n_triangles: int
    far_m: float
    large_m: float
    beams: str
    range_max_m: float

    def make(self, shapes: SimpleNamespace) -> tuple[Scene, Floats, BeamTemplate]:
        """Scene, stations (6, 3), template."""
        rng = np.random.default_rng(self.seed)
        centre = rng.uniform(-1, 1, 3) * self.far_m
        corners = soup(rng, self.n_triangles, self.large_m) + centre
        one = corners[rng.integers(0, len(corners), 4)]
        on = np.einsum("sc,sci->si", rng.dirichlet((1, 1, 1), 4), one)
        stations = [
            centre + rng.uniform(-4, 4, 3),
            on[0],
            on[1] + rng.normal(size=3) * 1e-4,
            on[2] + rng.normal(size=3) * 10.0 ** rng.uniform(-3, 0),
            one[3, 0],
            one[3, :2].mean(axis=0) + rng.normal(size=3) * 1e-2,
        ]
        azimuth, elevation = (np.asarray(angles, dtype=np.float64) for angles in TEMPLATES[self.beams])
        scene = shapes.scene_of(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        return scene, np.array(stations), BeamTemplate(azimuth, elevation, 0.0, self.range_max_m)


cases = st.builds(
    Case,
    seed=st.integers(0, 2**32 - 1),
    n_triangles=st.sampled_from([1, 2, 9, 64, 300]),
    far_m=st.sampled_from([0.0, 100.0, 1e4]),
    large_m=st.sampled_from([3.0, 30.0, 1000.0]),
    beams=st.sampled_from(sorted(TEMPLATES)),
    range_max_m=st.sampled_from([np.inf, 1000.0, 5.0]),
)


def engine_of(scene: Scene, device: Device) -> OpenCLEngine:
    return OpenCLEngine(scene, make_patches(scene, max_area_m2=1e7), device)


def rounded(values: Floats) -> Floats:
    return values.astype(np.float32).astype(np.float64)


def ranges_of(relative: Floats, beams: Floats) -> tuple[Floats, Floats]:
    """Ranges (N, T) of beams (N, 3) to triangles (T, 3, 3) minus the origin, infinite where missed; planes (T,).

    Planes: distances of the origin from the triangles' planes, NaN of those without area.
    """
    a, b, c = relative[:, 0], relative[:, 1], relative[:, 2]
    normal = np.cross(b - a, c - a)
    weights = np.stack([beams @ np.cross(p, q).T for p, q in ((b, c), (c, a), (a, b))])
    inside = (weights >= 0).all(axis=0) | (weights <= 0).all(axis=0)
    inside &= weights.sum(axis=0) != 0
    with np.errstate(divide="ignore", invalid="ignore"):
        volume = np.einsum("ti,ti->t", normal, a)
        ranges = volume / (beams @ normal.T)
        planes = np.abs(volume) / np.linalg.norm(normal, axis=1)
    return np.where(inside & (ranges > 0), ranges, np.inf), planes


def reach_of(relative: Floats) -> Floats:
    """(T,) distance of the farthest vertex."""
    return np.asarray(np.linalg.norm(relative, axis=2).max(axis=1))


def needle_slack(relative: Floats, beams: Floats) -> Floats:
    """How far (N, T) ranges of beams to needles may be off: their width over the sine of the angle to them; else 0."""
    edges = np.roll(relative, -1, axis=1) - relative
    squared = np.einsum("tei,tei->te", edges, edges)
    longest = np.take_along_axis(edges, squared.argmax(axis=1)[:, None, None], axis=1)[:, 0]
    area, length = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1), np.sqrt(squared.max(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.nan_to_num(beams @ (longest / length[:, None]).T)
        width = np.where(area < 1e-2 * length**2, area / length, 0.0)
    return np.asarray(2 * width / np.sqrt(np.maximum(1 - cosine**2, 1e-12)))


def distance_to(points: Floats, corners: Floats) -> Floats:
    """(N,) distances of points (N, 3) from triangles (N, 3, 3)."""
    first, edges = corners, np.roll(corners, -1, axis=1) - corners
    from_first = points[:, None] - first
    squared = np.einsum("nei,nei->ne", edges, edges)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.clip(np.nan_to_num(np.einsum("nei,nei->ne", from_first, edges) / squared), 0, 1)
        rim = np.linalg.norm(from_first - along[..., None] * edges, axis=2).min(axis=1)
        normal = np.cross(edges[:, 0], edges[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        over = (np.einsum("nei,ni->ne", np.cross(edges, from_first), normal) >= 0).all(axis=1)
        plane = np.abs(np.einsum("ni,ni->n", from_first[:, 0], normal))
    return np.where(over, plane, rim)


@settings(max_examples=25, deadline=None)
@given(case=cases)
def test_no_surface_is_passed_by(device: Device, shapes: SimpleNamespace, case: Case) -> None:
    scene, stations_m, template = case.make(shapes)
    batch = engine_of(scene, device).scan(template, stations_m)
    corners = rounded(scene.vertices_m)[scene.triangles]
    beams = rounded(directions(template).reshape(-1, 3))
    for station, found in zip(rounded(stations_m), batch.range_m, strict=True):
        relative = corners - station
        truth, planes = ranges_of(relative, beams)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = PLANE_ROUNDING * (np.where(np.isfinite(truth), truth, 0) + reach_of(relative)) / planes
        slack = needle_slack(relative, beams)
        # A plane through the origin, but for rounding, and a needle that the beam runs along give no range to compare.
        asked = np.isfinite(truth) & (share < 0.3) & (slack < 0.3 * truth)
        at_most = np.where(asked, truth * (1 + share + BESIDE) + slack, np.inf).min(axis=1)
        due = at_most < template.range_max_m
        assert (found.ravel()[due] <= at_most[due]).all()


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(case=cases)
def test_no_beam_ends_where_nothing_is(device: Device, shapes: SimpleNamespace, case: Case) -> None:
    scene, stations_m, template = case.make(shapes)
    batch = engine_of(scene, device).scan(template, stations_m[[0, 3]])
    corners = rounded(scene.vertices_m)[scene.triangles]
    beams = rounded(directions(template).reshape(-1, 3))
    for station, triangle, found in zip(
        rounded(stations_m[[0, 3]]), batch.triangle, batch.range_m.astype(np.float64), strict=True
    ):
        hit = triangle.ravel() >= 0
        range_m, named = found.ravel()[hit], corners[triangle.ravel()[hit]]
        away = distance_to(station + beams[hit] * range_m[:, None], named)
        relative = named - station
        reach, edges = reach_of(relative), np.roll(relative, -1, axis=1) - relative
        # The margin of a triangle is an angle, 1.25e-6 of its reach by the distance of the edge's line.
        with np.errstate(divide="ignore", invalid="ignore"):
            lines = np.linalg.norm(np.cross(relative, edges), axis=2) / np.linalg.norm(edges, axis=2)
            margin = range_m * 4e-6 * reach / np.where(np.isnan(lines), np.inf, lines).min(axis=1)
        # Along the beam a hit is off by the rounding of the plane over the cosine of the incidence, plane / range.
        normal = np.cross(edges[:, 0], edges[:, 1])
        area = np.linalg.norm(normal, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            plane = np.abs(np.einsum("ni,ni->n", normal, relative[:, 0])) / area
            along = np.nan_to_num(PLANE_ROUNDING * (range_m + reach) * range_m / plane)
        # Needles count as longer by a hundredth, and to the rounding of their ranges.
        longest = np.linalg.norm(edges, axis=2).max(axis=1)
        needle = np.where(area < 1e-2 * longest**2, 0.02 * longest, 0)
        assert (away <= BESIDE * range_m + 1e-5 * reach + margin + np.minimum(along, longest) + needle).all()


def same_bits(one: ScanBatch, other: ScanBatch) -> bool:
    names = ("range_m", "triangle", "patch", "cos_incidence")
    return all(getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in names)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@example(case=Case(seed=38697959, n_triangles=1, far_m=0.0, large_m=3.0, beams="one row", range_max_m=float("inf")))
@given(case=cases)
def test_bits_do_not_depend_on_the_way(device: Device, shapes: SimpleNamespace, case: Case) -> None:
    scene, stations_m, template = case.make(shapes)
    engine = engine_of(scene, device)
    scans = engine.scan(template, stations_m)
    for shape in SHAPES:
        if shape[2] > device.max_lanes:
            continue
        with use_shape(shape):
            assert same_bits(scans, engine.scan(template, stations_m)), shape
    beams = directions(template).astype(np.float32).reshape(-1, 3)
    stations = stations_m.astype(np.float32)
    rays = np.concatenate([np.repeat(stations, len(beams), axis=0), np.tile(beams, (len(stations), 1))], axis=1)
    with pytest.MonkeyPatch.context() as patch:
        for ways in ((64, 1), (64, 4), (7, 3), (1, 1)):
            patch.setattr(opencl, "_RAYS", {device.kind: ways})
            hits = engine.cast_prepared(rays, range_max_m=template.range_max_m)
            np.testing.assert_array_equal(hits.range_m, scans.range_m.ravel(), str(ways))
            np.testing.assert_array_equal(hits.triangle, scans.triangle.ravel(), str(ways))


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(case=cases)
def test_memory_asked_for_ahead_changes_nothing(device: Device, shapes: SimpleNamespace, case: Case) -> None:
    scene, stations_m, template = case.make(shapes)
    plain = engine_of(scene, device)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tree, "_CACHED_BYTES", 0)
        ahead = engine_of(scene, device)
    assert same_bits(plain.scan(template, stations_m), ahead.scan(template, stations_m))
    origins = np.repeat(stations_m, 50, axis=0)
    rays = np.random.default_rng(1).normal(size=origins.shape)
    one, other = (engine.cast_rays(origins, rays, range_max_m=np.inf) for engine in (plain, ahead))
    np.testing.assert_array_equal(one.range_m, other.range_m)
    np.testing.assert_array_equal(one.triangle, other.triangle)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), width_m=st.sampled_from([0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3]))
def test_needles_are_hit_where_they_are(device: Device, shapes: SimpleNamespace, seed: int, width_m: float) -> None:
    rng = np.random.default_rng(seed)
    start, along, side = rng.uniform(-5, 5, 3), rng.normal(size=3), rng.normal(size=3)
    along *= rng.uniform(1, 8) / np.linalg.norm(along)
    middle = start + along * rng.uniform(0.1, 0.9) + side * width_m / np.linalg.norm(side)
    scene = shapes.scene_of(np.array([start, start + along, middle]), np.array([[0, 1, 2]]))
    origin = rounded(rng.uniform(-3, 3, 3))
    corners = rounded(scene.vertices_m)
    aims = rng.dirichlet((1, 1, 1), 200) @ corners - origin
    truth = np.linalg.norm(aims, axis=1)
    hits = engine_of(scene, device).cast_rays(np.repeat(origin[None], 200, axis=0), aims, range_max_m=np.inf)
    assert (hits.triangle == 0).all()
    # Off by its width, where it is seen edge-on, and by rounding; more where the beam runs along it.
    sine = np.linalg.norm(np.cross(aims / truth[:, None], along / np.linalg.norm(along)), axis=1)
    assert (np.abs(hits.range_m - truth) <= (1.5 * width_m + 1e-5) / sine**2).all()


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(case=cases)
def test_open3d_sees_the_same_from_afar(device: Device, shapes: SimpleNamespace, case: Case) -> None:
    """Where rounding decides nothing: of clear triangles, and for a beam that passes no edge nearer than 1e-4 rad."""
    scene, stations_m, template = case.make(shapes)
    patches = make_patches(scene, max_area_m2=1e7)
    station = stations_m[:1]
    ours = OpenCLEngine(scene, patches, device).scan(template, station)
    theirs = Open3DEngine(scene, patches).scan(template, station)
    relative = rounded(scene.vertices_m)[scene.triangles] - rounded(station[0])
    beams = rounded(directions(template).reshape(-1, 3))
    apart = np.ones(len(beams), dtype=np.bool_)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        sides = np.cross(relative[:, first], relative[:, second])
        length = np.linalg.norm(sides, axis=1)
        apart &= (np.abs(beams @ sides.T) > 1e-4 * length).all(axis=1)
    same = ours.range_m.ravel(), theirs.range_m.ravel()
    np.testing.assert_array_equal(np.isnan(same[0][apart]), np.isnan(same[1][apart]))
    np.testing.assert_allclose(same[0][apart], same[1][apart], rtol=2e-3)


@pytest.mark.slow
def test_a_beam_beside_a_needle_is_stopped_by_it_in_a_tile_and_alone_or_in_neither(
    device: Device, shapes: SimpleNamespace
) -> None:
    """In parallel to its plane: the needle's own box and those that the walks meet are larger by pads of their own."""
    corners = np.array([[0.7885, -1.5927, 0.1499], [0.7885, -0.9491, 0.3883], [0.7885, 4.7207, 2.9456]])
    engine = engine_of(shapes.scene_of(corners, np.array([[0, 1, 2]], dtype=np.int32)), device)
    beside_m = np.concatenate([-np.geomspace(1e-6, 1e-4, 40), np.geomspace(1e-6, 1e-4, 40)])
    stations_m = np.column_stack([0.7885 + beside_m, np.full(80, 0.7794), np.full(80, 1.1917)])
    template = BeamTemplate(np.radians(np.arange(360.0)), np.linspace(-0.46, -0.38, 33), 0.0, np.inf)
    scans = engine.scan(template, stations_m).triangle.ravel()
    beams = directions(template).astype(np.float32).reshape(-1, 3)
    rays = np.concatenate(
        [np.repeat(stations_m.astype(np.float32), len(beams), axis=0), np.tile(beams, (80, 1))], axis=1
    )
    hits = engine.cast_prepared(rays, range_max_m=np.inf).triangle
    assert 0 < (scans == 0).sum() < scans.size
    np.testing.assert_array_equal(hits, scans)
