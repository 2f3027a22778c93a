"""Layers drawn over the world, a module each: plans, measurements, evidence."""
