"""Planners that ask a language model; nothing here is imported before one of them is chosen."""
