"""An image as a source: exact between its samples, scaled, moved and turned like any other."""

import pickle
import subprocess
import sys

import numpy as np
import pytest
from astropy import units as u
from astropy.io import fits
from astropy.table import vstack

import napari_issis as ni
from cardinal_images import exact_pixel, image_rate
from napari_issis.instruments import PIXEL_SCALE
from napari_issis.source_image import NegativeLightWarning, kept_image

pytestmark = [
    pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning"),
    pytest.mark.filterwarnings("ignore::napari_issis.source_image.NegativeLightWarning"),
]

FWHM = 0.1
SIGMA = FWHM / np.sqrt(8 * np.log(2)) / PIXEL_SCALE
SHAPE = (60, 72)
FLUX = 1e-14
OBSERVATION = ni.Observation(shape=SHAPE, psf=ni.GaussianPSF(FWHM))


def arcs(ny=30, nx=36):
    """Something without any symmetry."""
    y, x = np.mgrid[:ny, :nx].astype(float)
    ring = np.exp(-0.5 * ((np.hypot(y - 14, x - 17) - 8) / 1.5) ** 2)
    return ring * (1 + 0.8 * np.sin(np.arctan2(y - 14, x - 17) + 0.4)) + 0.05 * (x > 20) * (y > 6)


def placed(samples, x, y, pitch, pa, flux=FLUX):
    return ni.image_source(samples, x, y, flux, pixel_scale=pitch * PIXEL_SCALE, pa=pa)


def test_passes_through_its_samples():
    """At the samples' places the sum of Gaussians is the image, and zero around it."""
    samples = np.random.default_rng(3).random((9, 14))
    light = ni.SourceImage(samples)
    margin = (light.weights.shape[0] - 9) // 2
    offset = np.arange(-12, 13)
    kernel = np.exp(-0.5 * offset**2)
    rows = np.apply_along_axis(np.convolve, 0, light.weights, kernel, "same")
    through = np.apply_along_axis(np.convolve, 1, rows, kernel, "same")
    inside = through[margin : margin + 9, margin : margin + 14]
    scale = inside.sum() / samples.sum()
    np.testing.assert_allclose(inside, scale * samples, atol=1e-12 * scale)
    around = np.pad(np.zeros_like(inside), 30, constant_values=1)[:, :]
    cut = through[margin - 30 : margin + 39, margin - 30 : margin + 44]
    assert np.abs(cut * around).max() < 1e-12 * scale


def test_two_answers_agree():
    """The dense solution and the one of 30 digits, which the tests below lean on."""
    samples = np.random.default_rng(0).random((5, 6))
    where = (1.3, 30.2, 20.7, 25.0)
    rate = image_rate(samples, *where, (40, 50), SIGMA)
    for pixel in ((20, 30), (24, 28), (9, 41)):
        assert rate[pixel] == pytest.approx(
            exact_pixel(samples, *where, pixel, SIGMA), abs=1e-12 * rate.max()
        )


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("pa", [0.0, 33.0, 90.0, 200.0])
@pytest.mark.parametrize("pitch", [0.2, 1.1, 5.0])
def test_tolerance_is_kept(pitch, pa, tolerance):
    samples = arcs()
    x, y = 34.3, 28.9
    rate = ni.count_rate(placed(samples, x, y, pitch, pa), OBSERVATION, tolerance=tolerance)
    truth = image_rate(samples, pitch, x, y, pa, SHAPE, SIGMA) * FLUX * OBSERVATION.cps_per_flux
    assert np.abs(rate - truth).max() <= tolerance * truth.max()


@pytest.mark.parametrize("seed", range(12))
def test_tolerance_on_random_images(seed):
    """Noise of either sign, single bright samples, any size, place, angle, mostly off the frame."""
    rng = np.random.default_rng(seed)
    samples = rng.normal(size=rng.integers(1, 28, 2)) + 0.6
    samples[tuple(rng.integers(0, samples.shape))] += rng.choice([30.0, 3000.0])
    pitch, pa = float(np.exp(rng.uniform(-3.5, 1.5))), float(rng.uniform(-400, 400))
    x, y = rng.uniform(-15, 90, 2)
    tolerance = float(10.0 ** rng.uniform(-9, -2))
    rate = ni.count_rate(placed(samples, x, y, pitch, pa), OBSERVATION, tolerance=tolerance)
    truth = image_rate(samples, pitch, x, y, pa, SHAPE, SIGMA) * FLUX * OBSERVATION.cps_per_flux
    assert np.abs(rate - truth).max() <= tolerance * np.abs(truth).max() + 1e-14 * FLUX * 1e16


