"""Every error the library raises on purpose: one root, each also the builtin it refines.

A message has, in one line: what, got, expected, remedy. The command line prints it as it is: what it quotes of files
and names is made fit for a terminal here, once for all messages.
"""

import errno
import unicodedata
from collections.abc import Callable

LONGEST_LINE = 600
"""Characters of a message. What is longer quotes too much, and loses its middle."""
_CUT = " ... "
_HEAD = 400
_LONGEST_REASON = 300

_KEPT = "\n\t\u200c\u200d"  # the joiners of Persian and Indian scripts among them


def escaped(text: str, spell: Callable[[str], str] | None = None) -> str:
    """`text` as any terminal and encoding can show it: other characters than those of text are spelt, as `\\x1b`.

    These are: control characters, which command terminals; those that turn or break lines; halves of surrogate pairs,
    which stand for bytes of file names that are no UTF-8; marks of byte order and blanks of no width, which nobody
    sees; and numbers that are no character. spell : another spelling of one.
    """
    if text.isprintable():
        return text
    return "".join(sign if _is_shown(sign) else (spell or _spelt)(sign) for sign in text)


def one_line(text: str) -> str:
    """`text` as a line of a message: escaped, without line ends, and not too long."""
    line = " ".join(escaped(" ".join(text.split())).split())
    if len(line) <= LONGEST_LINE:
        return line
    return line[:_HEAD] + _CUT + line[_HEAD + len(_CUT) - LONGEST_LINE :]


def grouped(number: int) -> str:
    """`41022` as `41 022`."""
    return f"{number:,}".replace(",", " ")


def readable(text: str) -> str:
    """`text` with halves of surrogate pairs replaced by U+FFFD: files may hold them, and no encoding can write them."""
    return text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")


def is_text(name: str) -> bool:
    """A name of a file can be written as UTF-8: those of other times and systems may be any bytes."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def reason_of(error: Exception) -> str:
    """A library's message on a file, fit for a message."""
    return shortened(str(error)) or type(error).__name__


def shortened(text: str) -> str:
    """`one_line` of a text that a library made, no longer than a user reads."""
    line = one_line(text)
    return line if len(line) <= _LONGEST_REASON else f"{line[:_LONGEST_REASON]}..."


def _is_shown(sign: str) -> bool:
    return sign.isprintable() or sign in _KEPT or unicodedata.category(sign) == "Zs"


def _spelt(sign: str) -> str:
    of_byte = "\udc80" <= sign <= "\udcff"  # as Python reads a file name's byte that is no UTF-8
    return f"\\x{ord(sign) - 0xDC00:02x}" if of_byte else sign.encode("unicode_escape").decode("ascii")


_TAKES_NO_MORE = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG))


def is_of_full_disk(error: BaseException | None) -> bool:
    """Whether an error, or one that it was raised from, is of a disk that takes no more: full, or its quota used up.

    By the system's number: its words are in the language of the process that met it, which may be another machine's.
    """
    while error is not None:
        if isinstance(error, OSError) and error.errno in _TAKES_NO_MORE:
            return True
        error = error.__cause__
    return False


class PlannerError(Exception):
    """Root of all errors raised on purpose. `str(error)` is one line fit for a user."""

    def __str__(self) -> str:
        return one_line(super().__str__())


class SceneError(PlannerError, ValueError):
    """A scene file can't be used: wrong type, truncated, empty, no triangles, bad indices."""


class SceneNotFoundError(SceneError, FileNotFoundError):
    """The scene file does not exist or can't be read."""


class RequirementError(PlannerError, ValueError):
    """A requirement or option can't be met or makes no sense: bad coverage, unknown scanner or floor."""


class EnvironmentVariableError(RequirementError):
    """An environment variable has a value that makes no sense."""


class StationListError(PlannerError, ValueError):
    """A given station list (CSV or plan.json) can't be read."""


class PlanFolderError(PlannerError, ValueError):
    """A plan folder can't be read, or is not one."""


class ReviewError(PlannerError, ValueError):
    """A change of a review makes no sense: no such station, an outline that crosses itself, too long a text."""


class OutputExistsError(PlannerError, FileExistsError):
    """The output exists and overwriting was not allowed."""


class DeviceError(PlannerError, RuntimeError):
    """No OpenCL device, a program that does not build, memory exhausted, device lost."""


class DeviceMemoryError(DeviceError, MemoryError):
    """The device's memory does not suffice, by our own count or the driver's: less work at a time may do."""


class ClusterError(PlannerError, RuntimeError):
    """A cluster can't be used: no scheduler, no worker that does as this machine does."""


class MissingPackageError(PlannerError, ImportError):
    """An optional package or system library is missing; the message names how to get it."""


class CoordinatesError(PlannerError, ValueError):
    """The site's coordinates can't be made out: unknown CRS, control points that fix nothing, a bad number."""


class ExportError(PlannerError, ValueError):
    """A plan can't be exported to a format: a missing scene, something that the format can't hold, a full disk."""


class CrsNeededError(ExportError):
    """A format holds longitude and latitude, and the plan's coordinates have no CRS: a pack goes without it."""
