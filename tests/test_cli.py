"""The shell command."""

import os
import re
import subprocess
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from astropy.io import fits
from PIL import Image

from napari_issis import Exposure, ImagePSF, Observation, Sky, simulate, source
from napari_issis import cli as cli_module
from napari_issis.catalogue import read_sources, write_sources
from napari_issis.cli import main
from napari_issis.rgba import read_rgba
from napari_issis.scenes import example_scene

FRAME = ["--frame", "40", "48"]


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def no_screen(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")


@pytest.fixture
def star():
    write_sources(source("point", 20.0, 10.0, flux=1e-15), "star.ecsv")
    return "star.ecsv"


def refused(capsys, *arguments):
    """Run with bad input; return the one line on stderr."""
    with pytest.raises(SystemExit) as exit_:
        main(list(arguments))
    assert exit_.value.code == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("napari-issis: error: ")
    return captured.err


def test_simulate_equals_the_library(star, capsys):
    """Catches an option that is parsed and then forgotten."""
    arguments = ["simulate", star, "--channel", "FUV", "--filters", "open", "NF1", *FRAME]
    arguments += ["--exposure", "1e5", "--seed", "9", "--tolerance", "1e-4", "--output", "x.fits"]
    assert main(arguments) == 0
    observation = Observation("FUV", ("open", "NF1"), 1e5, (40, 48))
    expected = simulate(
        source("point", 20.0, 10.0, flux=1e-15), observation, seed=9, tolerance=1e-4
    )
    assert Exposure.read("x.fits") == expected
    captured = capsys.readouterr()
    assert "wrote x.fits" in captured.out
    assert "FUV, open-NF1, 100000 s, seed 9" in captured.out
    assert "assumed" in captured.out
    assert captured.err == ""


def test_sky_and_curves_by_name(star):
    """Catches a sky that is parsed and then forgotten."""
    arguments = ["simulate", star, "--channel", "FUV", "--filters", "LP1370", "open", *FRAME]
    assert main([*arguments, "--sky", "high orbit", "--output", "x.fits"]) == 0
    sky = Sky("high orbit", "average", "high orbit", galactic_latitude=90)
    observation = Observation("FUV", ("LP1370", "open"), shape=(40, 48), sky=sky)
    assert Exposure.read("x.fits").observation == observation


def test_headline_numbers(capsys):
    """Catches totals that include the sky, or rates given for counts.

    A Gaussian of 1e-15 well inside the frame gives 1e-15 x 1.14e17 = 114 cps (paper); the
    sky is 3.5e-4 cps/pixel x 100 s = 0.035 counts.
    """
    write_sources(source("gaussian", 63.5, 63.5, flux=1e-15, r_half=5, ellipticity=0.0), "blob.csv")
    main(["simulate", "blob.csv", "--frame", "128", "--output", "x.fits"])
    out = capsys.readouterr().out
    words = out.split()
    assert float(words[words.index("cps") - 1]) == pytest.approx(114, rel=0.01)
    assert "sky 0.035 counts per pixel" in out
    assert f"brightest pixel {Exposure.read('x.fits').counts.max()} counts" in out


def test_frame_of_one_number_and_compression(star):
    main(["simulate", star, "--frame", "32", "--compress", "--output", "x.fits"])
    assert Exposure.read("x.fits").observation.shape == (32, 32)
    main(["simulate", star, "--frame", "32", "--output", "y.fits"])
    assert Exposure.read("x.fits") == Exposure.read("y.fits")


def test_a_saved_exposure_keeps_its_observation(star):
    """Catches defaults of the command line that override the scene's own values."""
    main(["simulate", star, *FRAME, "--channel", "FUV", "--exposure", "5", "--output", "x.fits"])
    main(["simulate", "x.fits", "--exposure", "6", "--output", "y.fits"])
    assert Exposure.read("y.fits").observation == Observation("FUV", exposure=6, shape=(40, 48))


def test_picture_of_the_counts(star):
    main(["simulate", star, *FRAME, "--output", "x.fits", "--png", "x.png", "--scale", "sqrt"])
    counts = Exposure.read("x.fits").counts
    with Image.open("x.png") as image:
        assert image.text["Scale"] == "sqrt"
        pixels = np.asarray(image)
    expected = 255 * np.sqrt((counts - counts.min()) / np.ptp(counts))
    assert np.abs(pixels[::-1] - expected).max() <= 0.5 + 1e-9


def test_count_rate_warnings_are_lines(capsys):
    write_sources(source("point", 20.0, 10.0, flux=1e-13), "bright.csv")
    assert main(["simulate", "bright.csv", *FRAME, "--output", "x.fits"]) == 0
    err = capsys.readouterr().err
    assert err.startswith("napari-issis: warning: ")
    assert "22 cps" in err
    assert all(line.startswith("napari-issis: warning: ") for line in err.splitlines())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nonsense", "--output", "x.fits"], "there is no scene 'nonsense'; known: blend"),
        (["none.csv", "--output", "x.fits"], "cannot read none.csv"),
        (["blend"], "--output"),
        (["blend", "--output", "x.dat"], "x.dat: the name must end in .fits"),
        (["blend", "--output", "none/x.fits"], "none does not exist"),
        (["blend", "--output", "x.fits", "--png", "x.jpg"], "x.jpg: the name must end in .png"),
        (["blend", "--output", "x.fits", "--png", "old.png"], "old.png exists already"),
        (["blend", "--output", "old.fits"], "old.fits exists already; .* with --overwrite"),
        (["blend", "--output", "x.fits", "--channel", "XUV"], "'XUV'"),
        (["blend", "--output", "x.fits", "--filters", "open"], "--filters"),
        (["blend", "--output", "x.fits", "--filters", "open", "NF9"], "'NF9'"),
        (["blend", "--output", "x.fits", "--exposure", "nan"], "exposure is nan"),
        (["blend", "--output", "x.fits", "--exposure", "-1"], "exposure is -1"),
        (["blend", "--output", "x.fits", "--exposure", "long"], "'long'"),
        (["blend", "--output", "x.fits", "--frame", "0"], r"shape is \(0, 0\)"),
        (["blend", "--output", "x.fits", "--frame", "1", "2", "3"], r"shape is \(1, 2, 3\)"),
        (["blend", "--output", "x.fits", "--scale", "cubic"], "'cubic'"),
        (["star.ecsv", "--output", "x.fits", "--frame", "32", "--seed", "-1"], "seed"),
        (["star.ecsv", "--output", "x.fits", "--frame", "32", "--tolerance", "0"], "tolerance"),
    ],
)
@pytest.mark.usefixtures("star")
def test_bad_input_is_one_line_and_writes_nothing(arguments, message, capsys):
    for name in ("old.fits", "old.png"):
        Path(name).write_text("mine")
    error = refused(capsys, "simulate", *arguments)
    assert re.search(message, error)
    assert sorted(os.listdir()) == ["old.fits", "old.png", "star.ecsv"]
    assert Path("old.fits").read_text() == Path("old.png").read_text() == "mine"


