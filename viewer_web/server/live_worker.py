"""The live side of a server: its plan opened in the background, and one question to it answered at a time.

Opening loads the scene and prepares the scanner, which takes from a second to minutes: the server answers everything
else meanwhile. A `LivePlan` is not made for several threads, and its scans keep all cores busy: questions wait in turn.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from planner_core.errors import PlannerError
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import STAGE
from planner_core.progress import Progress, ProgressEvent

_Answer = TypeVar("_Answer")
#: Pages hear of progress at most this often.
_TELL_S = 0.5
#: A server that stops waits so long for the opening to end.
_STOP_S = 5.0
_THREAD = "live"


class NotReadyError(PlannerError):
    """The plan is not opened, or can't be: `str(error)` is a message for a user."""


class _StoppedError(Exception):
    """Raised from progress to end the opening."""


class LiveSide:
    """Opens a plan once, in a thread of its own, and holds it.

    Parameters
    ----------
    open_plan
        Called with a progress callback; `planner_core.planning.live.opening.open_live`, mostly.
    tell
        Gets the document of `state` whenever it changes; called from any thread.
    """

    def __init__(
        self, open_plan: Callable[[Progress], LivePlan], *, tell: Callable[[dict[str, Any]], None] = lambda _: None
    ) -> None:
        self._open_plan, self._tell = open_plan, tell
        self._plan: LivePlan | None = None
        self._state = _document("off", message="live editing was not started")
        self._asking = threading.Lock()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._reported_s = -_TELL_S
        self._n_done, self._n_steps, self._step = 0, 1, ""

    def start(self) -> None:
        """Begin to open the plan; returns at once."""
        self._set(_document("starting", step="", fraction=0.0))
        self._thread = threading.Thread(target=self._open, name=_THREAD, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the opening, at its next step, and let the plan go once the question under way is answered."""
        self._stopping.set()
        with self._asking:
            self._plan = None
            self._state = _document("off", message="the server stops")
        # Python ends badly under a thread that is inside a library, see `opening_goes_on`.
        self.wait(_STOP_S)

    def wait(self, timeout_s: float | None = None) -> None:
        """Wait until the plan is opened, or can't be."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def state(self) -> dict[str, Any]:
        """`state` (starting, ready, failed, off), `step` and `fraction` while starting, `message` if there is one."""
        return dict(self._state)

    def ask(self, question: Callable[[LivePlan], _Answer]) -> _Answer:
        """Answer a question as soon as those before it are.

        Raises
        ------
        NotReadyError
            The plan is not open.
        PlannerError
            As the question raises.
        """
        if self._plan is None:
            raise NotReadyError(_why_not(self._state))  # without waiting for anything
        with self._asking:
            if self._plan is None:
                raise NotReadyError(_why_not(self._state))
            return question(self._plan)

    def _open(self) -> None:
        try:
            plan = self._open_plan(self._show)
        except _StoppedError:
            return
        except PlannerError as error:
            self._set(_document("failed", message=str(error)))
        except BaseException as error:  # reported to the page here, and by Python to whoever reads the server's output
            self._set(_document("failed", message=f"live editing could not start ({type(error).__name__}: {error})"))
            raise
        else:
            with self._asking:
                if self._stopping.is_set():
                    return
                self._plan = plan
            self._set(_document("ready"))

    def _show(self, event: ProgressEvent) -> None:
        if self._stopping.is_set():
            raise _StoppedError
        within = 0.0
        if event.stage == STAGE:
            self._n_done, self._n_steps, self._step = event.done, max(event.total, 1), event.note
        elif event.total > 0:
            within = min(event.done / event.total, 1.0)
        fraction = min((self._n_done + within) / self._n_steps, 1.0)
        state = _document("starting", step=self._step, fraction=round(fraction, 3))
        now_s = time.monotonic()
        if event.stage == STAGE or now_s - self._reported_s >= _TELL_S:
            self._reported_s = now_s
            self._set(state)
        else:
            self._state = state

    def _set(self, state: dict[str, Any]) -> None:
        self._state = state
        self._tell(dict(state))


def opening_goes_on() -> bool:
    """Whether the opening of a plan outlived its server: it is inside a compiler, which takes no interrupts."""
    return any(thread.name == _THREAD for thread in threading.enumerate())


def _document(
    state: str, *, step: str | None = None, fraction: float | None = None, message: str | None = None
) -> dict[str, Any]:
    return {"state": state, "step": step, "fraction": fraction, "message": message}


def _why_not(state: dict[str, Any]) -> str:
    if state["state"] == "starting":
        return f"live editing is being prepared ({state['step'] or 'starting'}); try again in a moment"
    return f"live editing is not available: {state['message']}"
