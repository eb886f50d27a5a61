"""Simulated scans by Dask workers, a station each: the files of one process to the byte, fetched in pieces."""

from __future__ import annotations

import hashlib
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from planner_core.cluster.errands import Errands, Order
from planner_core.cluster.spread import Cluster, scans_alike
from planner_core.cluster.workplace import Outcome, Place
from planner_core.engine.scan_engine import ScanEngine, open_engine
from planner_core.errors import ExportError
from planner_core.export.clouds.points import STAGE, Clouds, every_nth, thinning_step
from planner_core.export.clouds.simulated import write_station
from planner_core.progress import ProgressEvent, silent
from planner_core.spread import Kept

#: Beams of the first station that every worker is asked about first.
_MOST_BEAMS_ASKED = 4096
_LOOK_S = 0.1
_N_RETURNS = "n_returns"
#: Errands that several processes gave wait for each other: they share an engine.
_engine_lock = Lock()


@dataclass(frozen=True)
class StationScans:
    """Scans of stations, by their numbers; an errand. engine : its kind. scene_key : of scene and patches."""

    clouds: Clouds
    formats: tuple[str, ...]
    engine: str
    scene_key: str

    def answer(self, number: int, kept: Kept) -> bytes:
        """Give a hash of what a few beams of a station meet."""
        clouds = self.clouds
        template = every_nth(clouds.template, thinning_step(clouds.template.shape, _MOST_BEAMS_ASKED))
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
            engine = place.kept(f"{self.scene_key} of errands", self._opened)
            clouds = replace(self.clouds, scan_engine=engine, progress=partial(_heard, place))
            n_returns = write_station(clouds, self.formats, number, place.made)
        (place.made / _N_RETURNS).write_text(str(n_returns), encoding="ascii")
        return Outcome()

    def _opened(self) -> ScanEngine:
        return open_engine(self.clouds.survey.scene, self.clouds.survey.patches, engine=self.engine)


class _NotWantedError(Exception):
    """Nobody waits for these scans any more."""


def write_scans_spread(cluster: Cluster, clouds: Clouds, formats: Sequence[str], folder: Path) -> list[int]:
    """Write the files of all stations into a folder -> returns of each. One for `write_simulated_scans`.

    Raises
    ------
    ClusterError
        All workers that there are scan otherwise than this process, or are of another version.
    ExportError
        A worker can't write what another one can't, either.
    """
    bare = replace(clouds, scan_engine=None, progress=silent)
    scene_key = cluster.key_of((clouds.survey.scene, clouds.survey.patches))
    question = StationScans(bare, tuple(formats), clouds.engine.name, scene_key)
    parcel, expected = cluster.parcel(question), question.answer(0, lambda key, make: clouds.engine)
    errands = Errands(cluster, lambda address: scans_alike(cluster, address, parcel, 0, expected))
    waiting, n_returns = list(range(len(clouds.stations))), dict[int, int]()

    def fetched(order: Order) -> int:
        n_found = int((order.made / _N_RETURNS).read_text(encoding="ascii"))
        (order.made / _N_RETURNS).unlink()
        for path in order.made.iterdir():
            path.rename(folder / path.name)
        shutil.rmtree(order.made)
        return n_found

    try:
        while waiting or errands.orders():
            while waiting and errands.free() > 0:
                number = waiting.pop(0)
                errands.give(Order(number, parcel, number, {}, folder / f".{number}"))
            for order, message in errands.done():
                number = order.task
                if message:
                    raise ExportError(f"station {clouds.stations[number].id}: {message}")
                n_returns[number] = fetched(order)
            left = errands.left_alone()
            for number in sorted([*waiting, *(order.task for order in left)]) if left is not None else ():
                n_returns[number] = write_station(replace(clouds, progress=silent), formats, number, folder)
            if left is not None:
                break
            clouds.progress(ProgressEvent(STAGE, len(n_returns), len(clouds.stations), "workers"))
            time.sleep(_LOOK_S)
    finally:
        errands.stop()
    return [n_returns[number] for number in range(len(clouds.stations))]


def _heard(place: Place, event: ProgressEvent) -> Any:
    if not place.is_wanted():
        raise _NotWantedError
    place.tell(f"{event.done} of {event.total}")
