"""Faces of a workcell: command line, viewer, MCP, Gymnasium, datasets, the bench, conformance checks."""