def test_one_flux_however_large():
    """The whole flux arrives, in counts per second of a source of that flux."""
    wide = OBSERVATION.replace(shape=(160, 160))
    for pitch in (0.3, 1.1, 2.0):
        rate = ni.count_rate(placed(arcs(), 80, 80, pitch, 10), wide, tolerance=1e-8)
        assert rate.sum() == pytest.approx(FLUX * wide.cps_per_flux, rel=1e-7)


def test_integer_shifts():
    source = placed(arcs(), 30.25, 24.5, 1.1, 20)
    first = ni.count_rate(source, OBSERVATION, tolerance=1e-9)
    source["x"] += 7
    source["y"] += 5
    second = ni.count_rate(source, OBSERVATION, tolerance=1e-9)
    np.testing.assert_allclose(second[5:, 7:], first[:-5, :-7], atol=2e-9 * first.max())


@pytest.mark.parametrize(("pa", "turned"), [(90, 1), (180, 2), (-90, 3)])
def test_turned_by_right_angles(pa, turned):
    """The same as the array turned counter-clockwise, as [y, x] with y up."""
    samples = arcs()
    there = ni.count_rate(placed(samples, 34.3, 28.9, 1.1, pa), OBSERVATION, tolerance=1e-9)
    # rot90 turns clockwise where row 0 is the lowest
    array = np.rot90(samples, -turned)
    here = ni.count_rate(placed(array, 34.3, 28.9, 1.1, 0), OBSERVATION, tolerance=1e-9)
    np.testing.assert_allclose(there, here, atol=2e-9 * here.max())


def test_superposition():
    """Images, points and galaxies at once are the sum of each alone."""
    scene = [
        placed(arcs(), 20.3, 30.1, 1.1, 30),
        placed(np.ones((4, 7)), 50.0, 10.0, 0.7, 120, 3e-15),
        placed(arcs(), 60.3, 50.1, 0.4, 30),
        ni.source("point", 40.2, 20.7, 2e-15),
        ni.source("devaucouleurs", 33.0, 41.0, 5e-15, 6, 0.4, 70),
        ni.source("uniform", 15.0, 12.0, 5e-15, 4, 0.4, 70),
    ]
    for observation in (OBSERVATION, ni.Observation(shape=SHAPE)):
        rate = ni.count_rate(vstack(scene), observation, tolerance=1e-8)
        parts = sum(ni.count_rate(one, observation, tolerance=1e-10) for one in scene)
        np.testing.assert_allclose(rate, parts, atol=1.1e-8 * rate.max())


@pytest.mark.parametrize("psf", [None, ni.GaussianPSF(FWHM), ni.MoffatPSF(0.1, 2.5)])
def test_an_image_of_a_gaussian_is_the_gaussian(psf):
    """Sampled with a FWHM of 7 samples, flattened and turned."""
    sigma, ratio, pa = 3.0, 0.7, 25.0
    y, x = np.mgrid[:61, :61] - 30.0
    angle = np.radians(pa)
    along, across = y * np.cos(angle) - x * np.sin(angle), y * np.sin(angle) + x * np.cos(angle)
    samples = np.exp(-0.5 * ((along / sigma) ** 2 + (across / sigma / ratio) ** 2))
    observation = OBSERVATION.replace(psf=psf)
    image = ni.count_rate(placed(samples, 30.3, 28.6, 1.2, 15), observation, tolerance=1e-8)
    r_half = 1.2 * sigma * np.sqrt(2 * np.log(2))
    source = ni.source("gaussian", 30.3, 28.6, FLUX, r_half, 1 - ratio, pa + 15)
    truth = ni.count_rate(source, observation, tolerance=1e-9)
    assert np.abs(image - truth).max() < 3e-7 * truth.max()


