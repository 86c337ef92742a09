"""The napari side: layers, widgets and the live scene. It holds no physics."""
