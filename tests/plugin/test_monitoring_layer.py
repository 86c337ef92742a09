"""A sequence of exposures with napari's slider."""

from __future__ import annotations

import numpy as np
import pytest
from small_scene import SMALL, few_sources

from napari_issis import monitor

pytest.importorskip("dask")
pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def test_the_slider_goes_through_the_epochs(viewer):
    """Catches a layer that holds one frame, or all of them computed."""
    plan = monitor(few_sources(), SMALL, [0.0, 1.0, 2.0], light_curves={0: lambda t: 1 + t})
    layer = plan.show(viewer)
    assert viewer.dims.range[0][:2] == (0.0, 2.0)
    assert viewer.dims.axis_labels[0] == "epoch"
    assert not isinstance(layer.data, np.ndarray)
    for epoch in (2, 0):
        viewer.dims.set_point(0, epoch)
        shown = np.asarray(layer._data_view)
        assert np.array_equal(shown, plan.simulate(epoch).counts)
