"""Spectra from files travel with the exposure."""

import subprocess
import sys

import astropy.units as u
import numpy as np
import pytest
from astropy.io import fits
from astropy.table import QTable, vstack

import napari_issis as ni
from napari_issis import sources as sources_module
from napari_issis.autosave import Autosave, CrashedScene
from napari_issis.exposure import same_table

OBSERVATION = ni.Observation("FUV", ("N1550", "open"), 300.0, (24, 30))
ELSEWHERE = """
import sys
import numpy as np
from napari_issis import Exposure, simulate
exposure = Exposure.read(sys.argv[1])
again = simulate(exposure.sources, exposure.observation, seed=exposure.seed)
np.savez(sys.argv[2], counts=again.counts, expected=again.expected,
         text=np.asarray(exposure.sources["spectrum"]))
"""


def curve(path, slope):
    """An irregular curve whose numbers are no round ones, and its fluxes far from 1."""
    wavelength = 1000.0 + np.cumsum(np.random.default_rng(slope + 9).random(3000))
    flux = 3e-15 * (wavelength / 1500.0) ** slope * (1.5 + np.sin(wavelength / 7.0))
    QTable({"wavelength": wavelength * u.AA, "flux": flux}).write(path, overwrite=True)


def scene(*texts):
    return vstack(
        [
            ni.source("point", 5.0 + 4 * i, 9.0 + i, 1e-14, spectrum=text)
            for i, text in enumerate(texts)
        ]
    )


@pytest.mark.parametrize("name", ["star.ecsv", "Übergröße, heiß.ecsv"])
def test_elsewhere_the_scene_is_the_same_bit_for_bit(tmp_path, monkeypatch, name):
    """Catches a file's name without its numbers, and numbers that were rounded on the way."""
    home, far = tmp_path / "home", tmp_path / "far"
    home.mkdir()
    far.mkdir()
    monkeypatch.chdir(home)
    curve(name, -2)
    curve("other.ecsv", 1)
    texts = (
        f'table("{name}")',
        f'table("{name}", z=0.1, at=1600)',
        "table(other.ecsv)",
        "flat",
        "powerlaw(-2)",
    )
    exposure = ni.simulate(scene(*texts), OBSERVATION, seed=5)
    exposure.write(far / "x.fits")
    assert ni.Exposure.read(far / "x.fits") == exposure
    for path in home.iterdir():
        path.unlink()
    command = [sys.executable, "-c", ELSEWHERE, "x.fits", "out.npz"]
    subprocess.run(command, cwd=far, check=True, timeout=120)
    with np.load(far / "out.npz") as out:
        np.testing.assert_array_equal(out["expected"], exposure.expected)
        np.testing.assert_array_equal(out["counts"], exposure.counts)
        assert out["text"].tolist() == list(texts)


def test_another_file_of_that_name_is_not_taken_for_it(tmp_path, monkeypatch):
    """Catches a scene that changes silently with what lies in the folder."""
    monkeypatch.chdir(tmp_path)
    curve("star.ecsv", -2)
    exposure = ni.simulate(scene("table(star.ecsv, z=0.1)", "flat"), OBSERVATION, seed=5)
    exposure.write("x.fits")
    curve("star.ecsv", 1)
    other = ni.simulate(scene("table(star.ecsv, z=0.1)", "flat"), OBSERVATION, seed=5)
    assert not np.array_equal(other.expected, exposure.expected)
    back = ni.Exposure.read("x.fits")
    text, flat = back.sources["spectrum"]
    assert text.startswith('table("star.ecsv#')
    assert text.endswith('", z=0.1)')
    assert flat == "flat"
    again = ni.simulate(back.sources, back.observation, seed=5)
    np.testing.assert_array_equal(again.expected, exposure.expected)
    # and once more, from the new name
    back.write("y.fits")
    assert same_table(ni.Exposure.read("y.fits").sources, back.sources)


def test_after_a_crash_the_spectra_are_there(tmp_path, monkeypatch):
    """Catches a scene that is lost with a file it was made from."""
    monkeypatch.chdir(tmp_path)
    curve("gone.ecsv", -2)
    table = scene("table(gone.ecsv)")
    rate = ni.count_rate(table, OBSERVATION)
    saved = Autosave(tmp_path)
    saved.write(table, OBSERVATION)
    (tmp_path / "gone.ecsv").unlink()
    sources, observation, _ = CrashedScene(saved.path, None).read()
    np.testing.assert_array_equal(ni.count_rate(sources, observation), rate)
    # a file that is gone for good does not stop the next save
    text = "table(never.ecsv)"
    sources["spectrum"] = [text]
    saved.write(sources, observation)


def test_the_file_is_good_fits(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    curve("star.ecsv", -2)
    ni.simulate(scene("table(star.ecsv)"), OBSERVATION).write("x.fits")
    with fits.open("x.fits") as hdus:
        hdus.verify("exception")
        assert hdus["SPECTRA"].data["FILE"].tolist() == ["star.ecsv"]
        assert hdus["SPECTRA"].data["COUNT"].tolist() == [3000]
        assert hdus["SAMPLES"].columns["WAVELENGTH"].unit == "Angstrom"
    ni.simulate(scene("flat"), OBSERVATION).write("y.fits")
    with fits.open("y.fits") as hdus:
        assert "SPECTRA" not in [hdu.name for hdu in hdus]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda hdus: hdus["SPECTRA"].data["COUNT"].__setitem__(0, 7), "does not match SAMPLES"),
        (lambda hdus: hdus["SPECTRA"].data["COUNT"].__setitem__(0, -7), "does not match SAMPLES"),
        (lambda hdus: hdus["SAMPLES"].data["FLUX"].__setitem__(3, np.nan), "has the flux nan"),
        (lambda hdus: hdus["SAMPLES"].data["WAVELENGTH"].__setitem__(3, 1.0), "run in one"),
        (lambda hdus: hdus["SAMPLES"].columns.change_name("FLUX", "F"), "SAMPLES holds no spectra"),
        (lambda hdus: hdus["SAMPLES"].columns.change_unit("WAVELENGTH", "s"), "not in Angstrom"),
    ],
)
def test_broken_extensions_are_named(tmp_path, monkeypatch, change, message):
    """Catches a curve that is taken unchecked, or an error that names nothing."""
    monkeypatch.chdir(tmp_path)
    curve("star.ecsv", -2)
    ni.simulate(scene("table(star.ecsv)"), OBSERVATION).write("x.fits")
    with fits.open("x.fits") as hdus:
        for hdu in hdus:
            hdu.header.remove("DATASUM", ignore_missing=True)
            hdu.header.remove("CHECKSUM", ignore_missing=True)
        change(hdus)
        hdus.writeto("y.fits")
    with pytest.raises(ValueError, match=message):
        ni.Exposure.read("y.fits")


def test_texts_are_parsed_once_for_a_picture(monkeypatch):
    """Catches the work of 100,000 texts done three times."""
    calls = []
    real = sources_module.parse_spectrum

    def counted(text):
        calls.append(text)
        return real(text)

    monkeypatch.setattr(sources_module, "parse_spectrum", counted)
    ni.count_rate(scene("powerlaw(-2)", "flat", "powerlaw(-2)"), OBSERVATION)
    # the three one-row tables are checked as they are made
    assert calls[3:] == ["powerlaw(-2)", "flat"]
