"""Run the program as ``python -m napari_issis``."""

import sys

from .cli import main

sys.exit(main())
