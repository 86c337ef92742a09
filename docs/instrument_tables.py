"""Fill the tables of instrument.md from the program: python docs/instrument_tables.py."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import MISSING
from functools import partial
from pathlib import Path

import napari_issis as ni
from napari_issis.encircled_energy import encircled_energy
from napari_issis.facts import Fact, facts_of, numbers
from napari_issis.instrument import Channel
from napari_issis.instruments import ISSIS, instrument_named
from napari_issis.psf import fwhm
from napari_issis.sky import SKIES, paper_estimate
from napari_issis.sky_tables import (
    EARTHSHINE,
    EARTHSHINE_HIGH,
    LINES,
    WAVELENGTH,
    ZODIACAL,
    ZODIACAL_HIGH,
)

CHANNELS = ISSIS.channels
PAGE = Path(__file__).with_name("instrument.md")
Rows = list[list[str]]
CIRCLES = (0.1, 0.2, 0.5, 1.0)


def channels() -> Rows:
    """Channels, their effective area and pivot wavelength."""
    rows = [["quantity", *CHANNELS, "status"]]
    bands = [ni.Observation(name).passband for name in CHANNELS]
    for label, values, status in (
        ("band (A)", ["{:g} to {:g}".format(*b.band) for b in bands], _status("band")),
        (
            "cps for 1 erg s-1 cm-2 A-1",
            [f"{b.cps_per_flux:.3g}" for b in bands],
            _status("cps_per_flux"),
        ),
        ("mean effective area (cm2)", [f"{b.area:.1f}" for b in bands], "derived"),
        ("its shape over the band", ["constant"] * 2, "assumed"),
        ("pivot wavelength (A)", [f"{c.pivot:.1f}" for c in CHANNELS.values()], "derived"),
        (
            "AB magnitude of 1 cps",
            [f"{_magnitude(name):.2f}" for name in CHANNELS],
            "derived",
        ),
        (
            "pixel (arcsec)",
            [f"{c.pixel_scale}" for c in CHANNELS.values()],
            _status("pixel_scale"),
        ),
    ):
        rows.append([label, *values, status])
    return rows


def psfs() -> Rows:
    """Width and encircled energy of the two assumed PSFs."""
    rows = [["channel", "FWHM (arcsec)", *(f"in {d:g} arcsec" for d in CIRCLES), "status"]]
    for name, channel in CHANNELS.items():
        shares = [f"{100 * encircled_energy(channel.psf, d):.0f} %" for d in CIRCLES]
        rows.append([name, f"{fwhm(channel.psf):.3f}", *shares, "assumed"])
    return rows


def skies() -> Rows:
    """Rates of each component in each of the named skies, cps per pixel."""
    rows = [["channel", "component", *SKIES]]
    for channel in CHANNELS:
        seen = [ni.Observation(channel, sky=sky) for sky in SKIES.values()]
        names = dict.fromkeys(name for one in seen for name in one.sky_components)
        for name in names:
            rates = [one.sky_components.get(name) for one in seen]
            rows.append([channel, name, *("" if r is None else f"{r:.2g}" for r in rates)])
        rows.append([channel, "**all**", *(f"**{one.sky_rate:.2g}**" for one in seen)])
    return rows


def paper_sky() -> Rows:
    """Compare the paper's two numbers, how they come about, and the integral over the band."""
    rows = [["channel", "part", "paper", "its way, here", "integrated", "integrated / paper"]]
    for name, channel in CHANNELS.items():
        observation = ni.Observation(name, sky=ni.Sky("average", "average", "high"))
        parts = observation.sky_components
        continuum = parts["earthshine"] + parts["zodiacal light"]
        estimate = paper_estimate(channel)
        for part, paper, ours, integrated in (
            (
                "earthshine and zodiacal light",
                channel.sky.earthshine_and_zodiacal,
                estimate["earthshine and zodiacal light"],
                continuum,
            ),
            ("all", channel.sky.total, sum(estimate.values()), observation.sky_rate),
        ):
            rows.append(
                [
                    *(name, part, f"{paper:.2g}", f"{ours:.3g}", f"{integrated:.3g}"),
                    f"{integrated / paper:.3g}",
                ]
            )
    return rows


def continua() -> Rows:
    """Tabulated continua of the sky at their high levels."""
    rows = [["A", "earthshine high", "zodiacal light high", "status"]]
    for row in zip(WAVELENGTH, EARTHSHINE_HIGH, ZODIACAL_HIGH, strict=True):
        wavelength, *fluxes = row
        rows.append([f"{wavelength:g}", *(f"{flux:.2e}" for flux in fluxes), "handbook"])
    return rows


def levels() -> Rows:
    """Levels of the continuum."""
    rows = [["component", "level", "share of the high one", "status"]]
    for component, shares in (("earthshine", EARTHSHINE), ("zodiacal", ZODIACAL)):
        for level, share in shares.items():
            status = "derived" if level == "high orbit" else "handbook"
            rows.append([component, level, f"{share:.3g}", status])
    return rows


