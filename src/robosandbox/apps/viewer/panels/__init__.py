"""Panels with what people click and read beside the scene, a module each."""
