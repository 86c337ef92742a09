"""The proposal sheet: what it says, how it is made again, and what it must not hold."""

import base64
import io
import re
from html.parser import HTMLParser

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.table import QTable, vstack
from PIL import Image

import napari_issis as ni
from napari_issis.sheet import both_channels
from napari_issis.sheet_pictures import ticks

VOID = {"meta", "image", "path", "rect", "polygon", "ellipse", "link", "img", "input", "br"}
CPS_PER_FLUX = {"NUV": 1.14e17, "FUV": 3.36e15}  # Shalyapin & Goicoechea 2014
SCENE = vstack(
    [
        ni.source("point", 20.25, 30.5, 4e-17),
        ni.source("point", 26.0, 31.0, 2e-17),
        ni.source("exponential", 40.0, 20.0, 3e-16, 6.0, 0.4, 30.0),
    ]
)
ONE = ni.Observation("NUV", shape=(48, 64), exposure=2000.0)


class Page(HTMLParser):
    """Tags, texts, and tables below their headings, as a browser would see them."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.open, self.tables, self.code, self.texts = [], [], {}, "", []
        self.heading = ""
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "h2":
            self.heading = ""
        if tag == "table":
            self.tables[self.heading] = []
        if tag == "tr":
            self.tables[self.heading].append([])
        if tag in ("td", "th"):
            self.tables[self.heading][-1].append("")

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)
        if self.open and self.open[-1] == "h2":
            self.heading += data
        elif self.open and self.open[-1] == "pre":
            self.code += data
        elif self.open and self.open[-1] in ("td", "th"):
            self.tables[self.heading][-1][-1] += data


def sheet(path, sources=SCENE, observations=ONE, **options):
    ni.proposal_sheet(sources, observations, path, **options)
    return Page(path.read_text(encoding="utf-8"))


def close(text, value):
    """Whether a printed number is the value, to the digits printed (three or more)."""
    return float(text) == pytest.approx(float(value), rel=5.1e-3)


def test_its_numbers_are_the_library_s(tmp_path):
    """Catches swapped channels, columns and units, and goals of the wrong source."""
    goals = [{"rows": 1, "snr": 20}, {"rows": [0, 1], "flux_ratio": 0.03}]
    goals.append({"rows": 0, "position": 2 * u.mas})
    page = sheet(tmp_path / "x.html", seed=3, goals=goals)
    pair = [ONE, ONE.replace(channel="FUV")]
    rows = page.tables["Forecast: what can be measured"]
    assert rows[0] == ["source", "NUV", "FUV"]
    assert [row[0] for row in rows[2:]] == ["0", "1", "2"]
    for i, one in enumerate(pair):
        table = ni.forecast(SCENE, one)
        for row, cells in enumerate(rows[2:]):
            counts, alone, snr, flux, place, neighbour = cells[1 + 6 * i : 7 + 6 * i]
            true = SCENE["flux"][row].value * CPS_PER_FLUX[one.channel] * 2000
            assert float(counts) == pytest.approx(true, abs=0.51)
            assert close(alone, table["snr_alone"][row])
            assert close(snr, table["snr"][row])
            relative = table["flux_error"][row] / SCENE["flux"][row]
            assert close(flux, 100 * relative.to_value(""))
            worst = max(table["x_error"][row].value, table["y_error"][row].value)
            assert close(place, worst * 36)
            index, correlation = table["neighbour", "flux_correlation"][row]
            assert neighbour == f"{index} ({correlation:+.2f})"
    times = page.tables["Exposure times for goals"]
    assert times[0] == ["goal", "NUV", "FUV"]
    assert [row[0] for row in times[1:]] == [
        "S/N 20 of 1: flux to 5 %",
        "flux ratio 0/1 to 3 %",
        "position of 0 to 2.0 mas",
    ]
    settings = {row[0]: row[1:] for row in page.tables["Settings"]}
    for i, one in enumerate(pair):
        for goal, cells in zip(goals, times[1:], strict=True):
            seconds = ni.exposure_for(SCENE, one, **goal).value
            assert close(cells[1 + i].split(" s")[0], seconds)
        exposure = ni.simulate(SCENE, one, seed=3)
        assert settings["Sum of all counts"][i] == str(exposure.counts.sum())
        assert settings["Brightest pixel"][i] == f"{exposure.counts.max()} counts"
        assert close(settings["Expected background"][i].split()[0], exposure.background)
    fluxes = [row[4] for row in page.tables["Sources"][1:]]
    assert [float(f) for f in fluxes] == SCENE["flux"].value.tolist()


STRANGE = QTable(
    {
        "kind": ["point", "sersic", "uniform", "point"],
        "x": [20.123456789012345, 30.0, 40.0, 12.0],
        "y": [1 / 3, 20.0, 30.0, 33.0],
        "flux": [21.5, 20.25, 22.0, 22.5] * u.ABmag,
        "r_half": [0.1, 0.2, 0.3, 0.1] * u.arcsec,
        "ellipticity": [0.5, 0.1 + 0.2, 0.1, 0.5],
        "pa": [0.0, 0.5, 1.0, 0.0] * u.rad,
        "n": [np.nan, 2.5, np.nan, np.nan],
        "spectrum": ["", "blackbody(30000 K)", "", "powerlaw(-1.5, at=2500)"],
    }
)
SET_UPS = {
    "plain": ONE,
    "everything": ni.Observation(
        "FUV",
        ("LP1370", "NF1"),
        12345.678,
        (40, 52),
        psf=ni.TelescopePSF(1.7, 0.3, (1200.0, 1700.0), 0.05, jitter_fwhm=0.03),
        pointing=SkyCoord(340.1, 3.36, unit="deg"),
        roll=33.3,
        sky=ni.Sky("high", "low", "high orbit", galactic_latitude=40.0),
        dark=1e-4,
        detector=ni.Detector(dead_time=1e-4, rollover=True),
    ),
    "curve": ONE.replace(
        filters=(ni.Filter("it's", [2000, 2500, 3000], [0, 0.7, 0.1]), "open"),
        psf=ni.MoffatPSF(0.11, 3.1),
        sky=ni.SKIES["HST high"],
    ),
    "camera": ni.Observation(instrument="ACS/SBC", shape=(48, 64), exposure=500.0),
    "background": ONE.replace(background=0.0123, psf=ni.GaussianPSF(0.08)),
}


@pytest.mark.parametrize(
    ("name", "scene"),
    [
        ("plain", STRANGE),
        ("everything", STRANGE),
        ("curve", SCENE),
        ("background", SCENE),
        ("camera", SCENE),
        ("plain", SCENE[:0]),
    ],
)
def test_its_commands_make_the_same_counts(name, scene, tmp_path, capsys):
    """Catches digits lost, and anything of the scene or the set-up that is not written."""
    page = sheet(tmp_path / "x.html", scene, SET_UPS[name], seed=11)
    made = {}
    exec(compile(page.code, "<sheet>", "exec"), made)
    pair = both_channels(SET_UPS[name])
    assert tuple(made["observations"]) == pair
    for column in ("x", "y", "flux", "r_half", "ellipticity", "pa"):
        given, again = (np.asarray(t[column], dtype=float) for t in (scene, made["sources"]))
        assert again.tolist() == given.tolist()
    totals, printed = page.tables["Settings"][-1][1:], capsys.readouterr().out
    for one, exposure, total in zip(pair, made["exposures"], totals, strict=True):
        assert np.array_equal(exposure.counts, ni.simulate(scene, one, seed=11).counts)
        assert f"{one.channel} {total}\n" in printed


def test_what_cannot_be_written_is_read_from_the_saved_exposure(tmp_path, monkeypatch):
    """Catches commands that silently make another scene."""
    y, x = np.mgrid[-16:17, -16:17]
    psf = ni.ImagePSF(np.exp(-(x**2 + y**2) / 8.0), 0.036)
    one = ONE.replace(psf=psf)
    monkeypatch.chdir(tmp_path)
    page = sheet(tmp_path / "x.html", SCENE, one)
    assert any("is read from" in text or "NUV.fits" in text for text in page.texts)
    exposure = ni.simulate(SCENE, one)
    exposure.write("NUV.fits")
    made = {}
    exec(compile(page.code, "<sheet>", "exec"), made)
    assert np.array_equal(made["exposures"][0].counts, exposure.counts)


def test_a_source_that_is_an_image_is_read_from_the_saved_exposure(tmp_path, monkeypatch):
    """Catches a page that cannot be made, and commands that lose the image."""
    y, x = np.mgrid[-9:10, -9:10]
    arc = ni.image_source(
        np.exp(-((np.hypot(x, y) - 5) ** 2)), 30, 22, flux=2e-16, pixel_scale=0.036
    )
    scene = vstack([SCENE, arc])
    monkeypatch.chdir(tmp_path)
    page = sheet(tmp_path / "x.html", scene)
    assert "NUV.fits" in " ".join(page.texts)
    exposure = ni.simulate(scene, ONE)
    exposure.write("NUV.fits")
    made = {}
    exec(compile(page.code, "<sheet>", "exec"), made)
    assert np.array_equal(made["exposures"][0].counts, exposure.counts)


@pytest.mark.parametrize("samples", [9, 500])
@pytest.mark.parametrize("left", ["gone", "changed"])
def test_spectra_from_files_are_on_the_page_or_in_the_saved_exposure(
    samples, left, tmp_path, monkeypatch
):
    """Catches commands that need the author's file, or take another of that name for it."""
    there, here = tmp_path / "author", tmp_path / "reader"
    there.mkdir()
    here.mkdir()
    wavelength = np.linspace(1000, 4000, samples)
    flux = 1e-17 * (1 + np.sin(wavelength / 300) ** 2) / 3
    own = there / "my sed.csv"
    own.write_text(
        "wavelength_A,flux\n" + "".join(f"{w},{f}\n" for w, f in zip(wavelength, flux, strict=True))
    )
    scene = SCENE.copy()
    scene["spectrum"] = [f'table("{own}", z=0.1, at=2600)', "", f'table("{own}", at=2100)']
    page = sheet(tmp_path / "x.html", scene)
    exposure = ni.simulate(scene, ONE)
    flat = ni.simulate(SCENE, ONE)
    assert not np.array_equal(exposure.counts, flat.counts)
    monkeypatch.chdir(here)
    if samples > 64:
        assert "500 samples" in " ".join(page.texts)
        exposure.write("NUV.fits")
    else:
        assert str(own) not in page.code
    if left == "gone":
        own.unlink()
    else:
        own.write_text("wavelength_A,flux\n1000,1\n4000,2\n")
    made = {}
    exec(compile(page.code, "<sheet>", "exec"), made)
    assert np.array_equal(made["exposures"][0].counts, exposure.counts)


