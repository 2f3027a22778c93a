"""Perception: the objects of a scene and where they are."""
