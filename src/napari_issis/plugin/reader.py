"""Open files in napari: exposures as live scenes, images under the frame, catalogues as sources."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import Any

import napari
import numpy as np
from napari.types import LayerDataTuple
from napari.utils.notifications import show_info, show_warning
from qtpy.QtCore import QTimer

from ..catalogue import READABLE, read_catalogue
from ..fits_image import DistortionWarning, read_image
from ..fits_io import SUFFIXES, read_exposure
from ..fits_table import open_fits
from ..observation import Observation
from . import layer_styles as styles
from .exposure_layers import adopt_layers, exposure_layers
from .scene import open_scene, scene_of

Reader = Callable[[Any], list[LayerDataTuple]]
FITS = (*SUFFIXES, *(f"{suffix}.gz" for suffix in SUFFIXES))
# napari's word for a file that was read and made no layer
NO_LAYER: list[LayerDataTuple] = [(None,)]


def get_reader(path: str | list[str]) -> Reader | None:
    """Return the function that reads a file, None if it is none of ours; called by napari."""
    if isinstance(path, list):
        return _each if path and all(get_reader(one) for one in path) else None
    return _read if str(path).lower().endswith((*READABLE, *FITS)) else None


def _each(paths: list[str]) -> list[LayerDataTuple]:
    return [layer for path in paths for layer in _read(path)]


def _read(path: str | list[str]) -> list[LayerDataTuple]:
    if isinstance(path, list):
        return _each(path)
    if not path.lower().endswith(FITS):
        return _catalogue(path)
    with open_fits(path) as hdus:
        names = {hdu.name for hdu in hdus}
        has_image = any(hdu.is_image and len(hdu.shape) >= 2 for hdu in hdus)
    if {"OBSERVATION", "SOURCES", "EXPECTED"} <= names:
        return _exposure(path)
    return _image(path) if has_image else _catalogue(path)


def _exposure(path: str) -> list[LayerDataTuple]:
    """Read an exposure; the live scene takes its layers when napari has added them."""
    layers = exposure_layers(read_exposure(path))
    viewer = napari.current_viewer()
    if viewer is not None:
        QTimer.singleShot(0, lambda: adopt_layers(viewer))
    return layers


def _image(path: str) -> list[LayerDataTuple]:
    """Read any other image, laid where it lies in the frame if both have a place on the sky."""
    observation = _observation()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DistortionWarning)
        image = read_image(path, observation)
    to_frame = np.eye(3) if image.transform is None else image.transform
    options: dict[str, Any] = {
        "name": os.path.basename(path),
        "affine": np.diag([observation.pixel_scale, observation.pixel_scale, 1.0]) @ to_frame,
        "units": styles.GEOMETRY["units"],
        "axis_labels": styles.GEOMETRY["axis_labels"],
        "metadata": {"header": dict(image.header), "position": image.note},
    }
    finite = image.data[np.isfinite(image.data)] if image.data.size else image.data
    if finite.size:
        low, high = (float(value) for value in np.percentile(finite, [1.0, 99.5]))
        options["contrast_limits"] = (low, high if high > low else low + 1.0)
    (show_info if image.deviation_in_frame <= 1 else show_warning)(
        f"{options['name']}: {image.note}"
    )
    return [(image.data, options, "image")]


def _catalogue(path: str) -> list[LayerDataTuple]:
    """Read a catalogue; its sources are added to the live scene, which makes no layer here."""
    catalogue = read_catalogue(path, _observation())
    viewer = napari.current_viewer()
    if viewer is None:
        raise ValueError(f"{path} is a catalogue; open it in a viewer, to add its sources there.")
    scene = open_scene(viewer=viewer)
    scene.add(catalogue.sources)
    tell_notes(path, len(catalogue.sources), catalogue.notes)
    return NO_LAYER


def tell_notes(path: str, count: int, notes: tuple[str, ...]) -> None:
    """Tell what was understood of a catalogue."""
    show_info("\n".join([f"{count} source(s) added from {path}", *notes]))


def _observation() -> Observation:
    viewer = napari.current_viewer()
    scene = None if viewer is None else scene_of(viewer)
    return Observation() if scene is None else scene.observation