def test_the_same_input_gives_the_same_bytes(tmp_path):
    for name in ("a.html", "b.html"):
        sheet(tmp_path / name, seed=2)
    sheet(tmp_path / "c.html", seed=2, date="26 November 2026")
    a, b, c = ((tmp_path / f"{name}.html").read_bytes() for name in "abc")
    assert a == b
    assert b"26 November 2026" in c
    assert not re.search(rb"\b20\d\d-\d\d", a)


def test_nothing_of_the_user_s_is_taken_for_html(tmp_path):
    """Catches one text that is not escaped."""
    evil = '</title></svg><script>alert(1)</script><img src="http://x/" onerror=alert(2)>&amp;"\''
    scene = SCENE.copy()
    scene["name"] = [evil, "B", "C"]
    scene["spectrum"] = ["", "", ""]
    page = sheet(tmp_path / "x.html", scene, title=evil, notes=f"{evil}\nmore", date=evil)
    tags = {tag for tag, _ in page.tags}
    assert not tags & {"script", "img", "link", "iframe", "object"}
    for _, attributes in page.tags:
        assert not any(name.startswith("on") for name in attributes)
        for name in ("src", "href"):
            assert attributes.get(name, "data:image/png;base64,").startswith("data:image/png")
    assert page.texts.count(evil) >= 5
    assert page.tables["Sources"][1][0] == evil


