"""The live routes, asked as a browser does: framing, entity tags, refusals in words, questions that are overtaken."""

from __future__ import annotations

import asyncio
import json
import struct
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import schemathesis
from fastapi import APIRouter, FastAPI
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from schemathesis import GenerationMode
from schemathesis.checks import CHECKS, load_all_checks
from shared_plans import SharedPlan

from planner_core.errors import PlanFolderError
from planner_core.model import Plan, Review
from planner_core.model.review import ForbiddenPlace, StationEdit, Zone
from planner_core.planning.live.live_plan import LivePlan
from planner_core.progress import Progress, ProgressEvent
from planner_core.review.stations import plan_under_review
from viewer_web.server.answers import answer_errors
from viewer_web.server.live_api import create_live_router
from viewer_web.server.live_worker import LiveSide

load_all_checks()


class Client:
    """Asks an application, one request at a time."""

    def __init__(self, app: FastAPI) -> None:
        self._app = app

    def get(self, path: str, headers: dict[str, str] | None = None) -> httpx.Response:
        return asyncio.run(self._send("GET", path, headers=headers))

    def post(self, path: str, json: dict[str, Any]) -> httpx.Response:
        return asyncio.run(self._send("POST", path, json=json))

    async def _send(self, method: str, path: str, **more: Any) -> httpx.Response:
        transport = httpx.ASGITransport(app=self._app)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            return await client.request(method, path, **more)


def app_of(router: APIRouter) -> FastAPI:
    app = FastAPI(separate_input_output_schemas=False)
    answer_errors(app)
    app.include_router(router)
    return app


def client_of(router: APIRouter) -> Client:
    return Client(app_of(router))


class Desk:
    """A server of one plan, whose review a test sets."""

    def __init__(self, live: LivePlan, folder: Path) -> None:
        self.live, self.review, self.plan = live, Review(revision=7), plan_under_review(folder)
        self.side = LiveSide(lambda progress: live)
        self.app = app_of(create_live_router(self.side, lambda: self.review, lambda: self.plan))
        self.client = Client(self.app)

    def ready(self) -> Desk:
        self.side.start()
        self.side.wait()
        return self


@pytest.fixture
def desk(house: LivePlan, house_plan: SharedPlan) -> Desk:
    return Desk(house, house_plan.folder).ready()


def unframed(content: bytes) -> tuple[dict[str, Any], bytes]:
    (length,) = struct.unpack("<I", content[:4])
    assert length % 4 == 0
    return json.loads(content[4 : 4 + length]), content[4 + length :]


def question(desk: Desk, **changes: Any) -> dict[str, Any]:
    station = desk.plan.stations[0]
    x, y, z = station.position_m
    asked = {
        "station": station.id,
        "floor": station.floor,
        "position": [x + 0.3, y - 0.2, z],
        "instrument_height_m": station.instrument_height_m,
        "layer": "range",
        "sequence": 3,
    }
    return {**asked, **changes}


def test_preview_is_framed_and_changes_the_layers_into_those_of_the_moved_station(desk: Desk) -> None:
    answer = desk.client.post("/api/live/preview", json=question(desk))
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/octet-stream"
    head, body = unframed(answer.content)
    n = head["n_patches_changed"]
    assert n > 0
    assert len(body) == 7 * n
    assert head["sequence"] == 3
    assert head["revision"] == 7
    patch = np.frombuffer(body, "<u4", n)
    values = np.frombuffer(body, "<u2", n, offset=4 * n)
    times = np.frombuffer(body, "u1", n, offset=6 * n)

    def layers() -> tuple[np.ndarray, np.ndarray]:
        found = (desk.client.get(f"/api/live/layers/{name}").content for name in ("times_seen", "range"))
        return np.frombuffer(next(found), "u1").copy(), np.frombuffer(next(found), "<u2").copy()

    expected_times, expected_values = layers()
    expected_times[patch], expected_values[patch] = times, values
    # The client commits what the preview answered, and the layers are what it painted.
    moved = StationEdit(tuple(head["position"]), head["instrument_height_m"], question(desk)["floor"])
    desk.review = replace(desk.review, revision=8, stations={question(desk)["station"]: moved})
    found_times, found_values = layers()
    np.testing.assert_array_equal(found_times, expected_times)
    np.testing.assert_array_equal(found_values, expected_values)
    figures = desk.client.get("/api/live/figures").json()
    assert figures["revision"] == 8
    assert figures["coverage"] == head["coverage"]
    assert figures["floors"] == head["floors"]
    station = next(row for row in figures["stations"] if row["id"] == question(desk)["station"])
    assert {key: station[key] for key in head["station"]} == pytest.approx(head["station"], abs=2e-6)
    of_station = [link for link in figures["registration"]["links"] if station["id"] in (link["a"], link["b"])]
    assert sorted(link["overlap"] for link in of_station) == sorted(link["overlap"] for link in head["links"])
    assert len(figures["registration"]["networks"]) == head["registration"]["n_networks"]


