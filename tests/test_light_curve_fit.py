"""Recovered light curves against counts of a pixel model of our own, and against scipy."""

import numpy as np
import pytest
from astropy.table import vstack
from scipy import optimize, special, stats

import napari_issis as ni
from napari_issis import light_curve_fit
from napari_issis.flux_fit import fit_fluxes, flux_errors

SCALE, FWHM, SKY = 0.036, 0.1, 0.05
SIGMA = FWHM / SCALE / 2.3548200450309493
SHAPE = (28, 33)
FRAME = ni.Observation(
    psf=ni.GaussianPSF(FWHM), background=SKY, shape=SHAPE, exposure=200.0, pointing=None
)
# cps, x, y, and sigma of the profile in pixels: three images and their lens galaxy
SCENE = [(40.0, 13.2, 18.9, 0.0), (25.0, 17.8, 16.1, 0.0), (12.0, 16.4, 9.7, 0.0)]
SCENE += [(60.0, 16.1, 14.0, 4.0)]
DELAYS = (0.0, 4.0, 9.0)
DITHERS = [(0.0, 0.0), (1.3, -0.6)]
EPOCHS, FALSE_ALARM = 600, 1e-6

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def brightness(time):
    return 1 + 0.3 * np.sin(time / 7) + 0.1 * np.cos(time / 2.3)


def seconds(epoch):
    return 200.0 + 50.0 * (epoch % 3)


def plan(epochs=EPOCHS, **options):
    rows = [ni.source("point", x, y, rate / FRAME.cps_per_flux) for rate, x, y, s in SCENE[:3]]
    rate, x, y, sigma = SCENE[3]
    rows.append(
        ni.source("gaussian", x, y, rate / FRAME.cps_per_flux, 1.1774100225154747 * sigma, 0.0)
    )
    settings = {
        "light_curves": dict.fromkeys(range(3), brightness),
        "delays": dict(enumerate(DELAYS)),
        "exposures": 2,
        "dithers": DITHERS,
        "seed": 3,
    }
    times = [ni.Epoch(2.0 * i, changes={"exposure": seconds(i)}) for i in range(epochs)]
    return ni.monitor(vstack(rows), FRAME, times, **{**settings, **options})


def images(dither):
    """Pixel integrals of the unit sources from the error function, shape (sources, pixels)."""

    def along(centre, sigma, n):
        edges = np.arange(n + 1) - 0.5 - centre
        return np.diff(0.5 * special.erf(edges / (np.sqrt(2) * sigma)))

    result = []
    for _, x, y, own in SCENE:
        sigma = np.hypot(SIGMA, own)
        columns = along(x - dither[0], sigma, SHAPE[1])
        result.append(np.outer(along(y - dither[1], sigma, SHAPE[0]), columns).ravel())
    return np.array(result)


def rates(times, sign=1.0):
    """Count rates of the sources at these times, shape (times, sources)."""
    shifts = sign * np.array(DELAYS)
    factors = brightness(np.asarray(times)[:, None] - shifts)
    return np.column_stack([factors, np.ones(len(times))]) * [one[0] for one in SCENE]


def observed(sign=1.0, exposure=1.0, sky=SKY, dithers=DITHERS, order=1):
    """Counts drawn from our own model, shape (epochs x 2, ny, nx)."""
    rng = np.random.default_rng(11)
    frames = []
    for i, rate in enumerate(rates(2.0 * np.arange(EPOCHS), sign)[::order]):
        for dither in dithers:
            mean = (rate @ images(dither) + sky) * (seconds(i) * exposure)
            frames.append(rng.poisson(mean).reshape(SHAPE))
    return np.array(frames)


def pulls(counts):
    table = ni.fit_light_curves(plan(), counts)
    assert table["epoch"][4 * 7 + 2] == 7
    assert table["source"][4 * 7 + 2] == 2
    assert table["time"][4 * 7 + 2] == 14.0
    expected = rates(2.0 * np.arange(EPOCHS)).ravel() / FRAME.cps_per_flux
    difference = table["flux"].value - expected
    return (difference / table["error"].value).reshape(EPOCHS, 4), table["truth"].value / expected


