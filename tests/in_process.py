"""The command line run in this process: its own would spend most of their time on imports and full-size pictures."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import pytest
from small_pictures import draw_blank, draw_small
from tlsplan import environment
from tlsplan.main import main

Tlsplan = Callable[..., "subprocess.CompletedProcess[str]"]


def run_here(
    *arguments: str | Path, env: dict[str, str] | None = None, draws: bool = False
) -> subprocess.CompletedProcess[str]:
    """Run `tlsplan` with arguments (and `env`) as a process would; blank pictures in reports unless `draws`."""
    words = ["tlsplan", *map(str, arguments)]
    with (
        pytest.MonkeyPatch.context() as patch,
        signals_and_warnings_kept(),
        TemporaryFile() as out,
        TemporaryFile() as err,
    ):
        (draw_small if draws else draw_blank)(patch)
        patch.setattr(sys, "argv", words)
        for name, value in (env or {}).items():
            patch.setenv(name, value)
        with sent_to(out, "stdout", 1), sent_to(err, "stderr", 2), pytest.raises(SystemExit) as end:
            main()
        said = [read(stream) for stream in (out, err)]
    code = end.value.code
    assert isinstance(code, int)
    return subprocess.CompletedProcess(words, code, *said)


@contextmanager
def signals_and_warnings_kept() -> Iterator[None]:
    """The program sets handlers and filters, and notes an interrupt, for good: its process is its own."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    with warnings.catch_warnings(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "unraisablehook", sys.unraisablehook)
        patch.setattr(environment, "_interrupted", False)
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


@contextmanager
def sent_to(file: IO[bytes], name: str, descriptor: int) -> Iterator[None]:
    """Let a standard stream end in `file`: what Python writes, and what compiled packages write past it."""
    stream = getattr(sys, name)
    stream.flush()
    kept = os.dup(descriptor)
    os.dup2(file.fileno(), descriptor)
    setattr(sys, name, TextIOWrapper(os.fdopen(os.dup(descriptor), "wb"), encoding="utf-8", line_buffering=True))
    try:
        yield
    finally:
        getattr(sys, name).close()
        setattr(sys, name, stream)
        os.dup2(kept, descriptor)
        os.close(kept)


def read(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode()
