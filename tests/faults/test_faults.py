"""The witness of the campaign of faults: two faults of each piece of work; and broken promises would be seen."""

import json
import random
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from tests.faults import campaign
from tests.faults.injected import VARIABLE, Fault

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> campaign.Sound:
    return campaign.Sound(tmp_path_factory.mktemp("sound"))


@pytest.fixture(scope="module")
def works(sound: campaign.Sound) -> dict[str, campaign.Work]:
    return {work.name: work for work in campaign.works(sound)}


@pytest.mark.parametrize("name", ["plan", "plan --overwrite", "export", "review"])
def test_faults_break_no_promise(works: dict[str, campaign.Work], tmp_path: Path, name: str) -> None:
    """A kill at a change drawn by the seed, and a fault of the disk at one of the last three."""
    n = campaign.n_changes(works[name], tmp_path)
    assert n > 10
    rng = random.Random(name)
    disk = rng.choice(("ENOSPC", "EIO", "EROFS", "EACCES", "EDQUOT"))
    kill, last = campaign.drawn(n, "kill", 2, rng, tmp_path / "kill")[0], tmp_path / "disk"
    for fault in (kill, *campaign.drawn(n, disk, 1, rng, last)):
        campaign.try_fault(works[name], Path(fault.below), fault)


def test_reviews_of_a_clock_that_jumps_are_kept(works: dict[str, campaign.Work], tmp_path: Path) -> None:
    fault = Fault(below=str(tmp_path / "review"), kind="clock", at=1)
    assert campaign.try_fault(works["review"], tmp_path / "review", fault).code == 0


def test_two_writers_of_one_plan_and_one_review_lose_nothing(works: dict[str, campaign.Work], tmp_path: Path) -> None:
    """Of two plans under one name one is there, whole; of two reviewers all that was acknowledged."""
    for name, n_done in (("plan", 1), ("review", 2)):
        work, folder = works[name], campaign._made(works[name], tmp_path / name)
        second = replace(work, words=lambda f: (str(f / "plan"), "Ben")) if name == "review" else work
        sound = Fault(below=str(folder))
        both = [campaign.begin(each, folder, sound) for each in (work, second)]
        with ThreadPoolExecutor(2) as threads:
            done = list(threads.map(finished, both))
        assert sum(each.code == 0 for each in done) >= n_done, done
        for each in done:
            campaign._check(work, folder, each)


def finished(process: subprocess.Popen[str]) -> campaign.Done:
    out, message = process.communicate(timeout=campaign._TAKES_S)
    return campaign.Done(process.returncode, out, message)


# ------------------------------------------------------------------------------------------------ it sees
NAIVE = campaign._PREFIX + "from pathlib import Path; Path(sys.argv[1]).write_text('x' * 30_000); print('kept')"
DEAF = campaign._PREFIX + "open(sys.argv[1], 'w').write('x')"


def naive(program: str) -> campaign.Work:
    """Writes a file under its own name."""

    def check(folder: Path, done: campaign.Done) -> None:
        if (folder / "out").exists() and (folder / "out").stat().st_size != 30_000:
            raise campaign.BrokenPromiseError("half a file")

    return campaign.Work("naive", lambda folder: None, program, lambda f: (str(f / "out"),), check)


def test_a_file_that_is_not_whole_after_a_kill_is_seen(tmp_path: Path) -> None:
    work = naive(NAIVE)
    n = campaign.n_changes(work, tmp_path)
    with pytest.raises(campaign.BrokenPromiseError, match="half a file"):
        for at in range(1, n + 1):
            folder = tmp_path / f"{at}"
            campaign.try_fault(work, folder, Fault(below=str(folder), kind="kill", at=at))


def test_a_traceback_is_seen(tmp_path: Path) -> None:
    folder = tmp_path / "x"
    with pytest.raises(campaign.BrokenPromiseError, match="No space left"):
        campaign.try_fault(naive(DEAF), folder, Fault(below=str(folder), kind="ENOSPC", at=1))


@pytest.mark.parametrize("kind", ["open", "write", "os.mkdir", "os.rename", "fsync", "os.remove"])
def test_every_kind_of_change_is_met(tmp_path: Path, kind: str) -> None:
    program = campaign._PREFIX.format(here=campaign._HERE) + (
        "import os; from pathlib import Path; at = Path(sys.argv[1]); at.mkdir(); f = (at / 'a').open('w'); "
        "f.write('x'); f.flush(); os.fsync(f.fileno()); f.close(); (at / 'a').rename(at / 'b'); (at / 'b').unlink()"
    )
    fault = Fault(below=str(tmp_path / "x"), told=str(tmp_path / "told"))
    subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "x")], env={VARIABLE: json.dumps(asdict(fault))}, check=True
    )
    assert kind in {line.split()[1] for line in (tmp_path / "told").read_text().splitlines()}