def alarms(pulls):
    """Sources whose pulls have another mean than 0 or another variance than 1.

    The mean of n pulls is normal with variance 1/n, the sum of their squares follows chi
    squared with n degrees of freedom; the 8 tests together raise a false alarm once in 10^6.
    """
    n, share = len(pulls), FALSE_ALARM / 8 / 2
    mean = np.abs(pulls.mean(axis=0)) * np.sqrt(n) > stats.norm.isf(share)
    low, high = stats.chi2.ppf([share, 1 - share], n)
    total = (pulls**2).sum(axis=0)
    return mean | (total < low) | (total > high)


def test_pulls():
    """Catches a wrong flux, error, sky, dither, exposure time, delay or order of epochs."""
    found, truth = pulls(observed())
    assert not alarms(found).any(), (found.mean(axis=0), found.var(axis=0))
    np.testing.assert_allclose(truth, 1.0, rtol=1e-12)


@pytest.mark.parametrize(
    "mistake",
    [
        {"order": -1},
        {"sign": -1.0},
        {"exposure": 1.02},
        {"sky": 0.0},
        {"dithers": [(0.0, 0.0), (-1.3, 0.6)]},
    ],
    ids=lambda mistake: next(iter(mistake)),
)
def test_the_alarm_is_raised(mistake):
    """What the test of the pulls would say of such a mistake: that it can fail."""
    assert alarms(pulls(observed(**mistake))[0]).any()


def test_likelihood_is_largest():
    """Catches weights of the data, and a fit of co-added frames: scipy finds the same maximum."""
    counts = observed()[:6]
    table = ni.fit_light_curves(plan(epochs=3), counts)
    for epoch in range(3):
        model = np.concatenate([images(d) for d in DITHERS], axis=1) * seconds(epoch)
        seen = counts[2 * epoch : 2 * epoch + 2].ravel()
        scale = np.array([one[0] for one in SCENE])

        def deviance(p, model=model, seen=seen, epoch=epoch, scale=scale):
            mean = (p * scale) @ model + SKY * seconds(epoch)
            value = (mean - special.xlogy(seen, mean)).sum()
            return value, scale * (model @ (1 - seen / mean))

        best = optimize.minimize(deviance, np.ones(4), jac=True, method="BFGS", tol=1e-6)
        own = table[table["epoch"] == epoch]
        error = own["error"].value * FRAME.cps_per_flux
        fitted = own["flux"].value * FRAME.cps_per_flux
        assert np.all(np.abs(fitted - best.x * scale) < 2e-3 * error)
        truth = rates([2.0 * epoch])[0]
        mean = truth @ model + SKY * seconds(epoch)
        information = (model / mean) @ model.T
        np.testing.assert_allclose(error, np.sqrt(np.diag(np.linalg.inv(information))), rtol=1e-4)


def test_faint_sources_by_brute_force():
    """Catches steps beyond the maximum where counts are few, and fluxes kept from negative."""
    rng = np.random.default_rng(5)
    model, sky = images((0.0, 0.0))[1:3], np.full(SHAPE[0] * SHAPE[1], 0.3)
    negative = 0
    for _ in range(20):
        seen = rng.poisson(sky + np.array([2.0, 9.0]) @ model)
        fitted = fit_fluxes(seen, model, sky)

        def minus(p, seen=seen):
            mean = p @ model + sky
            with np.errstate(invalid="ignore", divide="ignore"):
                value = (mean - special.xlogy(seen, mean)).sum()
            return value if np.all(mean > 0) else np.inf

        options = {"xatol": 1e-6, "fatol": 1e-9, "maxiter": 5000}
        best = optimize.minimize(minus, [3.0, 3.0], method="Nelder-Mead", options=options)
        np.testing.assert_allclose(fitted, best.x, atol=1e-3)
        negative += (fitted < 0).any()
    assert negative


def test_a_single_source_without_a_sky():
    """Its flux is all counts over all light, and exactly 0 if there are none."""
    model = images((0.0, 0.0))[:1]
    dark = np.zeros(model.shape[1])
    seen = np.random.default_rng(1).poisson(7.0 * model[0])
    assert fit_fluxes(seen, model, dark) == pytest.approx(seen.sum() / model.sum(), rel=1e-9)
    assert fit_fluxes(0 * seen, model, dark) == pytest.approx(0.0, abs=1e-6)
    error = flux_errors(model, 7.0 * model[0])
    assert error == pytest.approx(np.sqrt(7.0 / model.sum()), rel=1e-9)


