"""Keep napari from reading and writing the developer's own settings."""

import os

os.environ["NAPARI_CONFIG"] = ""
