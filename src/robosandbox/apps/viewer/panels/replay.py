"""A recorded episode, state by state: a slider over its time, and Play."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import viser

from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.news import Began, News
from robosandbox.apps.viewer.replay import RecordedFrames
from robosandbox.apps.viewer.source import Frame
from robosandbox.apps.viewer.stream import FRAME_HZ
from robosandbox.apps.viewer.theme import assign

_PLAY, _PAUSE = "Play", "Pause"


class ReplayPanel:
    """Shows a recorded episode; any other order pauses it.

    Args:
        server: Where.
        playback: What was recorded.
        show: Draws a frame.
    """

    def __init__(self, server: viser.ViserServer, playback: RecordedFrames, show: Callable[[Frame], None]) -> None:
        self._playback = playback
        self._show = show
        self._row = -1
        self._playing = threading.Event()
        self._player: threading.Thread | None = None
        gui = server.gui
        end = float(playback.seconds[-1])
        self._slider = gui.add_slider("Time, s", min=0.0, max=max(round(end, 2), 0.01), step=0.01, initial_value=0.0)
        self._button = gui.add_button(_PLAY, icon=viser.Icon.PLAYER_PLAY)
        self._words = gui.add_html("")
        self._slider.on_update(lambda _: self._go(playback.row(self._slider.value)))
        self._button.on_click(lambda _: self._clicked())

    def hear(self, news: News) -> None:
        """Pause when something else is begun."""
        if isinstance(news, Began):
            self.stop()

    def rewind(self) -> None:
        """Show the first state."""
        self._go(0)

    def stop(self) -> None:
        """Pause."""
        self._playing.clear()

    def _clicked(self) -> None:
        if self._playing.is_set():
            self.stop()
        elif self._player is None or not self._player.is_alive():
            self._playing.set()
            self._player = threading.Thread(target=self._play, name="replay", daemon=True)
            self._player.start()

    def _play(self) -> None:
        playback = self._playback
        at_end = self._row >= len(playback.seconds) - 1
        begin = 0.0 if at_end else float(playback.seconds[max(self._row, 0)])
        started = time.monotonic()
        self._button.label = _PAUSE
        while self._playing.is_set():
            row = playback.row(begin + time.monotonic() - started)
            self._go(row)
            assign(self._slider, round(float(playback.seconds[row]), 2))
            if row == len(playback.seconds) - 1:
                self._playing.clear()
            time.sleep(1.0 / FRAME_HZ)
        self._button.label = _PLAY

    def _go(self, row: int) -> None:
        if row == self._row:
            return
        self._row = row
        playback = self._playback
        self._show(playback.frame(row))
        said = [("episode", playback.name), ("at", f"{playback.seconds[row]:.2f} of {playback.seconds[-1]:.2f} s")]
        self._words.content = html.block(html.rows([*said, ("doing", playback.said(row))]))