@pytest.mark.slow
def test_committing_what_a_preview_answered_needs_no_other_scan(far: tuple[Path, Plan], far_plan: LivePlan) -> None:
    desk = Desk(far_plan, far[0]).ready()
    x, y, _ = desk.plan.stations[0].position_m
    where = question(desk, position=[x + 0.123456, y - 0.234567])
    head, _ = unframed(desk.client.post("/api/live/preview", json=where).content)
    before = desk.live.n_scans
    moved = StationEdit(tuple(head["position"]), head["instrument_height_m"], question(desk)["floor"])
    desk.review = replace(desk.review, stations={question(desk)["station"]: moved})
    assert desk.client.get("/api/live/figures").status_code == 200
    assert desk.live.n_scans == before > len(desk.plan.stations)


@pytest.mark.slow
def test_removed_and_added_stations_are_in_the_draft(desk: Desk) -> None:
    gone, beside = desk.plan.stations[0], desk.plan.stations[1]
    added = StationEdit(beside.position_m, beside.instrument_height_m, beside.floor, added=True)
    desk.review = Review(revision=2, stations={gone.id: StationEdit(removed=True), "S900": added})
    ids = [row["id"] for row in desk.client.get("/api/live/figures").json()["stations"]]
    assert gone.id not in ids
    assert ids[:2] == [beside.id, "S900"], "behind the nearest of its floor"
    twin = desk.client.get("/api/live/stations/S900/seen")
    assert twin.content == desk.client.get(f"/api/live/stations/{beside.id}/seen").content
    assert desk.client.get(f"/api/live/stations/{gone.id}/seen").status_code == 404


@pytest.mark.slow
def test_ground_is_framed_and_shows_what_the_review_keeps_free(desk: Desk) -> None:
    head, body = unframed(desk.client.get("/api/live/ground/F0").content)
    values = np.frombuffer(body, "u1").reshape(head["height"], head["width"])
    assert set(np.unique(values)) == {0, 1, 2}
    row, column = (int(each[0]) for each in np.nonzero(values == 2))
    x, y = (head["origin"][axis] + (index + 0.5) * head["cell_m"] for axis, index in enumerate((column, row)))
    square = ((x - 0.3, y - 0.3), (x + 0.3, y - 0.3), (x + 0.3, y + 0.3), (x - 0.3, y + 0.3))
    desk.review = Review(zones={"Z1": Zone("Z1", "keep_out", square, floor="F0")})
    _, excluded = unframed(desk.client.get("/api/live/ground/F0").content)
    assert np.frombuffer(excluded, "u1").reshape(values.shape)[row, column] == 3
    upstairs, _ = unframed(desk.client.get("/api/live/ground/F1").content)
    assert upstairs["floor"] == "F1"
    desk.review = Review(forbidden={"P1": ForbiddenPlace("P1", (x, y, 0.0), 0.2, "F0")})
    _, excluded = unframed(desk.client.get("/api/live/ground/F0").content)
    assert np.frombuffer(excluded, "u1").reshape(values.shape)[row, column] == 3


