"""The renderer against real-space quadrature, and what must hold of any scene."""

import numpy as np
import pytest
from astropy.table import vstack
from scipy import integrate, special

import napari_issis as ni
from napari_issis.render import render
from napari_issis.render.fine_mesh import fine_meshes
from napari_issis.render.near import NEAR
from napari_issis.render.optics import Optics
from napari_issis.render.plan import make_plan
from napari_issis.render.wrapping import wrapped_transfer
from quadrature import brightness, disc_rate, pixel_share
from quadrature import rate as quadrature_rate

CPS = 1.14e17  # NUV, the paper's
PIXEL = 0.036
SIGMA_PER_FWHM = 1 / 2.3548200450309493
INDEX = {"gaussian": 0.5, "exponential": 1.0, "devaucouleurs": 4.0}


def random_scene(seed):
    """A small random scene, frame and Gaussian PSF, sources outside the frame included."""
    rng = np.random.default_rng(seed)
    shape = tuple(int(n) for n in rng.integers(1, 40, 2))
    fwhm = np.exp(rng.uniform(np.log(0.8), np.log(15)))
    scene = []
    for kind in rng.choice(
        ["point", "uniform", "gaussian", "exponential", "devaucouleurs", "sersic"],
        rng.integers(1, 6),
    ):
        scene.append(
            (
                10 ** rng.uniform(-16, -14),
                str(kind),
                rng.uniform(-8, shape[1] + 8),
                rng.uniform(-8, shape[0] + 8),
                np.exp(rng.uniform(np.log(0.05), np.log(6))),
                rng.uniform(0, 0.75) * (rng.random() < 0.8),
                rng.uniform(-200, 400),
                rng.uniform(0.5, 8),
            )
        )
    # one source in the frame, so that the image's peak is not that of a far wing
    scene[0] = (
        *scene[0][:2],
        rng.uniform(0, shape[1] - 1),
        rng.uniform(0, shape[0] - 1),
        *scene[0][4:],
    )
    return shape, fwhm, scene


def table_of(scene):
    return vstack(
        [
            ni.source(kind, x, y, flux, r, e, pa, n=n if kind == "sersic" else None)
            for flux, kind, x, y, r, e, pa, n in scene
        ]
    )


@pytest.mark.parametrize("seed", range(50))
def test_random_scenes_keep_the_tolerance(seed):
    """Catches, in any profile: sign of PA, axes, half-light constant, half a pixel, the sinc."""
    tolerance = [1e-3, 1e-6, 1e-8][seed % 3]
    shape, fwhm, scene = random_scene(seed)
    observation = ni.Observation(shape=shape, psf=ni.GaussianPSF(fwhm * PIXEL))
    image = ni.count_rate(table_of(scene), observation, tolerance=tolerance)
    rng = np.random.default_rng(1000 + seed)
    pixels = {tuple(int(i) for i in np.unravel_index(image.argmax(), shape))}
    pixels |= {tuple(int(rng.integers(n)) for n in shape) for _ in range(3)}
    pixels |= {(0, 0), (shape[0] - 1, shape[1] - 1)}
    pixels = sorted(pixels)
    expected = np.zeros(len(pixels))
    for flux, kind, x, y, r, e, pa, n in scene:
        one = (kind, x, y, r, e, pa, INDEX.get(kind, n))
        expected += flux * CPS * quadrature_rate(one, pixels, fwhm * SIGMA_PER_FWHM)
    got = np.array([image[p] for p in pixels])
    assert np.abs(got - expected).max() <= tolerance * image.max()


@pytest.mark.parametrize("ellipticity", [0.86, 0.92])
@pytest.mark.parametrize("kind", ["gaussian", "devaucouleurs", "uniform"])
def test_needles(kind, ellipticity):
    """Very elongated sources, which the meshes cut into links (catches links too far apart)."""
    observation = ni.Observation(shape=(26, 26), psf=ni.GaussianPSF(1.5 * PIXEL))
    table = ni.source(kind, 12.3, 13.1, 1e-14, 7.0, ellipticity, 30.0)
    image = ni.count_rate(table, observation, tolerance=1e-7)
    pixels = [(13, 12), (19, 9), (6, 16), (12, 14), (22, 3)]
    one = (kind, 12.3, 13.1, 7.0, ellipticity, 30.0, INDEX.get(kind, 1.0))
    expected = 1e-14 * CPS * quadrature_rate(one, pixels, 1.5 * SIGMA_PER_FWHM)
    got = np.array([image[p] for p in pixels])
    assert np.abs(got - expected).max() <= 1e-7 * image.max()


