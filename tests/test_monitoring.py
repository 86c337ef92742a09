"""Sequences of exposures: each frame against `simulate`, and the sky against astropy's."""

import os
import warnings
from collections import Counter

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.table import vstack

import napari_issis as ni
from independent_wcs import independent_wcs
from napari_issis import monitoring, monitoring_tasks
from napari_issis.sources import check_sources

pytest.importorskip("dask")

FRAME = ni.Observation(shape=(32, 40), exposure=200.0, psf=ni.GaussianPSF(0.1))
TWO = vstack([ni.source("point", 12, 10, 4e-15), ni.source("exponential", 25.5, 20, 8e-15, 3)])
TIMES = ([0.0, 10.0, 20.0], [1.0, 2.0, 1.5])


def sequence(**options):
    settings = {"epochs": [5.0, 10.0, 15.0], "light_curves": {0: TIMES}, "exposures": 2, "seed": 7}
    return ni.monitor(TWO, FRAME, **{**settings, **options})


@pytest.fixture
def renders(monkeypatch):
    """Count the scenes that are rendered."""
    calls = Counter()
    real = monitoring_tasks.noise_ready_rate

    def counted(sources, observation, **options):
        calls[monitoring._scene_key(sources, observation)] += 1
        return real(sources, observation, **options)

    monkeypatch.setattr(monitoring_tasks, "noise_ready_rate", counted)
    return calls


def test_each_frame_is_what_simulate_gives():
    """Catches a flux, roll, offset or PSF of another epoch, and a seed used twice."""
    epochs = [
        ni.Epoch(5.0),
        ni.Epoch(10.0, roll=30.0, offset=(2.0, -1.0)),
        ni.Epoch(15.0, changes={"psf": ni.GaussianPSF(0.2), "exposure": 50.0}),
    ]
    plan = sequence(epochs=epochs, dithers=[(0, 0), (0.5, 3)])
    frames = plan.stack(coadd=False)
    assert frames.shape == (6, 32, 40)
    assert {chunk for axis in frames.chunks[:1] for chunk in axis} == {1}
    counts, expected = frames.compute(), plan.stack("expected", coadd=False).compute()
    for index, one in enumerate(plan.exposures):
        alone = ni.simulate(one.sources, one.observation, seed=one.seed)
        assert np.array_equal(counts[index], alone.counts)
        assert np.array_equal(expected[index], alone.expected)
        assert plan.simulate(index) == alone
    assert len({one.seed for one in plan.exposures}) == 6
    assert [one.observation.exposure for one in plan.exposures] == [200] * 4 + [50] * 2
    fluxes = [check_sources(one.sources).flux for one in plan.exposures[::2]]
    np.testing.assert_allclose(fluxes, [[6e-15, 8e-15], [8e-15, 8e-15], [7e-15, 8e-15]])


def test_delays_shift_light_curves():
    """Catches a delay of the wrong sign: the later image shows the earlier flux."""
    plan = sequence(light_curves={0: TIMES, 1: lambda t: 2.0 + t / 100}, delays={0: 5.0, 1: 3.0})
    np.testing.assert_allclose(plan.factors, [[1.0, 2.02], [1.5, 2.07], [2.0, 2.12]])


@pytest.mark.parametrize("dec", [0.0, 70.0])
def test_sources_stay_on_the_sky_when_the_telescope_moves(dec):
    """Catches a roll or an offset of the wrong sense, and an angle that stays in the frame."""
    frame = FRAME.replace(pointing=SkyCoord(50.0, dec, unit="deg"), roll=20.0)
    plan = ni.monitor(TWO, frame, [ni.Epoch(0), ni.Epoch(1, roll=35.0, offset=(4.0, -7.5))])
    places, angles = [], []
    for one in plan.exposures:
        arrays, wcs = check_sources(one.sources), independent_wcs(one.observation)
        places.append(wcs.pixel_to_world(arrays.x, arrays.y))
        x, y, pa = arrays.x[1], arrays.y[1], np.radians(arrays.pa[1])
        start, end = wcs.pixel_to_world([x, x - 9 * np.sin(pa)], [y, y + 9 * np.cos(pa)])
        angles.append(start.position_angle(end).deg % 180)
    assert np.all(places[0].separation(places[1]).arcsec < 1e-6)
    assert angles[0] == pytest.approx(angles[1], abs=1e-4)
    before, after = (one.observation for one in plan.exposures)
    assert after.roll == 55.0
    moved = independent_wcs(before.replace(roll=55.0)).world_to_pixel(after.pointing)
    np.testing.assert_allclose(moved, [19.5 + 4.0, 15.5 - 7.5], atol=1e-4)


