"""Scenes pay only for what they hold: what must not run does not.

The images themselves are checked elsewhere.
"""

import numpy as np
import pytest
from astropy.table import vstack

import napari_issis as ni
from napari_issis import render
from napari_issis.exposure import noise_ready_rate
from napari_issis.render import discs, near, painting, profiles, rings, stamps, windows
from watching import refuse, watch, watch_transforms

SHAPE = (120, 100)
PSFS = {"channel": None, "gaussian": ni.GaussianPSF(0.1), "moffat": ni.MoffatPSF(0.1, 3.0)}
each_psf = pytest.mark.parametrize("psf", PSFS)
# one source has a stamp, many have a fine mesh
one_and_many = pytest.mark.parametrize("number", [1, 200])


def observed(psf):
    return ni.Observation(shape=SHAPE, psf=PSFS[psf])


def scene(kind, number, **shape):
    """Place sources all over the frame."""
    rng = np.random.default_rng(number)
    one = ni.source(kind, 0.0, 0.0, 1e-14, **shape)
    table = vstack([one] * number)
    table["x"], table["y"] = rng.uniform(0, 99, number), rng.uniform(0, 119, number)
    return table


def drawn(calls, argument):
    """Sum of the lengths of one argument over all calls."""
    return sum(len(args[argument]) for args in calls)


def test_the_work_that_is_watched_is_done_where_it_is_needed(monkeypatch):
    """Without this, all others would hold for functions that nobody calls."""
    transforms = watch_transforms(monkeypatch)
    watched = {
        function.__name__: watch(monkeypatch, function)
        for function in (
            render._render,
            near.paint_near,
            stamps.add_stamps,
            stamps.transform,
            painting.paint,
            discs.paint_discs,
            discs.paint_large_discs,
            profiles.disc_transform,
            profiles.sersic_transform,
            profiles.sersic_gaussians,
            rings.band_transfer,
        )
    }
    mixed = [
        ni.source("point", 20.0, 30.0, 1e-14),
        ni.source("sersic", 50.0, 60.0, 1e-14, r_half=3.0, n=2.3),
        ni.source("uniform", 70.0, 60.0, 1e-14, r_half=4.0),
    ]
    # an observation that no other test has, so that no filter is kept
    observation = ni.Observation(shape=(90, 80), psf=ni.GaussianPSF(0.0987))
    for one in mixed:
        ni.count_rate(one, observation.replace(shape=(400, 400)))  # few sources: stamps
        ni.count_rate(vstack([one] * 200), observation)
    ni.count_rate(ni.source("uniform", 50.0, 60.0, 1e-14, r_half=900.0), observation)
    assert transforms
    assert [name for name, calls in watched.items() if not calls] == []


@pytest.mark.parametrize("flux", [None, 0.0])
def test_an_empty_or_dark_scene_costs_nothing(flux, monkeypatch):
    table = ni.source("sersic", 50.0, 60.0, flux or 0.0, r_half=5.0, n=4)
    table = vstack([table] * 5)[: 0 if flux is None else 5]
    transforms = watch_transforms(monkeypatch)
    monkeypatch.setattr(render, "_render", refuse)
    monkeypatch.setattr(render, "Optics", refuse)
    assert not ni.count_rate(table, observed("channel")).any()
    assert not noise_ready_rate(table, observed("channel"))[0].any()
    assert transforms == []


@one_and_many
def test_dark_sources_cost_nothing_beside_bright_ones(number, monkeypatch):
    stars = scene("point", number)
    dark = [
        ni.source("sersic", 40.0, 50.0, 0.0, r_half=30.0, n=5.5),
        ni.source("uniform", -200.0, 50.0, 0.0, r_half=900.0),
    ]
    painted = watch(monkeypatch, painting.paint)
    profile = watch(monkeypatch, profiles.sersic_gaussians)
    monkeypatch.setattr("napari_issis.render.meshes.paint_large_discs", refuse)
    alone = ni.count_rate(stars, observed("channel"))
    work = drawn(painted, 3)
    assert np.array_equal(ni.count_rate(vstack([stars, *dark]), observed("channel")), alone)
    assert drawn(painted, 3) == 2 * work
    assert profile == []


