"""``ccr-gym play`` in a real browser: Debian's Chromium, driven by Playwright; run by ``make browser``.

It says how many updates a second reach the page while a policy drives, and for how many the scene is drawn, beside
the frame rate of an empty page in the same run: without a GPU, and on a busy machine, a browser draws slowly.
"""

import io
import os
import queue
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
import psutil
import pytest

playwright = pytest.importorskip("playwright.sync_api")
CHROMIUM = os.environ.get("CHROMIUM", shutil.which("chromium") or "")
pytestmark = pytest.mark.skipif(not CHROMIUM, reason="needs chromium: apt-get install chromium")

SHOTS = Path("build/browser")
PATIENCE_MS = 180_000
UPDATES = 30.0  # asked of the page, less in proportion where even an empty page is not drawn FULL times a second
DRAWN = 15.0  # frames with a new shape, drawn without a GPU; a busy machine of two cores draws 23 to 27
FULL = 60.0
COUNT_FRAMES = """() => new Promise(done => {
  let count = 0; const start = performance.now();
  const frame = () => { count++; const time = performance.now() - start;
    time > 5000 ? done(1000 * count / time) : requestAnimationFrame(frame) };
  requestAnimationFrame(frame) })"""
NOTE_UPLOADS = """for (const name of ['bufferData', 'bufferSubData']) {
  const upload = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...data) {
    window.uploads = (window.uploads || 0) + 1; return upload.apply(this, data) } }"""
COUNT_DRAWN = """() => new Promise(done => {  // frames for which the scene got new points
  let count = 0, last = window.uploads; const start = performance.now();
  const frame = () => { if (window.uploads !== last) { count++; last = window.uploads }
    const time = performance.now() - start;
    time > 8000 ? done(1000 * count / time) : requestAnimationFrame(frame) };
  requestAnimationFrame(frame) })"""

HOLD_FRAMES = """const draw = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = callback => {
  const wait = time => window.held ? draw(wait) : callback(time);
  return draw(wait) }"""
HOLD_AND_CLICK = """option => new Promise(done => {  // what the page is sent in 4 s comes to it in one frame
  window.held = true;
  setTimeout(() => option.click(), 1000);
  setTimeout(() => { window.held = false; done() }, 4000) })"""


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("play"))
    command = [sys.executable, "-m", "agents.cli", "play", "--no-open", "--port", "8471", "--out", folder]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    lines: queue.Queue[str] = queue.Queue()
    reader = threading.Thread(target=lambda: [lines.put(line) for line in server.stdout], daemon=True)
    reader.start()
    while "Playing" not in (line := lines.get(timeout=120)):
        pass
    yield line.split(" at ")[1].split(";")[0]
    server.send_signal(2)
    assert server.wait(60) == 0
    reader.join()
    assert list(lines.queue) == ["Play has ended\n"]
    server.stdout.close()


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def page(browser, url):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script(NOTE_UPLOADS + HOLD_FRAMES)
    page.errors, page.outside = [], []
    page.on("console", lambda message: page.errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    local = url, "data:", "blob:"
    page.on("request", lambda request: None if request.url.startswith(local) else page.outside.append(request.url))
    page.goto(f"{url}/?fixedDpr=0.5")
    page.wait_for_selector("#ccr-status", state="attached")
    page.wait_for_timeout(3000)
    return page


def status(page, name):
    return float(page.evaluate(f"document.querySelector('#ccr-status').dataset.{name}"))


def force(page):
    return float(page.evaluate("document.querySelector('#ccr-true').textContent"))


def shoot(page, name):
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SHOTS / name, timeout=PATIENCE_MS)


def drag(page, start, end):
    """Drags with the mouse, slowly enough for a page that is drawn without a GPU."""
    page.mouse.move(*start)
    page.wait_for_timeout(1500)
    page.mouse.down()
    for part in range(1, 11):
        page.mouse.move(*(a + part / 10 * (b - a) for a, b in zip(start, end, strict=True)))
        page.wait_for_timeout(300)
    page.mouse.up()


def test_the_page_has_the_name_of_the_command(page):
    assert page.title() == "ccr-gym play"


def test_an_obstacle_dragged_into_the_robot_is_felt(page):
    assert force(page) == 0
    assert status(page, "contacts") == 0
    dismiss = page.query_selector(".mantine-Notification-closeButton")
    if dismiss:
        dismiss.click()
    x, y = handle(page)
    drag(page, (x, y), (x - 230, y))
    deadline = time.time() + 60
    while force(page) == 0 and time.time() < deadline:
        page.wait_for_timeout(300)
    shoot(page, "dragged.png")
    assert force(page) > 0
    assert status(page, "contacts") > 0


