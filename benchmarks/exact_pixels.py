"""Expected rate of a few pixels by quadrature that shares nothing with the package measured.

Stars are integrated in real space: the PSF's radial profile over the pixel. Galaxies are
integrated in Fourier space in polar coordinates, which knows no grid and no period. The results
are kept in exact_pixels.json; ``python benchmarks/exact_pixels.py [scene ...]`` makes them again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from exact_optics import ExactOptics
from exact_profiles import transform
from napari_issis import Observation, TelescopePSF
from speed_scenes import FIELD, SCENES, load_scene

RESULTS = Path(__file__).parent / "exact_pixels.json"
Array = NDArray[np.float64]
Pixels = NDArray[np.int64]

CPS_PER_FLUX = 1.14e17
PIXEL_SCALE = 0.036
# frequency (cycles per pixel) below which radial panels need not go on halving
LOWEST = 1e-7
# transform of unit flux that is left out
NEGLIGIBLE = 1e-18
# groups of galaxies by distance
GROUPS = 6
# nodes in one block of the polar sum
BLOCK = 100_000


def choose_pixels(table: QTable, corner: tuple[int, int], side: int, count: int = 20) -> Pixels:
    """Half of them on the brightest sources of a square, the others anywhere; (y, x) rows."""
    position = np.column_stack([_plain(table, "y"), _plain(table, "x")]) - np.array(corner)
    inside = np.flatnonzero(np.all((position >= 0) & (position <= side - 1), axis=1))
    brightest = inside[np.argsort(-_plain(table, "flux")[inside])][: count // 2]
    anywhere = np.random.default_rng(5).integers(0, side, (count - brightest.size, 2))
    pixels = np.concatenate([np.rint(position[brightest]).astype(np.int64), anywhere])
    return np.asarray(pixels + np.array(corner), dtype=np.int64)


def exact_rates(table: QTable, observation: Observation, pixels: Pixels) -> Array:
    """Rate of each of the pixels, cps."""
    psf = observation.psf
    assert isinstance(psf, TelescopePSF)
    arcsec = 180 * 3600 / np.pi
    optics = ExactOptics(
        cutoff=psf.diameter / (psf.band_limits[0] * 1e-10) / arcsec * PIXEL_SCALE,
        obscuration=psf.obscuration,
        blur=psf.blur_fwhm / PIXEL_SCALE / np.sqrt(8 * np.log(2)),
        reach=float(_distances(table, pixels).max()) + 1,
    )
    is_star = np.asarray(table["kind"]) == "point"
    rate = np.zeros(len(pixels))
    if is_star.any():
        rate += star_rates(table[is_star], optics, pixels)
    if not is_star.all():
        rate += galaxy_rates(table[~is_star], optics, pixels)
    return rate


def star_rates(table: QTable, optics: ExactOptics, pixels: Pixels) -> Array:
    """Stars' PSF over each pixel by 16 x 16 Gauss points."""
    x, w = np.polynomial.legendre.leggauss(16)
    rates = _plain(table, "flux") * CPS_PER_FLUX
    result = []
    for row, column in pixels:
        dy = row + 0.5 * x[None, :, None] - _plain(table, "y")[:, None, None]
        dx = column + 0.5 * x[None, None, :] - _plain(table, "x")[:, None, None]
        mean = np.einsum("sij,i,j->s", optics.psf(np.hypot(dy, dx)), 0.5 * w, 0.5 * w)
        result.append(rates @ mean)
    return np.array(result)


def galaxy_rates(table: QTable, optics: ExactOptics, pixels: Pixels) -> Array:
    """Fourier integrals of the galaxies, the near ones apart: they need fewer nodes."""
    distance = _distances(table, pixels) + 3 * _plain(table, "r_half")
    rate = np.zeros(len(pixels))
    for rows in np.array_split(np.argsort(distance), GROUPS):
        if rows.size:
            rate += _polar_integral(table[rows], optics, pixels, float(distance[rows].max()))
    return rate