def test_an_undersampled_psf():
    """A PSF whose spectrum is cut off reaches everywhere; an image is convolved with it too."""
    axis = np.arange(9) - 4
    row = np.exp(-0.5 * (axis / 0.7) ** 2)
    observation = OBSERVATION.replace(
        psf=ni.ImagePSF(np.outer(row, row), PIXEL_SCALE), shape=(40, 44)
    )
    y, x = np.mgrid[:41, :41] - 20.0
    samples = np.exp(-0.5 * (y**2 + x**2) / 9)
    image = ni.count_rate(placed(samples, 20.3, 18.6, 0.3, 30), observation, tolerance=1e-6)
    source = ni.source("gaussian", 20.3, 18.6, FLUX, 0.9 * np.sqrt(2 * np.log(2)), 0, 0)
    truth = ni.count_rate(source, observation, tolerance=1e-8)
    assert np.abs(image - truth).max() < 1.3e-6 * truth.max()


def blobs():
    """A well sampled image: FWHM of 6 samples, one blob negative."""
    y, x = np.mgrid[:48, :48].astype(float)
    samples = np.zeros((48, 48))
    for at_y, at_x, height in ((20.3, 18.1, 1.0), (27.8, 30.4, 0.6), (30.0, 15.5, -0.2)):
        samples += height * np.exp(-0.5 * ((y - at_y) ** 2 + (x - at_x) ** 2) / 2.5**2)
    return samples


def sinc_rate(samples, pitch, x, y, shape, sigma):
    """Share of a sinc-interpolated image's light in each pixel, by quadrature over frequency."""
    node, weight = np.polynomial.legendre.leggauss(400)
    k = 0.5 * node / pitch
    passed = 0.5 * weight / pitch * np.exp(-2 * (np.pi * sigma * k) ** 2) * np.sinc(k)

    def spread(n, count, at):
        place = at + pitch * (np.arange(count) - (count - 1) / 2)
        away = np.arange(n)[:, None] - place
        return np.cos(2 * np.pi * away[:, :, None] * k) @ passed

    rows = spread(shape[0], samples.shape[0], y)
    return rows @ samples @ spread(shape[1], samples.shape[1], x).T / samples.sum()


@pytest.mark.parametrize("pitch", [0.4, 0.9, 3.0])
def test_a_well_sampled_image_is_that_of_sinc_interpolation(pitch):
    rate = ni.count_rate(placed(blobs(), 34.3, 28.9, pitch, 0), OBSERVATION, tolerance=1e-9)
    rate /= FLUX * OBSERVATION.cps_per_flux
    truth = sinc_rate(blobs(), pitch, 34.3, 28.9, SHAPE, SIGMA)
    # What is not passed of a Gaussian of s samples adds up to about exp(-2 pi^2 (1 - 1 / s^2))
    # of its peak at either end of either axis.
    assert np.abs(rate - truth).max() < 4 * np.exp(-2 * np.pi**2 * (1 - 1 / 2.5**2)) * truth.max()


@pytest.mark.parametrize(("k", "passed"), [(0.25, 5e-5), (0.4, 0.02)])
def test_what_the_interpolation_passes(k, passed):
    """Of a wave with k cycles a sample so much is lost, as the docstring says."""
    light = ni.SourceImage(1 + np.cos(2 * np.pi * k * np.arange(400))[None, :] * np.ones((41, 1)))
    # transform of the sum of Gaussians, at the wave's frequency over that at none
    u = np.arange(light.weights.shape[1]) - (light.weights.shape[1] - 1) / 2
    line = light.weights.sum(axis=0)
    amplitude = np.abs(line @ np.exp(2j * np.pi * k * u)) * np.exp(-2 * (np.pi * k) ** 2)
    x = np.arange(400)
    sampled = np.abs((1 + np.cos(2 * np.pi * k * x)) @ np.exp(2j * np.pi * k * x)) / 400
    assert 1 - amplitude / sampled == pytest.approx(passed, rel=0.1)


