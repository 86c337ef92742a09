"""The row and the column of the picture through one pixel: under the pointer, or frozen."""

from __future__ import annotations

from dataclasses import dataclass
from io import StringIO
from os import PathLike
from typing import Any, Literal
from weakref import WeakValueDictionary

import astropy.units as u
import numpy as np
from astropy.table import QTable
from napari.utils.events import EmitterGroup, Event
from numpy.typing import NDArray
from superqt.utils import qthrottled

from ..safe_write import replacing
from .scene import Scene

Along = Literal["row", "column"]
ENDINGS = (".ecsv",)
# The pointer is looked at no more often than this, ms.
INTERVAL = 33

# The traces of each scene, kept alive by the widgets that show them.
_TRACES: WeakValueDictionary[int, Traces] = WeakValueDictionary()


@dataclass(frozen=True)
class Trace:
    """Counts and expected counts along one row or column.

    Attributes
    ----------
    along : {"row", "column"}
        What is traced.
    index : int
        Which row or column.
    position : int
        The pixel along it on which the pointer is (or was, when it was frozen).
    counts, expected : ndarray
        Counts and expected counts of its pixels.
    background : float
        Expected counts of the sky.
    """

    along: Along
    index: int
    position: int
    counts: NDArray[np.int64]
    expected: NDArray[np.float64]
    background: float


class Traces:
    """What the trace plots of a scene show.

    Got by `traces_of`. Follows pointer and pictures while a plot is in sight.

    Parameters
    ----------
    scene : Scene
        The live scene.

    Attributes
    ----------
    events : napari.utils.events.EmitterGroup
        ``changed`` when the plots have to be drawn anew, ``frozen`` and ``watched`` when the
        traces were frozen or freed, and when a plot came in sight or went out of it.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.events = EmitterGroup(source=self, changed=Event, frozen=Event, watched=Event)
        self._pixel: tuple[int, int] | None = None
        self._frozen = False
        self._watchers = 0
        scene.counts.events.scale.connect(self._scale_changed)
        _TRACES[id(scene)] = self

    @property
    def pixel(self) -> tuple[int, int]:
        """Row and column of the pixel through which the traces run; can be set.

        The middle of the frame until the pointer comes to it; always within the frame.
        """
        ny, nx = self._shape
        row, column = self._pixel or (ny // 2, nx // 2)
        return min(max(row, 0), ny - 1), min(max(column, 0), nx - 1)

    @pixel.setter
    def pixel(self, pixel: tuple[int, int]) -> None:
        row, column = pixel
        if (int(row), int(column)) != self._pixel:
            self._pixel = int(row), int(column)
            self.events.changed()

    @property
    def frozen(self) -> bool:
        """Whether the traces stay on their pixel wherever the pointer goes; can be set.

        They follow the picture all the same.
        """
        return self._frozen

    @frozen.setter
    def frozen(self, frozen: bool) -> None:
        if bool(frozen) != self._frozen:
            self._frozen = bool(frozen)
            self.events.frozen()
            self.events.changed()
            self._look()

    @property
    def scale(self) -> str:
        """Brightness scale of the plots, that of the image."""
        return self.scene.counts.scale

    def _scale_changed(self, event: Any = None) -> None:
        self.events.changed()

    def trace(self, along: Along) -> Trace | None:
        """Return the trace as it is on the screen now; None before the first picture."""
        picture = self.scene.picture
        if picture is None:
            return None
        exposure = picture.exposure
        row, column = self.pixel
        if along == "row":
            where: Any = (row, slice(None))
            index, position = row, column
        else:
            where = (slice(None), column)
            index, position = column, row
        return Trace(
            along,
            index,
            position,
            exposure.counts[where],
            exposure.expected[where],
            exposure.background,
        )

    def table(self, along: Along) -> QTable:
        """Return a trace as a table: position, counts, expected counts.

        Its metadata say which row or column of what observation it is.

        Raises
        ------
        ValueError
            If there is no picture yet.
        """
        trace = self.trace(along)
        picture = self.scene.picture
        if trace is None or picture is None:
            raise ValueError("there is no picture yet; add a source first.")
        observation = picture.exposure.observation
        table = QTable()
        table["position"] = u.Quantity(np.arange(trace.counts.size), u.pix, dtype=np.int64)
        table["counts"] = u.Quantity(trace.counts, u.ct, dtype=np.int64)
        table["expected"] = trace.expected * u.ct
        table.meta.update(
            {
                along: trace.index,
                "instrument": observation.instrument.name,
                "channel": observation.channel,
                "filters": list(observation.filter_names),
                "exposure": observation.exposure * u.s,
                "background": trace.background * u.ct,
                "pixel_scale": observation.pixel_scale * u.arcsec / u.pix,
                "frame": list(picture.exposure.counts.shape),
                "seed": picture.exposure.seed,
            }
        )
        return table

    def save(self, along: Along, path: str | PathLike[str], *, overwrite: bool = False) -> None:
        """Write a trace to an ECSV file.

        Parameters
        ----------
        along : {"row", "column"}
            Which trace.
        path : path-like
            The file; its name ends in ``.ecsv``.
        overwrite : bool
            Whether an existing file may be replaced.

        Raises
        ------
        ValueError
            If there is no picture yet, or the name has another ending.
        OSError
            If the file cannot be written, `FileExistsError` if it exists already.
        """
        text = StringIO()
        self.table(along).write(text, format="ascii.ecsv")
        with replacing(path, ENDINGS, overwrite=overwrite) as file:
            file.write(text.getvalue().encode())

    # ---------------------------------------------------------------- following the viewer

    @property
    def watched(self) -> bool:
        """Whether a plot is in sight."""
        return self._watchers > 0

    def watch(self) -> None:
        """Follow pointer and pictures: a plot came in sight."""
        self._watchers += 1
        if self._watchers == 1:
            self.scene.viewer.cursor.events.position.connect(self._pointer_moved)
            self.scene.events.shown.connect(self._picture_shown)
        self.events.watched()

    def unwatch(self) -> None:
        """Undo `watch`; without plots in sight nothing is followed."""
        self._watchers -= 1
        if self._watchers == 0:
            self.scene.viewer.cursor.events.position.disconnect(self._pointer_moved)
            self.scene.events.shown.disconnect(self._picture_shown)
        self.events.watched()

    def _pointer_moved(self, event: Any = None) -> None:
        self._look()

    def _picture_shown(self, event: Any = None) -> None:
        self.events.changed()

    @qthrottled(timeout=INTERVAL)  # type: ignore[untyped-decorator]
    def _look(self) -> None:
        """Take the pixel under the pointer, if it is one of the frame."""
        layer = self.scene.counts.layer
        if self._frozen or layer is None or not self.watched:
            return
        row, column = (round(float(v)) for v in layer.world_to_data(self._pointer)[-2:])
        ny, nx = self._shape
        if 0 <= row < ny and 0 <= column < nx:
            self.pixel = (row, column)

    @property
    def _pointer(self) -> tuple[float, ...]:
        position: tuple[float, ...] = self.scene.viewer.cursor.position
        return position

    @property
    def _shape(self) -> tuple[int, int]:
        picture = self.scene.picture
        return self.scene.observation.shape if picture is None else picture.exposure.counts.shape


def traces_of(scene: Scene) -> Traces:
    """Return the traces of a scene; made if it has none."""
    traces = _TRACES.get(id(scene))
    if traces is None or traces.scene is not scene:
        traces = Traces(scene)
    return traces
