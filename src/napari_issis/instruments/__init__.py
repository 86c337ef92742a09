"""Instruments that come with the program, by name: the files beside this one."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files

from ..instrument import Instrument
from ..instrument_file import parse_instrument

# File of each instrument.
INSTRUMENTS = {"ISSIS": "issis.toml", "FCU": "fcu.toml", "ACS/SBC": "acs_sbc.toml"}


def instrument_named(name: str) -> Instrument:
    """Return an instrument that comes with the program.

    Raises
    ------
    ValueError
        If there is none of that name; the message lists the known ones.
    """
    if not isinstance(name, str) or name not in INSTRUMENTS:
        raise ValueError(
            f"instrument is {name!r}; known: {', '.join(INSTRUMENTS)}; or give an Instrument, "
            "such as Instrument.read('my_camera.toml')."
        )
    return _read(INSTRUMENTS[name])


@lru_cache
def _read(file: str) -> Instrument:
    return parse_instrument(files(__package__).joinpath(file).read_bytes(), file)


ISSIS = instrument_named("ISSIS")
# arcsec per pixel where lengths come without an observation
PIXEL_SCALE = ISSIS.channels[ISSIS.default_channel].pixel_scale