def handle(page):
    """Finds the arrow along x of the obstacle's handle by its colour, at the arrow's tip."""
    picture = imageio.imread(io.BytesIO(page.screenshot(timeout=PATIENCE_MS)))[..., :3].astype(int)
    red = (picture[..., 0] > 200) & (picture[..., 1] < 90) & (picture[..., 2] < 140)
    red[:, :310], red[:, 950:] = False, False  # panels
    ys, xs = np.nonzero(red)
    assert len(xs), "the handle of the obstacle is not to be seen"
    return float(xs.max() - 8), float(np.median(ys))


def cpu_seconds():
    """CPU time of the server and of all processes of the browser [s]."""
    server, browser = 0.0, 0.0
    for process in psutil.Process().children(recursive=True):
        times = process.cpu_times()
        if "agents.cli" in process.cmdline():
            server += times.user + times.system
        elif "chrom" in process.name():
            browser += times.user + times.system
    return server, browser


def choose(page, label, option):
    page.get_by_label(label, exact=True).first.click()
    page.get_by_role("option", name=option, exact=True).click()


def test_a_recording_is_downloaded(page):
    page.keyboard.press("g")
    page.keyboard.press("k")
    page.wait_for_timeout(2000)
    with page.expect_download() as download:
        page.get_by_role("button", name="Stop recording").click()
    assert download.value.suggested_filename == "play-000.gif"
    assert len(imageio.mimread(download.value.path())) > 5


def test_space_pauses_whatever_has_the_focus(page):
    page.get_by_role("button", name="New", exact=True).click()
    page.wait_for_timeout(1000)
    page.keyboard.press("Space")
    page.wait_for_timeout(1000)
    step = page.inner_text("#ccr-status tr")
    page.wait_for_timeout(1500)
    assert page.inner_text("#ccr-status tr") == step
    page.keyboard.press("Space")
    page.wait_for_timeout(1500)
    assert page.inner_text("#ccr-status tr") != step


def test_settings_keep_their_tab(page):
    page.get_by_role("tab", name="Setting").click()
    choose(page, "Model", "paper")
    page.wait_for_timeout(2000)
    choose(page, "Task", "CCR/LoadCell-v1")
    page.wait_for_timeout(3000)
    assert page.get_by_label("Model", exact=True).first.input_value() == "rod"
    choose(page, "Task", "CCR/PushObstacle-v1")
    choose(page, "Sensing", "realistic")
    page.wait_for_timeout(2000)
    page.get_by_role("tab", name="Drive").click()
    assert force(page) == 0


def test_updates_a_second_with_a_policy(page, browser, url, capsys):
    page.get_by_role("tab", name="Setting").click()
    choose(page, "Task", "CCR/MovingObstacle-v1")  # where the robot never comes to rest
    choose(page, "Sensing", "ideal")
    page.wait_for_timeout(2000)
    page.get_by_role("tab", name="Drive").click()
    choose(page, "Driver", "MPC")
    page.wait_for_timeout(3000)
    before, first, start = cpu_seconds(), status(page, "tick"), time.perf_counter()
    drawn = page.evaluate(COUNT_DRAWN)
    ticks, seconds = status(page, "tick") - first, time.perf_counter() - start
    used = [1e3 * (b - a) / ticks for a, b in zip(before, cpu_seconds(), strict=True)]
    shoot(page, "policy.png")
    empty = browser.new_page(viewport={"width": 1280, "height": 800})
    empty.goto("about:blank")
    frames = empty.evaluate(COUNT_FRAMES)
    empty.close()
    with capsys.disabled():
        print(f"\n{ticks / seconds:.1f} updates/s reach the page with MPC driving, {drawn:.1f}/s are drawn;", end=" ")
        print(f"an empty page is drawn {frames:.1f} times a second")
        print(f"CPU per tick: {used[0]:.1f} ms in the server, {used[1]:.1f} ms in the browser, without a GPU")
    assert ticks / seconds >= UPDATES * min(1.0, frames / FULL)
    assert drawn >= DRAWN * min(1.0, frames / FULL)


def test_a_page_that_stalls_while_the_task_changes_catches_up(page):
    """A page handles what it was sent between two frames at once, removals of components before updates.

    A policy drives, so that the scene moves: what touches the panels alone is not kept for the next frame.
    """
    page.get_by_role("tab", name="Setting").click()
    for task in ("CCR/SpatialPush-v1", "CCR/MovingObstacle-v1", "CCR/TrackForce-v1"):
        page.get_by_label("Task", exact=True).first.click()
        page.get_by_role("option", name=task, exact=True).evaluate(HOLD_AND_CLICK)
        page.wait_for_timeout(1000)
        assert page.get_by_label("Task", exact=True).first.input_value() == task
    shoot(page, "stalled.png")
    assert page.errors == []


def test_no_error_and_nothing_from_elsewhere(page):
    assert page.errors == []
    assert page.outside == []
