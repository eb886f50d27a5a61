"""`tlsplan batch`: many buildings or storeys from one file, and a summary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..options import SchedulerAddress, apply, engine_options, output_options

if TYPE_CHECKING:
    from ..batch.folder import BatchFolder
    from ..batch.jobs import Job
    from ..batch.sites_file import BatchSite, PriceEntries
    from ..batch.summary import Row
    from ..progress import ProgressReporter


@click.command("batch", epilog="Example:  tlsplan batch sites.yaml -o portfolio/")
@click.argument("sites_file", metavar="SITES", type=click.Path(path_type=Path, readable=False))
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), required=True, metavar="FOLDER",
              help="Folder of the batch: plan folders, and the summary index.html, summary.csv, "
              "summary.json.")  # fmt: skip
@click.option("--jobs", "n_jobs", type=click.IntRange(min=1), default=None, metavar="NUMBER",
              help="Plans made at the same time. [default: half of the cores; with --scheduler, "
              "one per worker]")  # fmt: skip
@click.option("--scheduler", type=SchedulerAddress(), default=None, metavar="tcp://HOST:PORT|local[:N]",
              help="Dask scheduler whose workers make the plans, one at a time each; the plans stay the same. local: N "
              "workers on this machine. Needs the extra tlsplan[cluster]; see docs/howto/cluster.md.")  # fmt: skip
@apply(engine_options, output_options)
def command(
    sites_file: Path,
    folder: Path,
    n_jobs: int | None,
    engine: str,
    device: str | None,
    scheduler: str | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Plan the buildings or storeys of SITES, a YAML or JSON file, and sum them up.

    SITES names scene files and options of `tlsplan plan`; see docs/formats/sites.md. Each plan is made in a process of
    its own. A failed plan is reported in one line; the others continue, and the exit code is 8. Run the command again
    to resume: what is planned is not planned again unless its files, options or version changed.
    """
    from planner_core.operating_system import n_usable_cores

    from ..batch.folder import BatchFolder
    from ..batch.jobs import first_jobs
    from ..batch.on_workers import opened_runner
    from ..batch.runner import ThisMachine, work
    from ..batch.sites_file import read_sites
    from ..batch.summary import FAILED, write_summary
    from ..progress import ProgressReporter

    sites, prices = read_sites(sites_file)
    with_engine = [f"--engine={engine}", *([] if device is None else [f"--device={device}"])]
    held = BatchFolder(folder)
    with held.turn() as handle, ProgressReporter(quiet=quiet or as_json) as reporter:
        telling = _Telling(held, reporter, prices)
        for site in sites:
            if site.missing:
                telling.missing(site)
        jobs = first_jobs(sites, engine=with_engine)
        telling.wait_for(jobs)
        here = ThisMachine(held, handle, most=n_jobs or max(n_usable_cores() // 2, 1), engine=with_engine)
        try:
            with opened_runner(
                here, held, scheduler, most=n_jobs, engine=(engine, device), reporter=reporter
            ) as runner:
                work(jobs, held, runner, engine=with_engine, report=telling.ended, look=telling.look)
        finally:
            document = write_summary(folder, telling.rows(sites), prices)
    _finish(folder, document, as_json=as_json, quiet=quiet)
    if any(row["state"] == FAILED for row in document["rows"]):
        raise click.exceptions.Exit(8)


class _Telling:
    """Reports how jobs go and end, and keeps what the summary is made of."""

    def __init__(self, folder: BatchFolder, reporter: ProgressReporter, prices: PriceEntries | None) -> None:
        self._folder, self._reporter, self._prices = folder, reporter, prices
        self._rows: dict[str, list[Row]] = {}
        self._waiting: dict[str, Row] = {}

    def wait_for(self, jobs: list[Job]) -> None:
        """Keep in mind what has no result yet."""
        from ..batch.summary import WAITING, Row

        for job in jobs:
            self._waiting[job.site.name] = Row(job.site.name, job.site.portfolio, "", WAITING)

    def missing(self, site: BatchSite) -> None:
        """Tell of a site without a file."""
        self._failed(site, site.name, "", site.missing)

    def ended(self, job: Job, message: str, before: bool) -> None:
        """Tell how a job ended."""
        from ..batch.summary import hours, row_of

        if message:
            self._failed(job.site, job.name, job.floor, message)
            return
        site, folder = job.site, self._folder
        row = row_of(job.name, site.portfolio, job.floor, folder.plan(job), folder.root, self._prices)
        self._rows.setdefault(site.name, []).append(row)
        if row.message:
            self._reporter.warn([f"{job.name}: {row.message}"])
        if not before:
            bound = "" if row.lower_bound is None else f", lower bound {row.lower_bound}"
            time = f", {hours(row.field_time_s)}" if row.field_time_s is not None else ""
            self._reporter.say(f"{job.name}: {row.stations} stations{bound}{time}")

    def look(self, done: int, total: int, doing: list[tuple[Job, str]]) -> None:
        """Show how far the batch is, and what its jobs do."""
        from planner_core.progress import ProgressEvent

        note = "; ".join(f"{job.name}: {line}" for job, line in doing)
        self._reporter.show(ProgressEvent("sites", done, total, note))

    def rows(self, sites: tuple[BatchSite, ...]) -> list[Row]:
        """Return all rows in the order of the sites file."""
        return [
            row
            for site in sites
            for row in sorted(
                self._rows.get(site.name) or [self._waiting[site.name]], key=lambda row: (len(row.floor), row.floor)
            )
        ]

    def _failed(self, site: BatchSite, name: str, floor: str, message: str) -> None:
        from ..batch.summary import FAILED, Row

        self._rows.setdefault(site.name, []).append(Row(name, site.portfolio, floor, FAILED, message=message))
        self._reporter.warn([f"{name}: failed: {message}"])


def _finish(folder: Path, document: dict[str, Any], *, as_json: bool, quiet: bool) -> None:
    from .. import output
    from ..batch.summary import hours

    if as_json:
        output.as_json(document)
    elif not quiet:
        shown = ("stations", "lower_bound")
        output.table(
            ("portfolio", "jobs", "failed", *shown, "field time", f"cost {document['currency']}".strip()),
            [
                (total["name"] or "-", str(total["jobs"]), str(total["failed"]),
                 *("" if total[name] is None else str(total[name]) for name in shown), hours(total["field_time_s"]),
                 "" if total["cost"] is None else f"{total['cost']:.2f}")
                for total in document["totals"]
            ],
        )  # fmt: skip
        output.say()
        output.say(f"summary       {folder / 'index.html'}")