def test_overwrite(star):
    for seed in ("1", "2"):
        main(["simulate", star, *FRAME, "--seed", seed, "--overwrite", "--output", "x.fits"])
    assert Exposure.read("x.fits").seed == 2


def test_scenes_are_listed(capsys):
    assert main(["scenes"]) == 0
    out = capsys.readouterr().out
    for name in ("blend", "stars500", "galaxies100", "q2237"):
        assert name in out
    assert "Illustrative" in out


def test_version_and_help(capsys):
    for option in ("--version", "--help"):
        with pytest.raises(SystemExit) as exit_:
            main([option])
        assert exit_.value.code == 0
    told = capsys.readouterr().out
    for command in ("simulate SCENE", "sheet SCENE", "photometry SCENE", "scenes"):
        assert f"napari-issis {command}" in " ".join(told.split())


@pytest.mark.parametrize("zoom", ["0", "65", "1000"])
def test_a_wrong_zoom_leaves_no_file_behind(zoom, star, capsys):
    """Catches a FITS file without the picture that was asked for with it."""
    files = ["--output", "x.fits", "--png", "x.png", "--zoom", zoom]
    assert f"zoom is {zoom};" in refused(capsys, "simulate", star, *FRAME, *files)
    assert not Path("x.fits").exists()


# --- opening napari, or not ---


@pytest.mark.usefixtures("no_screen")
def test_without_a_screen_the_blend_becomes_files(capsys):
    """Catches a traceback of Qt's, and files that are overwritten."""
    assert main([]) == 0
    captured = capsys.readouterr()
    assert captured.err == (
        "napari-issis: there is no screen (neither DISPLAY nor WAYLAND_DISPLAY is set); "
        "writing the scene to blend.fits and blend.png instead.\n"
    )
    assert "wrote blend.fits\nwrote blend.png\n" in captured.out
    blend = example_scene("blend")
    assert Exposure.read("blend.fits") == simulate(blend.sources, blend.observation)
    os.remove("blend.fits")
    picture = Path("blend.png").read_bytes()
    assert main(["blend"]) == 0
    assert sorted(os.listdir()) == ["blend-2.fits", "blend-2.png", "blend.png"]
    assert Path("blend.png").read_bytes() == picture


