"""Make the picture of `monitoring.md`: the light curves of HE0435-1223, planned and recovered.

Run it by ``python docs/make_light_curves.py``.
"""

import warnings
from pathlib import Path

from monitor_quasars import arguments, plan_of, system_of, title_of

import napari_issis as ni

SYSTEM = 2
PICTURE = Path(__file__).parent / "pictures" / "light_curves.png"


def main() -> None:
    """Simulate, fit and plot what `monitor_quasars` does for this system, without files."""
    warnings.simplefilter("ignore", ni.CountRateWarning)
    options = arguments([""])
    table = ni.fit_light_curves(plan_of(SYSTEM, options))
    names = [*system_of(SYSTEM).images, "lens galaxy"]
    title = title_of(SYSTEM, options)
    ni.plot_light_curves(table, PICTURE, names=names, title=title, time_label="time, days")


if __name__ == "__main__":
    main()