@pytest.mark.parametrize(
    "disc",
    [
        (10, 20, 20, 0.4, 30),
        (-350, 20, 290, 0.2, 30),
        (-360, 20, 310, 0.2, 30),
        (20, 30, 3000, 0.98, 70),
        (-1.2e5, 3e4, 1e5, 0.5, 80),
    ],
)
def test_uniform_ellipses_of_any_size(disc):
    """Larger than frame and meshes too (catches a lost edge, and light lost outside a mesh)."""
    observation = ni.Observation(shape=(60, 60), psf=ni.GaussianPSF(0.06))
    image = ni.count_rate(ni.source("uniform", *disc[:2], 1e-14, *disc[2:]), observation)
    brightest = tuple(int(i) for i in np.unravel_index(image.argmax(), image.shape))
    pixels = [(0, 0), (30, 30), (59, 59), (0, 59), (59, 0), (20, 10), brightest]
    expected = 1e-14 * CPS * disc_rate(disc, pixels, 0.06 / PIXEL * SIGMA_PER_FWHM)
    got = np.array([image[p] for p in pixels])
    assert np.abs(got - expected).max() <= 1e-6 * image.max()


@pytest.mark.parametrize(("obscuration", "angstrom"), [(0.0, 2500), (0.35, 2500), (0.9, 1150)])
def test_bare_diffraction_star(obscuration, angstrom):
    """Star through a bare annulus: pixel integrals of the closed-form Airy pattern.

    Catches a wrong cut-off, obscuration taken by area instead of by diameter, a missing sinc,
    rings cut off where the pixel averages them least.
    """
    wavelength, diameter = angstrom * 1e-10, 1.7
    x, y = 15.3, 11.8
    observation = ni.Observation(
        shape=(24, 52), psf=ni.TelescopePSF(diameter, obscuration, angstrom)
    )
    image = ni.count_rate(ni.source("point", x, y, 1e-14), observation, tolerance=1e-6)
    per_pixel = np.pi * diameter / wavelength * np.radians(PIXEL / 3600)

    def airy(dy, dx):
        v = np.maximum(np.hypot(dy, dx) * per_pixel, 1e-9)
        amplitude = 2 * special.j1(v) / v
        if obscuration:
            w = obscuration * v
            amplitude = amplitude - obscuration**2 * 2 * special.j1(w) / w
        return (
            (amplitude / (1 - obscuration**2)) ** 2
            * per_pixel**2
            * (1 - obscuration**2)
            / (4 * np.pi)
        )

    node, weight = np.polynomial.legendre.leggauss(24)
    for py, px in [(12, 15), (11, 16), (14, 15), (0, 0), (23, 31), (12, 25), (12, 51)]:
        values = airy((py + 0.5 * node - y)[:, None], px + 0.5 * node - x)
        expected = 1e-14 * CPS * 0.25 * weight @ values @ weight
        assert abs(image[py, px] - expected) <= 1e-6 * image.max()


def test_image_psf_is_sinc_interpolated():
    """Undersampled, pixel included: products of sincs (catches wrapping of 1/x ripples)."""
    rng = np.random.default_rng(3)
    samples = rng.uniform(0, 1, (5, 7))
    samples /= samples.sum()
    observation = ni.Observation(
        shape=(30, 41), psf=ni.ImagePSF(samples, PIXEL, includes_pixel=True)
    )
    stars = ni.random_sources("point", 4, shape=(30, 41), seed=1)
    expected = np.zeros((30, 41))
    for star in stars:
        in_y = np.sinc(np.arange(30)[:, None] - star["y"] - (np.arange(5) - 2))
        in_x = np.sinc(np.arange(41)[:, None] - star["x"] - (np.arange(7) - 3))
        expected += star["flux"].value * CPS * in_y @ samples @ in_x.T
    image = ni.count_rate(stars, observation, tolerance=1e-7)
    assert np.abs(image - expected).max() <= 1e-7 * expected.max()


