"""The key in a layer's metadata by which our layers are recognised, whatever their names.

Its value is a dict with the ``role`` of the layer (``points``, ``ellipses`` or ``counts``) and,
for counts, the ``exposure`` that the layer shows.
"""

MARKER = "napari_issis"
