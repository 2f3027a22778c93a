"""A function carried out in a forked child."""

import multiprocessing
from collections.abc import Callable

# Seconds that a child may take which only finds out that it was forked; chosen so that a hang is told from it.
_SECONDS = 10.0


def told_in_forked_child(work: Callable[[], object]) -> str:
    """Return the error in which a function ends in a forked child; "" where it ends in none, "hangs" where it does not end."""
    context = multiprocessing.get_context("fork")
    hear, tell = context.Pipe(duplex=False)

    def run() -> None:
        try:
            work()
            tell.send("")
        except Exception as error:
            tell.send(f"{type(error).__name__}: {error}")

    child = context.Process(target=run, daemon=True)
    child.start()
    said = hear.recv() if hear.poll(_SECONDS) else "hangs"
    child.kill()
    child.join()
    return str(said)
