"""Simulate crowded ultraviolet fields as WSO-UV/ISSIS would record them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .cluster_profile import ClusterProfile
from .drag import Drag
from .exposure import Exposure, simulate
from .filters import Filter
from .image_psf import ImagePSF
from .limits import CountRateWarning
from .observation import Observation
from .populations import random_sources, star_cluster
from .psf import GaussianPSF, MoffatPSF, TelescopePSF
from .render import count_rate
from .sky import SKIES, Sky
from .sources import source

if TYPE_CHECKING:
    from astropy.table import Table
    from napari.viewer import Viewer

    from .plugin.scene import Scene

__version__ = "0.1.0"

__all__ = [
    "SKIES",
    "ClusterProfile",
    "CountRateWarning",
    "Drag",
    "Exposure",
    "Filter",
    "GaussianPSF",
    "ImagePSF",
    "MoffatPSF",
    "Observation",
    "Sky",
    "TelescopePSF",
    "count_rate",
    "random_sources",
    "show",
    "simulate",
    "source",
    "star_cluster",
]


def show(
    sources: Table | None = None,
    observation: Observation | None = None,
    *,
    viewer: Viewer | None = None,
    **options: Any,
) -> Scene:
    """Open a live scene in napari.

    Parameters
    ----------
    sources : astropy.table.QTable, optional
        The source table to start from, by default an empty one.
    observation : Observation, optional
        The instrument set-up.
    viewer : napari.Viewer, optional
        The viewer to add the layers to; a new one by default.

    Returns
    -------
    napari_issis.plugin.scene.Scene
        The live scene; ``sources``, ``observation`` and ``exposure`` can be read, the first
        two set.

    Raises
    ------
    ImportError
        If napari is not installed: ``pip install "napari-issis[all]"``.
    """
    from .plugin.scene import open_scene

    return open_scene(sources, observation, viewer=viewer, **options)
