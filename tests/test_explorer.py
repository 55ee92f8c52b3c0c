"""The explorer: what it computes, and the page in a real browser."""

import http.client
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge.app.cli import main
from rangeedge.explorer.guard import Guard, expect_free
from rangeedge.explorer.session import SLIDERS, SWITCHES, VIEWS, Session
from rangeedge.options import DETECTION

PACKAGE = Path(rangeedge.__file__).parents[1]

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
FLAGS = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking"
FLAGS += " --disable-component-update --disable-sync --window-size=1500,1100"


@pytest.fixture
def session():
    return Session.of_scene()


def test_every_view_is_a_picture_of_the_image(session):
    for name in VIEWS:
        picture = session.picture(name)
        assert (picture.dtype, picture.shape) == (np.uint8, (480, 640, 3)), name
        assert picture.std() > 1


def test_parameters_are_those_of_the_detector(session):
    for name, (low, high, _) in SLIDERS.items():
        default = DETECTION[name].default
        assert default is None or low <= default <= high
        session.change(name, high)
    for name in SWITCHES:
        session.change(name, not DETECTION[name].default)
    src, geometry = session.image
    options = {name: value for name, value in session.options.items()}
    assert len(options) == len(SLIDERS) + len(SWITCHES) - 1  # the largest hysteresis is the default
    expected = rangeedge.detectEdges(src, **geometry, **options)
    assert np.array_equal(session.picture("thin map")[..., 0], expected)
    for name in (*SLIDERS, *SWITCHES):
        session.change(name, DETECTION[name].default)
    assert session.options == {}
    for name in SLIDERS:  # as when they are put back
        session.change(name, session.value(name))
    assert session.options == {}
    session.change("minSignificance", 0.0)
    expected = rangeedge.detectEdges(src, **geometry, minSignificance=0)
    assert np.array_equal(session.picture("thin map")[..., 0], expected)


def test_exports_make_the_same_edges(session, tmp_path, monkeypatch):
    session.change("creaseThreshold", 20.0)
    session.change("maxGap", 3)
    monkeypatch.chdir(tmp_path)
    rangeedge.imwriteRange("built-in scene.npz", session.image.src)
    names = {}
    exec(session.python().replace("built-in scene", "built-in scene.npz"), names)
    detector = rangeedge.createScanLineDetector()
    Path("detector.yml").write_bytes(session.settings())
    detector.load("detector.yml")
    expected = session.picture("thin map")[..., 0]
    assert np.array_equal(names["edges"], expected)
    assert np.array_equal(detector.detectEdges(session.image.src), expected)
    assert detector.getCreaseThreshold() == 20


def test_what_a_parameter_leaves_as_it_was_is_kept(session):
    strength = session.results.strength
    session.change("creaseThreshold", 50.0)
    assert session.results.strength is strength
    expected = rangeedge.detectEdges(session.image.src, **session.geometry, creaseThreshold=50)
    assert np.array_equal(session.results.edges, expected)
    session.change("epsFactor", 5.0)
    assert session.results.strength is not strength


def test_everyone_has_a_session_of_their_own(session):
    session.change("maxGap", 3)
    other = session.copy()
    other.change("maxGap", 20)
    assert (session.value("maxGap"), other.value("maxGap")) == (3, 20)


def test_missing_camera_is_noted(session):
    assert session.notes == []
    session.place("", "", height_map=False)
    assert len(session.notes) == 1
    assert "give K" in session.notes[0]
    session.place("525, 525, 319.5, 239.5", "", height_map=False)
    assert session.notes == []


def test_wrong_uploads_change_nothing(session):
    before = session.picture("edges")
    colour = cv2.imencode(".png", np.zeros((20, 30, 3), np.uint8))[1].tobytes()
    truncated = cv2.imencode(".png", np.ones((200, 300), np.uint16))[1].tobytes()[:60]
    for name, content in (
        ("a.png", colour), ("b.png", truncated), ("c.txt", b"hello"), ("d.npy", b""), ("../e.png", b"\x89PNG"),
    ):  # fmt: skip
        with pytest.raises(rangeedge.error):
            session.upload(name, content)
    assert session.title == "built-in scene"
    assert np.array_equal(session.picture("edges"), before)


@pytest.mark.parametrize(
    "name", ["a.\0", "a." + "b" * 300, "a\n.png", "/etc/x/../y", "", "\ud800.png", '"); exit(3)  # .png']
)
def test_uploads_of_any_name(session, name, monkeypatch):
    """The program shows the name as a text, in one line."""
    content = cv2.imencode(".png", session.image.src)[1].tobytes()
    session.upload(name, content)
    assert session.title == name
    asked = []
    monkeypatch.setattr(rangeedge, "imreadRange", lambda path: asked.append(path) or session.image)
    exec(session.python(), {})
    assert asked == [name]
    assert session.python().splitlines()[2].startswith("src = ")


