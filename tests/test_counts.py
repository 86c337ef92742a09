"""The counts against mpmath, scipy.stats.poisson and what independence promises.

The frames are fixed by their seeds, so a test passes or fails for good. Each statistical test
states how probable its failure would have been for another seed.
"""

import mpmath
import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtri, pdtr

from napari_issis.counts import pixel_uniforms, poisson_counts
from napari_issis.poisson_exact import poisson_cdf, poisson_quantile_exact
from napari_issis.poisson_quantile import poisson_quantile

SMALLEST, LARGEST = 2.0**-54, 1 - 2.0**-53


@pytest.fixture(autouse=True)
def _fifty_digits():
    with mpmath.workdps(50):
        yield


def reference_cdf(k, lam):
    """P(counts <= k) to 30 digits and more, from mpmath's own functions."""
    k, lam = mpmath.mpf(int(k)), mpmath.mpf(float(lam))
    if k < 0:
        return mpmath.mpf(0)
    if lam < 1e4:
        return mpmath.gammainc(k + 1, lam, regularized=True)
    pmf = mpmath.exp(k * mpmath.log(lam) - lam - mpmath.loggamma(k + 1))
    scale = mpmath.sqrt(lam) if k < lam else -mpmath.sqrt(lam)
    integral = mpmath.quad(
        lambda t: mpmath.exp(k * mpmath.log1p(t * scale / lam) - t * scale),
        [0, 1, 2, 4, 8, 16],
    )
    tail = pmf * mpmath.sqrt(lam) * integral
    return tail if k < lam else 1 - tail


