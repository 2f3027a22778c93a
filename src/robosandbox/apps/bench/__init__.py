"""The bench: tasks over seeds, their rows and their sum."""