@pytest.mark.parametrize(
    ("host", "headers", "status"),
    [
        ("127.0.0.1", {"host": "127.0.0.1:8321"}, None),
        ("127.0.0.1", {"host": "localhost:8321", "origin": "http://localhost:8321"}, None),
        ("127.0.0.1", {"host": "LOCALHOST"}, None),
        ("localhost", {"host": "[::1]:8321"}, None),
        ("127.0.0.1", {"host": "example.org:8321"}, 421),
        ("127.0.0.1", {"host": "example.org:8321", "origin": "http://example.org:8321"}, 421),
        ("127.0.0.1", {"host": "127.0.0.1.example.org"}, 421),
        ("127.0.0.1", {"host": "127.0.0.1@example.org"}, 421),
        ("127.0.0.1", {}, 421),
        ("127.0.0.1", {"host": "["}, 421),
        ("127.0.0.1", {"host": "127.0.0.1:8321", "origin": "http://example.org"}, 403),
        ("127.0.0.1", {"host": "127.0.0.1:8321", "origin": "null"}, 403),
        ("127.0.0.1", {"host": "127.0.0.1:8321", "content-length": "300000000"}, 413),
        ("127.0.0.1", {"host": "127.0.0.1:8321", "content-length": "x"}, 413),
        ("0.0.0.0", {"host": "bench.example.org:8321", "origin": "http://bench.example.org:8321"}, None),
        ("0.0.0.0", {"host": "bench.example.org:8321", "origin": "http://example.org"}, 403),
        ("192.168.1.5", {"host": "192.168.1.5:8321"}, None),
    ],
)
def test_who_may_ask(host, headers, status):
    refusal = Guard(None, host).refusal([(name.encode(), value.encode()) for name, value in headers.items()])
    assert (refusal and refusal[0]) == status


@pytest.mark.parametrize(
    ("host", "port", "message"),
    [
        ("127.0.0.1", -1, "`port` must be an integer from 1 to 65535, got -1"),
        ("127.0.0.1", 99999, "`port` must be an integer from 1 to 65535, got 99999"),
        ("300.1.1.1", 8321, r"cannot listen at '300\.1\.1\.1', port 8321: "),
        ("a\0b", 8321, "cannot listen at"),
        ("x" * 300, 8321, "cannot listen at"),
    ],
)
def test_addresses_that_are_none(host, port, message):
    with pytest.raises(rangeedge.error, match=message):
        expect_free(host, port)


def test_a_port_that_is_taken():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(rangeedge.error, match=f"port {port}: Address already in use"):
            expect_free("127.0.0.1", port)
    expect_free("127.0.0.1", port)


def test_geometry_as_typed(session):
    with pytest.raises(rangeedge.error):
        session.place("525, 525", "", height_map=False)
    with pytest.raises(rangeedge.error, match="`K` must be four numbers"):
        session.place("a, b", "", height_map=False)
    with pytest.raises(rangeedge.error, match="depthFactor"):
        session.place("", "", height_map=False, depth_factor="many")
    session.place("500, 500, 320, 240", "", height_map=False)
    assert session.typed("K") == "500, 500, 320, 240"
    session.place("", "0.002", height_map=True)
    assert session.geometry == {"pixelSize": 0.002, "heightMap": True}
    session.place("500 500 320 240", "", height_map=False, depth_factor="5000", invalid="0, 65535")
    assert [session.typed(name) for name in ("K", "pixelSize", "depthFactor", "invalid")] == [
        "500, 500, 320, 240", "", "5000", "0, 65535",
    ]  # fmt: skip
    assert session.geometry["depthFactor"] == 5000


def test_command_says_what_is_missing(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "nicegui", None)
    monkeypatch.delitem(sys.modules, "rangeedge.explorer.page", raising=False)
    assert main(["explore", "--no-browser"]) == 2
    assert "pip install 'rangeedge[explorer]'" in capsys.readouterr().err