def test_station_dragged_into_a_keep_out_is_moved_beside_it_and_told_so(desk: Desk) -> None:
    station = desk.plan.stations[0]
    x, y, _ = station.position_m
    square = ((x - 0.4, y - 0.4), (x + 0.4, y - 0.4), (x + 0.4, y + 0.4), (x - 0.4, y + 0.4))
    desk.review = Review(zones={"Z1": Zone("Z1", "keep_out", square, floor=station.floor)})
    head, _ = unframed(desk.client.post("/api/live/preview", json=question(desk, position=[x, y])).content)
    assert head["admissible"]
    assert "keep-out of the review" in head["reason"]
    assert not (abs(head["position"][0] - x) < 0.4 and abs(head["position"][1] - y) < 0.4)


def test_browsers_that_have_a_layer_are_told_so_until_a_station_moves(desk: Desk) -> None:
    first = desk.client.get("/api/live/layers/times_seen")
    tag = {"if-none-match": first.headers["etag"]}
    assert desk.client.get("/api/live/layers/times_seen", headers=tag).status_code == 304
    assert desk.client.get("/api/live/layers/range", headers=tag).status_code == 200
    desk.review = replace(desk.review, revision=9)  # a comment, say
    assert desk.client.get("/api/live/layers/times_seen", headers=tag).status_code == 304
    desk.review = Review(stations={desk.plan.stations[0].id: StationEdit(removed=True)})
    assert desk.client.get("/api/live/layers/times_seen", headers=tag).status_code == 200


def test_clouds_of_stations_that_stay_and_maps_of_ground_are_not_sent_again(desk: Desk) -> None:
    gone, stays = desk.plan.stations[:2]
    paths = [f"stations/{stays.id}/cloud", f"stations/{stays.id}/seen", "ground/F0"]
    tags = {path: {"if-none-match": desk.client.get(f"/api/live/{path}").headers["etag"]} for path in paths}
    assert len({tag["if-none-match"] for tag in tags.values()}) == len(paths)
    desk.review = Review(stations={gone.id: StationEdit(removed=True)})
    for path, tag in tags.items():
        assert desk.client.get(f"/api/live/{path}", headers=tag).status_code == 304
    x, y, z = stays.position_m
    moved = StationEdit((x + 0.1, y, z), stays.instrument_height_m, stays.floor)
    desk.review = Review(stations={stays.id: moved}, forbidden={"P1": ForbiddenPlace("P1", (x, y, 0.0), 0.2, "F0")})
    for path, tag in tags.items():
        assert desk.client.get(f"/api/live/{path}", headers=tag).status_code == 200


@pytest.mark.slow
def test_files_of_the_plan_are_what_the_routes_give_of_the_unchanged_draft(desk: Desk, house_plan: SharedPlan) -> None:
    viewer = house_plan.folder / "viewer"
    assert desk.client.get("/api/live/layers/times_seen").content == (viewer / "patches.u8").read_bytes()
    for name in ("range", "incidence", "spacing"):
        assert desk.client.get(f"/api/live/layers/{name}").content == (viewer / f"layers/{name}.u16").read_bytes()
    for station in desk.plan.stations:
        seen = desk.client.get(f"/api/live/stations/{station.id}/seen").content
        assert seen == (viewer / f"seen/{station.id}.bits").read_bytes()
        lost = desk.client.get(f"/api/live/stations/{station.id}/lost").content
        assert lost == (viewer / f"lost/{station.id}.u32").read_bytes()


def test_a_part_of_a_cloud_is_that_part_of_the_whole_scan(desk: Desk) -> None:
    station = desk.plan.stations[0]
    template = desk.live.survey.template
    scan = desk.live.engine.scan(template, desk.live.draft.station(station.id).at_m[None])
    path = f"/api/live/stations/{station.id}/cloud-window"
    answer = desk.client.get(f"{path}?azimuth=-0.3&width=0.6&low=-0.4&high=0.1")
    assert answer.status_code == 200, answer.text
    head, content = unframed(answer.content)
    n = head["rows"] * head["columns"]
    assert (n, len(content)) == (head["beams"], 3 * n)
    ranges_m = np.frombuffer(content, "<u2", n).reshape(head["rows"], head["columns"])
    ranges_m = ranges_m * head["range_step_m"]
    rows = np.flatnonzero((template.elevation_rad >= -0.4) & (template.elevation_rad <= 0.1))
    assert head["elevations_rad"] == template.elevation_rad[rows].tolist()
    # Those that the scanner has at the end of its turn come first: the window begins before azimuth 0.
    of_turn = (template.azimuth_rad + np.pi) % (2 * np.pi) - np.pi
    columns = np.flatnonzero(np.abs(of_turn) <= 0.3)
    columns = columns[np.argsort(of_turn[columns])]
    azimuths_rad = head["azimuths_rad"][0] + head["azimuth_step_rad"] * np.arange(head["columns"])
    assert azimuths_rad == pytest.approx(of_turn[columns], abs=1e-9)
    expected_m = np.nan_to_num(scan.range_m[0][np.ix_(rows, columns)])
    assert ranges_m == pytest.approx(expected_m, abs=head["range_step_m"])
    assert (expected_m > 0).mean() > 0.3