def test_galsim():
    """To GalSim, by its nearly band-limited interpolation, a well sampled image is the same."""
    galsim = pytest.importorskip("galsim")
    pitch, pa, at = 0.9, 35.0, (34.3, 28.9)
    params = galsim.GSParams(folding_threshold=1e-5, maxk_threshold=1e-7, kvalue_accuracy=1e-9)
    light = galsim.InterpolatedImage(
        galsim.Image(blobs(), scale=pitch * PIXEL_SCALE),
        x_interpolant=galsim.Lanczos(30),
        k_interpolant=galsim.Lanczos(15),
        pad_factor=8,
        flux=1.0,
        gsparams=params,
    ).rotate(pa * galsim.degrees)
    seen = galsim.Convolve(light, galsim.Gaussian(fwhm=FWHM, flux=1.0), gsparams=params)
    # its first pixel is (1, 1)
    centre = galsim.PositionD((SHAPE[1] - 1) / 2, (SHAPE[0] - 1) / 2)
    drawn = seen.drawImage(
        nx=SHAPE[1],
        ny=SHAPE[0],
        scale=PIXEL_SCALE,
        offset=galsim.PositionD(*at) - centre,
        dtype=float,
    ).array
    rate = ni.count_rate(placed(blobs(), *at, pitch, pa), OBSERVATION, tolerance=1e-9)
    rate /= FLUX * OBSERVATION.cps_per_flux
    # the difference falls as GalSim's kernel grows: 6e-5 with Lanczos(15)
    assert np.abs(rate - drawn).max() < 1e-5 * rate.max()


def test_drag():
    scene = vstack([placed(arcs(), 20.3, 30.1, 1.1, 30), ni.source("point", 40, 20, 1e-15)])
    drag = ni.Drag(scene, OBSERVATION, [0], tolerance=1e-6)
    moved = scene[:1].copy()
    for x, y, pa in ((25.2, 31.7, 30), (70.0, 2.0, 30), (22.0, 40.0, 75), (-30.0, 10.0, 75)):
        moved["x"], moved["y"], moved["pa"] = [x], [y], [pa] * u.deg
        drag.move(moved)
        rate = ni.count_rate(vstack([moved, scene[1:]]), OBSERVATION, tolerance=1e-9)
        alone = ni.count_rate(placed(arcs(), 30, 30, 1.1, pa), OBSERVATION, tolerance=1e-6)
        assert np.abs(drag.rate - rate).max() <= 1e-6 * max(alone.max(), rate.max())


def test_signal_to_noise():
    """The noise-equivalent area is one over the sum of the squared shares of the pixels."""
    source = placed(arcs(), 50, 50, 0.6, 20)
    wide = OBSERVATION.replace(shape=(101, 101))
    share = image_rate(arcs(), 0.6, 50, 50, 20, wide.shape, SIGMA)
    counts = FLUX * wide.cps_per_flux * wide.exposure
    sky = wide.background_rate * wide.exposure
    expected = counts / np.sqrt(counts + sky / np.sum(share**2))
    assert ni.signal_to_noise(source, wide)[0] == pytest.approx(expected, rel=1e-4)


def test_forecast():
    """Flux and place of an image are forecast; its size and angle are known."""
    source = placed(arcs(), 30.2, 29.4, 0.9, 20)
    row = ni.forecast(source, OBSERVATION)[0]
    step = 1e-3

    def rate(**changes):
        moved = source.copy()
        for name, change in changes.items():
            moved[name] += change
        return ni.count_rate(moved, OBSERVATION, tolerance=1e-10)

    whole = rate()
    gradients = [whole / FLUX]
    gradients += [(rate(**{n: step}) - rate(**{n: -step})) / (2 * step) for n in ("x", "y")]
    seen = (whole + OBSERVATION.background_rate).ravel()
    stack = np.array([g.ravel() for g in gradients])
    errors = np.sqrt(np.diag(np.linalg.inv((stack / seen) @ stack.T)) / OBSERVATION.exposure)
    for name, expected in zip(("flux_error", "x_error", "y_error"), errors, strict=True):
        assert row[name].value == pytest.approx(expected, rel=2e-3)
    assert np.isnan(row["r_half_error"].value)
    assert np.isnan(row["pa_error"].value)


def test_spectrum_and_magnitude():
    one = ni.image_source(
        arcs(), 30, 30, 20 * u.ABmag, pixel_scale=0.04, spectrum="blackbody(30000 K)"
    )
    star = ni.source("point", 30, 30, 20 * u.ABmag, spectrum="blackbody(30000 K)")
    assert ni.expected_counts(one, OBSERVATION) == ni.expected_counts(star, OBSERVATION)


