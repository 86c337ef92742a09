"""Units of what is shown: conversions, and fields that lose nothing by them."""

from __future__ import annotations

import astropy.units as u
import numpy as np
import pytest
from typed import enter

from napari_issis import Observation
from napari_issis.plugin.limit_fields import QuantityLimits
from napari_issis.plugin.quantity_field import QuantityField
from napari_issis.plugin.units import FluxScale, LengthScale, Units
from napari_issis.sources import FLUX_UNIT, source

NUV, FUV = (Observation(channel=name).channel_data.pivot for name in ("NUV", "FUV"))
MAGNITUDES = {"NUV": FluxScale("AB mag", NUV), "FUV": FluxScale("AB mag", FUV)}


def check_flux(number):
    source("point", 0, 0, number)


@pytest.fixture
def flux(qapp):
    return QuantityField("flux", 1e-14, "", FluxScale(), check_flux)


@pytest.fixture
def length(qapp):
    return QuantityField("r_half", 20.0, "", LengthScale())


def by_astropy(magnitude, pivot):
    return (magnitude * u.ABmag).to(FLUX_UNIT, u.spectral_density(pivot * u.AA)).value


def test_units_say_when_they_change():
    """Catches a table that is not told, or told though nothing changed."""
    units, heard = Units(), []
    units.events.changed.connect(lambda event: heard.append((units.flux, units.length)))
    units.flux = "flux"
    units.length = "px"
    units.flux = "AB mag"
    units.length = "arcsec"
    assert heard == [("AB mag", "px"), ("AB mag", "arcsec")]
    assert (units.flux_label, units.length_label) == ("AB mag", "″")
    for name, message in (("flux", "unit of flux is 'Jy'"), ("length", "unit of length is 'Jy'")):
        with pytest.raises(ValueError, match=message):
            setattr(units, name, "Jy")
    with pytest.raises(ValueError, match="known: px, arcsec"):
        Units(length="m")
    assert (units.flux, units.length) == ("AB mag", "arcsec")


def test_units_convert_columns_and_numbers():
    """Catches a table or a read-out that shows another magnitude than is simulated."""
    units = Units()
    assert list(units.show_flux([1e-14, 0.0], NUV)) == [1e-14, 0.0]
    assert units.read_flux(1e-14, NUV) == 1e-14
    assert units.flux_text(1.2345e-14, NUV) == "1.23e-14"
    assert units.show_length([20.0]) == pytest.approx([20.0])
    assert units.length_text(20.0) == "20"
    units.flux, units.length = "AB mag", "arcsec"
    assert units.show_flux([by_astropy(21.0, FUV), 0.0], FUV) == pytest.approx([21.0, np.inf])
    assert units.read_flux(21.0, FUV) == pytest.approx(by_astropy(21.0, FUV), rel=1e-12, abs=0)
    assert units.flux_text(by_astropy(21.004, FUV), FUV) == "21.00"
    assert units.flux_text(0.0, FUV) == "∞"
    assert units.show_length([20.0]) == pytest.approx([0.72])
    assert units.read_length(0.72) == pytest.approx(20.0)
    assert units.show_length([20.0], pixel_scale=0.1) == pytest.approx([2.0])
    assert units.length_text(20.0) == "0.72"


def test_what_is_no_magnitude_is_named():
    for number in (-30.0, 300.0):
        with pytest.raises(ValueError, match=f"AB magnitude is {number:g}; it must be in"):
            MAGNITUDES["NUV"].read(number)
    with pytest.raises(ValueError, match="flux is 0, which has no AB magnitude; type one, or"):
        MAGNITUDES["NUV"].show_one(0.0)


@pytest.mark.parametrize("typed", ["20", "0.1", "1e-14", "1.23456789012345", "3e-17"])
@pytest.mark.parametrize("first", ["number", "unit"])
def test_there_and_back_gives_what_was_typed(flux, length, typed, first):
    """Catches numbers that drift by rounding each time that the unit is changed."""
    for field, base, other in (
        (length, LengthScale(), LengthScale("arcsec", 0.036)),
        (flux, FluxScale(), MAGNITUDES["NUV"]),
    ):
        if first == "unit":
            base, other = other, base
        if field is flux and (first == "unit") == ("e" in typed):
            continue
        field.show_in(base)
        enter(field, typed)
        value = base.read(float(typed))
        for _ in range(20):
            assert field.number == value
            field.show_in(other)
            assert field.value != typed
            assert other.read(float(field.value)) == pytest.approx(value, rel=1e-4, abs=0)
            assert field.number == value
            field.show_in(base)
        assert field.value == typed


