"""Do what panel, keys and desktop ask of the viewer: open files, take steps back, save, copy."""

import os
from collections.abc import Sequence
from typing import Any

from airlight.errors import AirlightError
from airlight.jobs.densities import of_density
from airlight.viewer import state as st
from airlight.viewer.command import as_text, command_line
from airlight.viewer.desktop import desktop_of
from airlight.viewer.saving import SENT
from airlight.viewer.undo import History

COMMAND = ("Control", "Meta")


class Errands:
    """Serves the requests of a viewer's state, at the beginning of a frame."""

    def __init__(self, viewer: Any) -> None:
        self.viewer, self.state = viewer, viewer.state
        self.desktop = desktop_of(viewer.canvas)
        self.desktop.wake = viewer.canvas.request_draw
        self.state.received, self.state.has_paths = self.desktop.names, self.desktop.has_paths
        viewer.panel.use_clipboard(self.desktop.copy, self.desktop.paste)
        self.history = History(self.state)
        self.delivery: Any = None  # what is being saved of a file that came as bytes

    def opened(self) -> None:
        """Begin anew with what is shown now."""
        state = self.state
        self.desktop.in_use = state.source
        state.sources = tuple(source for source in state.sources if not self.desktop.lacks(source))
        self.history.restart(state)

    def key(self, key: str, modifiers: Sequence[str]) -> bool:
        """Take a key that is pressed with Ctrl. False where it is not one of ours."""
        if not set(COMMAND) & set(modifiers):
            return False
        again = key == "y" or (key == "z" and "Shift" in modifiers)
        request = "redo" if again else {"s": "save" if self.state.is_image else "", "o": "choose", "z": "undo", "c": "copy"}.get(key)
        if request:
            self.state.requests.append((request, ""))
        return request is not None

    def serve(self) -> None:
        state = self.state
        while self.desktop.arrived:
            paths = self.desktop.arrived.popleft()
            state.requests.append(("open" if len(paths) == 1 else "open first", paths[0]))
        while self.desktop.cookies:
            number, path = self.desktop.cookies.popleft()
            state.requests.append(("cookie", f"{number}:{path}"))
        if self.delivery is not None and self.delivery.outcome is not None:
            saving, self.delivery = self.delivery, None
            if not saving.outcome[1]:
                self.desktop.deliver(saving.path)
        requests, state.requests = state.requests, []
        for request, argument in requests:
            try:
                self._serve(request, argument)
            except AirlightError as error:
                path = argument.partition(":")[2] if request == "cookie" else argument
                st.tell(state, self._named(str(error), path), error=True)

    def _serve(self, request: str, argument: str) -> None:
        state = self.state
        if request in ("open", "open first"):
            if not state.is_image and of_density(argument):
                self.viewer.add(argument)
                st.tell(state, f"{os.path.basename(argument)} lies in the air now")
                return
            self.viewer.open(argument)
            if request == "open first":
                st.tell(state, f"{os.path.basename(argument)} is shown, the first of the files")
        elif request in ("choose", "choose cookie"):
            folder = os.path.dirname(os.path.abspath(state.source))
            folder = folder if os.path.isdir(folder) else os.getcwd()
            lacking = self.desktop.choose(folder, int(argument)) if request == "choose cookie" else self.desktop.choose(folder)
            st.tell(state, lacking)
            state.path_wanted = bool(lacking) and request == "choose"
        elif request == "cookie":
            self._cookie(argument)
        elif request == "undo":
            self.history.undo(state)
        elif request == "redo":
            self.history.redo(state)
        elif request == "screenshot":
            path = self.viewer.screenshot()
            if state.source in state.received:
                self.desktop.deliver(path)
            st.tell(state, f"{path} saved{SENT if state.source in state.received else ''}")
        elif request == "save":
            self.viewer.save()
            if self.viewer.saving.is_received:
                self.delivery = self.viewer.saving
        elif request == "copy":
            state.command = as_text(command_line(state))  # which from now on is shown
            state.command_wanted = True
            name = state.received.get(state.source)
            yours = "" if name is None else f"; it is for the folder where you have {name}"
            st.tell(state, f"the command {self.desktop.copy(state.command)}{yours}")

    def _cookie(self, argument: str) -> None:
        """Give a light the picture of a file to send out: `number:path`."""
        state, viewer = self.state, self.viewer
        number, _, path = argument.partition(":")
        if state.is_image or int(number) >= len(state.lights) or not state.lights[int(number)].takes_cookie:
            return  # another scene is shown by now
        viewer.scene.shapes.read(path)
        state.lights[int(number)].gobo = path
        viewer.following.drop()
        viewer.following.frames.forget()
        st.tell(state, f"light {int(number) + 1} sends out {os.path.basename(state.received.get(path, path))}")

    def _named(self, text: str, path: str) -> str:
        """Write an error about a file that came as bytes with the name that it came with."""
        name = self.desktop.names.get(path)
        if name is None:
            return text
        text = text.replace(path, name)
        if name.lower().endswith((".gltf", ".obj")):
            text += f"; the files that {name} names do not come with it: send a .glb"
        return text
