"""The built-in scenes under File > Open Sample."""

from __future__ import annotations

import napari
from napari.types import LayerDataTuple
from qtpy.QtCore import QTimer

from ..exposure import expose, noise_ready_rate
from ..scenes import example_scene
from .exposure_layers import adopt_layers, exposure_layers
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


def he0435() -> list[LayerDataTuple]:
    """Lensed quasar HE0435-1223."""
    return _sample("he0435")


def pg1115() -> list[LayerDataTuple]:
    """Lensed quasar PG1115+080."""
    return _sample("pg1115")


def h1413() -> list[LayerDataTuple]:
    """Lensed quasar H1413+117, the Cloverleaf."""
    return _sample("h1413")


def scene_layers(name: str) -> list[LayerDataTuple]:
    """Image, ellipses and points of a built-in scene as napari layer data."""
    scene = example_scene(name)
    observation = scene.observation
    sources = master_table(scene.sources, observation.pixel_scale)
    rate, clipped = noise_ready_rate(sources, observation)
    return exposure_layers(expose(rate, sources, observation, clipped=clipped))


def _sample(name: str) -> list[LayerDataTuple]:
    viewer = napari.current_viewer()
    if viewer is not None:
        # napari adds the layers after this function has returned.
        QTimer.singleShot(0, lambda: adopt_layers(viewer))
    return scene_layers(name)
