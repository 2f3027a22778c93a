"""The browser viewer: a world drawn with viser, steered and inspected from any number of browsers on this machine.

Optional extra `viewer`. `app` puts the parts together; a `Cell` is the world that is looked at, here or in a sim process; the
stage draws its model, layers draw what is thought and measured, panels are what people click.
"""
