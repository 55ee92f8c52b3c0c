"""The page of the explorer, by NiceGUI."""

from __future__ import annotations

import asyncio
import base64
import time
import webbrowser
from concurrent.futures import CancelledError
from typing import Any

import cv2
import numpy as np
from nicegui import app, background_tasks, events, run, ui

from .._check import error
from ..cancellation import Cancellation
from ..draw import drawExplanation
from ..draw.palette import KINDS
from ..options import DETECTION, SELECTION
from .guard import LARGEST_UPLOAD, Guard, expect_free
from .session import SHARING, SLIDERS, SWITCHES, VIEWS, Results, Session

_FIRST = ("depth", "edges", "distance", "regions")
_CAPTIONS = {
    "depth": "near is bright, hatched has no data",
    "edges": "one pixel wide, in the colours above",
    "kinds": "every candidate, before thresholds",
    "crease": "angle between the surfaces, white from 64°",
    "thin map": "what detectEdges returns",
    "distance": "to the nearest edge, black is 0",
    "salience": "distance, strong edges reaching farther",
    "seeds": "where surfaces begin to grow",
    "regions": "surfaces, a colour each",
    "chains": "edges linked into lines, a colour each",
}
_GEOMETRY = {
    "K": "camera: fx, fy, cx, cy [pixels]",
    "pixelSize": "or pixel size",
    "depthFactor": "depth factor",
    "invalid": "no data",
}
_GROUPS = {"Which edges count": SELECTION, "How scan lines are cut": DETECTION.keys() - SELECTION.keys()}
_ENCODING = (cv2.IMWRITE_JPEG_QUALITY, 95, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444)
_HEAD = """
<style>
  body { background: #f4f5f7; }
  .q-drawer .text-caption, .q-drawer .q-switch { line-height: 1.2; }
  .q-uploader__list:empty { display: none; }
  .views { display: grid; gap: 10px; grid-template-columns: repeat(var(--columns), minmax(0,
           min(100%, calc(var(--aspect) * ((100vh - 132px) / var(--rows) - 40px))))); }
  .view { overflow: hidden; position: relative; background: #202020; border-radius: 4px; }
  .view img { transform-origin: 0 0; transform: translate(var(--x, 0), var(--y, 0)) scale(var(--zoom, 1));
              image-rendering: var(--rendering, auto); }
</style>
<script>
  const at = {zoom: 1, x: 0, y: 0};
  const show = () => {
    const root = document.documentElement.style;
    root.setProperty('--zoom', at.zoom);
    root.setProperty('--x', at.x + 'px');
    root.setProperty('--y', at.y + 'px');
    root.setProperty('--rendering', at.zoom > 1 ? 'pixelated' : 'auto');
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
    expect_free(host, port)

    @ui.page("/", title=f"{session.title} - rangeedge")
    def index() -> None:
        _Page(session.copy())

    app.add_middleware(Guard, host=host)
    address = f"http://{f'[{host}]' if ':' in host else host}:{port}/"
    print(f"The explorer is at {address}; end it with Ctrl-C.", flush=True)
    if browser:
        app.on_startup(lambda: webbrowser.open(address))
    ui.run(
        host=host, port=port, title="rangeedge", show=False, reload=False, show_welcome_message=False, favicon="📐",
        uvicorn_logging_level="warning",
    )  # fmt: skip


class _Page:
    def __init__(self, session: Session) -> None:
        self.session, self.pending, self.busy, self.cancellation = session, False, False, Cancellation()
        ui.add_head_html(_HEAD)
        with ui.left_drawer(fixed=True, bordered=True).props("width=320").classes("bg-white q-pa-md gap-2"):
            self._controls()
        with ui.row().classes("items-baseline w-full gap-x-4 gap-y-0"):
            self.title = ui.label().classes("text-h6").props("id=title")
            self.status = ui.label().classes("text-grey-8").props("id=status")
            self.problem = ui.label().classes("text-negative text-bold").props("id=problem")
            self.note = ui.label().classes("text-warning text-bold").props("id=note")
        with ui.row().classes("items-center w-full gap-x-4 gap-y-0"):
            for _, colour, text in reversed(KINDS):
                blue, green, red = colour
                ui.html(
                    f'<span style="background:rgb({red},{green},{blue});padding:0 9px;border-radius:2px">&nbsp;</span>'
                    f" {text}",
                    sanitize=False,
                )
            ui.space()
            ui.label("click: why? · wheel: zoom · double click: whole image").classes("text-grey-7")
            with ui.button("views", icon="grid_view").props("dense flat no-caps id=views"), ui.menu():
                self.choice = {name: self._view_switch(name) for name in VIEWS}
        self.grid = ui.element("div").classes("w-full views")
        with ui.dialog() as self.dialog, ui.card().classes("max-w-none").style("width: 1300px"):
            self.reason = ui.column().classes("w-full")
        self._lay_out()

    def _view_switch(self, name: str) -> ui.checkbox:
        box = ui.checkbox(f"{name}: {_CAPTIONS[name]}", value=name in _FIRST, on_change=lambda: self._lay_out())
        return box.props("dense").classes("q-px-md q-py-xs").style("width: 400px")

    def _controls(self) -> None:
        session = self.session
        _heading("Image")
        ui.upload(
            label="drop a range image here", auto_upload=True, max_file_size=LARGEST_UPLOAD, on_upload=self._uploaded,
            on_rejected=lambda: self._complain("the file is larger than 200 MB"),
        ).props("flat bordered").classes("w-full")  # fmt: skip
        self.geometry = {}
        with ui.element("div").classes("w-full grid grid-cols-3 gap-2"):
            for name, label in _GEOMETRY.items():
                field = ui.input(label).props(f"dense id={name}").classes("col-span-3" if name == "K" else "")
                self.geometry[name] = field.tooltip(_explained(name))
        with ui.row().classes("w-full items-center justify-between"):
            self.height = ui.checkbox("larger is nearer").props("dense")
            ui.button("apply", on_click=self._placed).props("dense flat no-caps id=apply")
        self._show_geometry()
        self.controls: dict[str, Any] = {}
        for heading, names in _GROUPS.items():
            _heading(heading)
            for name in (name for name in SLIDERS if name in names):
                self._slider(name)
            for name in (name for name in SWITCHES if name in names):
                switch = ui.switch(name, value=bool(session.value(name)), on_change=self._setter(name, bool))
                switch.props(f"dense id={name}").classes("text-caption").tooltip(_explained(name))
                self.controls[name] = switch
        _heading("Take them along")
        with ui.row().classes("gap-1"):
            ui.button("detector.yml", icon="download", on_click=self._download).props("dense flat no-caps id=download")
            ui.button("defaults", icon="restart_alt", on_click=self._defaults).props("dense flat no-caps id=defaults")
        self.program = ui.code("", language="python").classes("w-full text-caption").props("id=program")

    def _show_geometry(self) -> None:
        for name, field in self.geometry.items():
            field.value = self.session.typed(name)
        self.height.value = bool(self.session.geometry.get("heightMap"))

    def _slider(self, name: str) -> None:
        low, high, step = SLIDERS[name]
        kind = type(DETECTION[name].default or 0.0)
        with ui.row().classes("w-full no-wrap items-center gap-2"):
            ui.label(name).classes("w-32 flex-none text-caption").tooltip(_explained(name))
            slider = ui.slider(
                min=low, max=high, step=step, value=self.session.value(name), on_change=self._setter(name, kind)
            )
            slider.props(f"dense id={name}")
            value = ui.label().classes("w-10 flex-none text-right text-caption")
            value.bind_text_from(slider, "value", lambda v: "any" if name == "jumpThreshold" and not v else f"{v:g}")
        self.controls[name] = slider

    def _lay_out(self) -> None:
        """One view for each of the chosen pictures."""
        names = [name for name, box in self.choice.items() if box.value]
        self.grid.clear()
        self.views: dict[str, Any] = {}
        self.columns = 1 if len(names) == 1 else 2 if len(names) <= 4 else 3
        with self.grid:
            for name in names:
                with ui.column().classes("gap-1"):
                    with ui.row().classes("items-baseline gap-2 no-wrap"):
                        ui.label(name).classes("text-bold")
                        ui.label(_CAPTIONS[name]).classes("text-caption text-grey-7 ellipsis")
                    view = ui.interactive_image(on_mouse=self._asked, events=["click"], cross=False)
                    self.views[name] = view.classes("w-full view").props(f'id="view-{name.replace(" ", "-")}"')
        self._ask()

    def _ask(self) -> None:
        """Draw everything anew; what is drawn now for older parameters is given up once it has shown something."""
        self.pending = True
        if not self.busy:
            self.busy = True
            background_tasks.create(self._draw())

    async def _draw(self) -> None:
        try:
            while self.pending:
                self.pending, self.cancellation = False, Cancellation()
                start = time.perf_counter()
                results, views = self.session.results, self.views
                height, width = self.session.relief.shape[:2]
                rows = -(-len(views) // self.columns)
                self.grid.style(f"--aspect: {width / height:.4f}; --columns: {self.columns}; --rows: {max(rows, 1)}")
                self.title.text, self.note.text = self.session.title, " ".join(self.session.notes)
                self.program.content = self.session.python()
                await run.io_bound(lambda r=results: r.edges)
                await asyncio.gather(*(self._show(results, views, group) for group in SHARING))
                if not self.cancellation.cancelled and not self.status.is_deleted:
                    took, edges = 1000 * (time.perf_counter() - start), np.count_nonzero(results.edges)
                    self.status.text = f"{width} x {height}, {edges} edge pixels, {len(views)} views in {took:.0f} ms"
        except error as problem:
            self._complain(problem.err)
        finally:
            self.busy = False

    async def _show(self, results: Results, views: dict[str, Any], group: tuple[str, ...]) -> None:
        """Those of a group of views that are shown, each as soon as it is drawn."""
        for name in (name for name in group if name in views):
            picture = await run.io_bound(self._picture, name, results)
            if picture is None or views[name].is_deleted:  # other views were chosen, or the page was closed
                return
            views[name].set_source(picture)
            if self.pending:
                self.cancellation.cancel()

    def _picture(self, name: str, results: Results) -> str | None:
        """A view as an address; None if it is given up."""
        try:
            with self.cancellation:
                return _encoded(self.session.picture(name, results))
        except CancelledError:
            return None

    def _complain(self, text: str) -> None:
        self.problem.text = text
        with self.grid:
            ui.notify(text, type="negative", multi_line=True)

    def _setter(self, name: str, kind: type) -> Any:
        return lambda event: self._change(name, kind(event.value))

    def _change(self, name: str, value: Any) -> None:
        try:
            self.session.change(name, value)
        except error as problem:
            self._complain(problem.err)
            return
        self.problem.text = ""
        self._ask()

    def _defaults(self) -> None:
        for name, control in self.controls.items():
            self.session.change(name, DETECTION[name].default)
            control.value = self.session.value(name)
        self._ask()

    def _placed(self) -> None:
        try:
            camera, size, factor, invalid = (field.value or "" for field in self.geometry.values())
            self.session.place(camera, size, height_map=self.height.value, depth_factor=factor, invalid=invalid)
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
        self._show_geometry()
        self._ask()

    async def _asked(self, event: events.MouseEventArguments) -> None:
        height, width = self.session.relief.shape[:2]
        x, y = (int(np.clip(np.floor(v), 0, n - 1)) for v, n in ((event.image_x, width), (event.image_y, height)))
        why = await run.io_bound(self.session.explanation, x, y)
        self.reason.clear()
        with self.reason:
            ui.label(f"Pixel ({x}, {y}), {'an edge' if why.edge else 'no edge'}: {why.reason}").props("id=words")
            if why.change:
                text = ", ".join(f"{name}={value!r}" for name, value in why.change.items())
                ui.button(f"try {text}", on_click=lambda: self._try(why.change)).props("dense no-caps id=try")
            ui.image(_encoded(drawExplanation(why))).classes("w-full").props("id=why")
        self.dialog.open()

    def _try(self, change: Any) -> None:
        for name, value in change.items():
            self.session.change(name, value)
            if name in self.controls:
                self.controls[name].value = value
        self.dialog.close()
        self._ask()

    def _download(self) -> None:
        ui.download.content(self.session.settings(), "detector.yml")


def _heading(text: str) -> None:
    ui.label(text).classes("text-bold q-mt-sm")


def _explained(name: str) -> str:
    """What a parameter means, for those who point at it."""
    option = DETECTION[name]
    return option.text.replace("`", "") + (f" [{option.unit}]" if option.unit else "")


def _encoded(picture: np.ndarray) -> str:
    """A picture as the address of its own content."""
    content = cv2.imencode(".jpg", picture, _ENCODING)[1]
    return "data:image/jpeg;base64," + base64.b64encode(content).decode()
