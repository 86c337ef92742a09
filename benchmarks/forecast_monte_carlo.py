"""Scatter of maximum-likelihood fits to simulated exposures against the forecast errors.

``python benchmarks/forecast_monte_carlo.py`` writes the figure and the table of
``docs/forecast.md``; ``--fits 50`` is a quick look that writes ``build/forecast.md``;
What was measured stays in ``build/forecast`` and is not measured again; ``--scenes quad`` measures
those alone, so that several processes can share the work. Exposures are those of
`napari_issis.simulate`, rendered once; what is fitted to them is the pixel model of
``fit_model.py``, which shares nothing with the package.
"""

from __future__ import annotations

import argparse
import datetime
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from astropy.table import QTable, vstack
from numpy.typing import NDArray

import napari_issis as ni
from fit_model import PixelModel, fit
from forecast_plot import plot
from machine import machine
from napari_issis.exposure import expose, noise_ready_rate

Array = NDArray[np.float64]

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "build" / "forecast"
SCENES = ("isolated", "pair", "quad")
FWHM, FLUX = 0.1, 1e-17
SNRS = (5, 10, 20, 50, 100, 300)
SEPARATIONS = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
FITS = 500
# a fit that moves a star by more than this many forecast errors and FWHM has lost it
LOST = 1.0
MARKS = "<!-- made by benchmarks/forecast_monte_carlo.py -->", "<!-- until here -->"


@dataclass(frozen=True)
class Outcome:
    """What the fits to one scene gave.

    Attributes
    ----------
    scene : str
        "isolated", "pair" or "quad".
    separation : float
        Of a pair, FWHM.
    snr : float
        Forecast S/N in the crowd of the faintest point source.
    flux, position : (float, float)
        Scatter over forecast, root mean square over point sources, and its standard error.
    galaxy : (float, float)
        The same of all six parameters of the galaxy; NaN without one.
    bias : float
        Largest mean deviation of a point source's flux, in forecast errors.
    size_bias : float
        Mean deviation of the galaxy's half-light radius, in forecast errors; NaN without one.
    lost : float
        Share of fits that lost a star; they are left out.
    """

    scene: str
    separation: float
    snr: float
    flux: tuple[float, float]
    position: tuple[float, float]
    galaxy: tuple[float, float]
    bias: float
    size_bias: float
    lost: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fits", type=int, default=FITS)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=SCENES)
    chosen = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    outcomes = _measure(chosen.scenes, chosen.fits)
    text = _table(outcomes, chosen.fits)
    print(text)
    if len(chosen.scenes) < len(SCENES):
        return
    whole = chosen.fits >= FITS
    folder = ROOT / "docs" if whole else ROOT / "build"
    (folder / "pictures").mkdir(parents=True, exist_ok=True)
    plot(outcomes, folder / "pictures" / "forecast.png")
    page = folder / "forecast.md"
    if whole:
        before, rest = page.read_text(encoding="utf-8").split(MARKS[0])
        after = rest.split(MARKS[1])[1]
        text = f"{before}{MARKS[0]}\n{text}\n{MARKS[1]}{after}"
    page.write_text(text, encoding="utf-8")


def _measure(scenes: Sequence[str], fits: int) -> list[Outcome]:
    small = ni.Observation(shape=(31, 37), psf=ni.GaussianPSF(FWHM))
    large = small.replace(shape=(96, 96))
    apart = FWHM / small.pixel_scale
    outcomes = []
    if "isolated" in scenes:
        star = ni.source("point", 18.2, 15.4, FLUX)
        outcomes += [_kept("isolated", 0.0, star, small, snr, fits) for snr in SNRS]
    if "pair" in scenes:
        for snr in SNRS[:5]:
            for separation in SEPARATIONS:
                x = 18.2 + separation * apart * np.array([-0.5, 0.5])
                pair = vstack([ni.source("point", each, 15.1, FLUX) for each in x])
                outcomes.append(_kept("pair", separation, pair, small, snr, fits))
    if "quad" in scenes:
        quad = ni.lensed_quasar("Q2237+0305", large)
        outcomes += [_kept("quad", 0.0, quad, large, snr, fits) for snr in SNRS[:5]]
    return outcomes


def _kept(
    scene: str, separation: float, sources: QTable, where: ni.Observation, snr: float, fits: int
) -> Outcome:
    """Fit, unless that was done before."""
    file = KEPT / f"{scene}-{separation:g}-{snr:g}-{fits}.npz"
    if not file.exists():
        found, truth, errors = _fits(scene, separation, sources, where, snr, fits)
        np.savez(file, found=found, truth=truth, errors=errors)
    with np.load(file) as kept:
        return _outcome(scene, separation, snr, kept["found"], kept["truth"], kept["errors"])