def test_what_is_undetermined_is_said_and_spoils_nothing():
    stars = vstack([ni.source("point", x, 14.0, 4e-15) for x in (10.0, 10.0, 22.0, 1e6)])
    table = ni.fit_light_curves(ni.monitor(stars, FRAME, [0.0]))
    assert np.isinf(table["error"].value).tolist() == [True, True, False, True]
    assert np.isnan(table["flux"].value).tolist() == [True, True, False, True]
    assert abs(table["flux"][2] - table["truth"][2]) < 5 * table["error"][2]


def test_filters_and_spectra_count():
    """Catches a rate per flux that is that of a flat spectrum behind open wheels."""
    stars = vstack(
        [
            ni.source("point", 10.3, 14.0, 4e-14, spectrum="blackbody(9000 K)"),
            ni.source("point", 22.0, 13.2, 9e-14),
        ]
    )
    frame = FRAME.replace(filters=("NF1", "N2500"), dark=0.01, exposure=1e4)
    table = ni.fit_light_curves(ni.monitor(stars, frame, [0.0] * 50, seed=2))
    found = ((table["flux"] - table["truth"]) / table["error"]).value.reshape(50, 2)
    assert np.all(np.abs(found.mean(axis=0)) < 5.5 / np.sqrt(50))
    np.testing.assert_allclose(table["truth"].value[:2], [4e-14, 9e-14])


def test_an_image_is_a_source_like_the_others():
    """Catches an image taken for another one, whose template is kept under the same name."""
    y, x = np.indices((21, 21)) - 10.0
    blobs = [np.exp(-(x**2 + (y * q) ** 2) / 18) for q in (1.0, 2.5)]
    for blob in blobs:
        scene = vstack(
            [
                ni.source("point", 20.0, 9.0, 3e-16),
                ni.image_source(blob, 14.0, 15.0, 2e-15, pixel_scale=SCALE),
            ]
        )
        table = ni.fit_light_curves(ni.monitor(scene, FRAME, [0.0] * 60, seed=6))
        found = ((table["flux"] - table["truth"]) / table["error"]).value.reshape(60, 2)
        assert np.all(np.abs(found.mean(axis=0)) < 5.5 / np.sqrt(60))
        low, high = stats.chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], 60)
        total = (found**2).sum(axis=0)
        assert np.all((total > low) & (total < high))


def test_images_are_rendered_once_for_each_dither(monkeypatch):
    calls = []
    real = light_curve_fit.count_rate

    def counted(table, frame):
        calls.append(len(table))
        return real(table, frame)

    monkeypatch.setattr(light_curve_fit, "count_rate", counted)
    seen = []
    ni.fit_light_curves(plan(epochs=5), progress=lambda *numbers: seen.append(numbers))
    assert calls == [1] * 8
    assert seen == [(done, 5) for done in range(6)]


def test_files_give_the_same(tmp_path):
    pytest.importorskip("dask")
    sequence = plan(epochs=2)
    files = sequence.run(tmp_path)
    here, there = ni.fit_light_curves(sequence), ni.fit_light_curves(sequence, tmp_path)
    assert np.array_equal(here["flux"], there["flux"])
    with pytest.raises(ValueError, match="another sequence"):
        ni.fit_light_curves(plan(epochs=2, seed=4), tmp_path)
    files[3].unlink()
    with pytest.raises(FileNotFoundError):
        ni.fit_light_curves(sequence, tmp_path)


def test_bad_input():
    sequence = plan(epochs=1)
    good = np.zeros((2, *SHAPE), dtype=int)
    for counts, message in (
        (good[:1], r"shape \(1, 28, 33\); the sequence has \(2, 28, 33\)"),
        (good - 1, "counts of exposure 0 are int64, -1 or more"),
        (good + 0.5, "counts of exposure 0 are float64"),
    ):
        with pytest.raises(ValueError, match=message):
            ni.fit_light_curves(sequence, counts)
    lossy = FRAME.replace(detector=ni.Detector(dead_time=1e-3))
    with pytest.raises(ValueError, match="linear detector only"):
        ni.fit_light_curves(ni.monitor(sequence.sources, lossy, [0.0]))
    with pytest.raises(ValueError, match="no sources"):
        ni.fit_light_curves(ni.monitor(sequence.sources[:0], FRAME, [0.0]))
    many = ni.random_sources("point", 500, seed=1)
    with pytest.raises(ValueError, match=r"500 sources .* 1024 x 1024 pixels needs 4\.2 GB"):
        ni.fit_light_curves(ni.monitor(many, FRAME.replace(shape=(1024, 1024)), [0.0]))
