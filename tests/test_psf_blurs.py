"""Blurs and halo that an observation has in place of its channel's own."""

from dataclasses import replace

import pytest

from napari_issis import GaussianPSF, Observation, TelescopePSF
from napari_issis.psf_blurs import blurs_of, with_blurs, with_blurs_of

NUV, FUV = Observation(), Observation("FUV")


def test_blurs_are_told_and_taken_back():
    """Catches a PSF that counts as edited although it is the channel's own."""
    assert blurs_of(NUV) == {}
    edited = with_blurs(NUV, jitter_fwhm=0.05)
    assert edited.psf == TelescopePSF(1.7, 0.33, (1850, 3200), blur_fwhm=0.0888, jitter_fwhm=0.05)
    assert blurs_of(edited) == {"jitter_fwhm": 0.05}
    assert blurs_of(with_blurs(NUV, halo_share=0.1, halo_fwhm=2.0)) == {
        "halo_share": 0.1,
        "halo_fwhm": 2.0,
    }
    assert with_blurs(edited, jitter_fwhm=0.0, blur_fwhm=0.0888) == NUV


def test_another_channel_has_its_own_band_and_blur():
    """Catches diffraction of the old band, and the old channel's blur that nobody edited."""
    edited = with_blurs(NUV, jitter_fwhm=0.05)
    moved = with_blurs_of(edited.replace(channel="FUV"), edited)
    assert moved.psf == TelescopePSF(1.7, 0.33, (1150, 1750), blur_fwhm=0.0945, jitter_fwhm=0.05)
    narrow = with_blurs_of(edited.replace(filters=("N2500", "open")), edited)
    own = NUV.replace(filters=("N2500", "open")).effective_psf
    assert narrow.psf == replace(own, jitter_fwhm=0.05)
    assert own.band != (1850, 3200)
    assert with_blurs_of(FUV, NUV) == FUV


@pytest.mark.parametrize("psf", [GaussianPSF(0.1), TelescopePSF(2.4, 0.33, (1850, 3200))])
def test_another_psf_is_left_alone(psf):
    """Catches a script's PSF that is replaced by the channel's."""
    given = NUV.replace(psf=psf)
    assert blurs_of(given) is None
    assert with_blurs_of(given.replace(channel="FUV"), given) == FUV.replace(psf=psf)


def test_what_is_out_of_range_is_named():
    with pytest.raises(ValueError, match="halo_fwhm is 0 for a halo_share"):
        with_blurs(NUV, halo_share=0.2)
