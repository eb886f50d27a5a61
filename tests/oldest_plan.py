"""A plan.json with the keys of the first version that wrote any, and no other: two stations on two floors."""

from typing import Any


def floor(name: str, /, elevation_m: float, **instead: Any) -> dict[str, Any]:
    """A row of `floors`."""
    return {
        "id": name,
        "name": f"Level {name[1:]}",
        "elevation_m": elevation_m,
        "ground_area_m2": 32.0,
        "bounds": [[500000.0, 4000000.0], [500008.0, 4000004.0]],
        "origin": "slab",
        "n_stations": 1,
        **instead,
    }


def station(name: str, on: str, order: int, position: list[float], **instead: Any) -> dict[str, Any]:
    """A row of `stations`."""
    return {
        "id": name,
        "floor": on,
        "order": order,
        "position": position,
        "instrument_height_m": 1.5,
        "fixed": False,
        "covered_area_m2": 60.0,
        "own_area_m2": 30.0,
        **instead,
    }


def link(a: str, b: str, overlap: float = 0.4, strength: float | None = None) -> dict[str, Any]:
    """A row of `registration.links`."""
    return {"a": a, "b": b, "overlap": overlap, "strength": strength}


def oldest_plan(**instead: Any) -> dict[str, Any]:
    """The document; `instead` are keys in place of its own."""
    coverage = {
        "achievable_area_m2": 100.0,
        "total_area_m2": 200.0,
        "covered_area_m2": 96.0,
        "fraction_of_achievable": 0.96,
        "fraction_of_total": 0.48,
    }
    return {
        "schema": "tlsplan/plan/1",
        "scene": {
            "file": "house.ifc",
            "sha256": "0" * 64,
            "format": "ifc",
            "schema": "IFC2X3",
            "units": "metre",
            "metres_per_unit": 1.0,
            "up_axis": "Z",
            "offset": [500000.0, 4000000.0, 100.0],
            "n_elements": 5,
            "n_triangles": 60,
            "repairs": {
                "faces_read": 60,
                "non_finite": 0,
                "degenerate": 0,
                "duplicate": 0,
                "bad_index": 0,
                "dropped": [],
                "warnings": [],
            },
        },
        "scanner": {
            "name": "mine",
            "title": "My scanner",
            "source": "its manual",
            "range_min_m": 0.5,
            "range_max_m": 60.0,
            "n_azimuths": 360,
            "n_channels": 3,
            "elevation_rad": [0.5, 0.0, -0.5],
            "instrument_height_min_m": 1.2,
            "instrument_height_max_m": 1.9,
        },
        "requirements": {"coverage": 0.95, "overlap": 0.3, "floors": []},
        "method": "greedy",
        "seed": 0,
        "settings": {
            "grid_step_m": 0.5,
            "instrument_heights_m": [1.5],
            "height_step_m": 0.4,
            "clearance_m": 0.4,
            "ground_ring_radius_m": 0.2,
            "n_ground_ring_rays": 16,
            "max_patch_area_m2": 0.04,
            "n_candidates": 90,
            "n_patches": 5000,
        },
        "floors": [floor("F0", 100.0), floor("F1", 103.0)],
        "stations": [
            station("S001", "F0", 1, [500001.0, 4000002.0, 101.5]),
            station("S002", "F1", 2, [500002.0, 4000002.0, 104.5], fixed=True),
        ],
        "coverage": {
            "max_patch_area_m2": 0.04,
            **coverage,
            "floors": [{"floor": name, **coverage} for name in ("F0", "F1")],
        },
        "coverage_curve": [0.6, 0.96],
        "optimality": {
            "objective": "fewest stations",
            "stations": 2,
            "lower_bound": None,
            "gap": None,
            "proven": False,
        },
        "registration": {
            "threshold": 0.3,
            "connected": True,
            "links": [link("S001", "S002")],
        },
        "unseen": [
            {
                "element": 1,
                "name": "Wall",
                "kind": "IfcWall",
                "source_id": "1xS3BCk291UvhgP2dvNsgp",
                "floor": "F0",
                "unseen_area_m2": 4.0,
                "achievable_area_m2": 12.0,
            }
        ],
        "warnings": [],
        "device": "opencl on a processor",
        "versions": {"python": "3.11.7", "tlsplan": "0.1.0"},
        "timings_s": {"scan": 1.0},
        **instead,
    }
