"""The page of the explorer, by NiceGUI."""

from __future__ import annotations

import asyncio
import base64
import time
import webbrowser
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import cv2
import numpy as np
from nicegui import app, events, run, ui

from .._check import error
from ..draw import drawExplanation
from ..draw.palette import KINDS
from ..options import DETECTION
from .session import SLIDERS, SWITCHES, VIEWS, Session

_FIRST = ("depth", "edges", "distance", "regions")
_LARGEST_UPLOAD = 200_000_000  # bytes
_ZOOM = """
<style>
  .view { overflow: hidden; position: relative; background: #202020; }
  .view img { transform-origin: 0 0; transform: translate(var(--x, 0), var(--y, 0)) scale(var(--zoom, 1));
              image-rendering: pixelated; }
</style>
<script>
  const at = {zoom: 1, x: 0, y: 0};
  const show = () => {
    const root = document.documentElement.style;
    root.setProperty('--zoom', at.zoom);
    root.setProperty('--x', at.x + 'px');
    root.setProperty('--y', at.y + 'px');
  };
  document.addEventListener('wheel', event => {
    const view = event.target.closest('.view');
    if (!view) return;
    event.preventDefault();
    const box = view.getBoundingClientRect(), factor = event.deltaY < 0 ? 1.25 : 0.8;
    const zoom = Math.min(32, Math.max(1, at.zoom * factor)), by = zoom / at.zoom;
    const px = event.clientX - box.left, py = event.clientY - box.top;
    at.x = Math.min(0, Math.max(box.width * (1 - zoom), px - by * (px - at.x)));
    at.y = Math.min(0, Math.max(box.height * (1 - zoom), py - by * (py - at.y)));
    at.zoom = zoom;
    show();
  }, {passive: false});
  document.addEventListener('dblclick', event => {
    if (event.target.closest('.view')) Object.assign(at, {zoom: 1, x: 0, y: 0}), show();
  });
</script>
"""


def serve(session: Session, host: str, port: int, *, browser: bool) -> None:
    """Serve the page until interrupted. Everyone who opens it sees an image and parameters of their own."""

    @ui.page("/")
    def index() -> None:
        _Page(Session(session.image, session.title))

    address = f"http://{host}:{port}/"
    print(f"The explorer is at {address}; end it with Ctrl-C.", flush=True)
    if browser:
        app.on_startup(lambda: webbrowser.open(address))
    ui.run(
        host=host, port=port, title="rangeedge", show=False, reload=False, show_welcome_message=False, favicon="📐",
        uvicorn_logging_level="warning",
    )  # fmt: skip


