"""What people say to a robot arm: from a sentence to a small intent tree, and from there to skill calls.

text -> tokens -> grammar (a chart of every reading) -> intents -> ground (descriptions to objects) -> build (a checked plan).
"""