def lines() -> Rows:
    """Surface brightness of the geocoronal lines."""
    rows = [["line", "A", "high orbit", "low", "average", "high", "status"]]
    status = {
        "Ly-alpha 1216": "handbook; high orbit: assumed",
        "[O II] 2471": "handbook",
    }
    for one in LINES:
        fluxes = (one.high_orbit, one.low, one.average, one.high)
        of_line = status.get(one.name, "handbook; low: from memory")
        rows.append([one.name, f"{one.wavelength:g}", *(f"{flux:.3g}" for flux in fluxes), of_line])
    return rows


def filters() -> Rows:
    """List what each filter passes of a flat spectrum and of the sky."""
    rows = [["filter", "channel", "flat spectrum", "pivot (A)", "CIS sky (cps/px)", "status"]]
    for name in ISSIS.filter_names:
        status = "illustrative" if ISSIS.is_illustrative(name) else "paper"
        for channel in CHANNELS:
            if ISSIS.is_illustrative(name) and channel != _made_for(name):
                continue
            one = ni.Observation(channel, (name, "open"))
            rows.append(
                [
                    *(name, channel, f"{one.transmittance:.3g}", f"{one.pivot:.0f}"),
                    *(f"{one.sky_rate:.2g}", status),
                ]
            )
    return rows


def numbers_of(camera: str) -> Rows:
    """List every number of a camera with its unit, status and source, as its file has them."""
    rows = [["of", "number", "value", "unit", "status", "source"]]
    instrument = instrument_named(camera)
    every = {name: facts_of(one) for name, one in instrument.channels.items()}
    first = next(iter(every.values()))
    shared = {
        key: fact
        for key, fact in first.items()
        if len(every) > 1 and all(one.get(key) == fact for one in every.values())
    }
    rows += [_row("all channels", key, fact) for key, fact in shared.items()]
    for name, facts in every.items():
        rows += [_row(name, key, fact) for key, fact in facts.items() if key not in shared]
    for name, one in instrument.filters.items():
        rows += [_row(name, key, fact) for key, fact in facts_of(one).items()]
    return rows


def channel_fields() -> Rows:
    """List the numbers that a channel may have."""
    rows = [["number of a channel", "unit", "how many", "least", "most", "needed"]]
    for one, allowed in numbers(Channel):
        count = {1: "1", 2: "2", None: "a list"}[allowed.count]
        least = f"above {allowed.low:g}" if allowed.above else f"{allowed.low:g}"
        needed = "yes" if one.default is MISSING else ""
        if one.name in ("cps_per_flux", "effective_area"):
            needed = "one of the two"
        rows.append([f"`{one.name}`", allowed.unit, count, least, f"{allowed.high:g}", needed])
    return rows


def sources_of(camera: str) -> Rows:
    """List what the short names of a camera's sources stand for."""
    return [
        ["short", "source"],
        *([k, text] for k, text in instrument_named(camera).sources.items()),
    ]


def _row(of: str, key: str, fact: Fact) -> list[str]:
    values = fact.value if isinstance(fact.value, tuple) else (fact.value,)
    value = ", ".join(f"{one:.12g}" for one in values)
    return [of, f"`{key}`", value, fact.unit, fact.status, fact.source]


def _status(key: str) -> str:
    return "; ".join(dict.fromkeys(facts_of(one)[key].status for one in CHANNELS.values()))


TABLES: dict[str, Callable[[], Rows]] = {
    "channels": channels,
    "psf": psfs,
    "skies": skies,
    "paper": paper_sky,
    "levels": levels,
    "continua": continua,
    "lines": lines,
    "filters": filters,
    "issis_sources": partial(sources_of, "ISSIS"),
    "issis": partial(numbers_of, "ISSIS"),
    "fcu_sources": partial(sources_of, "FCU"),
    "fcu": partial(numbers_of, "FCU"),
    "sbc_sources": partial(sources_of, "ACS/SBC"),
    "fields": channel_fields,
    "sbc": partial(numbers_of, "ACS/SBC"),
}


def filled(page: str, tables: dict[str, Callable[[], Rows]] = TABLES) -> str:
    """Return the page with all its tables made anew."""

    def table(match: re.Match[str]) -> str:
        head, *body = tables[match[1]]()
        text = [head, ["---"] * len(head), *body]
        made = "\n".join(f"| {' | '.join(row)} |" for row in text)
        return f"<!-- table: {match[1]} -->\n{made}\n<!-- end -->"

    return re.sub(r"<!-- table: (\w+) -->\n.*?<!-- end -->", table, page, flags=re.DOTALL)


def _made_for(name: str) -> str:
    """Channel of an illustrative filter: that of its wavelength."""
    wavelength = float(name.strip("NLP"))
    return next(c for c, data in CHANNELS.items() if data.band[0] <= wavelength <= data.band[1])


def _magnitude(channel: str) -> float:
    from napari_issis.photometry import ab_magnitude

    observation = ni.Observation(channel)
    return float(ab_magnitude(1 / observation.cps_per_flux, observation.pivot))


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