UNSEEN = {
    "faint point": ni.source("point", 40.3, 50.0, 1e-25),
    "faint galaxy": ni.source("sersic", 40.3, 50.0, 1e-25, r_half=30.0, n=5.5),
    "faint ellipse": ni.source("uniform", 40.3, 50.0, 1e-25, r_half=900.0),
    "far point": ni.source("point", -4e6, 50.0, 1e-14),
    "far galaxy": ni.source("exponential", 50.0, 4e6, 1e-14, r_half=30.0),
    "far ellipse": ni.source("uniform", -4e6, 4e6, 1e-14, r_half=900.0),
}


@pytest.mark.parametrize("unseen", UNSEEN)
@one_and_many
@each_psf
def test_what_cannot_be_seen_costs_nothing(psf, number, unseen, monkeypatch):
    """Light in the frame far below the tolerance: the image is the same, bit for bit."""
    stars = scene("point", number)
    alone = ni.count_rate(stars, observed(psf))
    transforms = watch_transforms(monkeypatch)
    painted = watch(monkeypatch, painting.paint)
    ni.count_rate(stars, observed(psf))
    work = len(transforms), drawn(painted, 3)
    transforms.clear()
    painted.clear()
    assert np.array_equal(ni.count_rate(vstack([stars, UNSEEN[unseen]]), observed(psf)), alone)
    assert (len(transforms), drawn(painted, 3)) == work


@one_and_many
@each_psf
def test_points_make_no_profiles_and_no_discs(psf, number, monkeypatch):
    profile = [
        watch(monkeypatch, function)
        for function in (
            profiles.sersic_gaussians,
            profiles.sersic_transform,
            profiles.disc_transform,
            stamps.transform,
            discs.paint_large_discs,
        )
    ]
    painted = watch(monkeypatch, discs.paint_discs)
    ni.count_rate(scene("point", number), observed(psf))
    assert profile == [[]] * len(profile)
    assert drawn(painted, 3) == 0


@each_psf
def test_sharp_light_is_carried_once(psf, monkeypatch):
    """One star has a stamp and makes no fine mesh, many have a fine mesh and no stamps."""
    meshes = watch(monkeypatch, near.paint_near)
    stamped = watch(monkeypatch, stamps.add_stamps)
    ni.count_rate(scene("point", 1), observed(psf))
    assert (len(meshes), len(stamped)) == (0, 1)
    ni.count_rate(scene("point", 200), observed(psf))
    assert (len(meshes), len(stamped)) == (1, 1)


@one_and_many
@each_psf
def test_smooth_sources_make_no_fine_mesh_and_no_stamps(psf, number, monkeypatch):
    meshes = watch(monkeypatch, near.paint_near)
    stamped = [watch(monkeypatch, f) for f in (stamps.transform, stamps.high_pass)]
    ni.count_rate(scene("gaussian", number, r_half=20.0, ellipticity=0.3), observed(psf))
    assert meshes == []
    assert stamped == [[], []]


@one_and_many
@each_psf
def test_uniform_ellipses_paint_no_gaussians(psf, number, monkeypatch):
    painted = watch(monkeypatch, painting.paint)
    profile = [
        watch(monkeypatch, function)
        for function in (profiles.sersic_gaussians, profiles.sersic_transform)
    ]
    ni.count_rate(scene("uniform", number, r_half=5.0, ellipticity=0.3), observed(psf))
    assert drawn(painted, 3) == 0
    assert profile == [[], []]