def test_without_a_place_on_the_sky_the_frame_moves_the_same_way():
    epochs = [ni.Epoch(1, roll=35.0, offset=(4.0, -7.5))]
    pointed = FRAME.replace(pointing=SkyCoord(50.0, 0.0, unit="deg"))
    a, b = (
        check_sources(ni.monitor(TWO, frame, epochs).exposures[0].sources)
        for frame in (FRAME, pointed)
    )
    for name in ("x", "y"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), atol=1e-5)
    assert (a.pa[1] - b.pa[1]) % 360 == pytest.approx(0, abs=1e-4)


def test_co_added_exposures_lie_on_each_other():
    """Catches frames moved the wrong way: a star stays in its pixel and adds up."""
    star = ni.source("point", 20, 15, 4e-15)
    steps = [(0, 0), (3, -2), (-4, 5)]
    plan = ni.monitor(star, FRAME, [0.0], exposures=3, dithers=steps)
    total = plan.stack("expected").compute()[0]
    alone = ni.simulate(star, FRAME).expected
    inside = slice(5, -5), slice(5, -5)
    np.testing.assert_allclose(total[inside], 3 * alone[inside], rtol=1e-4)
    time = plan.exposure_map(0)
    assert time.max() == 600.0
    # Row 0 of the frame is seen by all but the one that points 5 pixels up.
    assert time[0, 20] == 400.0
    frames = plan.stack(coadd=False).compute()
    counts = plan.stack().compute()[0]
    assert counts[15, 20] == frames[0, 15, 20] + frames[1, 17, 17] + frames[2, 10, 24]


def test_nothing_is_rendered_twice(renders):
    """Catches a render for each exposure, epoch or image where the scene is the same."""
    dask = pytest.importorskip("dask")
    plan = sequence(epochs=[5.0, 10.0, 5.0], exposures=3)
    dask.compute(plan.stack(), plan.stack("expected"), plan.stack(coadd=False))
    assert list(renders.values()) == [1, 1]


def test_a_stack_computes_nothing_until_asked_and_then_one_frame(renders):
    stack = sequence().stack()
    assert not renders
    stack[1].compute()
    assert sum(renders.values()) == 1


def test_frames_do_not_depend_on_the_order():
    """Catches random numbers that are drawn one after the other."""
    stack, again = sequence().stack(), sequence().stack()
    backwards = [again[epoch].compute() for epoch in (2, 1, 0)]
    assert np.array_equal(stack.compute(), backwards[::-1])


@pytest.fixture
def environment_kept():
    """A cluster of dask sets the number of threads in the environment, and leaves it so."""
    before = dict(os.environ)
    yield
    os.environ.clear()
    os.environ.update(before)


@pytest.mark.usefixtures("environment_kept")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_cluster_gives_the_same_by_the_same_call(tmp_path):
    """Catches what cannot be sent to another process, and noise that depends on the process."""
    distributed = pytest.importorskip("distributed")
    plan = sequence()
    here = plan.stack().compute()
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster),
    ):
        there = plan.stack().compute()
        files = plan.run(tmp_path)
    assert np.array_equal(here, there)
    assert ni.Exposure.read(files[3]) == plan.simulate(3)


def test_a_run_that_was_interrupted_goes_on(tmp_path, renders):
    """Catches finished exposures that are computed again, or files of a part of the run."""
    seen = []

    class Stop(Exception):
        pass

    def stop(done, total):
        seen.append((done, total))
        if done:
            raise Stop

    before, monitoring_tasks.BATCH = monitoring_tasks.BATCH, 1
    try:
        with pytest.raises(Stop):
            sequence().run(tmp_path, progress=stop)
    finally:
        monitoring_tasks.BATCH = before
    assert seen == [(0, 6), (2, 6)]
    finished = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    seen.clear()
    plan = sequence()
    files = plan.run(tmp_path, progress=lambda *numbers: seen.append(numbers))
    assert seen == [(2, 6), (6, 6)]
    assert list(renders.values()) == [1, 1, 1]
    assert all(path.stat().st_mtime_ns == time for path, time in finished.items())
    for index, path in enumerate(files):
        assert ni.Exposure.read(path) == plan.simulate(index)
    plan.run(tmp_path)
    assert list(renders.values()) == [1, 1, 1]


def test_files_of_another_sequence_are_not_taken_for_finished(tmp_path):
    sequence().run(tmp_path)
    with pytest.raises(ValueError, match=r"epoch\d+_\w+\.fits holds .* another sequence"):
        sequence(seed=8).run(tmp_path)
    (tmp_path / "epoch0001_exposure01.fits").write_bytes(b"SIMPLE")
    with pytest.raises(ValueError, match=r"epoch0001_exposure01\.fits is no finished exposure"):
        sequence().run(tmp_path)


