"""Tasks, success criteria, randomization, and the bench."""
