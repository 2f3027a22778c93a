"""Grasp candidates from an object's shape."""
