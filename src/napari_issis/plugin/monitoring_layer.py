"""A sequence of exposures as one napari layer with a slider."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import napari
from numpy.typing import NDArray

from ..monitoring_tasks import IMAGES, import_dask
from .contrast import contrast_limits
from .frames import Frames
from .layer_styles import GEOMETRY

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
        The layer. A frame is computed in the background when the slider comes to it, and dark
        until it is there; the first one sets the contrast limits.
    """
    if image not in IMAGES:
        raise ValueError(f"image is {image!r}; known: {', '.join(IMAGES)}.")
    import_dask()
    viewer = napari.Viewer() if viewer is None else viewer
    number = len(monitoring.epochs if coadd else monitoring.exposures)
    one = monitoring.exposures[0].observation
    sky = one.background_rate * one.exposure * (len(monitoring.exposures) // number)
    untouched = (0.0, 1.0)

    def arrived(frame: NDArray[Any]) -> None:
        if layer not in viewer.layers:
            frames.stop()
            return
        if tuple(layer.contrast_limits) == untouched:
            layer.contrast_limits_range = (0.0, max(float(frame.max()), 1.0))
            layer.contrast_limits = contrast_limits(frame, sky)
        layer.refresh(extent=False)

    frames = Frames(
        (number, *monitoring.observation.shape),
        "int64" if image == "counts" else "float64",
        partial(monitoring.stack, image, coadd=coadd),
        arrived,
    )
    scale = monitoring.observation.pixel_scale
    layer = viewer.add_image(
        frames,
        name=f"ISSIS monitoring, {image}",
        scale=(1.0, scale, scale),
        # the other layers' on the sky; napari's scale bar wants one unit for all
        units=("pixel", *GEOMETRY["units"]),
        contrast_limits=untouched,
        colormap="gray",
        multiscale=False,
        rgb=False,
    )
    if viewer.dims.ndim == 3:
        viewer.dims.axis_labels = ("epoch" if coadd else "exposure", "y", "x")
        viewer.dims.set_point(0, 0)
    return layer