# ---------------------------------------------------------------- files


def scene():
    return vstack(
        [
            ni.source("point", 10, 20, 1e-15),
            placed(arcs(), 30.3, 28.9, 1.1, 30),
            placed(arcs(), 50.0, 20.0, 0.5, 200),
            placed(np.ones((3, 5)), 40.0, 40.0, 0.5, 0),
        ]
    )


def in_a_new_process(code):
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.mark.parametrize("compress", [False, True])
def test_exposure_comes_back_elsewhere(tmp_path, compress):
    exposure = ni.simulate(scene(), OBSERVATION, seed=5)
    path = tmp_path / "scene.fits"
    exposure.write(path, compress=compress)
    with fits.open(path) as hdus:
        assert [hdu.name for hdu in hdus].count("LIGHT1") == 1
        assert "LIGHT3" not in [hdu.name for hdu in hdus]
        np.testing.assert_array_equal(hdus["LIGHT1"].data, arcs())
    printed = in_a_new_process(
        "import napari_issis as ni\n"
        f"read = ni.Exposure.read({str(path)!r})\n"
        "again = ni.simulate(read.sources, read.observation, seed=read.seed)\n"
        "print(again == read, list(read.sources['image']))"
    )
    assert printed.startswith("True ")
    assert kept_image(str(exposure.sources["image"][1])).digest in printed


def test_catalogue_as_fits(tmp_path):
    path = tmp_path / "sources.fits"
    ni.write_sources(scene(), path)
    total = ni.expected_counts(scene(), OBSERVATION).sum()
    printed = in_a_new_process(
        "import napari_issis as ni\n"
        f"read = ni.read_sources({str(path)!r})\n"
        "print(repr(float(ni.expected_counts(read, ni.Observation()).sum())))"
    )
    assert float(printed) == pytest.approx(total, rel=1e-12)


def test_a_damaged_image_is_told(tmp_path):
    path = tmp_path / "scene.fits"
    ni.simulate(scene(), OBSERVATION).write(path)
    with fits.open(path) as hdus:
        hdus["LIGHT1"].data[3, 4] += 1
        hdus.writeto(path, overwrite=True, checksum=True)
    with pytest.raises(ValueError, match="the image LIGHT1 is damaged"):
        ni.Exposure.read(path)


def test_text_formats_name_the_file(tmp_path):
    picture, table = tmp_path / "arcs.fits", tmp_path / "sources.ecsv"
    fits.writeto(picture, arcs(), fits.Header([("PIXELSCL", 0.04)]))
    for mirrored in (False, True):
        one = ni.image_source(picture, 30, 30, FLUX, mirrored=mirrored)
        ni.write_sources(one, table, overwrite=True)
        printed = in_a_new_process(
            "import napari_issis as ni\n"
            f"read = ni.read_sources({str(table)!r})\n"
            "from napari_issis.source_image import NegativeLightWarning, kept_image\n"
            "print(repr(float(kept_image(str(read['image'][0])).array[3, 4])))"
        )
        assert float(printed) == (np.fliplr(arcs()) if mirrored else arcs())[3, 4]
    picture.unlink()
    with pytest.raises(ValueError, match=r"row 0, image: the image is no longer in .*as FITS"):
        ni.write_sources(one, table, overwrite=True)
    with pytest.raises(ValueError, match=r"row 1, image: the image was an array.*as FITS"):
        ni.write_sources(scene(), tmp_path / "other.ecsv")
    assert not (tmp_path / "other.ecsv").exists()
    code = f"import napari_issis as ni\nni.read_sources({str(table)!r})"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "row 0, image: the image" in result.stderr
    assert "holds no image with that digest; load it with" in result.stderr


def test_workers_in_other_processes():
    plan = ni.monitor(scene(), OBSERVATION, [0.0, 1.0])
    content = pickle.dumps(plan.exposures[0])
    printed = in_a_new_process(
        "import pickle, napari_issis as ni\n"
        f"one = pickle.loads({content!r})\n"
        "print(ni.simulate(one.sources, one.observation, seed=one.seed).counts.sum())"
    )
    here = ni.simulate(scene(), OBSERVATION, seed=plan.exposures[0].seed)
    assert int(printed) == here.counts.sum()