@pytest.mark.usefixtures("no_screen")
def test_without_a_screen_a_file_gives_its_name(tmp_path, capsys):
    (tmp_path / "in").mkdir()
    write_sources(source("point", 20.0, 10.0), "in/star.csv")
    main(["in/star.csv"])
    capsys.readouterr()
    assert sorted(os.listdir()) == ["in", "star.fits", "star.png"]
    assert "cannot read none.csv" in refused(capsys, "none.csv")


@pytest.fixture
def fake_napari(monkeypatch):
    calls = []
    monkeypatch.setitem(
        sys.modules, "napari", types.SimpleNamespace(run=lambda: calls.append("run"))
    )
    monkeypatch.setattr(cli_module, "find_spec", lambda name: object())
    monkeypatch.setattr("napari_issis.show", lambda *scene: calls.append(scene))
    return calls


@pytest.mark.parametrize(
    ("platform", "environment"),
    [
        ("linux", {"DISPLAY": ":0"}),
        ("linux", {"WAYLAND_DISPLAY": "wayland-0"}),
        ("linux", {"QT_QPA_PLATFORM": "offscreen"}),
        ("linux", {"QT_QPA_PLATFORM": "vnc:size=800x600"}),
        ("win32", {}),
        ("darwin", {}),
    ],
)
@pytest.mark.usefixtures("no_screen")
def test_with_a_screen_napari_opens(fake_napari, monkeypatch, platform, environment):
    monkeypatch.setattr(sys, "platform", platform)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert main(["q2237"]) == 0
    (sources, observation), run = fake_napari
    assert run == "run"
    assert len(sources) == 5
    assert observation == example_scene("q2237").observation
    assert main([]) == 0
    assert fake_napari[2] == (None, None)
    assert os.listdir() == []


@pytest.mark.usefixtures("no_screen")
def test_a_qt_platform_that_needs_a_screen_is_none(monkeypatch):
    monkeypatch.setenv("QT_QPA_PLATFORM", "xcb")
    assert "no screen" in cli_module._obstacle()


@pytest.mark.parametrize("missing", [("napari",), cli_module.QT_BINDINGS])
def test_without_napari_or_qt(monkeypatch, missing, star, capsys):
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(cli_module, "find_spec", lambda n: None if n in missing else object())
    assert main([star]) == 0
    err = capsys.readouterr().err
    assert 'napari or Qt is not installed (pip install "napari-issis[all]")' in err
    assert os.path.exists("star.png")


