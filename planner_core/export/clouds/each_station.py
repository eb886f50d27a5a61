"""Files of clouds, station by station: written here or, within `spread_over`, by others, the same bytes.

Clouds and what writes the files of a station -> a folder, and what became of the beams.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.executor import Kept, NotWantedError, Outcome, Place, Task, current_executor
from planner_core.export.clouds.file_header import file_names
from planner_core.export.clouds.points import STAGE, BeamTally, Clouds, every_nth, thinning_step
from planner_core.plan_folder.plan_source import FieldStation
from planner_core.progress import Progress, ProgressEvent, silent

Write = Callable[[Clouds, tuple[FieldStation, ...], Path], None]
"""Writes a file of some stations."""
WriteStation = Callable[[Clouds, FieldStation, Path], None]
"""Writes files of a station: the path is their name, without a suffix."""

#: Beams of the first station that go to other workers first.
_MOST_BEAMS_AHEAD = 4096
#: File jobs that several processes gave wait for each other: they share an engine.
_engine_lock = Lock()


def one_file(suffix: str, write: Write) -> WriteStation:
    """Return what writes a file of a station."""
    return partial(_one_file, suffix, write)


def _one_file(suffix: str, write: Write, clouds: Clouds, station: FieldStation, path: Path) -> None:
    write(clouds, (station,), path.with_name(f"{path.name}{suffix}"))


def write_each(clouds: Clouds, passes: Sequence[WriteStation], folder: Path) -> list[BeamTally]:
    """Write the files of all stations into a folder -> what became of the beams of each; `clouds.tally` has the sum.

    passes : over the beams of a station, one after the other; they are sent to others, and have to be functions of
    modules.
    """
    executor = current_executor()
    if executor is None:
        tallies = [write_station(clouds, passes, number, folder) for number in range(len(clouds.stations))]
    else:
        scene_key = executor.key_of((clouds.survey.scene, clouds.survey.patches))
        job = StationClouds(
            replace(clouds, scan_engine=None, progress=silent), tuple(passes), clouds.engine.name, scene_key
        )

        def here(number: int) -> bytes:
            alone = replace(clouds, scan_engine=clouds.engine, progress=silent)
            return _packed(write_station(alone, passes, number, folder))

        found = executor.files(
            job,
            [Task(number, 1, f"station {station.id}") for number, station in enumerate(clouds.stations)],
            folder,
            kept=lambda key, make: clouds.engine,
            here=here,
            stage=STAGE,
            progress=clouds.progress,
        )
        tallies = [BeamTally(**json.loads(each)) for each in found]
    for tally in tallies:
        clouds.tally.n_points += tally.n_points
        clouds.tally.n_dropped += tally.n_dropped
        clouds.tally.n_beyond_table += tally.n_beyond_table
    return tallies


def write_station(clouds: Clouds, passes: Sequence[WriteStation], number: int, folder: Path) -> BeamTally:
    """Write the files of one station, by its number."""
    station, name, tally = clouds.stations[number], file_names(clouds)[number], BeamTally()
    for n_done, write in enumerate(passes):

        def report(event: ProgressEvent, n_done: int = n_done) -> None:
            n_beams = event.total // len(clouds.stations)
            done = event.done - number * n_beams + (number * len(passes) + n_done) * n_beams
            clouds.progress(replace(event, done=done, total=len(passes) * event.total))

        tally = BeamTally()
        write(replace(clouds, scan_engine=clouds.engine, progress=report, tally=tally), station, folder / name)
    return tally


def _packed(tally: BeamTally) -> bytes:
    return json.dumps(asdict(tally)).encode()


@dataclass(frozen=True)
class StationClouds:
    """Files of stations, by their numbers; a file job. engine : its kind. scene_key : of scene and patches."""

    clouds: Clouds
    passes: tuple[WriteStation, ...]
    engine: str
    scene_key: str

    def answer(self, number: int, kept: Kept, progress: Progress = silent) -> bytes:
        """Give a hash of what a few beams of a station meet."""
        clouds = self.clouds
        template = every_nth(clouds.template, thinning_step(clouds.template.shape, _MOST_BEAMS_AHEAD))
        position_m = (clouds.stations[number].position_m - clouds.survey.scene.offset_m)[None]
        scan = kept(self.scene_key, self._opened).scan(template, position_m)
        found = hashlib.sha256()
        for values in (scan.range_m, scan.triangle, scan.patch, scan.cos_incidence):
            found.update(values.tobytes())
        return found.digest()

    def do(self, number: int, place: Place) -> Outcome:
        """Write the files of a station."""
        with _engine_lock:
            # Not the one that answers meanwhile: an engine does one thing at a time.
            engine = place.kept(f"{self.scene_key} of file jobs", self._opened)
            clouds = replace(self.clouds, scan_engine=engine, progress=partial(_heard, place))
            return Outcome(answer=_packed(write_station(clouds, self.passes, number, place.made)))

    def _opened(self) -> ScanEngine:
        return open_engine(self.clouds.survey.scene, self.clouds.survey.patches, engine=self.engine)


def _heard(place: Place, event: ProgressEvent) -> Any:
    if not place.is_wanted():
        raise NotWantedError
    place.tell(f"{event.done} of {event.total}")