def _fits(
    scene: str, separation: float, sources: QTable, where: ni.Observation, snr: float, fits: int
) -> tuple[Array, Array, Array]:
    """Parameters found by fits to exposures, (fits, parameters), the true ones and their errors."""
    stars = np.flatnonzero(sources["kind"] == "point")
    seconds = ni.exposure_for(sources, where, rows=stars.tolist(), snr=snr).value
    where = where.replace(exposure=seconds)
    truth, errors = _parameters(sources, where)
    sigma = FWHM / where.pixel_scale / np.sqrt(8 * np.log(2))
    galaxy = len(sources) > stars.size
    model = PixelModel(sigma, where.background_rate, where.shape, stars.size, galaxy)
    found = []
    rate, _ = noise_ready_rate(sources, where)
    # the same seeds would give all scenes the same noise
    first = zlib.crc32(f"{scene} {separation} {snr}".encode())
    for seed in range(first, first + fits):
        counts = expose(rate, sources, where, seed=seed).counts.ravel().astype(float)
        found.append(fit(model, counts, seconds, truth, errors))
    print(f"{scene} {separation} S/N {snr}: {seconds:.4g} s", flush=True)
    return np.array(found), truth, errors


def _outcome(
    scene: str, separation: float, snr: float, found: Array, truth: Array, errors: Array
) -> Outcome:
    stars = 4 if scene == "quad" else truth.size // 3
    if scene == "quad":
        found = _one_name(found, truth)
    pixel_fwhm = FWHM / ni.Observation().pixel_scale
    deviation = (found - truth) / errors
    places = np.arange(3 * stars).reshape(-1, 3)
    moved = np.abs((found - truth)[:, places[:, 1:]])
    far = moved > LOST * pixel_fwhm + 5 * errors[places[:, 1:]]
    lost = far.any(axis=(1, 2))
    deviation = deviation[~lost]
    return Outcome(
        scene,
        separation,
        float(snr),
        _ratio(deviation[:, places[:, 0]]),
        _ratio(deviation[:, places[:, 1:].ravel()]),
        _ratio(deviation[:, 3 * stars :]) if scene == "quad" else (np.nan, np.nan),
        float(np.abs(deviation[:, places[:, 0]].mean(axis=0)).max()),
        float(deviation[:, -3].mean()) if scene == "quad" else np.nan,
        float(lost.mean()),
    )


def _one_name(found: Array, truth: Array) -> Array:
    """Of the parameters of one and the same ellipse those of the longer axis nearest the true.

    Below an ellipticity of 0 the axes have changed places; angles repeat after half a turn.
    """
    found = found.copy()
    r_half, ellipticity, pa = found[:, -3:].T
    swapped = ellipticity < 0
    r_half[swapped] *= 1 - ellipticity[swapped]
    ellipticity[swapped] = 1 - 1 / (1 - ellipticity[swapped])
    pa[swapped] += 90
    pa -= 180 * np.round((pa - truth[-1]) / 180)
    return found


def _parameters(sources: QTable, where: ni.Observation) -> tuple[Array, Array]:
    """Parameters of the pixel model and their forecast errors."""
    table = ni.forecast(sources, where)
    truth, errors = [], []
    for source, row in zip(sources, table, strict=True):
        names = ["x", "y"]
        if source["kind"] != "point":
            names += ["r_half", "ellipticity", "pa"]
        truth.append(row["flux"].value * where.cps_per_flux)
        errors.append(row["flux_error"].value * where.cps_per_flux)
        for name in names:
            truth.append(float(getattr(source[name], "value", source[name])))
            errors.append(float(getattr(row[f"{name}_error"], "value", row[f"{name}_error"])))
    return np.array(truth), np.array(errors)


def _ratio(deviation: Array) -> tuple[float, float]:
    """Scatter in forecast errors, root mean square over parameters, and its standard error.

    The error is that of 200 bootstrap samples of the fits.
    """
    rng = np.random.default_rng(1)

    def scatter(sample: Array) -> float:
        return float(np.sqrt(np.mean(np.var(sample, axis=0, ddof=1))))

    n = len(deviation)
    samples = [scatter(deviation[rng.integers(n, size=n)]) for _ in range(200)]
    return scatter(deviation), float(np.std(samples))


def _table(outcomes: list[Outcome], fits: int) -> str:
    lines = [
        f"{fits} exposures and fits a row, {datetime.date.today()}, {machine()}.",
        "",
        "| scene | S/N | flux | position | galaxy | bias of flux | of size | lost |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in outcomes:
        name = f"pair, {one.separation:g} FWHM" if one.scene == "pair" else one.scene
        galaxy = _value(one.galaxy) if one.scene == "quad" else ""
        size = f"{one.size_bias:+.2f}" if one.scene == "quad" else ""
        lines.append(
            f"| {name} | {one.snr:g} | {_value(one.flux)} | {_value(one.position)} | {galaxy} "
            f"| {one.bias:.2f} | {size} | {100 * one.lost:.1f} % |"
        )
    return "\n".join(lines)


def _value(ratio: tuple[float, float]) -> str:
    return f"{ratio[0]:.3f} ± {ratio[1]:.3f}"


if __name__ == "__main__":
    main()
