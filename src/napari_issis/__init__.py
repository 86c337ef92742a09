"""Simulate crowded ultraviolet fields as WSO-UV/ISSIS would record them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .cluster_profile import ClusterProfile
from .detector import Detector
from .drag import Drag
from .exposure import Exposure, simulate
from .exposure_goal import exposure_for
from .filters import Filter
from .forecast import forecast
from .host_arcs import host_arcs
from .image_psf import ImagePSF
from .image_source import image_source
from .instrument import Instrument
from .instruments import INSTRUMENTS
from .lens_delays import isothermal_delays
from .lens_model import lens_images
from .lensed_quasars import lensed_quasar, lensed_quasars
from .light_curve_fit import fit_light_curves
from .light_curve_plot import plot_light_curves
from .light_curves import damped_random_walk, sinusoid
from .limits import CountRateWarning
from .monitoring import Epoch, Monitoring, monitor
from .observation import Observation
from .populations import random_sources, star_cluster
from .psf import GaussianPSF, MoffatPSF, TelescopePSF
from .render import count_rate
from .sky import SKIES, Sky
from .source_counts import expected_counts, signal_to_noise
from .source_image import SourceImage
from .sources import source
from .spectra import BlackBody, Flat, Line, PowerLaw, Spectrum, TableSpectrum, parse_spectrum

if TYPE_CHECKING:
    from astropy.table import Table
    from napari.viewer import Viewer

    from .apertures import aperture_photometry
    from .catalogue import Catalogue, read_catalogue, read_sources, write_sources
    from .fits_image import FitsImage, read_image
    from .plugin.scene import Scene
    from .png import write_png, write_side_by_side_png, write_source_png
    from .rgba import read_rgba, write_rgba
    from .sheet import proposal_sheet

__version__ = "0.1.0"

# Loaded when first used: astropy's formats and statistics take their time.
_LATER = {
    "aperture_photometry": "apertures",
    "Catalogue": "catalogue",
    "read_catalogue": "catalogue",
    "read_sources": "catalogue",
    "write_sources": "catalogue",
    "FitsImage": "fits_image",
    "read_image": "fits_image",
    "write_png": "png",
    "write_side_by_side_png": "png",
    "write_source_png": "png",
    "proposal_sheet": "sheet",
    "read_rgba": "rgba",
    "write_rgba": "rgba",
}

__all__ = [
    "INSTRUMENTS",
    "SKIES",
    "BlackBody",
    "Catalogue",
    "ClusterProfile",
    "CountRateWarning",
    "Detector",
    "Drag",
    "Epoch",
    "Exposure",
    "Filter",
    "FitsImage",
    "Flat",
    "GaussianPSF",
    "ImagePSF",
    "Instrument",
    "Line",
    "MoffatPSF",
    "Monitoring",
    "Observation",
    "PowerLaw",
    "Sky",
    "SourceImage",
    "Spectrum",
    "TableSpectrum",
    "TelescopePSF",
    "aperture_photometry",
    "count_rate",
    "damped_random_walk",
    "expected_counts",
    "exposure_for",
    "fit_light_curves",
    "forecast",
    "host_arcs",
    "image_source",
    "isothermal_delays",
    "lens_images",
    "lensed_quasar",
    "lensed_quasars",
    "monitor",
    "parse_spectrum",
    "plot_light_curves",
    "proposal_sheet",
    "random_sources",
    "read_catalogue",
    "read_image",
    "read_rgba",
    "read_sources",
    "show",
    "signal_to_noise",
    "simulate",
    "sinusoid",
    "source",
    "star_cluster",
    "write_png",
    "write_rgba",
    "write_side_by_side_png",
    "write_source_png",
    "write_sources",
]


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_LATER[name]}", __name__), name)


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
