"""Sentences to a robot arm: parsed into a small intent tree, and from there into skill calls.

text -> tokens -> grammar (a chart of every reading) -> intents -> ground (descriptions to objects) -> build (a checked plan).
"""
