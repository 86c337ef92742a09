"""The frames of a stack, computed in the background when napari asks for them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
from napari.utils.notifications import show_error
from numpy.typing import NDArray

from .latest_wins import LatestWins

# Bytes of frames that are kept.
MOST_BYTES = 512e6
# Frames that are computed ahead of the one that was asked for.
AHEAD = 6


class Frames:
    """A stack that napari can show without waiting: frames that are not there yet are zeros.

    Each that is asked for is computed in a thread, the newest first, and then those that
    follow it. What napari sees of it is an array of shape (n, ny, nx).

    Parameters
    ----------
    shape : (int, int, int)
        Of the stack, (n, ny, nx).
    dtype : dtype
        Of its numbers.
    make : callable
        Makes the stack, a dask array of one chunk a frame; called in the thread, once.
    arrived : callable
        Called in the GUI's thread with each frame that was shown as zeros and is there now.
    """

    def __init__(
        self,
        shape: tuple[int, int, int],
        dtype: Any,
        make: Callable[[], Any],
        arrived: Callable[[NDArray[Any]], None],
    ) -> None:
        self.shape, self.dtype, self.ndim = shape, np.dtype(dtype), len(shape)
        self._stack, self._arrived = cache(make), arrived
        self._blank = np.zeros(self.shape[1:], self.dtype)
        self._kept: dict[int, NDArray[Any]] = {}
        self._missed: set[int] = set()
        self._ahead: list[int] = []
        self._jobs = LatestWins(self._keep, self._failed)
        self._most = max(int(MOST_BYTES // max(self._blank.nbytes, 1)), AHEAD + 1)

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Compute all frames, for whoever saves them."""
        return np.asarray(self._stack().compute(), dtype=dtype)

    def __getitem__(self, key: Any) -> NDArray[Any]:
        first, *rest = key if isinstance(key, tuple) else (key,)
        wanted = np.arange(len(self))[first]
        if wanted.ndim == 0:
            frame: NDArray[Any] = self._frame(int(wanted))[tuple(rest)]
            self._prepare_after(int(wanted))
            return frame
        # Of more than may be kept, the first: the others would drive each other out for ever.
        seen = [self._frame(int(index)) for index in wanted[: self._most]]
        if len(wanted) == 1:
            self._prepare_after(int(wanted[0]))
        frames = np.stack(seen + [self._blank] * (len(wanted) - len(seen)))
        return frames[(slice(None), *rest)]

    @property
    def busy(self) -> bool:
        """Whether a frame is computed."""
        return self._jobs.busy

    def stop(self) -> None:
        """Compute nothing more, but for what is being computed."""
        self._ahead.clear()
        self._jobs.cancel()

    def _frame(self, index: int) -> NDArray[Any]:
        if index in self._kept:
            # asked for last, dropped last
            self._kept[index] = self._kept.pop(index)
            return self._kept[index]
        self._missed.add(index)
        self._request(index)
        return self._blank

    def _prepare_after(self, index: int) -> None:
        self._ahead = list(range(index + 1, min(index + 1 + AHEAD, len(self))))
        self._follow()

    def _follow(self) -> None:
        while self._ahead and not self._jobs.busy:
            following = self._ahead.pop(0)
            if following not in self._kept:
                self._request(following)

    def _request(self, index: int) -> None:
        self._jobs.request(partial(self._compute, index))

    def _compute(self, index: int) -> tuple[int, NDArray[Any]]:
        # asked for again while it was computed
        frame = self._kept.get(index)
        return index, np.asarray(self._stack()[index].compute()) if frame is None else frame

    def _keep(self, result: tuple[int, NDArray[Any]]) -> None:
        index, frame = result
        self._kept[index] = frame
        while len(self._kept) > self._most:
            del self._kept[next(iter(self._kept))]
        if index in self._missed:
            # the others were passed by, and are asked for again where they are seen
            self._missed.clear()
            self._arrived(frame)
        self._follow()

    def _failed(self, error: BaseException) -> None:
        self._ahead.clear()
        show_error(f"A frame could not be computed: {error}")
