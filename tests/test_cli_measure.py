"""The shell commands that measure: sheet and photometry."""

import re

import pytest
from astropy.table import QTable

import napari_issis as ni
from napari_issis.catalogue import write_sources
from napari_issis.cli import main
from napari_issis.result_table import write_table
from test_cli import refused

FRAME = ["--frame", "40", "48"]
STAR = ni.source("point", 20.0, 10.0, flux=1e-15)


@pytest.fixture(autouse=True)
def star(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_sources(STAR, "star.ecsv")
    return tmp_path


def test_a_sheet_equals_the_library_s(star, capsys):
    """Catches an option that is parsed and then forgotten."""
    arguments = ["sheet", "star.ecsv", *FRAME, "--output", "x.html", "--channel", "FUV"]
    arguments += ["--exposure", "500", "--seed", "4", "--goal", "snr", "20", "0"]
    arguments += ["--goal", "position", "0.01", "0", "--rows", "0", "--title", "A", "--notes", "B"]
    assert main(arguments) == 0
    one = ni.Observation("FUV", exposure=500, shape=(40, 48))
    goals = [{"rows": 0, "snr": 20.0}, {"rows": 0, "position": 0.01}]
    options = {"seed": 4, "goals": goals, "rows": [0], "title": "A", "notes": "B"}
    ni.proposal_sheet(STAR, one, "y.html", **options)
    assert (star / "x.html").read_bytes() == (star / "y.html").read_bytes()
    assert capsys.readouterr().out == "wrote x.html\n"
    assert "--overwrite" in refused(capsys, *arguments)
    assert main([*arguments, "--overwrite"]) == 0


@pytest.mark.parametrize("words", [["snr"], ["snr", "x", "0"], ["snr", "20"], ["mag", "2", "0"]])
def test_a_wrong_goal_is_named(words, star, capsys):
    error = refused(capsys, "sheet", "star.ecsv", "--output", "x.html", "--goal", *words)
    assert f"--goal is '{' '.join(words)}'" in error
    assert not (star / "x.html").exists()


@pytest.mark.parametrize("words", [["snr", "20", "1"], ["position", "0.1", "0", "-1"]])
def test_a_goal_for_a_source_that_is_not_there_is_refused(words, star, capsys):
    """Catches a page that is written, with the error in its table."""
    error = refused(capsys, "sheet", "star.ecsv", "--output", "x.html", "--goal", *words)
    assert f"--goal is '{' '.join(words)}': there is no row {words[-1]}; the table has 1" in error
    assert not (star / "x.html").exists()


def test_photometry_equals_the_library_s(star, capsys):
    """Catches an option that is parsed and then forgotten."""
    arguments = ["photometry", "star.ecsv", *FRAME, "--seed", "4", "--radius", "3", "--scale", "1"]
    arguments += ["--level", "mean", "--annulus", "1.5", "2.5", "--output"]
    assert main([*arguments, "x.ecsv"]) == 0
    assert main([*arguments, "x.csv"]) == 0
    exposure = ni.simulate(STAR, ni.Observation(shape=(40, 48)), seed=4)
    options = {"radius": 3, "scale": 1, "sky": "mean", "annulus": (1.5, 2.5)}
    expected = ni.aperture_photometry(exposure, **options)
    table = QTable.read("x.ecsv", format="ascii.ecsv")
    for read in (table, QTable.read("x.csv", format="ascii.csv")):
        assert read.colnames == expected.colnames
        for name in ("aperture_counts", "sky", "counts", "bias_sigma"):
            value = getattr(expected[name], "value", expected[name])
            assert getattr(read[name], "value", read[name])[0] == value[0]
    assert table["counts"].unit == "ct"
    assert table.meta["annulus"] == [1.5, 2.5]
    assert "x.ecsv exists already" in refused(capsys, *arguments, "x.ecsv")
    assert "must end in .ecsv or .csv" in refused(capsys, *arguments, "x.txt")


def test_help_names_every_option(capsys):
    for command in ("sheet", "photometry"):
        with pytest.raises(SystemExit) as exit_:
            main([command, "--help"])
        assert exit_.value.code == 0
        assert re.search(r"--exposure SECONDS", capsys.readouterr().out)


def test_a_table_is_not_replaced_unasked(star):
    (star / "x.csv").write_text("old")
    with pytest.raises(FileExistsError):
        write_table(QTable({"a": [1]}), "x.csv")
    assert (star / "x.csv").read_text() == "old"