def test_a_window_without_beams_is_refused_in_words(desk: Desk) -> None:
    path = f"/api/live/stations/{desk.plan.stations[0].id}/cloud-window"
    answer = desk.client.get(f"{path}?azimuth=0&width=0.1&low=0.1&high=0.0")
    assert (answer.status_code, "without a beam" in answer.json()["message"]) == (422, True)
    assert desk.client.get("/api/live/stations/S777/cloud-window?azimuth=0&width=1&low=0&high=1").status_code == 404
    assert desk.client.get(f"{path}?azimuth=0&width=7&low=0&high=1").status_code == 422


def test_route_goes_through_all_stations(desk: Desk) -> None:
    route = desk.client.get("/api/live/route").json()
    assert sorted(route["route"]["order"]) == sorted(station.id for station in desk.plan.stations)
    assert route["route"]["length_m"] > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "status", "words"),
    [
        ({"station": "S777"}, 422, "expected one of"),
        ({"floor": "F9"}, 422, "expected one of F0"),
        ({"layer": "colour"}, 422, "expected one of times_seen"),
        ({"position": [1e6, 1e6]}, 200, ""),
        ({"position": [0.0]}, 422, ""),
        ({"instrument_height_m": -1}, 422, ""),
        ({"more": 1}, 422, ""),
    ],
)
def test_previews_that_make_no_sense_are_refused_in_words(
    desk: Desk, changes: dict[str, Any], status: int, words: str
) -> None:
    answer = desk.client.post("/api/live/preview", json=question(desk, **changes))
    assert answer.status_code == status
    if words:
        assert words in answer.json()["message"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", ["ground/F9", "layers/colour", "stations/S777/seen", "stations/S777/lost", "stations/S777/cloud"]
)
def test_names_that_are_not_there_are_not_found(desk: Desk, path: str) -> None:
    answer = desk.client.get(f"/api/live/{path}")
    assert answer.status_code == 404
    assert "expected" in answer.json()["message"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "mode", [GenerationMode.POSITIVE, pytest.param(GenerationMode.NEGATIVE, marks=pytest.mark.slow)]
)
def test_every_answer_is_one_that_the_document_describes(desk: Desk, mode: GenerationMode) -> None:
    schema = schemathesis.openapi.from_asgi("/openapi.json", desk.app)
    # Of the right form, and yet no station, floor or layer of this plan: refused then.
    excluded = CHECKS.get_by_names(["positive_data_acceptance"])
    n_operations = 0
    for found in schema.exclude(path_regex="/(route|figures)$").get_all_operations():
        operation = found.ok()
        if mode is GenerationMode.NEGATIVE and not operation.body:
            continue  # nothing in it can be wrong
        n_operations += 1

        @settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
        @given(case=operation.as_strategy(generation_mode=mode))
        def check(case: schemathesis.Case) -> None:
            case.call_and_validate(base_url="http://127.0.0.1", excluded_checks=excluded)

        check()
    assert n_operations == (7 if mode is GenerationMode.POSITIVE else 1)


