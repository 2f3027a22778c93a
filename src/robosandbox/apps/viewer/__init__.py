"""The browser viewer: a world drawn with viser, steered and inspected from any number of browsers on this machine.

Optional extra `viewer`. `app` puts the parts together; a `WorldSource` gives the world that is shown, here or in a
sim process; `scene` draws its model, layers draw plans and measurements, panels are what people click.
"""