def test_the_image_is_that_of_the_counts(tmp_path):
    """Catches an image upside down, of the other channel, or with another stretch."""
    page = sheet(tmp_path / "x.html", seed=5)
    pictures = [a["href"] for tag, a in page.tags if tag == "image"]
    assert len(pictures) == 4
    for one, href in zip((ONE, ONE.replace(channel="FUV")), pictures[::2], strict=True):
        data = base64.b64decode(href.removeprefix("data:image/png;base64,"))
        shown = np.asarray(Image.open(io.BytesIO(data)), dtype=float)
        exposure = ni.simulate(SCENE, one, seed=5)
        low = np.floor(exposure.background)
        part = np.clip((exposure.counts - low) / (exposure.counts.max() - low), 0, 1)
        brightness = np.log(1000 * part + 1) / np.log(1001)
        assert np.abs(shown - (255 - 255 * brightness[::-1])).max() <= 0.51


def test_the_labels_of_the_colour_bar_stand_where_the_colours_are():
    for value, place in ticks(4.0, 840.0):
        part = (value - 4) / 836
        assert place == pytest.approx(np.log(1000 * part + 1) / np.log(1001))
    assert [value for value, _ in ticks(4.0, 840.0)] == [4, 10, 30, 100, 300]


@pytest.mark.parametrize(("roll", "north", "east"), [(0, (0, -1), (-1, 0)), (90, (1, 0), (0, -1))])
def test_compass_and_scale(roll, north, east, tmp_path):
    """Catches a compass that turns the wrong way: at roll 90 the frame's top is east."""
    page = sheet(tmp_path / "x.html", observations=ONE.replace(roll=roll))
    paths = [a["d"] for tag, a in page.tags if tag == "path"]
    arms = [re.fullmatch(r"M[\d. ]+l(\S+) (\S+)", path) for path in paths]
    arms = [(float(m[1]) / 20, float(m[2]) / 20) for m in arms if m]
    assert arms[0] == pytest.approx(north, abs=1e-3)
    assert arms[2] == pytest.approx(east, abs=1e-3)
    bar = next(re.fullmatch(r"M10 [\d.]+h([\d.]+)", path) for path in paths if "h" in path)
    label = page.texts[page.texts.index("N") - 1]
    # the picture is 300 units wide, the frame 64 pixels of 0.036 arcsec
    assert float(bar[1]) / 300 * 64 * 0.036 == pytest.approx(float(label.strip("″")), rel=1e-3)


