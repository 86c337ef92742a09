"""A sequence of exposures as one napari layer with a slider."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import napari

from .contrast import contrast_limits

if TYPE_CHECKING:
    from ..monitoring import Monitoring


def show_monitoring(
    monitoring: Monitoring, viewer: Any = None, *, image: str = "counts", coadd: bool = True
) -> Any:
    """Add a sequence to a viewer as a lazily computed image layer.

    Parameters
    ----------
    monitoring : Monitoring
        The sequence.
    viewer : napari.Viewer, optional
        A new one by default.
    image : {"counts", "expected"}
        What to show.
    coadd : bool
        One frame for each epoch, or one for each exposure.

    Returns
    -------
    napari.layers.Image
        The layer. A frame is computed when the slider comes to it.
    """
    viewer = napari.Viewer() if viewer is None else viewer
    stack = monitoring.stack(image, coadd=coadd)
    first = stack[0].compute()
    one = monitoring.exposures[0].observation
    per_frame = len(monitoring.exposures) // len(stack)
    scale = monitoring.observation.pixel_scale
    layer = viewer.add_image(
        stack,
        name=f"ISSIS monitoring, {image}",
        scale=(1.0, scale, scale),
        contrast_limits=contrast_limits(first, one.background_rate * one.exposure * per_frame),
        colormap="gray",
    )
    if viewer.dims.ndim == 3:
        viewer.dims.axis_labels = ("epoch" if coadd else "exposure", "y", "x")
        viewer.dims.set_point(0, 0)
    return layer