@pytest.fixture
def server():
    """The port of the explorer, in a process of its own."""
    pytest.importorskip("nicegui", reason="the extra [explorer] is not installed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "rangeedge", "explore", "--no-browser", "--port", str(port)]
    environment = {name: value for name, value in os.environ.items() if "PYTEST" not in name}  # which NiceGUI minds
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(command, cwd=PACKAGE, env=environment, **silent)
    try:
        _wait(lambda: _open(port))
        yield port
    finally:
        process.terminate()
        process.wait(10)


@pytest.fixture
def page(tmp_path, server):
    """The page in a browser that shows nothing."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    if not (CHROMIUM and DRIVER):
        pytest.skip("no browser: chromium and chromedriver are not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in [*FLAGS.split(), f"--user-data-dir={tmp_path / 'profile'}"]:
        options.add_argument(flag)
    options.add_experimental_option("prefs", {"download.default_directory": str(tmp_path)})
    driver = None
    try:
        driver = webdriver.Chrome(options, webdriver.ChromeService(DRIVER))
        driver.get(f"http://127.0.0.1:{server}/")
        yield Page(driver)
    finally:
        if driver:
            driver.quit()


def _open(port):
    try:
        return urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5).status == 200
    except OSError:
        return False


def _wait(condition, seconds=120):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError("waited in vain")


class Page:
    def __init__(self, driver):
        self.driver = driver

    def text(self, name):
        found = self.driver.find_elements("id", name)
        return found[0].text if found else ""

    def status(self):
        return _wait(lambda: "edge pixels" in self.text("status") and self.text("status"))

    def after(self, action):
        before = self.status()
        action()
        return _wait(lambda: self.text("status") != before and self.text("status"))


def edges_of(status):
    return int(status.split(",")[1].split()[0])


def test_page(page, tmp_path):
    from selenium.webdriver import ActionChains, Keys

    driver = page.driver
    first = page.status()
    assert first.startswith("640 x 480, ")
    views = driver.find_elements("css selector", ".view img")
    assert len(views) == 4
    assert all(view.get_attribute("src").startswith("data:image/jpeg") for view in views)

    # A slider changes the edges, the program that the page shows, and nothing else.
    slider = driver.find_element("id", "creaseThreshold")
    high = slider.size["width"] * 0.45  # from its middle
    status = page.after(ActionChains(driver).move_to_element_with_offset(slider, high, 0).click().perform)
    _wait(lambda: "creaseThreshold" in page.text("program"))
    assert edges_of(page.status()) < edges_of(first)
    assert status.endswith(" ms")

    driver.save_screenshot(str(tmp_path / "explorer.png"))

    # A click asks why.
    image = driver.find_element("css selector", "#view-edges img, #view-edges")
    ActionChains(driver).move_to_element(image).click().perform()
    _wait(lambda: page.text("words").startswith("Pixel (3"))
    assert driver.find_elements("id", "why")

    time.sleep(0.5)  # that the dialog takes to open
    driver.save_screenshot(str(tmp_path / "why.png"))
    ActionChains(driver).send_keys(Keys.ESCAPE).perform()
    _wait(lambda: not driver.find_elements("css selector", ".q-dialog__backdrop"))

    # The menu chooses views.
    driver.find_element("id", "views").click()
    _wait(lambda: [box for box in driver.find_elements("css selector", ".q-menu .q-checkbox") if box.is_displayed()])
    status = page.after(driver.find_elements("css selector", ".q-menu .q-checkbox")[2].click)
    assert "5 views" in status
    ActionChains(driver).send_keys(Keys.ESCAPE).perform()
    _wait(lambda: not driver.find_elements("css selector", ".q-menu"))

    # The wheel zooms all views together.
    image = driver.find_element("css selector", "#view-edges img, #view-edges")
    ActionChains(driver).scroll_from_origin(_origin(image), 0, -300).perform()
    zoom = "return getComputedStyle(document.documentElement).getPropertyValue('--zoom')"
    _wait(lambda: float(driver.execute_script(zoom) or 1) > 1)

    # Wrong uploads are told so; a right one is taken.
    (upload,) = driver.find_elements("css selector", "input[type=file]")
    (tmp_path / "notes.txt").write_text("hello")
    upload.send_keys(str(tmp_path / "notes.txt"))
    _wait(lambda: "notes.txt" in page.text("problem"))
    assert page.text("title") == "built-in scene"
    step = np.where(np.arange(200) < 90, 900, 1200) * np.ones((150, 1))
    cv2.imwrite(str(tmp_path / "step.png"), step.astype(np.uint16))
    (upload,) = driver.find_elements("css selector", "input[type=file]")
    upload.send_keys(str(tmp_path / "step.png"))
    _wait(lambda: page.status().startswith("200 x 150, "))
    assert page.text("title") == "step.png"
    assert page.text("problem") == ""


def _origin(element):
    from selenium.webdriver.common.actions.wheel_input import ScrollOrigin

    return ScrollOrigin.from_element(element)


def test_only_this_machine_can_open_it(server):
    assert _open(server)
    with socket.socket() as probe, pytest.raises(OSError, match="refused"):
        probe.connect(("127.0.0.2", server))


def test_other_pages_of_the_browser_are_refused(server):
    """By a name that somebody lets point here, or from elsewhere, as pages and as sockets."""
    socket_of_page = "/_nicegui_ws/socket.io/?EIO=4&transport="
    own, other = f"http://127.0.0.1:{server}", "http://example.org"
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    upgrade |= {"Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}
    for path, headers, status in (
        ("/", {}, 200),
        ("/", {"Host": "example.org"}, 421),
        (socket_of_page + "polling", {"Origin": own}, 200),
        (socket_of_page + "polling", {"Origin": other}, 403),
        (socket_of_page + "websocket", {"Origin": own, **upgrade}, 101),
        (socket_of_page + "websocket", {"Origin": other, **upgrade}, 403),
        (socket_of_page + "websocket", {"Host": "example.org", "Origin": other, **upgrade}, 403),
    ):
        asked = http.client.HTTPConnection("127.0.0.1", server, timeout=20)
        asked.request("GET", path, headers=headers)
        assert asked.getresponse().status == status
        asked.close()