def test_asymmetric_oversampled_image_psf():
    """Two displaced Gaussians as an image, against shifted scenes (catches a mirrored PSF)."""
    fwhm, scale, n = 0.05, PIXEL / 4, 61
    line = np.exp(-0.5 * ((np.arange(n) - n // 2) * scale / (fwhm * SIGMA_PER_FWHM)) ** 2)
    round_ = np.outer(line, line)
    # 2 pixels up and 1 to the left of the main one
    samples = 0.7 * round_ + 0.3 * np.roll(round_, (8, -4), axis=(0, 1))
    scene = vstack(
        [
            ni.random_sources("point", 4, shape=(40, 50), seed=1),
            ni.random_sources("devaucouleurs", 3, shape=(40, 50), r_half=(0.3, 8), seed=2),
            ni.random_sources("uniform", 2, shape=(40, 50), r_half=(0.3, 8), seed=3),
        ]
    )
    shifted = scene.copy()
    shifted["y"] += 2
    shifted["x"] -= 1
    gaussian = ni.Observation(shape=(40, 50), psf=ni.GaussianPSF(fwhm))
    expected = 0.7 * ni.count_rate(scene, gaussian, tolerance=1e-9)
    expected += 0.3 * ni.count_rate(shifted, gaussian, tolerance=1e-9)
    image = ni.count_rate(scene, gaussian.replace(psf=ni.ImagePSF(samples, scale)), tolerance=1e-6)
    assert np.abs(image - expected).max() <= 1e-6 * expected.max()


def test_image_psf_is_normalised():
    one = ni.ImagePSF(np.full((5, 5), 7.0), PIXEL)
    assert one.array.sum() == pytest.approx(1, rel=1e-15)


@pytest.fixture(scope="module")
def mixed():
    return vstack(
        [
            ni.random_sources("point", 5, shape=(48, 64), seed=1),
            ni.random_sources("exponential", 3, shape=(48, 64), r_half=(2, 9), seed=2),
            ni.random_sources("sersic", 2, shape=(48, 64), r_half=(2, 9), seed=3),
            ni.random_sources("uniform", 2, shape=(48, 64), r_half=(2, 9), seed=4),
        ]
    )


@pytest.fixture(scope="module")
def observation():
    return ni.Observation(shape=(48, 64))


def test_superposition(mixed, observation):
    whole = ni.count_rate(mixed, observation, tolerance=1e-8)
    parts = sum(ni.count_rate(mixed[i : i + 4], observation, tolerance=1e-8) for i in (0, 4, 8))
    assert np.abs(whole - parts).max() <= 2e-8 * whole.max()


def test_half_turn(mixed, observation):
    turned = mixed.copy()
    turned["x"] = 63 - turned["x"]
    turned["y"] = 47 - turned["y"]
    first = ni.count_rate(mixed, observation, tolerance=1e-8)
    second = ni.count_rate(turned, observation, tolerance=1e-8)
    assert np.abs(first[::-1, ::-1] - second).max() <= 2e-8 * first.max()


def test_whole_pixel_shift(mixed, observation):
    """Catches rounding of positions and effects of the frame's edge."""
    moved = mixed.copy()
    moved["x"] += 3
    moved["y"] -= 5
    first = ni.count_rate(mixed, observation, tolerance=1e-8)
    second = ni.count_rate(moved, observation, tolerance=1e-8)
    assert np.abs(first[5:, :-3] - second[:-5, 3:]).max() <= 2e-8 * first.max()


@pytest.mark.parametrize("n", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("r_half", [300.0, 3000.0])
def test_centre_of_a_broad_profile(n, r_half):
    """The cusp of a profile far wider than the frame (catches Gaussians dropped from it)."""
    sigma = 0.1 / PIXEL * SIGMA_PER_FWHM
    observation = ni.Observation(shape=(33, 33), psf=ni.GaussianPSF(0.1))
    table = ni.source("sersic", 16, 16, 1e-14, r_half, 0.0, 0.0, n=n)
    image = ni.count_rate(table, observation, tolerance=1e-6)
    node, weight = np.polynomial.legendre.leggauss(20)
    edges = np.concatenate([[0], np.geomspace(1e-12, 10 * sigma + 2, 300)])
    half = 0.5 * np.diff(edges)[:, None]
    r = (edges[:-1, None] + half * (node + 1)).ravel()
    theta = 2 * np.pi * (np.arange(400) + 0.5) / 400
    share = pixel_share(np.outer(r, np.cos(theta)), np.outer(r, np.sin(theta)), sigma).mean(1)
    measure = (half * weight).ravel() * 2 * np.pi * r * brightness("", n, r / r_half) / r_half**2
    expected = 1e-14 * CPS * np.sum(measure * share)
    assert abs(image[16, 16] - expected) <= 1e-6 * image.max()


def test_flux_arrives():
    """Light of a compact source in a large frame; a de Vaucouleurs galaxy's share by its growth."""
    observation = ni.Observation(shape=(301, 301), psf=ni.GaussianPSF(0.1))
    star = ni.count_rate(ni.source("point", 150, 150, 1e-14), observation)
    assert star.sum() == pytest.approx(1e-14 * CPS, rel=1e-6)
    galaxy = ni.count_rate(
        ni.source("devaucouleurs", 150, 150, 1e-14, 4.0, 0.0), observation, tolerance=1e-9
    )
    b = special.gammaincinv(8, 0.5)

    def share(theta):  # light inside the square frame, by the enclosed flux along each direction
        radius = 150.5 / max(abs(np.cos(theta)), abs(np.sin(theta)))
        return special.gammainc(8, b * (radius / 4.0) ** 0.25) / (2 * np.pi)

    expected = 8 * integrate.quad(share, 0, np.pi / 4)[0]
    assert galaxy.sum() / (1e-14 * CPS) == pytest.approx(expected, rel=1e-6)


def test_moffat_wings_reach_far():
    """A star outside the frame: only the wing, (r/a)^(-2 beta), is in it."""
    psf = ni.MoffatPSF(0.1, 2.5)
    observation = ni.Observation(shape=(8, 8), psf=psf)
    image = ni.count_rate(ni.source("point", 400.0, 4.0, 1e-14), observation, tolerance=1e-4)
    a = 0.1 / (2 * np.sqrt(2 ** (1 / 2.5) - 1)) / PIXEL
    expected = 1e-14 * CPS * 1.5 / (np.pi * a**2) * (1 + ((400 - 4) / a) ** 2) ** -2.5
    assert image[4, 4] == pytest.approx(expected, rel=2e-4)


def test_nothing_gives_exact_zeros():
    empty = ni.random_sources("point", 0)
    dark = ni.random_sources("exponential", 3, flux=(0, 0))
    far = ni.source("gaussian", 1e9, 0.0, 1e-14)
    observation = ni.Observation(shape=(20, 30))
    for table in (empty, dark):
        image = ni.count_rate(table, observation)
        assert image.shape == (20, 30)
        assert not image.any()
    assert np.abs(ni.count_rate(far, observation.replace(psf=ni.GaussianPSF(0.1)))).max() < 1e-11


def test_filters_and_channel_scale_the_rate():
    star = ni.source("point", 10, 10, 1e-14)
    open_ = ni.Observation(shape=(21, 21), psf=ni.GaussianPSF(0.1))
    dimmed = ni.count_rate(star, open_.replace(filters=("NF1", "NF2")))
    assert dimmed == pytest.approx(1e-3 * ni.count_rate(star, open_), rel=1e-12)
    fuv = ni.count_rate(star, open_.replace(channel="FUV"))
    assert fuv.sum() / ni.count_rate(star, open_).sum() == pytest.approx(3.36e15 / 1.14e17)


def test_tighter_for_the_sky():
    """1e-6 of a bright star's peak is as much as the sky: the second demand is kept."""
    star = ni.source("point", 30.2, 30.7, 1e-14)
    observation = ni.Observation(shape=(64, 64))
    exact = ni.count_rate(star, observation, tolerance=1e-11)
    tight = render(star, observation, tolerance=1e-2, absolute=3.5e-6)
    assert np.abs(tight - exact).max() <= 3.5e-6


@pytest.mark.parametrize("tolerance", [0, -1e-6, 1, 1e-13, np.nan])
def test_bad_tolerance(tolerance):
    with pytest.raises(ValueError, match="tolerance is"):
        ni.count_rate(ni.source("point", 1, 1), tolerance=tolerance)


TELESCOPE = ni.TelescopePSF(1.7, 0.35, 2500.0, 0.05)


@pytest.mark.parametrize("seen", [(511.0, 511.0), (150.0, 420.0)])
def test_kernel_wraps_around_only_where_nobody_looks(seen):
    """Against its Hankel transform, out to the largest distances seen.

    Catches a window too steep or too early, an image folded on the wrong place, rings lost;
    and a kernel that does not wrap.
    """
    optics = Optics(TELESCOPE, PIXEL)
    farthest = float(np.hypot(*seen))
    shape = tuple(int(d) + 1 for d in seen)
    plan = make_plan(optics, shape, 1e-10, 1e-11, lambda reach: (farthest, seen), 10000, 0)
    assert plan.wraps
    low, high = -5.0, np.array(shape) + 4.0
    _, mesh = fine_meshes(plan)
    periods = [8 * int(np.ceil(mesh.period(i, shape[i], low, high[i]) / 8)) for i in (0, 1)]
    assert all(p < 2 * d + 100 for p, d in zip(periods, seen, strict=True))
    transfer = wrapped_transfer(plan.filters, NEAR, *periods, mesh.highest)

    def wrapped(y, x):
        phase_y, phase_x = (
            np.cos(2 * np.pi * np.arange(n) * d / p) * np.where(np.arange(n) > 0, 2, 1) / p
            for n, d, p in zip(transfer.shape, (y, x), periods, strict=True)
        )
        return phase_y @ transfer @ phase_x

    node, weight = np.polynomial.legendre.leggauss(24)
    edges = np.linspace(0, TELESCOPE.cutoff() * PIXEL, 1601)
    half = 0.5 * np.diff(edges)[:, None]
    k = (edges[:-1, None] + half * (node + 1)).ravel()
    measure = (half * weight).ravel() * 2 * np.pi * k * TELESCOPE.otf(k / PIXEL)
    measure *= 1 - plan.lowpass(k, 0)

    def kernel(y, x):
        return float(measure @ special.j0(2 * np.pi * k * np.hypot(y, x)))

    allowed = np.exp(-plan.ring_digits) * optics.moment(0)
    places = [(0, 0), (3, 1), (0, seen[1]), (seen[0], 0), seen, (0.4 * seen[0], 0.9 * seen[1])]
    rings = [abs(kernel(y, x)) for y, x in places]
    assert min(rings[2:4]) > 3 * allowed  # otherwise there is nothing to lose
    # half a period away two half images meet
    for y, x in [*places, (0, 0.5 * periods[1]), (0.5 * periods[0], 0)]:
        assert abs(wrapped(y, x) - kernel(y, x)) <= allowed + 1e-16
    assert abs(wrapped(0, periods[1] - 60.0)) > 30 * abs(kernel(0, periods[1] - 60.0))


@pytest.mark.parametrize("shape", [(220, 330), (330, 220)])
def test_rings_cross_the_frame(shape):
    """Crowded stars at a corner, on a fine mesh: rings at the other end, pixel by pixel.

    Catches rings dropped or cut before the frame's end, and those that wrap back into it.
    """
    count, x, y = 300, 1.3, shape[0] - 1.7
    star = ni.source("point", x, y, 1e-14)
    image = ni.count_rate(
        vstack([star] * count), ni.Observation(shape=shape, psf=TELESCOPE), tolerance=1e-11
    )
    for row, column in [(0, shape[1] - 1), (shape[0] - 1, shape[1] - 1)]:
        expected = count * 1e-14 * CPS * polar_rate(row - y, column - x)
        assert abs(image[row, column] - expected) <= 1e-11 * image.max()


@pytest.mark.parametrize(("side", "distance"), [(24, 100), (24, 230), (60, 150)])
def test_rings_of_a_bright_star_far_outside(side, distance):
    """Several frame sides away from a small frame: its rings are the brightest errors.

    Catches rings cut at a distance that goes by the frame's size and not by what is felt.
    """
    star = (side + distance + 0.3, 0.4 * side, 1e-10)
    faint = (0.5 * side + 0.2, 0.3 * side, 1e-14)
    table = vstack([ni.source("point", *one) for one in (star, faint)])
    observation = ni.Observation(shape=(side, side), psf=TELESCOPE)
    image = ni.count_rate(table, observation, tolerance=1e-7)
    for row, column in [(side // 2, side - 1), (0, 0), (side - 1, side - 4)]:
        expected = sum(f * CPS * polar_rate(row - y, column - x) for x, y, f in (star, faint))
        assert abs(image[row, column] - expected) <= 1e-7 * image.max()


def polar_rate(dy, dx):
    """Share of a star's light in the pixel at a distance: the Fourier integral in polar form."""
    far = np.hypot(dy, dx) + 1
    node, weight = np.polynomial.legendre.leggauss(16)
    cutoff = TELESCOPE.cutoff() * PIXEL
    kinks = cutoff * np.array([0, 0.325, 0.35, 0.675, 1])
    # the OTF has powers of 3/2 at its kinks: panels crowd there
    near = np.geomspace(1e-6, 1, 16) * cutoff
    panels = [np.linspace(0, cutoff, int(1.5 * cutoff * far) + 2)]
    panels += [part for c in kinks for part in (c - near, [c], c + near)]
    edges = np.unique(np.clip(np.concatenate(panels), 0, cutoff))
    half = 0.5 * np.diff(edges)[:, None]
    k = edges[:-1, None] + half * (node + 1)
    measure = half * weight * k * TELESCOPE.otf(k / PIXEL)
    angles = int(1.2 * 2 * np.pi * cutoff * far) + 64
    theta = np.pi * (np.arange(angles) + 0.5) / angles
    total = 0.0
    for panel, share in zip(k, measure, strict=True):
        kx, ky = np.outer(panel, np.cos(theta)), np.outer(panel, np.sin(theta))
        light = np.sinc(kx) * np.sinc(ky) * np.cos(2 * np.pi * (kx * dx + ky * dy))
        total += share @ light.sum(axis=1) * 2 * np.pi / angles
    return total