def test_cube(tmp_path):
    """Catches planes in another order and sky coordinates that hold for one plane only."""
    frame = FRAME.replace(pointing=SkyCoord(50.0, 1.0, unit="deg"))
    plan = ni.monitor(TWO, frame, [5.0, 10.0], light_curves={0: TIMES}, exposures=2)
    plan.write_cube(tmp_path / "cube.fits")
    plan.write_cube(tmp_path / "each.fits", "expected", coadd=False)
    with fits.open(tmp_path / "cube.fits", checksum=True) as hdus:
        assert np.array_equal(hdus[0].data, plan.stack().compute())
        assert hdus[0].header["CRVAL1"] == 50.0
        assert hdus["PLANES"].data["TIME"].tolist() == [5.0, 10.0]
        assert hdus["PLANES"].data["EXPOSURE"].tolist() == [400.0, 400.0]
        np.testing.assert_allclose(hdus["FACTORS"].data, [[1.5, 1], [2, 1]])
    with fits.open(tmp_path / "each.fits") as hdus:
        assert np.array_equal(hdus[0].data, plan.stack("expected", coadd=False).compute())
    with pytest.raises(FileExistsError):
        plan.write_cube(tmp_path / "cube.fits")
    turned = ni.monitor(TWO, frame, [0.0, ni.Epoch(1.0, roll=5.0)])
    turned.write_cube(tmp_path / "turned.fits")
    assert "CRVAL1" not in fits.getheader(tmp_path / "turned.fits")


def test_magnitudes_vary_too():
    star = ni.source("point", 20, 15, flux=20 * u.ABmag)
    plan = ni.monitor(star, FRAME, [0.0], light_curves={0: lambda t: 0.5})
    halved, whole = (
        check_sources(table, pivot=FRAME.pivot).flux for table in (plan.exposures[0].sources, star)
    )
    assert halved[0] / whole[0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"epochs": []}, "epochs is empty"),
        ({"epochs": ["monday"]}, "time of an epoch is 'monday'"),
        ({"epochs": [25.0]}, "row 0: the light curve covers 0 to 20, but 25 is needed"),
        ({"light_curves": {2: TIMES}}, "no row 2; .* rows 0 to 1"),
        ({"light_curves": {0: lambda t: -1.0}}, r"row 0, time 5: the light curve gives -1"),
        ({"light_curves": {0: ([0, 0], [1, 1])}}, "must increase"),
        ({"delays": {1: 3.0}}, "row 1 has a delay and no light curve"),
        ({"exposures": 0}, "exposures is 0"),
        ({"dithers": [(0, 0)]}, "1 dithers and 2 exposures"),
        ({"dithers": [(0, 0), 5]}, r"an offset is 5"),
        ({"seed": -1}, "seed is -1"),
        ({"epochs": [ni.Epoch(5, changes={"shape": (8, 8)})]}, "epoch 0 changes the shape"),
        ({"epochs": [ni.Epoch(5, changes={"colour": 1})]}, "epoch 0 changes what"),
    ],
)
def test_bad_input(options, message):
    with pytest.raises(ValueError, match=message):
        sequence(**options)


def test_the_detector_acts_on_expected_counts():
    """Catches a stack that forgets the coincidence loss which `simulate` knows."""
    lossy = FRAME.replace(detector=ni.Detector(dead_time=1e-2))
    plan = ni.monitor(TWO, lossy, [0.0], exposures=1)
    alone = plan.simulate(0)
    assert np.array_equal(plan.stack("expected").compute()[0], alone.expected)
    assert np.array_equal(plan.stack().compute()[0], alone.counts)


def test_magnitudes_of_a_spectrum_vary_as_its_flux():
    """Catches a magnitude that is converted at the channel's pivot instead of where it is given."""
    star = ni.source("point", 12, 10, 20 * u.ABmag, spectrum="powerlaw(-2, at=2000)")
    plan = ni.monitor(star, FRAME, [0.0], light_curves={0: lambda time: 0.5})
    whole = ni.expected_counts(star, FRAME)
    assert ni.expected_counts(plan.exposures[0].sources, FRAME) == pytest.approx(0.5 * whole)


def test_the_limits_are_told_once_a_sequence():
    """Catches a warning for each of a hundred exposures, each with other words."""
    star = ni.source("point", 20, 20, 1e-13)
    plan = ni.monitor(
        star, FRAME, range(4), light_curves={0: lambda time: 1 + 0.1 * time}, exposures=1
    )
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("default")
        plan.stack().compute(scheduler="synchronous")
        ni.fit_light_curves(plan)
    told = [one for one in told if one.category is ni.CountRateWarning]
    assert len(told) == 1
    assert "more than 22 cps" in str(told[0].message)