def test_simulate_loads_neither_napari_nor_qt(star):
    """Catches an import at the top of a module, which would need a screen on a cluster."""
    program = (
        "import sys\n"
        "from napari_issis.cli import main\n"
        f"main(['simulate', {star!r}, '--frame', '32', '--output', 'x.fits', '--png', 'x.png'])\n"
        "heavy = {'napari', 'qtpy', 'PyQt6', 'PySide6', 'PyQt5', 'magicgui', 'vispy', 'superqt'}\n"
        "loaded = heavy & {name.split('.')[0] for name in sys.modules}\n"
        "assert not loaded, loaded\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
    assert sorted(os.listdir()) == ["star.ecsv", "x.fits", "x.png"]


def test_module_run():
    result = subprocess.run(
        [sys.executable, "-m", "napari_issis", "simulate", "nonsense", "--output", "x.fits"],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.returncode == 2
    assert result.stderr.startswith("napari-issis: error: there is no scene 'nonsense'")
    assert "Traceback" not in result.stderr


SKY = "ra,dec,mag\n150.0,60.0,18\n150.001,60.0002,19\n"


def test_a_catalogue_with_positions_on_the_sky(capsys):
    """Catches a pointing, roll or frame that comes too late for the catalogue."""
    Path("sky.csv").write_text(SKY)
    arguments = ["--pointing", "10h00m00s +60d00m00s", "--roll", "30", *FRAME]
    assert main(["simulate", "sky.csv", *arguments, "--output", "x.fits"]) == 0
    out = capsys.readouterr().out
    assert "ra, dec -> x, y (ICRS" in out
    assert "taken as AB magnitudes" in out
    exposure = Exposure.read("x.fits")
    assert exposure.observation.roll == 30.0
    observation = exposure.observation
    assert exposure == simulate(read_sources("sky.csv", observation), observation)
    assert exposure.sources["x"][0] == pytest.approx(23.5)
    assert "give the frame's with --pointing" in refused(
        capsys, "simulate", "sky.csv", "--output", "y.fits"
    )
    for pointing in ("here", "1 2 3 4", "10 95"):
        message = refused(
            capsys, "simulate", "sky.csv", "--pointing", pointing, "--output", "y.fits"
        )
        assert f"pointing is '{pointing}'" in message


def test_a_catalogue_in_the_frame_of_a_scene():
    """Catches the scene's own sources kept, or the default frame taken for the scene's."""
    Path("sky.csv").write_text(SKY)
    point = ["--pointing", "150 60", "--channel", "FUV", *FRAME]
    main(["simulate", "blend", *point, "--output", "x.fits"])
    main(["simulate", "x.fits", "--catalogue", "sky.csv", "--output", "y.fits"])
    exposure = Exposure.read("y.fits")
    assert exposure.observation == Exposure.read("x.fits").observation
    assert len(exposure.sources) == 2


def test_an_exposure_as_the_scene_is_rendered_the_same(star):
    main(["simulate", star, *FRAME, "--seed", "3", "--output", "x.fits"])
    main(["simulate", "x.fits", "--seed", "3", "--output", "y.fits"])
    assert Exposure.read("x.fits") == Exposure.read("y.fits")


def test_one_image_alone(star, capsys):
    """Catches an option that is parsed and then forgotten."""
    options = ["--image", "expected", "--image-only"]
    main(["simulate", star, *FRAME, *options, "--output", "x.fits"])
    main(["simulate", star, *FRAME, "--output", "whole.fits"])
    with fits.open("x.fits") as hdus:
        assert len(hdus) == 1
        np.testing.assert_array_equal(hdus[0].data, Exposure.read("whole.fits").expected)
    assert "the file holds no table" in refused(capsys, "simulate", "x.fits", "--output", "y.fits")


def test_further_files(star, capsys):
    """Catches an option that is parsed and then forgotten."""
    files = ["--rgba", "r.png", "--model", "m.png", "--png", "p.png"]
    options = ["--zoom", "2", "--image", "snr", "--dtype", "float32", "--compress"]
    main(["simulate", star, *FRAME, *files, *options, "--output", "x.fits"])
    exposure = Exposure.read("x.fits")
    np.testing.assert_array_equal(read_rgba("r.png"), exposure.counts)
    for name in ("m.png", "p.png"):
        with Image.open(name) as image:
            assert image.size == (96, 80)
    with fits.open("x.fits") as hdus:
        np.testing.assert_array_equal(hdus[1].data, exposure.snr.astype("f4"))
    assert capsys.readouterr().out.count("wrote ") == 4
    again = ["simulate", star, "--output", "y.fits", "--rgba", "r.png"]
    assert "r.png exists already" in refused(capsys, *again)
    assert not Path("y.fits").exists()


def test_psf_of_a_file(star, capsys):
    """Catches a PSF that is read and forgotten, and a scale that is not passed on."""
    axis = np.arange(-20, 21)
    array = np.exp(-0.5 * (axis[:, None] ** 2 + axis**2) / 9)
    fits.PrimaryHDU(array).writeto("psf.fits")
    arguments = ["simulate", star, *FRAME, "--psf", "psf.fits", "--output", "x.fits"]
    assert "does not say its pixel scale" in refused(capsys, *arguments)
    assert main([*arguments, "--psf-scale", "0.02"]) == 0
    observation = Observation(shape=(40, 48), psf=ImagePSF(array, 0.02))
    assert Exposure.read("x.fits") == simulate(read_sources(star), observation)
    fits.PrimaryHDU(np.roll(array, 2, axis=1)).writeto("psf.fits", overwrite=True)
    said = refused(capsys, *arguments, "--psf-scale", "0.02", "--overwrite")
    assert "not centred" in said
    assert "cut 4 columns off its left side" in said
    assert "give --psf too" in refused(
        capsys, "simulate", star, *FRAME, "--output", "y.fits", "--psf-scale", "0.02"
    )
    assert not Path("y.fits").exists()
