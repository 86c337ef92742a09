"""Images of a point source behind a model lens, by lenstronomy."""

from __future__ import annotations

from typing import Any

import numpy as np
from astropy.table import QTable, vstack

from .observation import Observation
from .sky_offsets import anchor, offsets_to_frame
from .sources import source


def lens_images(
    observation: Observation | None = None,
    *,
    einstein_radius: float,
    ellipticity: float = 0.0,
    pa: float = 0.0,
    shear: float = 0.0,
    shear_pa: float = 0.0,
    quasar: tuple[float, float] = (0.05, 0.02),
    flux: float,
    centre: Any = None,
) -> QTable:
    """Make the images of a quasar behind a singular isothermal ellipsoid with external shear.

    Parameters
    ----------
    observation : Observation, optional
        The frame: its roll turns the system.
    einstein_radius : float
        Arcsec. With q = 1 - ellipticity and coordinates along the major and minor axes, the
        convergence is ``einstein_radius / (2 sqrt(q x^2 + y^2 / q))``.
    ellipticity : float
        1 - b/a of the convergence, in [0, 1).
    pa : float
        Position angle of its major axis, degrees from north through east.
    shear : float
        External shear, in [0, 1).
    shear_pa : float
        Position angle, from north through east, of the direction in which the shear alone
        stretches an image; the mass that causes it lies at right angles to it.
    quasar : (float, float)
        Where the quasar would be seen without the lens: arcsec east and north of the lens.
    flux : float
        That of the quasar without the lens, erg s-1 cm-2 A-1.
    centre : (float, float) or SkyCoord, optional
        Where the lens stands, as for `lensed_quasar`.

    Returns
    -------
    astropy.table.QTable
        A source table of points, the earliest image first, with a further column
        ``magnification``, negative for images of negative parity. The lens galaxy itself is
        not in it.

    Raises
    ------
    ImportError
        If lenstronomy is not installed: ``pip install "napari-issis[lens]"``.
    ValueError
        If a value is out of range; the message names it.

    Notes
    -----
    Kormann, Schneider & Bartelmann (1994, A&A 284, 285); solved by lenstronomy (Birrer & Amara
    2018, Phys. Dark Univ. 22, 189). A circular lens without shear has a ring for an image where
    the quasar is exactly behind it, which is refused.
    """
    observation = Observation() if observation is None else observation
    lens = IsothermalLens(einstein_radius, ellipticity, pa, shear, shear_pa)
    east, north = source_offset(quasar)
    if ellipticity == shear == east == north == 0:
        raise ValueError(
            "the quasar lies exactly behind a circular lens: its image is a ring, not points; "
            "move the quasar, or give the lens an ellipticity or shear."
        )
    place = anchor(centre, observation)
    x, y, magnification = _solve(lens, (-east, north))
    if not x.size:
        raise ValueError("lenstronomy finds no image; move the quasar, or change the lens.")
    px, py = offsets_to_frame(-x, y, place, observation.pixel_scale)
    rows = [source("point", *row) for row in zip(px, py, flux * np.abs(magnification), strict=True)]
    table = vstack(rows)
    table["magnification"] = magnification
    return table


def source_offset(offset: tuple[float, float], name: str = "quasar") -> tuple[float, float]:
    """Return an offset (east, north) in arcsec, or raise a ValueError that names it."""
    try:
        east, north = (float(value) for value in offset)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {offset!r}; give (east, north) in arcsec.") from None
    if not (np.isfinite(east) and np.isfinite(north)):
        raise ValueError(f"{name} is {offset!r}; it must be finite.")
    return east, north


class IsothermalLens:
    """A singular isothermal ellipsoid with external shear, as lenstronomy has it.

    The parameters are those of `lens_images`; a ValueError names one that is out of range.
    Coordinates are x to the west and y to the north of the lens, arcsec.
    """

    def __init__(
        self, einstein_radius: float, ellipticity: float, pa: float, shear: float, shear_pa: float
    ) -> None:
        numbers = {
            "einstein_radius": (einstein_radius, 0.0, np.inf),
            "ellipticity": (ellipticity, -1e-300, 1.0),
            "shear": (shear, -1e-300, 1.0),
        }
        for name, (value, low, high) in numbers.items():
            if not low < float(value) < high:
                raise ValueError(
                    f"{name} is {value}; it must be above {max(low, 0):g}, below {high}."
                )
        for name, value in (("pa", pa), ("shear_pa", shear_pa)):
            if not np.isfinite(value):
                raise ValueError(f"{name} is {value}; it must be a finite angle in degrees.")
        try:
            from lenstronomy.LensModel.lens_model import LensModel
            from lenstronomy.Util.param_util import phi_q2_ellipticity, shear_polar2cartesian
        except ImportError:
            raise ImportError(
                'images of a model lens need lenstronomy: pip install "napari-issis[lens]"'
            ) from None
        # Their angles count from +x, counter-clockwise, as position angles do from north.
        e1, e2 = phi_q2_ellipticity(np.radians(pa + 90), 1 - ellipticity)
        gamma1, gamma2 = shear_polar2cartesian(np.radians(shear_pa + 90), shear)
        self.radius, self.shear = float(einstein_radius), float(shear)
        self.model = LensModel(["SIE", "SHEAR"])
        self.values = [
            {"theta_E": self.radius, "e1": e1, "e2": e2, "center_x": 0.0, "center_y": 0.0},
            {"gamma1": gamma1, "gamma2": gamma2, "ra_0": 0.0, "dec_0": 0.0},
        ]


def _solve(lens: IsothermalLens, quasar: tuple[float, float]) -> tuple[Any, Any, Any]:
    """Images (x to the west, y to the north, arcsec) and their signed magnifications."""
    from lenstronomy.LensModel.Solver.lens_equation_solver import LensEquationSolver

    model, values = lens.model, lens.values
    solver = LensEquationSolver(model)
    # The closed solver finds nothing where lens or place is symmetric; the search always does.
    x, y = solver.image_position_from_source(
        *quasar,
        values,
        solver="lenstronomy",
        min_distance=lens.radius / 40,
        search_window=(6 * lens.radius + 2 * float(np.hypot(*quasar))) / (1 - lens.shear),
        precision_limit=1e-12,
        num_iter_max=200,
        magnification_limit=1e-3,
    )
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.size:
        order = np.argsort(model.fermat_potential(x, y, values, *quasar), kind="stable")
        x, y = x[order], y[order]
    return x, y, np.asarray(model.magnification(x, y, values), dtype=np.float64)
