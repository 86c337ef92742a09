"""The built-in scenes under File > Open Sample."""

from __future__ import annotations

from typing import Any

import napari
import numpy as np
from napari.types import LayerDataTuple
from qtpy.QtCore import QTimer
from qtpy.QtWidgets import QMessageBox

from ..exposure import expose, noise_ready_rate
from ..scenes import example_scene
from . import layer_styles as styles
from .contrast import contrast_limits
from .layers import features, points_data, shapes_data
from .marks import MARKER
from .scene import marked_layers, open_scene, scene_of
from .table import master_table


def blend() -> list[LayerDataTuple]:
    """Two blended galaxies, example 1 of the paper."""
    return _sample("blend")


def stars500() -> list[LayerDataTuple]:
    """500 random stars, example 2 of the paper."""
    return _sample("stars500")


def galaxies100() -> list[LayerDataTuple]:
    """100 random galaxies, example 3 of the paper."""
    return _sample("galaxies100")


def q2237() -> list[LayerDataTuple]:
    """Lensed quasar Q2237+0305."""
    return _sample("q2237")


def scene_layers(name: str) -> list[LayerDataTuple]:
    """Image, ellipses and points of a built-in scene as napari layer data.

    The layers carry the mark by which a scene recognises and adopts them.
    """
    scene = example_scene(name)
    sources, observation = master_table(scene.sources), scene.observation
    rate, clipped = noise_ready_rate(sources, observation)
    exposure = expose(rate, sources, observation, clipped=clipped)
    point = np.asarray(sources["kind"], dtype=str) == "point"
    ids = np.arange(1, len(sources) + 1)
    image = {
        **styles.COUNTS,
        "contrast_limits": contrast_limits(exposure.counts, exposure.background),
        "metadata": {MARKER: {"role": "counts", "exposure": exposure}},
    }
    ellipses = {
        **styles.ELLIPSES,
        "edge_width": styles.edge_width(observation.shape),
        "features": features(sources[~point], ids[~point]),
        "metadata": {MARKER: {"role": "ellipses"}},
    }
    corners = list(shapes_data(sources[~point]))
    if corners:
        ellipses["shape_type"] = "ellipse"
        ellipses["edge_color"] = styles.edge_colors(sources["kind"][~point])
    else:
        ellipses["ndim"] = 2
    points = {
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


def _sample(name: str) -> list[LayerDataTuple]:
    viewer = napari.current_viewer()
    if viewer is not None:
        # napari adds the layers after this function has returned.
        QTimer.singleShot(0, lambda: adopt_sample(viewer))
    return scene_layers(name)


def adopt_sample(viewer: Any) -> None:
    """Make a live scene of a sample's layers, or put it in the place of the scene."""
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
    if len(scene.sources) == 0 or _may_replace(len(scene.sources)):
        scene.observation, scene.seed = exposure.observation, exposure.seed
        open_scene(exposure.sources, viewer=viewer)


def _may_replace(count: int) -> bool:
    answer = QMessageBox.question(
        None,
        "Open sample",
        f"Replace the {count} source(s) of the present scene by the sample?",
    )
    return bool(answer == QMessageBox.StandardButton.Yes)
