"""The image layer with the counts of the final image."""

from __future__ import annotations

from typing import Any

import numpy as np
from napari.layers import Image
from napari.utils.colormaps import Colormap, ensure_colormap
from napari.utils.events import EmitterGroup, Event
from numpy.typing import NDArray

from ..exposure import Exposure
from . import layer_styles as styles
from .brightness import SCALES, scaled_colormap
from .contrast import contrast_limits, symmetric_limits
from .marks import MARKER
from .picture import Picture

# What the layer can show.
SHOWN = ("counts", "expected", "difference")


class CountsLayer:
    """Shows pictures on an Image layer, with limits that hold still while a source moves.

    Attributes
    ----------
    layer : napari.layers.Image or None
        None where the user deleted it.
    events : napari.utils.events.EmitterGroup
        ``scale`` after a change of the brightness scale.
    """

    def __init__(self) -> None:
        self.events = EmitterGroup(source=self, scale=Event)
        self._layer: Image | None = None
        self._picture: Picture | None = None
        self._limits: tuple[float, ...] | None = None
        self._rescale = True
        self._always = True
        self._scale = styles.SCALE
        self._shows = "counts"
        self._base: Colormap = ensure_colormap(styles.COUNTS["colormap"])
        self._coloring = False

    @property
    def layer(self) -> Image | None:
        """The layer; can be set."""
        return self._layer

    @layer.setter
    def layer(self, layer: Image | None) -> None:
        self._layer = layer
        if layer is not None:
            layer.events.contrast_limits.connect(self._color)
            layer.events.colormap.connect(self._colormap_chosen)
            self._color()

    @property
    def scale(self) -> str:
        """Brightness scale, one of `SCALES`; can be set."""
        return self._scale

    @scale.setter
    def scale(self, scale: str) -> None:
        if scale not in SCALES:
            raise ValueError(f"scale is {scale!r}; known: {', '.join(SCALES)}.")
        if scale != self._scale:
            self._scale = scale
            self.set_limits(None)
            self.events.scale()

    @property
    def shows(self) -> str:
        """What the layer holds: counts, expected counts or their difference; can be set."""
        return self._shows

    @shows.setter
    def shows(self, what: str) -> None:
        if what not in SHOWN:
            raise ValueError(f"what is shown is {what!r}; known: {', '.join(SHOWN)}.")
        if what != self._shows:
            self._shows = what
            if self._layer is not None and self._picture is not None:
                self._layer.data = self._data(self._picture.exposure)
            self.set_limits(None)

    @property
    def effective_scale(self) -> str:
        """The scale in use: a difference has no other than the linear one."""
        return "linear" if self._shows == "difference" else self._scale

    @property
    def base_colormap(self) -> Colormap:
        """The colours, from dark to bright, whatever the scale."""
        return self._base

    @property
    def background(self) -> float:
        """Expected sky counts per pixel of what is shown."""
        return 0.0 if self._picture is None else self._picture.exposure.background

    @property
    def limits(self) -> tuple[float, float]:
        """Counts that are black and white."""
        if self._layer is None:
            return 0.0, 1.0
        low, high = self._layer.contrast_limits
        return float(low), float(high)

    def make(self, shape: tuple[int, int], pixel_scale: float, picture: Picture | None) -> Image:
        """Create the layer, with the last picture if there is one."""
        self._picture = picture
        mark: dict[str, Any] = {"role": "counts"}
        data: NDArray[Any] = np.zeros(shape, np.int64)
        if picture is not None:
            mark["exposure"] = picture.exposure
            data = self._data(picture.exposure)
        layer = Image(
            data,
            contrast_limits=self._limits or (0, 1),
            metadata={MARKER: mark},
            scale=(pixel_scale, pixel_scale),
            **styles.COUNTS,
        )
        frame = layer.bounding_box
        frame.visible, frame.points, frame.line_color = True, False, styles.FRAME_COLOR
        self.layer = layer
        if picture is not None:
            self.set_limits(None)
            self._rescale = self._always = False
        return layer

    def rescale(self, *, always: bool = False) -> None:
        """Let the next final picture set the limits; ``always`` even if they were set by hand."""
        self._rescale = True
        self._always = self._always or always

    def show(self, picture: Picture) -> None:
        """Show a picture, or keep it for a layer that comes back."""
        self._picture = picture
        if self._layer is None:
            return
        exposure = picture.exposure
        self._layer.data = self._data(exposure)
        if not picture.final:
            return
        mark = {"role": "counts", "exposure": exposure}
        self._layer.metadata = {**self._layer.metadata, MARKER: mark}
        by_hand = self._limits is not None and tuple(self._layer.contrast_limits) != self._limits
        if self._rescale and (self._always or not by_hand):
            self.set_limits(None)
        self._rescale = self._always = False

    def set_limits(self, limits: tuple[float, float] | None) -> None:
        """Set the counts that are black and white; None chooses them by what is shown.

        Raises
        ------
        ValueError
            If the lower limit is not below the upper one.
        """
        if self._layer is None or self._picture is None:
            return
        exposure = self._picture.exposure
        chosen = limits
        if chosen is None:
            data = self._data(exposure)
            if self._shows == "difference":
                chosen = symmetric_limits(data)
            else:
                chosen = contrast_limits(data, exposure.background, self._scale)
        low, high = chosen
        if not low < high:
            raise ValueError(f"limits are {low:g}, {high:g}; the lower must be below the upper.")
        least, most = float(self._layer.data.min()), float(self._layer.data.max())
        self._layer.contrast_limits_range = (min(least, low, 0.0), max(most, high))
        self._layer.contrast_limits = (low, high)
        if limits is None:
            self._limits = tuple(self._layer.contrast_limits)
        self._color()

    def _data(self, exposure: Exposure) -> NDArray[Any]:
        if self._shows == "expected":
            return exposure.expected
        if self._shows == "difference":
            return exposure.counts - exposure.expected
        return exposure.counts

    def _colormap_chosen(self, event: Any = None) -> None:
        """Draw the scale in the colours that the user chose."""
        if not self._coloring and self._layer is not None:
            self._base = self._layer.colormap
            self._color()

    def _color(self, event: Any = None) -> None:
        if self._layer is None or self._coloring:
            return
        self._coloring = True
        try:
            colormap, gamma = scaled_colormap(
                self._base, self.effective_scale, self.limits, self.background
            )
            self._layer.colormap, self._layer.gamma = colormap, gamma
        finally:
            self._coloring = False
