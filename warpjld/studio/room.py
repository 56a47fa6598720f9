"""The studio's server: connects browser windows, panels and the worker thread to one state."""

from __future__ import annotations

import secrets
import sys
import traceback
from collections.abc import Callable, Hashable
from typing import Any

from warpjld.errors import WarpjldError
from warpjld.page.guard import RequestGuard
from warpjld.page.server import guarded_server, stop
from warpjld.studio.background import JobProgress
from warpjld.studio.panels.curves import CurvesPanel
from warpjld.studio.panels.drag import DragPanel
from warpjld.studio.panels.files import FilesPanel
from warpjld.studio.panels.ghosts import GhostsPanel
from warpjld.studio.panels.menus import MenusPanel
from warpjld.studio.panels.messages import MessagesPanel
from warpjld.studio.panels.pose_tools import PoseToolsPanel
from warpjld.studio.panels.progress import ProgressPanel
from warpjld.studio.panels.script import ScriptPanel
from warpjld.studio.panels.selected import SelectedPanel
from warpjld.studio.panels.skin import SkinPanel
from warpjld.studio.panels.sliders import SlidersPanel
from warpjld.studio.panels.stage import StagePanel
from warpjld.studio.panels.things import ThingsPanel
from warpjld.studio.panels.timeline import TimelinePanel
from warpjld.studio.panels.views import ViewsPanel
from warpjld.studio.panels.work import WorkPanel
from warpjld.studio.performance import Performance
from warpjld.studio.state import StudioState
from warpjld.studio.worker import Worker

__all__ = ["Room"]

LOCAL = "127.0.0.1"
_WIDTH = 384  # of the panels [CSS pixels]: labels, a slider with its limits, and its number side by side


class Room:
    """A studio that browser windows connect to; all of them show and edit the same state.

    Args:
        state: State shown and edited by the panels.
        host: Address to listen on. Any but this machine's own asks windows for a token.
        port: Port to listen on, or the next that is free; 0 for any.

    Attributes:
        address: What to open in a browser.
    """

    def __init__(self, state: StudioState, *, host: str = LOCAL, port: int = 8080) -> None:
        self.state = state
        local = host in (LOCAL, "localhost", "::1")
        token = None if local else secrets.token_urlsafe(24)
        self.server = guarded_server(RequestGuard(host, token), port, "the studio")
        self.worker = Worker(self.refresh, self._failed)
        self.panels: list[Any] = []
        self._kept = state.document.text
        self._furnish()
        state.begin(self._beside)
        shown = LOCAL if host in ("0.0.0.0", "::") else host
        shown = f"[{shown}]" if ":" in shown else shown
        self.address = f"http://{shown}:{self.server.get_port()}/" + (f"?token={token}" if token else "")
        self.post(lambda: None)

    def post(self, job: Callable[[], object], key: Hashable = None) -> None:
        """Queue a job that may change the state; panels are refreshed afterwards."""
        self.worker.post(job, key)

    def by_hand(self, event: Any, job: Callable[[], object], key: Hashable = None) -> None:
        """``post`` a job for a control's event, unless it was caused by a panel's refresh."""
        if event.client_id is not None:
            self.post(job, key)

    def refresh(self) -> None:
        """Refresh all panels, and save the script's recovery file if it has changed."""
        for panel in self.panels:
            panel.refresh()
        if self.state.document.text != self._kept:
            self._kept = self.state.document.text
            self._autosave()

    def stop(self) -> None:
        """Save unsaved changes to the recovery file, and stop the server."""
        self.worker.stop()
        self._autosave()
        stop(self.server)

    def _furnish(self) -> None:
        gui = self.server.gui
        gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        gui.set_panel_label("warpjld studio")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_WIDTH)  # else a page that loads slowly docks it before it knows the theme's width
        self.progress, messages = ProgressPanel(self), MessagesPanel(self)  # above all tabs, so always visible
        tabs = gui.add_tab_group()
        with tabs.add_tab("Pose"):
            pose = PoseToolsPanel(self)
            with gui.add_folder("Stage"):
                self.stage, ghosts, views = StagePanel(self), GhostsPanel(self), ViewsPanel(self)
            self.drag, self.things, self.skin = DragPanel(self), ThingsPanel(self), SkinPanel(self)
            self.selected, sliders = SelectedPanel(self), SlidersPanel(self)
        with tabs.add_tab("Script"):
            script = ScriptPanel(self)
        with tabs.add_tab("Work"):
            files, work = FilesPanel(self), WorkPanel(self)
        with tabs.add_tab("Menus"):
            menus = MenusPanel(self)
        below = gui.add_panel()
        with below.add_tab("Time"):
            timeline = TimelinePanel(self)
        with below.add_tab("Keys"):
            curves = CurvesPanel(self)
        below.dock_below(gui.main_panel)
        posing = [self.stage, ghosts, views, pose, self.drag, self.things, self.skin, self.selected, sliders]
        self.panels = [*posing, script, files, work, menus, timeline, curves, self.progress, messages]

    def _beside(self, text: str, then: Callable[[], object]) -> None:
        """Run a text with grasp searches in the background, and then call ``then``."""
        state = self.state
        performance, path = state.performance.beside(), state.document.path

        def work(progress: JobProgress) -> Performance:
            performance.run(text, path, progress)
            return performance

        def told(ran: Performance) -> None:
            state.performance.learn(ran)
            then()

        def failed(error: BaseException) -> None:
            if isinstance(error, WarpjldError):
                state.fail(error, text)

        self.progress.start("the search", work, told, failed)

    def _failed(self, error: BaseException) -> None:
        """Show the exception of a job; the studio keeps running."""
        if isinstance(error, WarpjldError):
            self.state.error = error
        else:
            traceback.print_exception(error, file=sys.stderr)
            self.state.error = WarpjldError(f"unexpected {type(error).__name__}: {error} (a fault of warpjld)")
        self.panels[-1].refresh()

    def _autosave(self) -> None:
        try:
            self.state.document.autosave()
        except OSError as error:
            self.state.messages.append(f"cannot keep the script beside its file: {error.strerror}")
