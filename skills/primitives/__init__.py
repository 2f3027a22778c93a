"""Primitives that verbs are made of: hands, grasps, strokes, places, drawers, sensing."""