def test_the_model_is_drawn_where_the_sources_are(tmp_path):
    """Catches a mirrored angle and a frame upside down."""
    page = sheet(tmp_path / "x.html")
    (galaxy,) = (a for tag, a in page.tags if tag == "ellipse")
    numbers = [float(v) for v in re.findall(r"-?[\d.]+", galaxy["transform"])]
    zoom = 300 / 64
    assert numbers[:2] == pytest.approx([40.5 * zoom, (47.5 - 20) * zoom], abs=0.01)
    assert float(galaxy["ry"]) == pytest.approx(6 * zoom, abs=0.01)
    assert float(galaxy["rx"]) == pytest.approx(0.6 * 6 * zoom, abs=0.01)
    # the upper end of the major axis, turned as SVG does with y down: to the left
    turn = np.radians(numbers[2])
    end = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ [0, -1]
    assert end == pytest.approx([-np.sin(np.radians(30)), -np.cos(np.radians(30))], abs=1e-3)


def test_many_sources_are_folded_and_the_brightest_shown(tmp_path):
    scene = ni.random_sources("point", 60, shape=(64, 64), flux=(1e-17, 1e-16), seed=4)
    one = ni.Observation(shape=(64, 64))
    page = sheet(tmp_path / "x.html", scene, one)
    rows = page.tables["Forecast: what can be measured"][2:]
    assert [int(row[0]) for row in rows] == sorted(np.argsort(-scene["flux"].value)[:15])
    assert "45 of 60 sources are left out" in " ".join(page.texts)
    assert sum(tag == "details" for tag, _ in page.tags) == 2
    assert len(page.tables["Sources"]) == 61
    chosen = sheet(tmp_path / "y.html", scene, one, rows=[7, 3])
    rows = chosen.tables["Forecast: what can be measured"][2:]
    assert [row[0] for row in rows] == ["7", "3"]


def test_warnings_and_goals_out_of_reach_are_told(tmp_path):
    """Catches a page without the warnings, and one that is not written for a goal's sake."""
    scene = vstack([ni.source("point", 30, 20, 1e-14), ni.source("point", 900, 20, 1e-14)])
    page = sheet(tmp_path / "x.html", scene, goals=[{"rows": 1, "snr": 10}])
    text = " ".join(page.texts)
    assert "receive more than 22 cps" in text
    assert "row 1 cannot be measured" in page.tables["Exposure times for goals"][1][1]
    assert "The PSF is assumed" in text
    given = sheet(tmp_path / "y.html", observations=[ONE.replace(psf=ni.GaussianPSF(0.1))])
    assert "Gaussian, FWHM 0.1 arcsec" in given.tables["Settings"][7][1]


def test_an_old_file_is_kept(tmp_path):
    path = tmp_path / "x.html"
    path.write_text("old")
    with pytest.raises(FileExistsError, match="exists already"):
        ni.proposal_sheet(SCENE, ONE, path)
    assert path.read_text() == "old"
    ni.proposal_sheet(SCENE, ONE, path, overwrite=True)
    assert path.read_text().startswith("<!DOCTYPE html>")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"path": "x.pdf"}, "the name must end in .html"),
        ({"observations": []}, "give one or two Observations"),
        ({"observations": [ONE, ONE.replace(shape=(9, 9))]}, "give frames of the same shape"),
        ({"goals": [{"rows": 1}]}, "a goal is {'rows': 1}"),
        ({"goals": [{"rows": 1, "mag": 3}]}, "snr, flux_ratio, position"),
        (
            {"goals": [{"rows": 30, "snr": 3}]},
            "'snr': 3}: there is no row 30; the table has 3 rows",
        ),
        ({"goals": [{"rows": [1, 1], "flux_ratio": 0.1}]}, "takes two different rows"),
        ({"rows": [3]}, "there is no row 3; the table has 3 rows"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_bad_arguments_are_named(arguments, words, tmp_path):
    values = {"observations": ONE, "path": "x.html", **arguments}
    path = tmp_path / values.pop("path")
    with pytest.raises(ValueError, match=re.escape(words)):
        ni.proposal_sheet(SCENE, values.pop("observations"), path, **values)
    assert not path.exists()
