"""Count rates of sources of known images, by maximum likelihood of Poisson counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Array = NDArray[np.float64]

# Steps end below this share of an error.
PRECISION = 1e-8
MOST_STEPS = 200
# Eigenvalues of the normalised information below which a combination is undetermined.
SINGULAR = 1e-11
# Share of an undetermined combination above which a source is undetermined too.
INVOLVED = 1e-6


def fit_fluxes(counts: NDArray[np.int64], templates: Array, sky: Array) -> Array:
    """Fit the amplitudes of known images to Poisson counts.

    Parameters
    ----------
    counts : ndarray of int, shape (m,)
        Detected counts of the pixels.
    templates : ndarray, shape (n, m)
        Expected counts of each source at amplitude 1, none negative.
    sky : ndarray, shape (m,)
        Expected counts without the sources.

    Returns
    -------
    ndarray, shape (n,)
        The amplitudes of largest likelihood for which no expected count is negative; they may
        be negative themselves. Of amplitudes that are undetermined (see `flux_errors`) one
        solution of many.

    Raises
    ------
    RuntimeError
        If the fit does not converge.

    Notes
    -----
    The logarithm of the likelihood, sum of c log(mu) - mu with mu = amplitudes @ templates +
    sky, is concave, so that it has one maximum. Fisher scoring, which here is iteratively
    reweighted least squares with weights 1 / mu (Green 1984, J. R. Stat. Soc. B 46, 149), with
    steps halved until they gain.
    """
    lit = templates.sum(axis=0) > 0
    seen = counts[lit].astype(np.float64)
    templates, sky = templates[:, lit], sky[lit]
    if not seen.size:
        return np.zeros(len(templates))
    light = templates.sum(axis=1)
    # evenly shared, and positive, so that the likelihood is finite
    share = max(float((seen - sky).sum()), 1.0) / len(templates)
    amplitude: Array = np.divide(share, light, out=np.zeros_like(light), where=light > 0)
    expected = amplitude @ templates + sky
    for _ in range(MOST_STEPS):
        step, gain = _step(seen, templates, expected)
        change = step @ templates
        part, slack = 1.0, 1e-12 * float(seen.sum() + expected.sum())
        while not _gains(seen, expected, part * change, slack):
            part *= 0.5
            if part < 1e-12:
                return amplitude
        amplitude = amplitude + part * step
        expected = expected + part * change
        if part * part * gain < PRECISION**2:
            return amplitude
    raise RuntimeError(
        f"the fit of {len(templates)} fluxes has not converged after {MOST_STEPS} steps."
    )


def flux_errors(templates: Array, expected: Array) -> Array:
    """Forecast the errors of amplitudes that `fit_fluxes` fits.

    Parameters
    ----------
    templates : ndarray, shape (n, m)
        Expected counts of each source at amplitude 1.
    expected : ndarray, shape (m,)
        Expected counts of all, sky included.

    Returns
    -------
    ndarray, shape (n,)
        Standard deviations: roots of the diagonal of the inverse of the Fisher information,
        sum over pixels of templates_i templates_j / expected (Kay 1993, Fundamentals of
        Statistical Signal Processing, 3.7); infinite where undetermined.
    """
    lit = expected > 0
    values, vectors, norm = _information(templates[:, lit], expected[lit])
    singular = values < SINGULAR
    infinite = (vectors[:, singular] ** 2).sum(axis=1) > INVOLVED
    regular = vectors[:, ~singular]
    variance = ((regular**2) / values[~singular]).sum(axis=1) * norm**2
    return np.where(infinite, np.inf, np.sqrt(variance))


def _information(templates: Array, expected: Array) -> tuple[Array, Array, Array]:
    """Eigenvalues and vectors of the information of unit diagonal, and what makes it so."""
    matrix = (templates / expected) @ templates.T
    diagonal = np.diagonal(matrix)
    norm = np.divide(1.0, np.sqrt(diagonal), out=np.zeros_like(diagonal), where=diagonal > 0)
    values, vectors = linalg.eigh(matrix * norm * norm[:, None])
    return values, vectors, norm


def _step(counts: Array, templates: Array, expected: Array) -> tuple[Array, float]:
    """Scoring step, and its square in units of the errors."""
    values, vectors, norm = _information(templates, expected)
    regular = values >= SINGULAR
    slope = (templates @ (counts / expected - 1)) * norm
    along = (slope @ vectors)[regular]
    step = vectors[:, regular] @ (along / values[regular]) * norm
    return step, float((along**2 / values[regular]).sum())


def _gains(counts: Array, expected: Array, change: Array, slack: float) -> bool:
    """Whether a step keeps all expected counts positive and loses no likelihood."""
    if not np.all(expected + change > 0):
        return False
    # log1p keeps the digits that the difference of two sums over all pixels would lose
    return bool((counts * np.log1p(change / expected) - change).sum() >= -slack)
