"""What only POSIX systems have is in one module: elsewhere Windows would fail on import, or in the middle of a plan."""

import ast
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
THE_PLACE = Path("planner_core/operating_system.py")
SHIPPED = (
    "planner_core",
    "cli",
    "docs/reproduction/paper_figures",
    "docs/tlsplib/tlsplib",
    "scenes_synthetic",
    "viewer_web/server",
    "viewer_web",
)
MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
#: What CPython's documentation marks "Availability: Unix", as far as anybody might use it.
OS = """
O_CLOEXEC O_DIRECTORY O_NOCTTY O_NOFOLLOW O_NONBLOCK O_PATH O_SYNC O_TMPFILE WEXITSTATUS WIFEXITED WIFSIGNALED WNOHANG
WTERMSIG chown chroot confstr fchdir fchmod fchown fork forkpty getegid geteuid getgid getgroups getloadavg getpgid
getpgrp getpriority getresuid getsid getuid initgroups killpg lchown lockf memfd_create mkfifo mknod nice openpty
pipe2 posix_fallocate posix_spawn pread preadv pwrite pwritev readv register_at_fork sched_getaffinity
sched_setaffinity sched_yield sendfile setegid seteuid setgid setpgid setpriority setsid setuid statvfs sync sysconf
tcgetpgrp ttyname uname wait wait3 wait4 writev
"""
SIGNAL = """
ITIMER_PROF ITIMER_REAL ITIMER_VIRTUAL SIGALRM SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGTTIN
SIGTTOU SIGUSR1 SIGUSR2 SIGWINCH SIG_BLOCK alarm getitimer pause pthread_kill pthread_sigmask setitimer siginterrupt
sigpending sigtimedwait sigwait sigwaitinfo
"""
ATTRIBUTES = {
    "os": set(OS.split()),
    "signal": set(SIGNAL.split()),
    "socket": {"AF_UNIX", "SO_REUSEPORT", "socketpair"},
    "time": {"clock_gettime", "clock_settime", "tzset"},
}
KEYWORDS = {"dir_fd", "pass_fds", "preexec_fn", "process_group", "start_new_session"}
#: Methods that raise on Windows, of any object.
METHODS = {"add_signal_handler", "is_mount"}


def shipped_modules() -> list[Path]:
    return sorted(
        {path for part in SHIPPED for path in (ROOT / part).glob("*.py" if part == "viewer_web" else "**/*.py")}
    )


def posix_only(source: str) -> Iterator[str]:
    """What is used in a module that Windows lacks, with the line."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = {alias.name for alias in node.names} & MODULES
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            names = {module} & MODULES | {alias.name for alias in node.names} & ATTRIBUTES.get(module, set())
        elif isinstance(node, ast.Attribute):
            of = node.value.id if isinstance(node.value, ast.Name) else ""
            names = {node.attr} & (ATTRIBUTES.get(of, set()) | METHODS)
        elif isinstance(node, ast.keyword):
            names = {node.arg or ""} & KEYWORDS
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names = {"/proc"} if node.value == "/proc" or node.value.startswith("/proc/") else set()
        else:
            continue
        yield from (f"{getattr(node, 'lineno', 0)}: {name}" for name in sorted(names))


@pytest.mark.slow
def test_what_windows_lacks_is_used_in_one_place() -> None:
    assert (ROOT / THE_PLACE) in shipped_modules()
    elsewhere = [
        f"{path.relative_to(ROOT)}:{found}"
        for path in shipped_modules()
        if path.relative_to(ROOT) != THE_PLACE
        for found in posix_only(path.read_text(encoding="utf-8"))
    ]
    assert elsewhere == []


@pytest.mark.parametrize(
    "source",
    [
        "import fcntl",
        "from os import fork",
        "import os; os.getuid()",
        "import signal; signal.SIGALRM",
        "f(pass_fds=())",
        "open('/proc/meminfo')",
        "from pwd import getpwuid",
        "path.is_mount()",
    ],
)
def test_it_is_found(source: str) -> None:
    assert list(posix_only(source))


def test_names_looked_for_are_names_that_python_has() -> None:
    # Those of other systems than Linux are missing here; a slip of the pen would be missing everywhere.
    assert {name for name in ATTRIBUTES["os"] if not hasattr(os, name)} == set()
    assert {name for name in ATTRIBUTES["signal"] if not hasattr(signal, name)} == set()