def _polar_integral(table: QTable, optics: ExactOptics, pixels: Pixels, reach: float) -> Array:
    """Sum over rings of equally spaced angles, half a circle by symmetry."""
    rate = np.zeros(len(pixels))
    for k, weight, angle in _rings(optics, reach):
        ky, kx = k * np.sin(angle), k * np.cos(angle)
        spectrum = _spectrum(table, ky, kx) * weight * np.sinc(ky) * np.sinc(kx)
        for i, (row, column) in enumerate(pixels):
            phase = 2 * np.pi * (ky * row + kx * column)
            rate[i] += spectrum.real @ np.cos(phase) - spectrum.imag @ np.sin(phase)
    return rate


def _distances(table: QTable, pixels: Pixels) -> Array:
    """Distance of each source from the farthest of the pixels."""
    dy = pixels[:, :1] - _plain(table, "y")
    dx = pixels[:, 1:] - _plain(table, "x")
    farthest: Array = np.hypot(dy, dx).max(axis=0)
    return farthest


def _rings(optics: ExactOptics, reach: float) -> Iterator[tuple[Array, Array, Array]]:
    """Blocks of polar nodes: frequency, weight with the OTF, angle."""
    radial_k, radial_w = optics.radial_nodes(cycles=1.05 * reach, lowest=LOWEST)
    transfer = optics.transfer(radial_k)
    keep = radial_k * transfer * radial_w > 1e-19
    # Bessel functions J_n(z) vanish faster than any power once n is above z
    angles = (np.pi * radial_k * reach * 1.02 + 300).astype(int)
    block: list[tuple[Array, Array, Array]] = []
    for k, w, f, n in zip(
        radial_k[keep], radial_w[keep], transfer[keep], angles[keep], strict=True
    ):
        angle = np.pi * (np.arange(n) + 0.5) / n
        block.append((np.full(n, k), np.full(n, 2 * np.pi * k * f * w / n), angle))
        if sum(b[0].size for b in block) > BLOCK:
            yield tuple(np.concatenate(parts) for parts in zip(*block, strict=True))  # type: ignore[misc]
            block = []
    if block:
        yield tuple(np.concatenate(parts) for parts in zip(*block, strict=True))  # type: ignore[misc]


def _spectrum(table: QTable, ky: Array, kx: Array) -> NDArray[np.complex128]:
    """Sum of the sources' transforms, cps."""
    total = np.zeros(ky.size, dtype=np.complex128)
    rates = _plain(table, "flux") * CPS_PER_FLUX
    radius, angle = _plain(table, "r_half"), np.radians(_plain(table, "pa"))
    ratio = 1 - _plain(table, "ellipticity")
    x, y = _plain(table, "x"), _plain(table, "y")
    for i, kind in enumerate(table["kind"]):
        along = ky * np.cos(angle[i]) - kx * np.sin(angle[i])
        across = (ky * np.sin(angle[i]) + kx * np.cos(angle[i])) * ratio[i]
        value = rates[i] * transform(str(kind), radius[i] * np.hypot(along, across))
        if np.abs(value).max() < NEGLIGIBLE * rates[i]:
            continue
        total += value * np.exp(-2j * np.pi * (ky * y[i] + kx * x[i]))
    return total


def _plain(table: QTable, name: str) -> Array:
    column = table[name]
    return np.asarray(getattr(column, "value", column), dtype=np.float64)


def load_exact(scene: str) -> tuple[Pixels, Array]:
    """Pixels (y, x) and rates kept in exact_pixels.json; none if the scene is not there."""
    kept = json.loads(RESULTS.read_text(encoding="utf-8")).get(scene, {"pixels": [], "rates": []})
    return np.array(kept["pixels"], dtype=np.int64).reshape(-1, 2), np.array(kept["rates"])


def main() -> None:
    """Integrate the pixels of every scene; long, and needed once."""
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for scene in sys.argv[1:] or SCENES:
        table, observation = load_scene(scene)
        # of the large field the middle only, where the sources are nearer
        corner, side = ((992, 992), 64) if scene == FIELD else ((0, 0), observation.shape[0])
        pixels = choose_pixels(table, corner, side)
        rates = exact_rates(table, observation, pixels)
        results[scene] = {"pixels": pixels.tolist(), "rates": rates.tolist()}
        RESULTS.write_text(json.dumps(results) + "\n", encoding="utf-8")
        print(scene, flush=True)


if __name__ == "__main__":
    main()
