"""The judge: tells from contacts and geometry of the simulated state whether a task has succeeded.

Nothing here is shared with what skills, plans or the agent conclude from: neither `robosandbox.world` nor `robosandbox.skills` is
imported, so that a mistake there is not made here as well. What both sides share are the words of the relations.
"""
