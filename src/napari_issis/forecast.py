"""What can be measured: expected errors of every source of a scene, fitted together."""

from __future__ import annotations

import astropy.units as u
import numpy as np
from astropy.table import QTable, Table

from .fisher import covariance
from .observation import Observation
from .source_rates import rates_per_flux
from .sources import FLUX_UNIT


def forecast(sources: Table, observation: Observation | None = None) -> QTable:
    """Forecast the errors with which each source of a scene can be measured.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table, of n rows.
    observation : Observation, optional
        The instrument set-up, by default the paper's (NUV, open-open, 100 s, 512 x 512).

    Returns
    -------
    astropy.table.QTable
        One row a source, in order: ``row kind x y flux``; the 1-sigma errors ``flux_error
        x_error y_error`` and for extended sources ``r_half_error ellipticity_error pa_error``
        (NaN for points, which have none); ``snr_alone``, flux over its error as if the source
        were alone on the sky; ``snr``, the same with all its neighbours fitted too;
        ``neighbour``, row of the source whose flux is most strongly correlated with its own
        (-1 if none is), and that ``flux_correlation``, -1 to 1. An error is infinite where the
        exposure does not determine the parameter: position and shape of a source without
        flux, anything of one outside the frame, sources at the same place, the angle of a
        round source.

    Raises
    ------
    ValueError
        If the source table is not valid; the message names the row and the value.

    Notes
    -----
    Cramer-Rao bounds of the Poisson likelihood, jointly over all sources, see
    `napari_issis.fisher`. They hold for a maximum-likelihood fit with the known PSF, sky and
    Sersic index, of sources that are bright enough: a fit of faint or blended ones scatters
    more and is biased. What coincidence loss takes away, if the detector has a dead time, is
    counted; a rollover of its memory is taken as undone.
    """
    observation = Observation() if observation is None else observation
    result = covariance(sources, observation)
    arrays, rates, n = result.sources, result.rates, len(result.sources)
    error = np.sqrt(result.variance / observation.exposure)
    alone = np.sqrt(result.alone / observation.exposure)
    neighbour = np.full(n, -1)
    correlation = np.zeros(n)
    pairs = result.correlation.tocsr()
    for i in range(n):
        part = slice(pairs.indptr[i], pairs.indptr[i + 1])
        others, values = pairs.indices[part], pairs.data[part]
        values = np.where(others == i, 0.0, values)
        if values.size and np.any(values != 0):
            worst = int(np.argmax(np.abs(values)))
            neighbour[i], correlation[i] = others[worst], np.clip(values[worst], -1.0, 1.0)
    return QTable(
        {
            "row": np.arange(n),
            "kind": arrays.kind,
            "x": arrays.x * u.pix,
            "y": arrays.y * u.pix,
            "flux": arrays.flux * FLUX_UNIT,
            "flux_error": error[:, 0] / rates_per_flux(sources, observation) * FLUX_UNIT,
            "x_error": error[:, 1] * u.pix,
            "y_error": error[:, 2] * u.pix,
            "r_half_error": error[:, 3] * u.pix,
            "ellipticity_error": error[:, 4],
            "pa_error": error[:, 5] * u.deg,
            "snr_alone": rates / alone,
            "snr": rates / error[:, 0],
            "flux_correlation": correlation,
            "neighbour": neighbour,
        }
    )