@settings(max_examples=20, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    station=st.none() | st.sampled_from(["S001", "S002", "S999"]),
    floor=st.sampled_from(["F0", "F1", "F7"]),
    position=st.lists(st.floats(-1e7, 1e7) | st.floats(-20.0, 20.0), min_size=2, max_size=3),
    height=st.floats(0.0, 100.0) | st.floats(1.2, 1.8),
    layer=st.sampled_from(["times_seen", "range", "spacing", "noise"]),
)
def test_previews_of_any_place_and_height_are_answered(
    desk: Desk, station: str | None, floor: str, position: list[float], height: float, layer: str
) -> None:
    asked = question(desk, station=station, floor=floor, position=position, instrument_height_m=height, layer=layer)
    answer = desk.client.post("/api/live/preview", json=asked)
    assert answer.status_code in (200, 422)
    if answer.status_code == 422:
        is_far = max(map(abs, position[:2])) > 5e4  # beyond what the scanner's numbers reach
        assert station == "S999" or floor == "F7" or layer == "noise" or is_far
        return
    head, body = unframed(answer.content)
    assert len(body) == 7 * head["n_patches_changed"]
    assert head["admissible"] or head["reason"]


def test_questions_that_a_newer_one_of_the_page_overtook_are_not_answered(desk: Desk) -> None:
    def ask(sequence: int, client: str) -> int:
        asked = question(desk, sequence=sequence, client=client)
        return desk.client.post("/api/live/preview", json=asked).status_code

    assert ask(5, "a") == 200
    assert ask(4, "a") == 204
    assert ask(4, "b") == 200
    assert ask(5, "a") == 200
    assert ask(3, "") == 200


def test_plan_that_was_made_anew_is_not_mixed_with_the_old_one(desk: Desk) -> None:
    desk.plan = replace(desk.plan, sha256="0" * 64)
    answer = desk.client.get("/api/live/figures")
    assert answer.status_code == 503
    assert "was replaced" in answer.json()["message"]


def test_review_that_cannot_be_read_is_told_in_words(house: LivePlan, house_plan: SharedPlan) -> None:
    def broken() -> Review:
        raise PlanFolderError("review.usda: is no USD layer, expected one; repair it")

    side = LiveSide(lambda progress: house)
    client = client_of(create_live_router(side, broken, lambda: plan_under_review(house_plan.folder)))
    side.start()
    side.wait()
    answer = client.get("/api/live/figures")
    assert answer.status_code == 503
    assert "no USD layer" in answer.json()["message"]


# ------------------------------------------------------------------------------------------------- the live side
def test_server_answers_while_the_plan_is_opened(house: LivePlan, house_plan: SharedPlan) -> None:
    go_on, shown = threading.Event(), threading.Event()
    told: list[dict[str, Any]] = []

    def opening(progress: Progress) -> LivePlan:
        progress(ProgressEvent("opening", 1, 4, "reading the scene"))
        progress(ProgressEvent("load", 1, 2))
        shown.set()
        go_on.wait(30)
        return house

    desk = Desk(house, house_plan.folder)
    desk.side = LiveSide(opening, tell=told.append)
    client = client_of(create_live_router(desk.side, lambda: desk.review, lambda: desk.plan))
    assert client.get("/api/live/figures").status_code == 503
    desk.side.start()
    shown.wait(30)
    answer = client.get("/api/live/figures")
    assert answer.status_code == 503
    assert "reading the scene" in answer.json()["message"]
    assert desk.side.state() == {"state": "starting", "step": "reading the scene", "fraction": 0.375, "message": None}
    go_on.set()
    desk.side.wait()
    assert desk.side.state()["state"] == "ready"
    assert [told[0]["state"], told[-1]["state"]] == ["starting", "ready"]
    assert client.get("/api/live/figures").status_code == 200


def test_opening_that_fails_says_why() -> None:
    def opening(progress: Progress) -> LivePlan:
        raise PlanFolderError("plan: its scene house.ifc is not found; name it with --scene")

    side = LiveSide(opening)
    side.start()
    side.wait()
    assert side.state()["state"] == "failed"
    assert "--scene" in side.state()["message"]


@pytest.mark.slow
def test_opening_ends_when_the_server_stops() -> None:
    stopped = threading.Event()

    def opening(progress: Progress) -> LivePlan:
        stopped.wait(30)
        while True:
            progress(ProgressEvent("load", 0, 0))

    side = LiveSide(opening)
    side.start()
    side.stop()
    stopped.set()
    side.wait(30)
    assert side.state()["state"] == "off"
