"""The picture of a scene, made in the background after each change: the newest request wins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from astropy.table import QTable
from napari.utils.notifications import show_error
from numpy.typing import NDArray

from ..observation import Observation
from .latest_wins import LatestWins
from .picture import HeldSources, Picture, PictureMaker
from .single_shot import single_shot

# A drag that rests for so long (ms) is shown as it will be when it ends.
PAUSE = 200
# A picture that is not there after so long (ms) is slow.
SLOW = 300


@dataclass(frozen=True, eq=False)
class SceneNow:
    """A scene as it is now.

    ``version`` is another one after each change, ``held`` what the mouse holds; ``source_id``
    has the ids of the sources by row.
    """

    version: tuple[int, int]
    sources: QTable
    source_id: NDArray[np.int64]
    observation: Observation
    seed: int
    held: HeldSources | None


class LivePicture:
    """Keeps a picture in step with a scene.

    Parameters
    ----------
    now : callable
        Returns the `SceneNow`.
    wanted : callable
        Returns whether there is anything to show a picture on.
    show : callable
        Gets each new picture and the one before it.
    progressed : callable
        Called after a change of `slow` or `cancelled`.
    """

    def __init__(
        self,
        now: Callable[[], SceneNow],
        wanted: Callable[[], bool],
        show: Callable[[Picture, Picture | None], None],
        progressed: Callable[[], None],
    ) -> None:
        self._now, self._wanted, self._show, self._progressed = now, wanted, show, progressed
        self.picture: Picture | None = None
        self._error: BaseException | None = None
        self._maker = PictureMaker()
        self._jobs = LatestWins(self._arrived, self._failed)
        # version, and whether the picture is to stay
        self._requested: tuple[Any, bool] = (None, False)
        self._shown: tuple[Any, bool] = (None, False)
        self._cancelled: Any = None
        self._pause = single_shot(self._request_final, PAUSE)
        self._patience = single_shot(self._be_slow, SLOW)
        self.slow = False

    @property
    def settled(self) -> bool:
        """Whether the picture is that of the scene as it is now, and no preview."""
        return self._shown == (self._now().version, True)

    @property
    def cancelled(self) -> bool:
        """Whether the picture of the scene as it is now was cancelled."""
        return self._cancelled is not None and bool(self._cancelled == self._now().version)

    @property
    def error(self) -> BaseException | None:
        """Why the newest picture could not be made, if no other is on its way."""
        return None if self._jobs.busy else self._error

    def follow(self) -> None:
        """Make what the scene asks for now; cheap if nothing changed."""
        now = self._now()
        if now.held is None:
            self._pause.stop()
            self._request_final()
        elif self._requested[0] != now.version:
            self._pause.stop()
            self._request_preview(now, now.held)

    def drop(self) -> None:
        """Forget what waits to be made."""
        self._jobs.drop()

    def cancel(self) -> None:
        """Keep the picture that is shown until the next change."""
        if self._jobs.busy:
            self._jobs.cancel()
            self._cancelled, self._requested = self._now().version, (None, False)
            self._watch()

    def resume(self) -> None:
        """Take back `cancel`."""
        self._cancelled = None
        self._progressed()

    def _request_final(self) -> None:
        now = self._now()
        ticket = (now.version, True)
        asked = self._requested == ticket
        if self.cancelled or (
            asked and (self._jobs.busy or self._shown == ticket or self._error is not None)
        ):
            return
        maker = self._maker
        self._request(ticket, lambda: maker.final(now.sources, now.observation, now.seed))

    def _request_preview(self, now: SceneNow, held: HeldSources) -> None:
        maker = self._maker

        def job() -> Picture:
            return maker.preview(held, now.sources, now.source_id, now.observation, now.seed)

        self._request((now.version, False), job)

    def _request(self, ticket: Any, job: Callable[[], Picture]) -> None:
        self._requested, self._error = ticket, None
        if self._cancelled is not None:
            self.resume()
        self._jobs.request(lambda: (ticket, job()))
        if not self.slow and not self._patience.isActive():
            self._patience.start()

    def _be_slow(self) -> None:
        if self._jobs.busy and not self.cancelled:
            self.slow = True
            self._progressed()

    def _watch(self) -> None:
        """Begin to wait for the next picture, if there is to be one."""
        if self._jobs.busy and not self.cancelled:
            self._patience.start()
        else:
            self._patience.stop()
        if self.slow or self.cancelled:
            self.slow = False
            self._progressed()

    def _arrived(self, result: tuple[Any, Picture]) -> None:
        self._watch()
        if not self._wanted():
            return
        self._shown, picture = result
        previous, self.picture = self.picture, picture
        self._show(picture, previous)
        if not picture.final and self._shown[0] == self._now().version:
            # The mouse rests: when it does so for long, show what the drag would end with.
            self._pause.start()

    def _failed(self, error: BaseException) -> None:
        # The last good picture stays.
        self._watch()
        self._error = error
        show_error(f"The scene could not be simulated: {error}")
