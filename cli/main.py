"""Where the command begins and ends: a Ctrl-C of any moment, and every error, is one line and a documented exit code.

Nothing but this is imported before signals are heeded: click and the commands take a tenth of a second or more.
"""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False  # so that not even `typing` is imported
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import NoReturn

_INTERRUPTED = "tlsplan: interrupted; nothing was left half-written. Run the same command to start again."
_INTERRUPTED_CODE = 130


def main() -> None:
    """Run the command line; every error ends in one line on standard error and a documented exit code."""
    _take_signals(_leave)
    _speak_utf8()
    debug = "--debug" in sys.argv[1:2]
    import click

    from planner_core.errors import one_line

    from .environment import is_interrupted, leave_at_once, prepare, raise_what_waits
    from .exit_codes import exit_code_of, line_of
    from .group import cli

    stdout = sys.stdout
    try:
        prepare(debug=debug)  # from here on an interrupt ends the work in good order
        try:
            _check_arguments()
            code = cli.main(standalone_mode=False)
        except Exception:
            if is_interrupted():
                raise KeyboardInterrupt from None
            raise
        finally:
            raise_what_waits()
    except click.exceptions.Exit as stop:
        code = stop.exit_code
    except click.UsageError as error:
        path = error.ctx.command_path if error.ctx is not None else "tlsplan"
        message = error.format_message()
        end = "" if message.endswith((".", "?")) else "."
        click.echo(one_line(f"tlsplan: {message}{end} See `{path} --help`."), err=True)
        code = error.exit_code
    except click.ClickException as error:
        click.echo(one_line(f"tlsplan: {error.format_message()}"), err=True)
        code = error.exit_code
    except (KeyboardInterrupt, click.exceptions.Abort):
        _take_signals(signal.SIG_IGN)  # pressed twice, it is reported once
        click.echo(_INTERRUPTED, err=True)
        code = _INTERRUPTED_CODE
    except (BrokenPipeError, SystemExit) as error:
        # click makes the other one of a broken pipe, and puts another stream in its place.
        code = error.code if isinstance(error, SystemExit) and sys.stdout is stdout else _nobody_reads()
    except Exception as error:  # the last resort of the program: every other place lets exceptions through
        if debug:
            raise
        click.echo(line_of(error), err=True)
        code = exit_code_of(error)
    status = code if isinstance(code, int) else 0
    # An interrupt that leaves an `exec` of text (dataclasses and compilers have these) is remembered even where it is
    # caught: `python -m` would end by the signal and not by the status. The next `exec` forgets it.
    exec("")
    _take_signals(lambda *_: leave_at_once(status))  # all is done: Python's own way out is what is left to interrupt
    sys.exit(status)


def _nobody_reads() -> int:
    """Return the code where the reader of a pipe (`... | head`) went away: no error, and nobody left to tell."""
    nobody = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nobody, 1)
    os.dup2(nobody, 2)
    return 0


def _speak_utf8() -> None:
    """Begin again where the locale has another encoding: names of files would be others in USD and OpenCL libraries."""
    if sys.getfilesystemencoding() == "utf-8" or os.environ.get("PYTHONUTF8") == "1":
        return
    os.environ["PYTHONUTF8"] = "1"
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def _check_arguments() -> None:
    """Refuse names that plans can't hold before hours of work: neither JSON nor USD can write what is no Unicode."""
    for argument in sys.argv[1:]:
        try:
            argument.encode()
        except UnicodeEncodeError:
            from planner_core.errors import SceneError

            raise SceneError(
                f"got the name {argument}, expected one in UTF-8, which plans and other programs can hold; rename the "
                "file or folder"
            ) from None


def _take_signals(handler: Callable[[int, FrameType | None], NoReturn] | signal.Handlers) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)


def _leave(number: int, frame: FrameType | None) -> NoReturn:
    """End at once, by one line: nothing has begun, and an exception might be lost inside what is being imported."""
    try:  # noqa: SIM105 (no import in here: one is being interrupted)
        os.write(2, f"{_INTERRUPTED}\n".encode())
    except OSError:  # standard error is closed: nobody to tell
        pass
    os._exit(_INTERRUPTED_CODE)
