"""The image layer with the counts of the final image."""

from __future__ import annotations

from typing import Any

import numpy as np
from napari.layers import Image

from . import layer_styles as styles
from .contrast import contrast_limits
from .marks import MARKER
from .picture import Picture


class CountsLayer:
    """Shows pictures on an Image layer, with limits that hold still while a source moves."""

    def __init__(self) -> None:
        self.layer: Image | None = None
        self._limits: tuple[float, ...] | None = None
        self._rescale = True
        self._always = True

    def make(self, shape: tuple[int, int], picture: Picture | None) -> Image:
        """Create the layer, with the last picture if there is one."""
        counts = np.zeros(shape, np.int64) if picture is None else picture.exposure.counts
        mark: dict[str, Any] = {"role": "counts"}
        if picture is not None:
            mark["exposure"] = picture.exposure
        self.layer = Image(
            counts,
            contrast_limits=self._limits or (0, 1),
            metadata={MARKER: mark},
            **styles.COUNTS,
        )
        frame = self.layer.bounding_box
        frame.visible, frame.points, frame.line_color = True, False, styles.FRAME_COLOR
        return self.layer

    def rescale(self, *, always: bool = False) -> None:
        """Choose new limits with the next picture.

        Limits that the user set by hand are kept unless ``always``, as after a change of the
        instrument set-up, in which they may show nothing.
        """
        self._rescale = True
        self._always |= always

    def show(self, picture: Picture) -> None:
        """Show a picture."""
        assert self.layer is not None
        exposure = picture.exposure
        self.layer.data = exposure.counts
        if not picture.final:
            return
        mark = {"role": "counts", "exposure": exposure}
        self.layer.metadata = {**self.layer.metadata, MARKER: mark}
        by_hand = self._limits is not None and tuple(self.layer.contrast_limits) != self._limits
        if self._rescale and (self._always or not by_hand):
            limits = contrast_limits(exposure.counts, exposure.background)
            highest = max(float(exposure.counts.max(initial=0)), limits[1])
            self.layer.contrast_limits_range = (0.0, highest)
            self.layer.contrast_limits = limits
            self._limits = tuple(self.layer.contrast_limits)
        self._rescale = self._always = False