# ---------------------------------------------------------------- what is said of errors


def test_file_of_another_telescope(tmp_path):
    path = tmp_path / "hst.fits"
    header = fits.Header(
        [
            ("CTYPE1", "RA---TAN"),
            ("CTYPE2", "DEC--TAN"),
            ("CRVAL1", 10.0),
            ("CRVAL2", 20.0),
            ("CD1_1", -0.05 / 3600),
            ("CD1_2", 0.0),
            ("CD2_1", 0.0),
            ("CD2_2", 0.05 / 3600),
        ]
    )
    fits.HDUList([fits.PrimaryHDU(), fits.ImageHDU(arcs().astype(">f4"), header)]).writeto(path)
    one = ni.image_source(path, 30, 30, FLUX)
    light = kept_image(str(one["image"][0]))
    assert one["r_half"][0].value == pytest.approx(light.r_half * 0.05 / PIXEL_SCALE, rel=1e-12)
    np.testing.assert_array_equal(light.array, arcs().astype(np.float32))
    assert ni.image_source(path, 30, 30, FLUX, hdu=1)["image"] == one["image"]
    with pytest.raises(ValueError, match="extension 0 is no image"):
        ni.image_source(path, 30, 30, FLUX, hdu=0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: placed(np.ones(4), 0, 0, 1, 0), r"two dimensions; this array's shape is \(4,\)"),
        (lambda: placed([[1, np.inf]], 0, 0, 1, 0), "holds inf at x = 1, y = 0"),
        (lambda: placed([[1, -1]], 0, 0, 1, 0), "sums to 0.0; the sum must be positive"),
        (lambda: placed([["a"]], 0, 0, 1, 0), "no array of numbers"),
        (lambda: placed(np.ones((1025, 1024)), 0, 0, 1, 0), "1024 x 1025 samples, more than"),
        (lambda: ni.image_source(arcs(), 0, 0, FLUX), "an array has no pixel scale"),
        (lambda: placed(arcs(), 0, 0, 0, 0), "pixel_scale is 0"),
        (lambda: placed(arcs(), 0, 0, 1, 0, flux=-1), "flux: -1 is not allowed"),
        (lambda: placed(arcs(), np.nan, 0, 1, 0), "x: nan is not allowed"),
        (lambda: placed(arcs(), 0, 0, 1, np.nan), "pa: nan is not allowed"),
        (lambda: ni.source("image", 0, 0), "image_source"),
        (lambda: kept_image("array#0123456789abcdef"), "is not loaded; load it with"),
        (lambda: kept_image("arcs.fits"), "names no image"),
    ],
)
def test_bad_values(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_bad_tables():
    table = placed(arcs(), 30, 30, 1, 0)
    table["ellipticity"] = [0.3]
    with pytest.raises(ValueError, match=r"row 0, ellipticity: 0.3 .* 0 for an image"):
        ni.count_rate(table)
    del table["image"]
    table["ellipticity"] = [0.0]
    with pytest.raises(ValueError, match="no column image, which row 0"):
        ni.count_rate(table)


def test_much_negative_light_is_told():
    samples = arcs()
    samples[0] -= 0.1
    share = 100 * -samples[samples < 0].sum() / samples.sum()
    with pytest.warns(NegativeLightWarning, match=f"hold {share:.2g} % of its light") as warned:
        placed(samples, 30, 30, 1, 0)
    assert len(warned) == 1


def test_scenes_without_images_pay_nothing(monkeypatch):
    """No image is looked for, and the table has no column for it."""

    def looked_for(text):
        raise AssertionError(text)

    monkeypatch.setattr("napari_issis.source_image.kept_image", looked_for)
    monkeypatch.setattr("napari_issis.render.images.kept_image", looked_for)
    monkeypatch.setattr("napari_issis.render.image_gaussians", looked_for)
    table = vstack([ni.source("point", 10, 20), ni.source("sersic", 30, 30, n=2.0)])
    exposure = ni.simulate(table, OBSERVATION)
    assert "image" not in exposure.sources.colnames
    ni.signal_to_noise(table, OBSERVATION)
    ni.forecast(table, OBSERVATION)
    ni.Drag(table, OBSERVATION, [1])
