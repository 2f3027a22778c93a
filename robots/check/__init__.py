"""A sidecar compared with its model, and what its author should change."""