class _Page:
    def __init__(self, session: Session) -> None:
        self.session, self.pending, self.busy = session, False, False
        self.shown: np.ndarray | None = None
        ui.add_head_html(_ZOOM)
        with ui.left_drawer(fixed=True).props("width=330").classes("bg-grey-1"):
            self._controls()
        with ui.row().classes("items-center w-full"):
            self.title = ui.label().classes("text-h6").props("id=title")
            self.status = ui.label().classes("text-grey-8").props("id=status")
            self.problem = ui.label().classes("text-negative text-bold").props("id=problem")
        with ui.row().classes("items-center"):
            for _, colour, text in reversed(KINDS):
                blue, green, red = colour
                ui.html(f'<span style="background:rgb({red},{green},{blue});padding:0 8px">&nbsp;</span> {text}')
            ui.label("Wheel: zoom all. Double click: whole image. Click: why?").classes("text-grey-8")
        self.choice = ui.select(list(VIEWS), value=list(_FIRST), multiple=True, label="views", on_change=self._lay_out)
        self.choice.props("use-chips dense id=views").classes("w-full")
        self.grid = ui.element("div").classes("w-full grid grid-cols-2 gap-2")
        self.reason = ui.column().classes("w-full").props("id=reason")
        self._lay_out()

    def _controls(self) -> None:
        session = self.session
        ui.label("Image").classes("text-bold")
        ui.upload(
            label="drop a range image here", auto_upload=True, max_file_size=_LARGEST_UPLOAD, on_upload=self._uploaded,
            on_rejected=lambda: self._complain("the file is larger than 200 MB"),
        ).props("flat bordered").classes("w-full")  # fmt: skip
        K = session.geometry.get("K")
        camera = "" if K is None else ", ".join(f"{v:g}" for v in np.asarray(K).ravel()[[0, 4, 2, 5]])
        self.camera = ui.input("camera: fx, fy, cx, cy", value=camera).props("dense").classes("w-full")
        size = session.geometry.get("pixelSize")
        self.size = ui.input("or pixel size of a grid", value="" if size is None else str(size)).props("dense")
        self.height = ui.checkbox("larger values are nearer", value=bool(session.geometry.get("heightMap")))
        ui.button("use this geometry", on_click=self._placed).props("dense flat")
        ui.separator()
        self.sliders: dict[str, Any] = {}
        for name, (low, high, step) in SLIDERS.items():
            with ui.row().classes("w-full no-wrap items-center gap-1").tooltip(DETECTION[name].text):
                ui.label(name).classes("w-36 text-caption")
                slider = ui.slider(min=low, max=high, step=step, value=session.value(name)).props(f"id={name}")
                slider.on("update:model-value", self._slid(name, slider), throttle=0.1, leading_events=False)
                ui.label().bind_text_from(slider, "value", lambda v: f"{v:g}").classes("w-10 text-caption")
                self.sliders[name] = slider
        for name in SWITCHES:
            switch = ui.switch(name, value=bool(session.value(name)), on_change=self._switched(name))
            switch.props("dense").tooltip(DETECTION[name].text)
            self.sliders[name] = switch
        with ui.row():
            ui.button("defaults", on_click=self._defaults).props("dense flat")
            ui.button("detector.yml", on_click=self._download).props("dense flat")
        self.program = ui.code("", language="python").classes("w-full text-caption").props("id=program")

    def _lay_out(self) -> None:
        """One view for each of the chosen pictures."""
        self.grid.clear()
        self.views = {}
        with self.grid:
            for name in [view for view in VIEWS if view in self.choice.value]:
                with ui.column().classes("gap-0"):
                    ui.label(name).classes("text-caption")
                    view = ui.interactive_image(on_mouse=self._asked, events=["click"], cross=False)
                    self.views[name] = view.classes("w-full view").props(f'id="view-{name.replace(" ", "-")}"')
        self._ask()

    def _ask(self) -> None:
        """Draw everything anew, once what is drawn now is done."""
        self.pending = True
        if not self.busy:
            self.busy = True
            ui.timer(0, self._draw, once=True)

    async def _draw(self) -> None:
        try:
            while self.pending:
                self.pending = False
                start = time.perf_counter()
                names = list(self.views)
                pictures = await run.io_bound(self._pictures, names)
                for name, picture in zip(names, pictures or (), strict=False):
                    self.views[name].set_source(picture)
                took = 1000 * (time.perf_counter() - start)
                height, width = self.session.relief.shape[:2]
                self.title.text = self.session.title
                edges = self.session.edge_count()
                self.status.text = f"{width} x {height}, {edges} edge pixels, {len(names)} views in {took:.0f} ms"
                self.program.content = self.session.python()
                await asyncio.sleep(0)
        except error as problem:
            self._complain(problem.err)
        finally:
            self.busy = False

    def _pictures(self, names: list[str]) -> list[str]:
        """The views as addresses; that of the image itself, which no parameter changes, is kept."""
        if self.shown is not self.session.relief:
            self.shown, self.relief = self.session.relief, _encoded(self.session.relief)
        pictures = {name: self.session.picture(name) for name in names if name != "depth"}
        with ThreadPoolExecutor() as pool:
            encoded = dict(zip(pictures, pool.map(_encoded, pictures.values()), strict=True))
        return [encoded.get(name, self.relief) for name in names]

    def _complain(self, text: str) -> None:
        self.problem.text = text
        ui.notify(text, type="negative", multi_line=True)

    def _slid(self, name: str, slider: Any) -> Any:
        return lambda _: self._changed(name, type(DETECTION[name].default or 0.0)(slider.value))

    def _switched(self, name: str) -> Any:
        return lambda event: self._changed(name, bool(event.value))

    def _changed(self, name: str, value: Any) -> None:
        try:
            self.session.change(name, value)
        except error as problem:
            self._complain(problem.err)
            return
        self.problem.text = ""
        self._ask()

    def _defaults(self) -> None:
        for name, control in self.sliders.items():
            self.session.change(name, DETECTION[name].default)
            control.value = self.session.value(name)
        self._ask()

    def _placed(self) -> None:
        try:
            self.session.place(self.camera.value, self.size.value, height_map=self.height.value)
        except error as problem:
            self._complain(problem.err)
            return
        self.problem.text = ""
        self._ask()

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        content = await event.file.read()
        event.sender.reset()
        try:
            self.session.upload(event.file.name, content)
        except error as problem:
            self._complain(f"{event.file.name}: {problem.err}")
            return
        self.problem.text = ""
        self._ask()

    async def _asked(self, event: events.MouseEventArguments) -> None:
        height, width = self.session.relief.shape[:2]
        x, y = (int(np.clip(np.floor(v), 0, n - 1)) for v, n in ((event.image_x, width), (event.image_y, height)))
        why = await run.io_bound(self.session.explanation, x, y)
        self.reason.clear()
        with self.reason:
            ui.image(_encoded(drawExplanation(why))).classes("w-full max-w-5xl").props("id=why")
            ui.label(f"Pixel ({x}, {y}), {'an edge' if why.edge else 'no edge'}: {why.reason}").props("id=words")
            if why.change:
                with ui.row().classes("items-center"):
                    text = ", ".join(f"{name}={value!r}" for name, value in why.change.items())
                    ui.button(f"try {text}", on_click=lambda: self._try(why.change)).props("dense id=try")

    def _try(self, change: Any) -> None:
        for name, value in change.items():
            self.session.change(name, value)
            if name in self.sliders:
                self.sliders[name].value = value
        self._ask()

    def _download(self) -> None:
        ui.download.content(self.session.settings(), "detector.yml")


def _encoded(picture: np.ndarray) -> str:
    """A picture as the address of its own content."""
    content = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    return "data:image/png;base64," + base64.b64encode(content).decode()