@each_psf
def test_stars_out_of_reach_are_not_on_the_fine_mesh(psf, monkeypatch):
    """They are painted on a coarse mesh; the fine one is as small as without them."""
    stars, far = scene("point", 200), scene("point", 40)
    far["x"] += 3000.0
    meshes = watch(monkeypatch, near.paint_near)
    ni.count_rate(stars, observed(psf))
    ni.count_rate(vstack([stars, far]), observed(psf))
    alone, beside_others = (args[2] for args in meshes)
    assert len(beside_others) == len(alone) == 200


@each_psf
def test_stars_out_of_reach_have_no_stamps(psf, monkeypatch):
    stamped = watch(monkeypatch, windows.place)
    far = scene("point", 1)
    far["x"] += 3000.0
    ni.count_rate(vstack([scene("point", 1), far]), observed(psf))
    assert len(stamped) == 1


def test_distance_costs_its_logarithm(monkeypatch):
    """A star ten thousand frames away is felt through a dozen more meshes, all of them small."""
    transforms = watch_transforms(monkeypatch)

    def work(distance):
        table = scene("point", 3)
        table["x"][0] += distance
        ni.count_rate(table, observed("channel"))  # makes filters
        transforms.clear()
        ni.count_rate(table, observed("channel"))
        return sum(args[0].size for args in transforms)

    assert work(1e6) < 4 * work(0.0)


@pytest.mark.parametrize("kind", ["point", "exponential"])
@one_and_many
@each_psf
def test_moved_sources_find_their_filters(psf, number, kind, monkeypatch):
    """Nothing is looked up in the PSF for a scene of the same kind in the same frame."""
    table = scene(kind, number, r_half=4.0)
    ni.count_rate(table, observed(psf))
    table["x"] += 0.11
    made = watch(monkeypatch, rings.band_transfer)
    ni.count_rate(table, observed(psf))
    assert made == []


def test_neutral_filters_scale():
    """The same image, bit for bit: catches filters that are rendered."""
    table = vstack([scene("point", 30), scene("exponential", 3, r_half=4.0)])
    observation = observed("channel")
    rate, clipped = noise_ready_rate(table, observation)
    dimmed = observation.replace(filters=("NF1", "NF2"))
    again, clipped_again = noise_ready_rate(table, dimmed)
    assert np.array_equal(again, rate * dimmed.transmittance)
    assert clipped_again == clipped * dimmed.transmittance


def test_exposing_renders_nothing(monkeypatch):
    table, observation = scene("point", 3), observed("channel")
    rate, _ = noise_ready_rate(table, observation)
    monkeypatch.setattr(render, "_render", refuse)
    transforms = watch_transforms(monkeypatch)
    for exposure in (1.0, 1000.0):
        ni.exposure.expose(rate, table, observation.replace(exposure=exposure), seed=3)
    assert transforms == []


@pytest.mark.parametrize("kind", ["point", "uniform", "gaussian", "devaucouleurs"])
def test_a_move_is_one_small_transform(kind, monkeypatch):
    """One along each axis."""
    observation = ni.Observation(shape=(600, 500), psf=PSFS["gaussian"])
    moved = ni.source(kind, 250.0, 260.0, 1e-15, r_half=2.0)
    drag = ni.Drag(vstack([scene("point", 50), moved]), observation, [50], rest=np.ones((600, 500)))
    monkeypatch.setattr(render, "_render", refuse)
    transforms = watch_transforms(monkeypatch)
    for x in (20.3, 130.6, 480.9):
        moved["x"] = x
        drag.move(moved)
    assert len(transforms) == 2 * 3
    assert max(args[0].size for args in transforms) < 0.1 * drag.rate.size


def test_a_known_rest_is_not_rendered(monkeypatch):
    monkeypatch.setattr(render, "_render", refuse)
    table = scene("point", 50)
    drag = ni.Drag(table, observed("gaussian"), [3], rest=np.ones(SHAPE))
    assert drag.rate.max() > 1