def test_converted_numbers_are_short(flux, length):
    """Catches seventeen digits in a field of ten."""
    flux.show_in(MAGNITUDES["NUV"])
    enter(flux, "20.1")
    flux.show_in(FluxScale())
    enter(length, "33.333")
    length.show_in(LengthScale("arcsec", 0.036))
    assert len(flux.value) <= 11
    assert length.value == "1.19999"


def test_a_magnitude_that_was_typed_stays_when_the_channel_changes(flux):
    """Catches 20 that becomes 20.9 before the user's eyes."""
    flux.show_in(MAGNITUDES["NUV"])
    enter(flux, "20")
    flux.show_in(MAGNITUDES["FUV"])
    assert flux.value == "20"
    assert flux.number == pytest.approx(by_astropy(20.0, FUV), rel=1e-12, abs=0)


def test_a_flux_that_was_typed_stays_when_the_channel_changes(flux):
    """Catches a flux that follows the channel because it was looked at as a magnitude."""
    for scale in (MAGNITUDES["NUV"], MAGNITUDES["FUV"], FluxScale()):
        flux.show_in(scale)
        assert flux.number == 1e-14
    assert flux.value == "1e-14"
    flux.show_in(MAGNITUDES["FUV"])
    assert by_astropy(float(flux.value), FUV) == pytest.approx(1e-14, rel=1e-4, abs=0)
    enter(flux, "20.00001")
    flux.show_in(FluxScale())
    enter(flux, "1.23456789e-14")
    for scale in (MAGNITUDES["NUV"], MAGNITUDES["FUV"], FluxScale("flux", FUV)):
        flux.show_in(scale)
    assert flux.value == "1.23456789e-14"
    flux.show_in(MAGNITUDES["FUV"])
    # Seen as a flux while the channel changed, a typed magnitude is that flux.
    enter(flux, "20")
    flux.show_in(FluxScale("flux", FUV))
    shown, number = flux.value, flux.number
    flux.show_in(FluxScale("flux", NUV))
    assert (flux.value, flux.number) == (shown, number)
    flux.show_in(MAGNITUDES["NUV"])
    assert by_astropy(float(flux.value), NUV) == pytest.approx(number, rel=1e-4, abs=0)


def test_no_flux_has_no_magnitude_and_comes_back(flux):
    """Catches a 0 that is lost, or that is taken for the magnitude 0: a very bright star."""
    enter(flux, "0")
    flux.show_in(MAGNITUDES["NUV"])
    assert flux.value == "∞"
    with pytest.raises(ValueError, match="flux is 0, which has no AB magnitude"):
        _ = flux.number
    assert "no AB magnitude" in flux.native.toolTip()
    assert flux.native.styleSheet()
    flux.show_in(FluxScale())
    assert flux.number == 0.0
    assert flux.native.styleSheet() == ""


def test_what_has_to_be_corrected_stays_through_a_change_of_units(flux):
    """Catches typed text that is replaced by an older number."""
    enter(flux, "2e-")
    flux.show_in(MAGNITUDES["NUV"])
    assert flux.value == "2e-"
    with pytest.raises(ValueError, match="flux is '2e-'"):
        _ = flux.number
    enter(flux, "21")
    assert flux.number == pytest.approx(by_astropy(21.0, NUV), rel=1e-12, abs=0)


def test_a_script_sets_the_number_on_any_scale(flux, length):
    """Catches pixels that are written into a field of arcsec."""
    length.show_in(LengthScale("arcsec", 0.036))
    length.number = 100.0
    assert (length.value, length.number) == ("3.6", 100.0)
    length.show_in(LengthScale())
    assert length.value == "100"


def test_limits_in_magnitudes_are_taken_in_either_order(qapp):
    """Catches 18 to 22 that is refused because 22 is the fainter, and fluxes out of order."""
    limits = QuantityLimits("flux", 1e-15, 1e-14, "", FluxScale(), check_flux)
    limits.show_in(MAGNITUDES["NUV"])
    assert float(limits.low.value) > float(limits.high.value)
    assert limits.numbers == (1e-15, 1e-14)
    expected = pytest.approx((by_astropy(22.0, NUV), by_astropy(18.0, NUV)), rel=1e-12, abs=0)
    for first, second in (("22", "18"), ("18", "22")):
        enter(limits.low, first)
        enter(limits.high, second)
        assert limits.numbers == expected
    limits.show_in(MAGNITUDES["FUV"])
    assert (limits.low.value, limits.high.value) == ("18", "22")
    limits.show_in(FluxScale())
    assert float(limits.low.value) < float(limits.high.value)
    # In fluxes the order is an error that is told, not mended.
    enter(limits.low, "2e-14")
    enter(limits.high, "1e-14")
    assert limits.numbers == (2e-14, 1e-14)