def random_lambdas(rng, n):
    return np.concatenate([10 ** rng.uniform(-6, 15, n // 2), 10 ** rng.uniform(-1, 3, n - n // 2)])


def random_probabilities(rng, n):
    """Uniform ones and both tails down to what 53 bits hold."""
    tail = 10 ** rng.uniform(-16.25, -0.3, n)
    u = rng.choice([0, 1, 2], n)
    u = np.where(u == 0, rng.random(n), np.where(u == 1, tail, 1 - tail))
    return np.clip(u, SMALLEST, LARGEST)


def one(u, lam):
    return int(poisson_quantile(np.array([u]), np.array([lam]))[0])


def test_random_quantiles_against_mpmath():
    """Catches an off-by-one anywhere: a lost +1, a wrong coefficient, a tail cut short."""
    rng = np.random.default_rng(11)
    lam, u = random_lambdas(rng, 300), random_probabilities(rng, 300)
    for u_, lam_, k in zip(u, lam, poisson_quantile(u, lam), strict=True):
        u_exact = mpmath.mpf(float(u_))
        assert reference_cdf(k - 1, lam_) < u_exact <= reference_cdf(k, lam_), (u_, lam_, k)


@pytest.mark.parametrize("lam", [1e-6, 1e-3, 0.03, 0.7, 3.0, 9.99, 10.0, 37.5, 1e3, 1e5, 3e8, 1e15])
def test_one_ulp_from_a_boundary(lam):
    """Catches a decision by a 16-digit CDF: u within an ulp of CDF(k) needs more digits."""
    wanted, got = [], []
    for z in (-8, -5, -2, -0.5, 0, 0.5, 2, 5, 8):
        k = max(int(lam + z * lam**0.5), 0)
        at = reference_cdf(k, lam)
        below, above = reference_cdf(k - 1, lam), reference_cdf(k + 1, lam)
        nearest = float(at)
        for u in (np.nextafter(nearest, 0), nearest, np.nextafter(nearest, 1)):
            if SMALLEST <= u <= LARGEST and below < mpmath.mpf(float(u)) <= above:
                wanted.append(k if mpmath.mpf(float(u)) <= at else k + 1)
                got.append(one(u, lam))
    assert len(set(wanted)) > 1
    assert got == wanted


def test_boundaries_in_the_upper_tail_of_a_bright_pixel():
    """Catches trust in scipy's CDF, off by 1e-6 there: u is at 1e-6 of a count from CDF(k)."""
    lam = 1e15
    k = int(lam + 4.6 * lam**0.5)
    cdf = reference_cdf(k, lam)
    pmf = cdf - reference_cdf(k - 1, lam)
    wanted, got = [], []
    for _ in range(3000):
        if abs(float(cdf) - cdf) < 2e-19:
            wanted.append(k if float(cdf) <= cdf else k + 1)
            got.append(one(float(cdf), lam))
        k += 1
        pmf *= mpmath.mpf(lam) / k
        cdf += pmf
    assert len(got) >= 4
    assert got == wanted


def test_expansion_bound_holds_near_integers():
    """Catches a bound on the expansion's error that is too small: u is placed within it."""
    rng = np.random.default_rng(12)
    u, lam, wanted = [], [], []
    while len(u) < 500:
        lam_ = 10 ** rng.uniform(1, 4)
        z = rng.uniform(-7, 7)
        bound = 3e-3 * (z * z + 2) ** 3 / lam_**2
        k = round(lam_ + z * lam_**0.5)
        if k < 1 or bound > 0.4:
            continue
        distance = rng.choice([-1, 1]) * 10 ** rng.uniform(-3, 0.2) * bound
        x = mpmath.mpf(k) + mpmath.mpf(float(distance))
        u_ = float(mpmath.gammainc(x, lam_, regularized=True))
        if SMALLEST < u_ < LARGEST:
            u.append(u_)
            lam.append(lam_)
            wanted.append(k - 1 if u_ <= mpmath.gammainc(k, lam_, regularized=True) else k)
    np.testing.assert_array_equal(poisson_quantile(np.array(u), np.array(lam)), wanted)


@pytest.mark.parametrize("lam", [0.5, 30.0, 1900.0, 2100.0, 1e6, 1e15])
@pytest.mark.parametrize("z", [-8.3, -3, 0, 0.3, 8.3])
def test_thirty_digits(lam, z):
    """Catches a short Stirling series, a coarse trapezoidal step, a wrong side of lam."""
    k = max(int(lam + z * lam**0.5), 0)
    wanted, got = reference_cdf(k, lam), mpmath.mpf(str(poisson_cdf(k, lam)))
    assert abs(got - wanted) <= 1e-30 * min(wanted, 1 - wanted)


@pytest.mark.parametrize("guess", [-3, 0, 2, 7, 40])
def test_exact_search_does_not_depend_on_the_guess(guess):
    """Catches a search that walks in one direction only."""
    assert poisson_quantile_exact(0.3, 5.0, guess) == stats.poisson.ppf(0.3, 5.0) == 4


def test_scipy_is_as_accurate_as_assumed():
    """Catches a scipy whose incomplete gamma function is worse than the 1e-10 relied upon."""
    rng = np.random.default_rng(13)
    worst = 0.0
    for lam, z in zip(10 ** rng.uniform(1, 4, 300), rng.uniform(-8.3, 8.3, 300), strict=True):
        k = max(int(lam + z * lam**0.5), 0)
        worst = max(worst, abs(float(pdtr(k, lam) / reference_cdf(k, lam) - 1)))
    assert worst < 1e-11


def test_ndtri_is_as_accurate_as_assumed():
    """Catches a scipy whose normal quantile is worse than the 2e-15 (z^2 + 2) relied upon."""
    u = random_probabilities(np.random.default_rng(14), 400)
    for u_, z in zip(u, ndtri(u), strict=True):
        error = (mpmath.ncdf(float(z)) - mpmath.mpf(float(u_))) / mpmath.npdf(float(z))
        assert abs(error) < 1e-15 * (z * z + 2)


PINNED = [
    "0x1.ccf2d9115c140p-7",
    "0x1.07f42307c03cep-2",
    "0x1.62288cd825d4ap-1",
    "0x1.e6b9182577c98p-1",
]
LAMBDAS = [1e-3, 0.03, 0.3, 1.0, 3.0, 9.9, 10.1, 30.0, 300.0, 1e4, 1e5, 1e7]


@pytest.mark.parametrize("lam", LAMBDAS)
def test_counts_are_poisson(lam):
    """Chi-square of 262144 counts against scipy.stats.poisson; 1e-6 for all lambdas together.

    Catches a biased uniform, a wrong expectation, a quantile that is off by one for a few
    per cent of the pixels.
    """
    counts = poisson_counts(np.full((512, 512), lam), 5).ravel()
    law = stats.poisson(lam)
    edges = np.unique(law.ppf(np.linspace(0, 1, 101)[1:-1]))
    edges = np.unique(np.concatenate([edges, law.ppf([1 - 1e-3, 1 - 1e-4])]))
    cumulative = np.concatenate([[0], law.cdf(edges), [1]])
    wanted = counts.size * np.diff(cumulative)
    found = np.bincount(np.searchsorted(edges, counts), minlength=wanted.size)
    enough = wanted > 10
    assert wanted[~enough].sum() < 10
    wanted = np.append(wanted[enough], wanted[~enough].sum() + 1e-300)
    found = np.append(found[enough], found[~enough].sum())
    if wanted[-1] < 10:
        wanted, found = (np.append(a[:-2], a[-2:].sum()) for a in (wanted, found))
    assert stats.chisquare(found, wanted, sum_check=False).pvalue > 1e-6 / len(LAMBDAS)


def test_mean_and_variance_at_the_upper_limit():
    """Catches rounding of counts above 2^53 / 10; 1.1e-6 by chance (5 sigma, two figures)."""
    lam = 1e15
    deviation = (poisson_counts(np.full((512, 512), lam), 6) - int(lam)) / np.sqrt(lam)
    n = deviation.size
    assert abs(deviation.mean()) < 5 / np.sqrt(n)
    assert abs(deviation.var() - 1) < 5 * np.sqrt(2 / n)
    odd = np.mean(poisson_counts(np.full((512, 512), lam), 6) % 2)
    assert abs(odd - 0.5) < 5 * 0.5 / np.sqrt(n)


def test_pixels_rows_and_seeds_are_independent():
    """Correlations of normals and of their squares, 1e-6 for the 16 of them by chance.

    Catches rows that share a counter, seeds that are shifts or copies of each other.
    """
    threshold = stats.norm.isf(0.5e-6 / 16) / 512
    frames = {seed: ndtri(pixel_uniforms(seed, (512, 512))) for seed in (0, 1, 2, 2**64, 2**200)}
    a = frames[0]
    pairs = [
        (a, np.roll(a, 1, axis=1)),
        (a, np.roll(a, 4, axis=1)),
        (a, np.roll(a, 1, axis=0)),
        (a, a.T * np.where(np.eye(512), 0, 1)),
        *((a, frames[seed]) for seed in (1, 2, 2**64, 2**200)),
    ]
    for first, second in pairs:
        assert abs(np.mean(first * second)) < threshold
        assert abs(np.mean((first**2 - 1) * (second**2 - 1))) / 2 < threshold


def test_counts_never_fall_when_lambda_rises():
    """Catches two methods that disagree where one takes over from the other."""
    rng = np.random.default_rng(15)
    lam = 10 ** rng.uniform(-2, 5, (512, 512))
    lam[:256] = np.geomspace(9.9, 10.1, 256)[:, None]
    more = lam * (1 + 10 ** rng.uniform(-16, -1, lam.shape))
    assert np.all(poisson_counts(more, 7) >= poisson_counts(lam, 7))
    column = np.geomspace(1e-3, 1e4, 4000)
    for u in (SMALLEST, 0.01, 0.5, 0.99, LARGEST):
        assert np.all(np.diff(poisson_quantile(np.full(column.shape, u), column)) >= 0)


def test_a_pixel_keeps_its_counts_if_its_lambda_stays():
    """Catches noise drawn in sequence, where one pixel's change shifts the others'."""
    lam = 10 ** np.random.default_rng(16).uniform(-2, 4, (200, 300))
    before = poisson_counts(lam, 8)
    changed = np.zeros(lam.shape, bool)
    changed[50:60, 100:130] = True
    after = poisson_counts(np.where(changed, lam * 3, lam), 8)
    np.testing.assert_array_equal(after[~changed], before[~changed])
    assert np.all(after[changed] >= before[changed])
    assert np.any(after[changed] > before[changed])


def test_recomputing_only_what_changed_gives_the_same():
    """Catches uniforms taken from the wrong pixels, or the earlier counts overwritten."""
    rng = np.random.default_rng(17)
    lam = 10 ** rng.uniform(-2, 4, (200, 300))
    counts = poisson_counts(lam, 9)
    kept = counts.copy()
    moved = lam.copy()
    moved[20:50, 70:90] += rng.uniform(-0.005, 50, (30, 20))
    again = poisson_counts(moved, 9, previous=(lam, counts))
    np.testing.assert_array_equal(again, poisson_counts(moved, 9))
    np.testing.assert_array_equal(counts, kept)


def test_a_small_frame_is_the_corner_of_a_large_one():
    """Catches uniforms that run through the frame row after row."""
    large = pixel_uniforms(3, (512, 512))
    np.testing.assert_array_equal(pixel_uniforms(3, (256, 200)), large[:256, :200])
    lam = 10 ** np.random.default_rng(18).uniform(-2, 4, (512, 512))
    np.testing.assert_array_equal(
        poisson_counts(lam[:256, :256], 3), poisson_counts(lam, 3)[:256, :256]
    )


def test_uniforms_are_the_same_for_ever():
    """Pinned: another value changes the noise of every seed that anyone has published."""
    assert [x.hex() for x in pixel_uniforms(0, (2, 2)).ravel()] == PINNED
    assert not pixel_uniforms(0, (2, 2)).flags.writeable


def test_uniforms_fill_the_open_interval():
    """Catches 0 or 1, a 32-bit uniform, and a distribution that is not uniform (1e-6)."""
    u = pixel_uniforms(4, (512, 512))
    assert 0 < u.min() < 1e-4
    assert 1 - 1e-4 < u.max() < 1
    assert np.unique(u).size == u.size
    assert np.unique((u * 2.0**53) % 2.0**21).size > 0.9 * 2.0**21 * (1 - np.exp(-(2.0**-3)))
    assert stats.kstest(u.ravel(), "uniform").pvalue > 1e-6


def test_uniforms_are_never_zero_or_one(monkeypatch):
    """Catches log(0) and endless sums at the bits that a random frame never holds."""

    class Philox:
        def __init__(self, **state):
            pass

        def random_raw(self, n):
            return np.array([0, 2**64 - 1], np.uint64)

    monkeypatch.setattr(np.random, "Philox", Philox)
    seed = 123456789  # of no other test: the frame is cached
    assert pixel_uniforms(seed, (1, 2)).tolist() == [[SMALLEST, LARGEST]]
    counts = poisson_counts(np.full((1, 2), 10.0), seed)
    assert counts.tolist() == [[0, 45]]  # mpmath: 1 - CDF(44; 10) > 2^-53 > 1 - CDF(45; 10)


def test_zero_and_next_to_zero():
    for u in (SMALLEST, 0.5, LARGEST):
        assert one(u, 0.0) == one(u, -0.0) == one(u, 5e-324) == one(u, 1e-16) == 0
    assert one(LARGEST, 2.0**-53 * 1.5) == 1
    assert poisson_counts(np.zeros((0, 5)), 0).shape == (0, 5)
    counts = poisson_counts(np.zeros((3, 5)), 0)
    assert counts.dtype == np.int64
    assert not counts.any()


@pytest.mark.parametrize(
    ("value", "named"),
    [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf"), (-1e-9, "-1e-09"), (1.1e15, "1.1e[+]15")],
)
def test_bad_lambda_is_named(value, named):
    lam = np.ones((4, 6))
    lam[2, 5] = value
    with pytest.raises(ValueError, match=rf"\[2, 5\] expects {named} counts"):
        poisson_counts(lam, 0)


@pytest.mark.parametrize("seed", [-1, 1.0, "7", None])
def test_bad_seed_is_named(seed):
    for call in (
        lambda: pixel_uniforms(seed, (2, 2)),
        lambda: poisson_counts(np.ones((2, 2)), seed),
    ):
        with pytest.raises(ValueError, match=f"seed is {seed!r}"):
            call()


def test_numpy_integers_are_seeds():
    np.testing.assert_array_equal(pixel_uniforms(np.int64(3), (2, 2)), pixel_uniforms(3, (2, 2)))


def test_bad_shapes():
    with pytest.raises(ValueError, match="1 dimensions"):
        poisson_counts(np.ones(3), 0)
    with pytest.raises(ValueError, match=r"previous has the shapes \(2, 3\) and \(3, 2\)"):
        poisson_counts(np.ones((2, 3)), 0, previous=(np.ones((2, 3)), np.ones((3, 2), np.int64)))


def test_only_the_windows_are_looked_at():
    """Catches windows that are ignored, and pixels of a window that keep their old counts."""
    rng = np.random.default_rng(3)
    before = rng.uniform(0, 50, (40, 50))
    counts = poisson_counts(before, 5)
    expected = before.copy()
    expected[3:20, 10:30] += rng.uniform(0, 5, (17, 20))
    expected[15:35, 25:45] *= 2
    windows = [(slice(3, 20), slice(10, 30)), (slice(15, 35), slice(25, 45))]
    drawn = poisson_counts(expected, 5, previous=(before, counts), windows=windows)
    assert np.array_equal(drawn, poisson_counts(expected, 5))
    first = poisson_counts(expected, 5, previous=(before, counts), windows=windows[:1])
    outside = np.ones(counts.shape, dtype=bool)
    outside[windows[0]] = False
    assert np.array_equal(first[outside], counts[outside])
    expected[17, 28] = -1
    with pytest.raises(ValueError, match=r"pixel \[17, 28\]"):
        poisson_counts(expected, 5, previous=(before, counts), windows=windows)
