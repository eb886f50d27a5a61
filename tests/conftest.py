"""What holds for all tests: of the user's cache they share compiled functions alone, workers share no work, and chance
plays no part.

`make pytest` deals tests out to its workers file by file. Hypothesis tries the same examples in every run, however slow
the machine is; `--hypothesis-profile=default` tries others.
"""

import fcntl
import gc
import os
import random
import signal
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

from planner_core.cache import cache_folder

#: Devices are checked, and functions compiled, once for all runs of the tests. What the demo has compiled here is in
#: the user's cache, known by path and time of its source; where that can't be written, and for all else, there is the
#: folder below, which `make clean` removes. numba is imported after this.
os.environ["NUMBA_CACHE_DIR"] = os.environ.get("NUMBA_CACHE_DIR") or str(
    users / "numba"
    if (users := cache_folder()) is not None and os.access(users, os.W_OK)
    else Path(__file__).resolve().parents[1] / "build" / "test-cache" / "numba"
)
os.environ["TLSPLAN_CACHE"] = str(Path(__file__).resolve().parents[1] / "build" / "test-cache")
#: No result of another test: what a test replaces is no input of results that are kept.
os.environ["TLSPLAN_CACHE_SIZE"] = "0"

from planner_core.device import Device, list_devices, open_device
from planner_core.engine.open3d import prepare_import

