"""An exposure as napari layers, and its way from there into a viewer's live scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from napari.types import LayerDataTuple
from qtpy.QtWidgets import QApplication, QMessageBox

from ..exposure import Exposure
from . import layer_styles as styles
from .contrast import contrast_limits
from .layers import features, points_data, shapes_data
from .marks import MARKER
from .scene import marked_layers, open_scene, scene_of
from .table import master_table


def exposure_layers(exposure: Exposure) -> list[LayerDataTuple]:
    """Image, ellipses and points of an exposure as napari layer data.

    The layers carry the mark by which a scene recognises and adopts them.
    """
    observation = exposure.observation
    sources = master_table(exposure.sources, observation.pixel_scale)
    point = np.asarray(sources["kind"], dtype=str) == "point"
    ids = np.arange(1, len(sources) + 1)
    scale = (observation.pixel_scale, observation.pixel_scale)
    image = {
        "scale": scale,
        **styles.COUNTS,
        "contrast_limits": contrast_limits(exposure.counts, exposure.background),
        "metadata": {MARKER: {"role": "counts", "exposure": exposure}},
    }
    ellipses = {
        "scale": scale,
        **styles.ELLIPSES,
        "edge_width": styles.edge_width(observation.shape),
        "features": features(sources[~point], ids[~point]),
        "metadata": {MARKER: {"role": "ellipses"}},
    }
    corners = list(shapes_data(sources[~point]))
    if corners:
        ellipses["shape_type"] = styles.shape_types(sources["kind"][~point])
        ellipses["edge_color"] = styles.edge_colors(sources["kind"][~point])
    else:
        ellipses["ndim"] = 2
    points = {
        "scale": scale,
        **styles.POINTS,
        "size": styles.marker_size(observation.shape),
        "features": features(sources[point], ids[point]),
        "metadata": {MARKER: {"role": "points"}},
    }
    return [
        (exposure.counts, image, "image"),
        (corners, ellipses, "shapes"),
        (points_data(sources[point]), points, "points"),
    ]


def adopt_layers(viewer: Any) -> None:
    """Make a live scene of an exposure's layers, or put it in the place of the scene."""
    layers = marked_layers(viewer)
    if "counts" not in layers:
        return
    scene = scene_of(viewer)
    if scene is None:
        open_scene(viewer=viewer)
        return
    exposure = layers["counts"].metadata[MARKER]["exposure"]
    for layer in layers.values():
        viewer.layers.remove(layer)
    if len(scene.sources) == 0 or may_replace(len(scene.sources)):
        scene.observation, scene.seed = exposure.observation, exposure.seed
        open_scene(exposure.sources, viewer=viewer)
    elif scene.layers:
        # the mouse and the keys of the scene need one of its layers to be active
        viewer.layers.selection.active = scene.layers[-1]


def may_replace(count: int) -> bool:
    """Ask whether the sources of the present scene may go; undo brings them back."""
    answer = QMessageBox.question(
        QApplication.activeWindow(),
        "Open",
        f"Replace the {count} source(s) of the present scene by those opened? Undo brings them "
        "back.",
    )
    return bool(answer == QMessageBox.StandardButton.Yes)