# Hypothesis tries numbers and words of our modules: of those that are loaded by then, which is a matter of chance where
# tests are dealt out to workers. It has no public way to be asked not to.
providers._get_local_constants = lambda: providers._local_constants
settings.register_profile(
    "tlsplan", deadline=None, derandomize=True, max_examples=25, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("tlsplan")
prepare_import()
# As after `make test &`: commands that tests interrupt would inherit it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

gc.disable()  # until the tests are collected: modules and tests stay, whatever it looks through meanwhile
NO_DEVICE = "this machine has no OpenCL device"
_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import oldest_plan  # noqa: F401 - from here on they are known by their names
    import oracles  # noqa: F401
    import slow_cases  # noqa: F401
    import small_pictures
    import waiting  # noqa: F401
    from doc_pages import Page  # noqa: F401
    from in_process import Tlsplan, run_here
    from made_once import MadeOnce, folders_made_once
    from read_once import keep_what_children_read
    from real_buildings import RealScene, real_scenes
    from shared_plans import KEPT_IN_A_DAY, SharedPlan, shared_plans
finally:
    sys.path.remove(_FOLDER)
keep_what_children_read()


@pytest.fixture(autouse=True)
def own_signals() -> Iterator[None]:
    """A command that a test runs in this process takes the signals for good: the next test has them back."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    hook = sys.unraisablehook
    yield
    sys.unraisablehook = hook
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session")
def needs_opencl() -> None:
    """Skip on a machine without a device."""
    if _has_no_device():
        pytest.skip(NO_DEVICE)


@pytest.fixture(scope="session")
def device(needs_opencl: None) -> Device:
    """The default OpenCL device."""
    return open_device()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Leave out, on a machine without OpenCL, what asks for a device: it is marked so, or a parameter says so."""
    asked = getattr(item, "callspec", None)
    asks = item.get_closest_marker("opencl") or (asked and {"opencl", "device"} & {*map(str, asked.params.values())})
    if asks and _has_no_device():
        pytest.skip(NO_DEVICE)


@cache
def _has_no_device() -> bool:
    return not list_devices()


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> MadeOnce:
    """Call with a name and what fills a folder: the folder, filled once for all workers; who changes it copies it."""
    return folders_made_once(of_all_workers(tmp_path_factory))


def of_all_workers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of this run of the tests that its workers share."""
    own = tmp_path_factory.getbasetemp()
    return own.parent if "PYTEST_XDIST_WORKER" in os.environ else own


@pytest.fixture(scope="session")
def tlsplan() -> Tlsplan:
    """The command line, run in this process: call with its arguments."""
    return run_here


@pytest.fixture(scope="session")
def demo_folder(made_once: MadeOnce, needs_opencl: None) -> Path:
    """What `tlsplan demo` makes, pictures small: `demo`, `demo.ifc`, and in `printed.txt` its warnings and summary."""

    def fill(folder: Path) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("TLSPLAN_CACHE_SIZE", KEPT_IN_A_DAY)
            small_pictures.draw_small(patch)
            done = run_here("demo", "-o", folder / "demo")
        assert done.returncode == 0, done.stderr
        (folder / "printed.txt").write_text(done.stderr + done.stdout)

    return made_once("demo", fill)


@pytest.fixture(scope="session")
def real_scene(made_once: MadeOnce) -> RealScene:
    """Call with `duplex` or `fzk-haus`: the scene of the real building, loaded once; skips where there is none."""
    return real_scenes(made_once)


@pytest.fixture(scope="session")
def shared_plan(made_once: MadeOnce) -> Callable[[str], SharedPlan]:
    """Call with `house`, `house_on_map` or `box`: its plan (shared_plans.py)."""
    return shared_plans(made_once)


@pytest.fixture(scope="session")
def house_plan(shared_plan: Callable[[str], SharedPlan]) -> SharedPlan:
    """The synthetic house, planned by patches with links."""
    return shared_plan("house")


@pytest.fixture(scope="session")
def house_on_map(shared_plan: Callable[[str], SharedPlan]) -> SharedPlan:
    """The house with a position on earth, planned by beams."""
    return shared_plan("house_on_map")


@pytest.fixture(scope="session")
def box_plan(shared_plan: Callable[[str], SharedPlan]) -> SharedPlan:
    """One room with a position on earth."""
    return shared_plan("box")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of `make test-repeatedly`."""
    parser.addoption("--random-order", metavar="SEED", help="random order of groups and of the tests in each")


def pytest_make_parametrize_id(val: object) -> str | None:
    """Name cases by the beginning of long texts: names go to workers and reports, and a file may be a megabyte."""
    return repr(val[:40])[:60] if isinstance(val, str | bytes) and len(val) > 100 else None


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Iterator[None]:
    """In a new checkout one worker compiles all modules, which takes as long as all else here, and the others wait."""
    if "PYTEST_XDIST_WORKER" not in os.environ or any(Path(_FOLDER, "__pycache__").glob("test_*-pytest-*.pyc")):
        return (yield)
    shared: Path = session.config._tmp_path_factory.getbasetemp().parent  # type: ignore[attr-defined]
    with (shared / "compiling.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return (yield)


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep tests of a file on one worker, so that what they share is made once, not once a worker.

    A folder's conftest.py comes first, and may name a group for fixtures that its files share. Tests of campaigns are
    slow, too.
    """
    for item in items:
        if item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(str(item.path.relative_to(_FOLDER))))
        if item.get_closest_marker("campaign"):
            item.add_marker("slow")
    if seed := config.getoption("--random-order"):
        rng = random.Random(seed)
        rng.shuffle(items)
        position = {group: rng.random() for group in dict.fromkeys(map(_group, items))}
        items.sort(key=lambda item: position[_group(item)])


def _group(item: pytest.Item) -> str:
    marker = item.get_closest_marker("xdist_group")
    assert marker is not None
    return str(marker.args[0])


def pytest_collection_finish() -> None:
    """Leave modules and tests out of what the collector of cycles looks through: it would, thousands of times."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 10, 30)  # for fewer objects at a time, cycles took 3 % of the tests' time
    gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List the skipped tests, a line per reason; also in the file SKIPPED_TESTS, which make prints last."""
    files = defaultdict(list)
    for report in terminalreporter.getreports("skipped"):
        _, _, reason = report.longrepr
        files[reason.removeprefix("Skipped: ")].append(report.nodeid.partition("::")[0])
    lines = [f"{len(of)} skipped: {reason} ({', '.join(sorted(set(of)))})" for reason, of in sorted(files.items())]
    for line in lines:
        terminalreporter.write_line(line)
    if (path := os.environ.get("SKIPPED_TESTS")) and "PYTEST_XDIST_WORKER" not in os.environ:
        with Path(path).open("a", encoding="utf-8") as listed:
            listed.writelines(f"{line}\n" for line in lines)
