"""Pages of `voxlathe view`, `validate` and `converge` in headless Chromium.

    python3 tests/page.py VOXLATHE [SCENE.toml ...]

Every scene's page is opened, and held against the command: no error in the console, the silhouette within two pixels of
`render`'s, the value under the pointer at a hundred places that of a stack, bit for bit. Then what browsers lack: WebGL 2,
large 3-D textures, a context that is lost, a wide window; names that look like markup; a finished stack; reports.
The browser is $CHROME, or one of the usual names. Only Python's own library is needed.
"""

import base64
import concurrent.futures
import glob
import json
import math
import os
import random
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time

NAMES = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "chromium-headless-shell"]
FLAGS = [
    "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-quic", "--no-first-run", "--no-default-browser-check", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-extensions", "--hide-scrollbars", "--mute-audio",
    "--force-device-scale-factor=1", "--disable-dev-shm-usage", "--remote-debugging-port=0",
]
# What differs from a silhouette by more than this is seen, in pixels.
MOST_OFF = 2
PLACES = 100
# Of the scenes' grids; surfaces are drawn from finer ones.
RESOLUTION = 48


def chrome():
    """The browser, or None."""
    given = os.environ.get("CHROME")
    if given:
        return given
    return next((found for found in map(shutil.which, NAMES) if found), None)


class Socket:
    """Just enough of RFC 6455 to talk to a browser on this machine."""

    def __init__(self, port, path):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=120)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        self.rest = b""
        while b"\r\n\r\n" not in self.rest:
            self.rest += self.socket.recv(4096)
        head, self.rest = self.rest.split(b"\r\n\r\n", 1)
        assert b" 101 " in head, head

    def send(self, text):
        data = text.encode()
        mask = os.urandom(4)
        if len(data) < 126:
            head = struct.pack("!BB", 0x81, 0x80 | len(data))
        elif len(data) < 1 << 16:
            head = struct.pack("!BBH", 0x81, 0x80 | 126, len(data))
        else:
            head = struct.pack("!BBQ", 0x81, 0x80 | 127, len(data))
        pad = (mask * (len(data) // 4 + 1))[: len(data)]
        masked = (int.from_bytes(data, "big") ^ int.from_bytes(pad, "big")).to_bytes(len(data), "big") if data else b""
        self.socket.sendall(head + mask + masked)

    def take(self, count):
        while len(self.rest) < count:
            more = self.socket.recv(1 << 20)
            if not more:
                raise EOFError("the browser has gone")
            self.rest += more
        taken, self.rest = self.rest[:count], self.rest[count:]
        return taken

    def receive(self):
        text = b""
        while True:
            first, length = self.take(2)
            length &= 127
            if length == 126:
                (length,) = struct.unpack("!H", self.take(2))
            elif length == 127:
                (length,) = struct.unpack("!Q", self.take(8))
            data = self.take(length)
            if first & 15 in (0, 1):
                text += data
                if first & 128:
                    return text.decode()


class Browser:
    """A browser and one of its tabs."""

    def __init__(self, program):
        self.folder = tempfile.mkdtemp(prefix="voxlathe-page-")
        self.errors = []
        self.process = subprocess.Popen(
            [program, *FLAGS, f"--user-data-dir={self.folder}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL,
        )
        told = os.path.join(self.folder, "DevToolsActivePort")
        for _ in range(600):
            if os.path.exists(told) and open(told).read().count("\n"):
                break
            if self.process.poll() is not None:
                raise RuntimeError(f"{program} ended with {self.process.returncode}")
            time.sleep(0.05)
        lines = open(told).read().split("\n")
        self.socket = Socket(int(lines[0]), lines[1])
        self.number = 0
        self.session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.scripts = []
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.socket.send(json.dumps(message))
        while True:
            answer = json.loads(self.socket.receive())
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.listen(answer)

    def listen(self, event):
        parameters = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif event.get("method") == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in parameters["args"]))
        elif event.get("method") == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.errors.append(parameters["entry"]["text"])

    def size(self, width, height, touch=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=touch)
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch)

    def dark(self, is_dark):
        feature = {"name": "prefers-color-scheme", "value": "dark" if is_dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[feature])

    def open(self, path, fragment="", before=None, ready=True):
        """Opens a page; `before` is a script that runs ahead of it."""
        for script in self.scripts:
            self.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
        self.scripts = []
        self.call("Page.navigate", url="about:blank")
        if before:
            found = self.call("Page.addScriptToEvaluateOnNewDocument", source=before)
            self.scripts = [found["identifier"]]
        self.errors = []
        self.call("Page.navigate", url="file://" + os.path.abspath(path) + fragment)
        for _ in range(1200):
            if self.run("document.readyState === 'complete' && location.protocol === 'file:'"):
                break
            time.sleep(0.05)
        if ready:
            self.run("window.voxlathe.ready")

    def run(self, expression):
        found = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in found:
            details = found["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return found["result"].get("value")

    def picture(self, path, whole=False):
        clip = {}
        if whole:
            size = self.call("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"clip": {**size, "scale": 1}, "captureBeyondViewport": True}
        data = base64.b64decode(self.call("Page.captureScreenshot", **clip)["data"])
        with open(path, "wb") as file:
            file.write(data)

    def press(self, key):
        for kind in ("keyDown", "keyUp"):
            text = {"text": key} if len(key) == 1 and kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, **text)

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
        except (OSError, EOFError, RuntimeError):
            self.process.kill()
        self.process.wait(30)
        shutil.rmtree(self.folder, ignore_errors=True)


# What is seen of a page's canvas and of a picture of the same size that `render` made: how far one reaches over the other.
# The picture's floor and background are grey, its solids are not.
SILHOUETTES = """
(async (picture) => {
  const canvas = document.getElementById('solid'), [w, h] = [canvas.width, canvas.height];
  const pixels = (image) => {
    const copy = document.createElement('canvas');
    [copy.width, copy.height] = [w, h];
    const context = copy.getContext('2d', { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, w, h).data;
  };
  const image = new Image();
  image.src = 'data:image/png;base64,' + picture;
  await image.decode();
  if (image.width !== w || image.height !== h) throw new Error(`${image.width} x ${image.height}, not ${w} x ${h}`);
  const drawn = pixels(canvas), wanted = pixels(image);
  const own = new Uint8Array(w * h), other = new Uint8Array(w * h);
  let count = 0;
  for (let n = 0; n < w * h; n++) {
    own[n] = drawn[4 * n + 3] > 127 ? 1 : 0;
    const [r, g, b] = wanted.subarray(4 * n, 4 * n + 3);
    other[n] = wanted[4 * n + 3] > 127 && Math.max(r, g, b) - Math.min(r, g, b) > 0.13 * Math.max(r, g, b) ? 1 : 0;
    count += other[n];
  }
  // The furthest of a's pixels from b's, up to 9 pixels, and where it is; what lies within b does not count.
  const reach = (a, b) => {
    const offsets = [];
    for (let y = -9; y <= 9; y++) for (let x = -9; x <= 9; x++) if (x * x + y * y <= 81) offsets.push([x, y, Math.hypot(x, y)]);
    offsets.sort((p, q) => p[2] - q[2]);
    let most = 0, at = null, over = 0;
    for (let y = 0; y < h; y++) for (let x = 0; x < w; x++) {
      if (!a[y * w + x] || b[y * w + x]) continue;
      const near = offsets.find(([dx, dy]) => b[(y + dy) * w + x + dx] && x + dx >= 0 && x + dx < w && y + dy >= 0 && y + dy < h);
      const far = near ? near[2] : 10;
      if (far > 2) over++;
      if (far > most) [most, at] = [far, [x, y]];
    }
    return { most, at, over };
  };
  const seen = [];
  for (let n = 0; n < w * h && seen.length < 400; n += 97) if (own[n] && other[n]) seen.push([n % w, Math.floor(n / w)]);
  return { size: [w, h], count, seen, outside: reach(own, other), inside: reach(other, own) };
})
"""


# Makes the view as large as the still picture, which it gives; the view has a border of a pixel.
AS_LARGE_AS_STILL = """
(async () => {
  const still = document.getElementById('still'), style = document.getElementById('view').style;
  [style.aspectRatio, style.maxHeight] = ['auto', 'none'];
  [style.width, style.height] = [still.naturalWidth + 2 + 'px', still.naturalHeight + 2 + 'px'];
  const canvas = document.getElementById('solid');
  for (let n = 0; n < 200 && canvas.width !== still.naturalWidth; n++) await new Promise((done) => setTimeout(done, 50));
  return still.src.split(',')[1];
})()
"""


class Checks:
    """Runs the command, opens pages, and keeps what is wrong."""

    def __init__(self, program, browser, folder):
        self.program, self.browser, self.folder = program, browser, folder
        self.wrong = []
        self.passed = 0

    def check(self, name, what):
        if what:
            self.passed += 1
        else:
            print(f"WRONG: {name}", flush=True)
            self.wrong.append(name)

    def command(self, *arguments, code=0):
        run = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True, check=False)
        if run.returncode != code:
            raise RuntimeError(f"{arguments}: {run.returncode}\n{run.stderr}")
        return run

    def view(self, name, source, *arguments):
        page = os.path.join(self.folder, f"{name}.html")
        told = json.loads(self.command("view", source, "-o", page, "--force", "--json", *arguments).stdout)
        return page, told

    def quiet(self, name):
        self.check(f"{name}: the console says {self.browser.errors[:2]}", not self.browser.errors)

    def silhouette(self, name, scene, pause=0, against=None):
        """The page's default view against a picture of the same size: the furthest pixel, and some of the solid's."""
        time.sleep(pause / 1000)
        size = self.browser.run("[document.getElementById('solid').width, document.getElementById('solid').height]")
        if against is None:
            picture = os.path.join(self.folder, f"{name}.png")
            self.command("render", scene, "-o", picture, "--plain", "--lines", 0, "--width", size[0], "--height", size[1])
            with open(picture, "rb") as file:
                against = base64.b64encode(file.read()).decode()
        found = self.browser.run(f"{SILHOUETTES}('{against}')")
        seen = found.pop("seen")
        furthest = max(found["outside"]["most"], found["inside"]["most"])
        self.check(f"{name}: silhouette {found}", furthest <= MOST_OFF and found["count"] > 500)
        return furthest, seen

    def digests(self, name, told, stack):
        """The digests of the page's facts against those of a stack's files."""
        with open(os.path.join(stack, "manifest.json"), encoding="utf-8") as file:
            files = {f["name"]: f["blake3"] for f in json.load(file)["files"]}
        wanted = {c: files[f"{c}.raw"] for c in told["channels"]}
        found = self.browser.run(
            "Object.fromEntries([...document.querySelectorAll('.facts')]"
            ".filter((f) => f.querySelector('h3').textContent === 'Values, BLAKE3')"
            ".flatMap((f) => [...f.querySelectorAll('dt')].map((t) => [t.textContent, t.nextElementSibling.textContent])))"
        )
        self.check(f"{name}: digests {found}, of the stack {wanted}", found == wanted)

    def values(self, name, stack, told, seen):
        """What is under the pointer at some places against the samples of a stack, and where it should be.

        `seen`: pixels of the view in which the solid is.
        """
        nx, ny, _ = told["dims"]
        arrays = {}
        for channel in told["channels"]:
            with open(os.path.join(stack, f"{channel}.raw"), "rb") as file:
                data = file.read()
            arrays[channel] = memoryview(data).cast("B" if channel == "occupancy" else "I" if channel == "material" else "f")
        browser = self.browser
        # Whatever the scene, the same places.
        choice = random.Random(name)
        met, right = 0, 0
        for element in ("view", "slice-0", "slice-1", "slice-2"):
            x0, y0, w, h = browser.run(
                f"(() => {{ const e = document.getElementById('{element}'); e.scrollIntoView({{block: 'center'}});"
                " const r = e.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()"
            )
            axis = None if element == "view" else int(element[-1])
            for turn in range(30 if axis is not None else 16):
                if axis is None:
                    x, y = choice.choice(seen)
                else:
                    fw, fh = self.frame(told, axis, w, h)[1:]
                    x, y = 0.5 * w + choice.uniform(-0.48, 0.48) * fw, 0.5 * h + choice.uniform(-0.48, 0.48) * fh
                x, y = round(x0 + x) - x0, round(y0 + y) - y0
                browser.mouse("mouseMoved", x0 + x, y0 + y)
                found = browser.run(
                    "(() => { const p = window.voxlathe.pointer; return p && { ...p, at: window.voxlathe.state.at,"
                    " text: Object.fromEntries([...document.querySelectorAll('#readout tbody tr')].map((r) => [r.dataset.channel, r.cells[1].textContent])),"
                    " voxel: document.getElementById('voxel').textContent }; })()"
                )
                if not found:
                    continue
                met += 1
                i, j, k = found["index"]
                at = (k * ny + j) * nx + i
                same = found["voxel"] == f"{i}, {j}, {k}"
                for a, n in enumerate((i, j, k)):
                    same = same and found["position"][a] == told["origin"][a] + (n + 0.5) * told["spacing"][a]
                for channel, array in arrays.items():
                    shown = float(found["text"][channel].split(" ")[0])
                    same = same and found["values"][channel] == array[at]
                    same = same and struct.pack("<f", shown) == struct.pack("<f", array[at])
                if axis is not None:
                    same = same and self.is_under(found, told, axis, (x, y, w, h))
                elif "sdf" in arrays:
                    same = same and abs(arrays["sdf"][at]) <= 1.01 * math.hypot(*told["spacing"])
                right += same
                if not same:
                    print(f"  {name} {element} ({x:.1f}, {y:.1f}): {found}, stored {[a[at] for a in arrays.values()]}")
        self.check(f"{name}: {right} of {met} values", right == met and met >= PLACES)

    @staticmethod
    def frame(told, axis, w, h):
        """How large a slice's picture is: as large as fits. The scale, and width and height in pixels."""
        across = [(1, 2), (0, 2), (0, 1)][axis]
        sides = [told["dims"][a] * told["spacing"][a] for a in across]
        scale = min(w / sides[0], h / sides[1])
        return scale, sides[0] * scale, sides[1] * scale

    def is_under(self, found, told, axis, place):
        """Whether a slice's voxel is the one under the pointer; the picture is in the middle of the canvas."""
        x, y, w, h = place
        scale, fw, fh = self.frame(told, axis, w, h)
        across = [(1, 2), (0, 2), (0, 1)][axis]
        for a, at in ((across[0], x - 0.5 * (w - fw)), (across[1], 0.5 * (h + fh) - y)):
            number = at / (scale * told["spacing"][a])
            if not found["index"][a] - 1e-6 <= number <= found["index"][a] + 1 + 1e-6:
                return False
        return found["index"][axis] == found["at"][axis]

    def made(self, path, *arguments):
        """A scene's page and stack, made beside the browser."""
        name = os.path.splitext(os.path.basename(path))[0]
        begin = time.time()
        page, told = self.view(name, path, *arguments)
        took = time.time() - begin
        stack = os.path.join(self.folder, f"{name}.stack")
        names = ",".join(told["channels"])
        self.command("voxelize", path, "-o", stack, "--formats", "raw", "--force", "--channels", names, *arguments)
        return name, page, told, took, stack

    def scene(self, path, made):
        """All that is asked of a shipped scene's page."""
        name, page, told, took, stack = made
        browser = self.browser
        browser.size(780, 700)
        browser.open(page)
        self.quiet(name)
        times = browser.run("window.voxlathe.times")
        drawn = browser.run("window.voxlathe.drawn")
        self.check(f"{name}: drawn by {drawn}", drawn == "webgl")
        furthest = self.silhouette(f"{name} by the command", path)[0]
        self.digests(name, told, stack)
        # Where the solid is in the picture that the page carries, which is as large as the view.
        against = browser.run(AS_LARGE_AS_STILL)
        _, seen = self.silhouette(name, None, against=against)
        self.values(name, stack, told, seen)
        self.quiet(name)
        shutil.rmtree(stack, ignore_errors=True)
        print(
            f"{name}: {told['bytes'] / 1e6:.2f} MB in {took:.1f} s, first picture {times['first'] / 1000:.2f} s,"
            f" all {times['ready'] / 1000:.2f} s, silhouette {furthest:.1f} pixels",
            flush=True,
        )

    def goblet(self, scenes):
        """256 voxels: how large, how soon, how many frames a second."""
        page, told = self.view("goblet-256", os.path.join(scenes, "goblet.toml"), "--resolution", 256)
        browser = self.browser
        browser.size(1440, 900)
        browser.open(page)
        times = browser.run("window.voxlathe.times")
        frames = browser.run("window.voxlathe.frames(512, 512, 10)")
        self.quiet("goblet-256")
        self.check(f"goblet-256: {told['bytes']} bytes", told["bytes"] <= 20_000_000)
        self.check(f"goblet-256: first picture after {times['first']} ms", times["first"] <= 2000)
        print(
            f"goblet at 256: {told['bytes'] / 1e6:.2f} MB, first picture {times['first'] / 1000:.2f} s,"
            f" all {times['ready'] / 1000:.2f} s, {frames:.1f} frames a second at 512 x 512 without a graphics processor"
        )
        return page

    def thin_walls(self, scenes):
        """Walls that are thinner than a voxel have the colour of their own material, not of what is behind them."""
        page, _ = self.view("tank", os.path.join(scenes, "two_material_tank.toml"), "--resolution", 24)
        browser = self.browser
        browser.size(780, 700)
        browser.open(page)
        self.quiet("tank")
        red = browser.run(
            "(() => { const from = document.getElementById('solid'), c = document.createElement('canvas'); [c.width, c.height] = [from.width, from.height];"
            " const g = c.getContext('2d'); g.drawImage(from, 0, 0); const half = Math.floor(c.height / 2), n = [0, 0];"
            " g.getImageData(0, 0, c.width, c.height).data.forEach((_, i, d) => { if (i % 4 === 0 && d[i + 3] > 0 && d[i] > d[i + 2] + 40) n[i / 4 / c.width < half ? 0 : 1]++; });"
            " return n; })()"
        )
        self.check(f"tank: {red} pixels of water in the upper half and the lower", red[0] > 500 and red[1] == 0)

    def large(self, scenes):
        """A grid with more voxels along a side than are shown."""
        browser = self.browser
        goblet, stack = os.path.join(scenes, "goblet.toml"), os.path.join(self.folder, "large")
        arguments = ("--resolution", 600, "--channels", "occupancy,sdf")
        page, told = self.view("large", goblet, *arguments)
        self.command("voxelize", goblet, "-o", stack, "--formats", "raw", "--force", *arguments)
        self.check(f"large: one voxel of {told['stride']}, {told['shown']}", told["stride"] == 2 and max(told["shown"]) <= 512)
        browser.size(780, 700)
        browser.open(page)
        self.quiet("large")
        self.check("large: said", "reduced to" in browser.run("document.getElementById('notices').textContent"))
        (nx, ny, nz), choice = told["dims"], random.Random("large")
        right = 0
        with open(os.path.join(stack, "sdf.raw"), "rb") as sdf, open(os.path.join(stack, "occupancy.raw"), "rb") as occupancy:
            for _ in range(PLACES):
                place = [told["stride"] * choice.randrange(n) for n in told["shown"]]
                found = browser.run("voxlathe.voxel(" + ", ".join(map(str, place)) + ")")
                i, j, k = found["index"]
                at = (k * ny + j) * nx + i
                sdf.seek(4 * at)
                occupancy.seek(at)
                same = found["values"] == {"occupancy": occupancy.read(1)[0], "sdf": struct.unpack("<f", sdf.read(4))[0]}
                for a, n in enumerate((i, j, k)):
                    same = same and n % 2 == 0 and found["position"][a] == told["origin"][a] + (n + 0.5) * told["spacing"][a]
                right += same
        self.check(f"large: {right} of {PLACES} values", right == PLACES)
        furthest, _ = self.silhouette("large", goblet)
        shutil.rmtree(stack, ignore_errors=True)
        print(f"goblet at 600: {told['shown']} of {told['dims']} shown, {told['bytes'] / 1e6:.2f} MB, silhouette {furthest:.1f} pixels")

    def fallbacks(self, page, scenes):
        """What a browser may lack."""
        browser = self.browser
        is_drawn = (
            "(() => { const c = document.getElementById('soft'); const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            " let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n / (c.width * c.height); })()"
        )
        turn = "(async () => { voxlathe.setState({ azimuth: 30 }); await new Promise((r) => setTimeout(r, 900)); return voxlathe.drawn; })()"
        slices = (
            "[0, 1, 2].map((a) => { const c = document.getElementById('slice-' + a); const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            " return new Set(new Uint32Array(d.buffer)).size; })"
        )
        without = (
            "const own = HTMLCanvasElement.prototype.getContext;"
            "HTMLCanvasElement.prototype.getContext = function (kind, ...more) { return kind === 'webgl2' ? null : own.call(this, kind, ...more); };"
        )
        browser.open(page, before=without)
        self.quiet("no WebGL 2")
        still = browser.run("(() => { const i = document.getElementById('still'); return voxlathe.drawn === 'still' && !i.hidden && i.complete && i.naturalWidth; })()")
        self.check(f"no WebGL 2: a still picture {still}", still == 720)
        self.check("no WebGL 2: slices", min(browser.run(slices)) > 20)
        self.check("no WebGL 2: said", "still picture" in browser.run("document.getElementById('status').textContent"))
        self.check("no WebGL 2: turned", browser.run(turn) == "soft" and browser.run(is_drawn) > 0.02)

        browser.open(page)
        browser.run("window.lost = document.getElementById('solid').getContext('webgl2').getExtension('WEBGL_lose_context'); lost.loseContext()")
        time.sleep(0.5)
        drawn = browser.run("voxlathe.drawn")
        self.check(f"lost context: drawn by {drawn}", drawn == "still")
        self.check("lost context: turned", browser.run(turn) == "soft" and browser.run(is_drawn) > 0.02)
        browser.run("lost.restoreContext()")
        time.sleep(1.5)
        self.check("restored context", browser.run("voxlathe.drawn") == "webgl")
        browser.run("voxlathe.setState({ azimuth: voxlathe.model.view.azimuth })")
        self.silhouette("restored context", os.path.join(scenes, "goblet.toml"), 800)
        self.quiet("lost context")

        # A stack has no still picture; its longest side has more voxels than the texture may have.
        stack = os.path.join(self.folder, "long")
        goblet = os.path.join(scenes, "goblet.toml")
        self.command("voxelize", goblet, "-o", stack, "--resolution", 300, "--force", "--channels", "sdf")
        long, told = self.view("long", stack)
        limit = (
            "const own = WebGL2RenderingContext.prototype.getParameter, image = WebGL2RenderingContext.prototype.texImage3D;"
            "WebGL2RenderingContext.prototype.getParameter = function (name) { return name === this.MAX_3D_TEXTURE_SIZE ? 256 : own.call(this, name); };"
            "WebGL2RenderingContext.prototype.texImage3D = function (...a) { if (Math.max(a[3], a[4], a[5]) > 256) throw new Error('too large'); return image.apply(this, a); };"
        )
        browser.open(long, before=limit)
        self.quiet("textures up to 256")
        self.check("textures up to 256: drawn", browser.run("voxlathe.drawn") == "webgl")
        self.check("textures up to 256: said", "256" in browser.run("document.getElementById('status').textContent"))
        self.check("stack: values", browser.run("voxlathe.voxel(3, 4, 5).values.sdf") is not None)
        self.silhouette("textures up to 256", None, 800, against=browser.run("document.getElementById('solid').toDataURL().split(',')[1]"))
        mine = browser.run("document.getElementById('solid').toDataURL().split(',')[1]")
        browser.open(long)
        self.silhouette("a stack, with and without the limit", None, 800, against=mine)
        browser.open(long, before=without)
        self.quiet("a stack without WebGL 2")
        self.check("a stack without WebGL 2: drawn", browser.run("voxlathe.drawn") == "soft" and browser.run(is_drawn) > 0.02)

    def layout(self, name, page, width, height, touch=False):
        """Nothing beyond the window, nothing on top of another."""
        browser = self.browser
        browser.size(width, height, touch)
        browser.open(page)
        self.quiet(f"{name} at {width}")
        found = browser.run(
            "(() => { const boxes = [...document.querySelectorAll('.card, .top, .keys')].filter((e) => e.offsetParent).map((e) => [e.id || e.className, e.getBoundingClientRect()]);"
            " const wrong = []; for (const [n, r] of boxes) if (r.left < 0 || r.right > innerWidth + 0.5) wrong.push(`${n} ${r.left} ${r.right}`);"
            " for (let i = 0; i < boxes.length; i++) for (let j = 0; j < i; j++) { const [a, b] = [boxes[i][1], boxes[j][1]];"
            "  if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1) wrong.push(boxes[i][0] + ' over ' + boxes[j][0]); }"
            " for (const e of document.querySelectorAll('h1, dd, td, label, output, button, figcaption')) if (e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflow === 'visible' && getComputedStyle(e).display !== 'inline') wrong.push('text of ' + e.tagName + ' ' + e.textContent.slice(0, 30));"
            " return { wrong, wide: document.documentElement.scrollWidth }; })()"
        )
        self.check(f"{name} at {width}: {found}", not found["wrong"] and found["wide"] <= width)

    def use(self, page):
        """Keys, pointers, sliders, the address, names for readers of screens."""
        browser = self.browser
        browser.size(1440, 900)
        browser.open(page)
        state = lambda: browser.run("voxlathe.state")
        first = state()
        for key, view in (("x", [0, 0]), ("y", [-90, 0]), ("z", [-90, 90])):
            browser.press(key)
            now = state()
            self.check(f"key {key}: {now}", [now["azimuth"], now["elevation"]] == view)
        browser.press("r")
        self.check("key r", state() == first)
        browser.run("document.getElementById('view').focus()")
        browser.press("ArrowRight")
        browser.press("+")
        now = state()
        self.check("arrows and +", now["azimuth"] == first["azimuth"] + 5 and now["zoom"] > 1)
        browser.press("r")
        x, y = browser.run("(() => { const r = document.getElementById('view').getBoundingClientRect(); return [Math.round(r.left + 300), Math.round(r.top + 200)]; })()")
        browser.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
        browser.mouse("mouseMoved", x + 40, y + 10, button="left", buttons=1)
        browser.mouse("mouseReleased", x + 40, y + 10, button="left", clickCount=1)
        now = state()
        self.check("dragged", now["azimuth"] < first["azimuth"] and now["elevation"] > first["elevation"])
        browser.mouse("mouseWheel", x, y, deltaX=0, deltaY=-200)
        self.check("wheel", state()["zoom"] > 1)
        browser.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        before = state()
        touch = lambda kind, *points: browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": p[0], "y": p[1], "id": n} for n, p in enumerate(points)])
        touch("touchStart", (x, y), (x + 60, y))
        touch("touchMove", (x - 40, y), (x + 100, y))
        touch("touchEnd")
        self.check("pinched", state()["zoom"] > 1.3 * before["zoom"])
        browser.call("Emulation.setTouchEmulationEnabled", enabled=False)
        set_ = (
            "((id, v) => { const e = document.getElementById(id); e.value = v; e.dispatchEvent(new Event('input', { bubbles: true })); })"
        )
        browser.run(f"{set_}('iso', 300); {set_}('cut-1', 500); {set_}('index-2', 7); document.getElementById('theme').click()")
        browser.run("(() => { const e = document.getElementById('colour'); e.value = 'channel'; e.dispatchEvent(new Event('change')); })()")
        time.sleep(0.6)
        now = state()
        self.check(f"sliders: {now}", now["iso"] < 0 and now["cut"][1] == 0.5 and now["at"][2] == 7 and now["theme"] == "dark")
        address = browser.run("location.hash")
        browser.open(page, address)
        again = browser.run("voxlathe.state")
        near = lambda a, b: a == b or (isinstance(a, (int, float)) and abs(a - b) <= 1e-4 * max(1, abs(b)))
        same = all(all(map(near, again[k], now[k])) if isinstance(now[k], list) else near(again[k], now[k]) for k in now)
        self.check(f"address {address}: {again}, not {now}", same and len(address) > 10)
        browser.open(page, "#zoom=nan&at=9e9,x,-1&view=1e999,&cut=,,&channel=%3Cb%3E&theme=none&=&%%%&iso=-Infinity")
        strange = browser.run("voxlathe.state")
        self.check(f"a strange address: {strange}", strange["zoom"] == 1 and strange["channel"] == first["channel"])
        self.quiet("use")
        nameless = browser.run(
            "[...document.querySelectorAll('input, select, button, canvas[role], [role=application], section, output')]"
            ".filter((e) => !(e.ariaLabel || (e.labels && e.labels.length) || e.textContent.trim() || e.title || e.htmlFor?.length)).map((e) => e.outerHTML.slice(0, 80))"
        )
        self.check(f"without a name: {nameless}", not nameless)
        self.check("nothing is loaded", browser.run("performance.getEntriesByType('resource').filter((e) => !e.name.startsWith('data:')).length") == 0)

    def names(self):
        """Names that look like markup are text."""
        odd = "</script><script>window.hacked=1</script><img src=x onerror=\"window.hacked=2\">' & \u00c4\u00d6\u6728 <!--"
        scene = os.path.join(self.folder, "odd.json")
        solids = [{"kind": "sphere", "radius": 1, "name": odd}, {"kind": "box", "size": [1, 1, 3], "name": "<b>", "material": 2}]
        with open(scene, "w", encoding="utf-8") as file:
            json.dump({"schema": 1, "name": odd, "grid": {"resolution": 10}, "materials": {"1": odd, "2": "\u202ex"}, "solid": solids}, file)
        page, _ = self.view("odd", scene)
        browser = self.browser
        for width in (1440, 390):
            self.layout("markup", page, width, 800)
        found = browser.run(
            "({ title: document.querySelector('h1').textContent, hacked: window.hacked, images: document.images.length, bold: document.querySelectorAll('b:not(.x):not(.y):not(.z)').length,"
            " legend: document.getElementById('legend').textContent, ready: voxlathe.isReady })"
        )
        right = found["title"] == odd and "hacked" not in found and found["images"] == 1 and found["bold"] == 0 and odd in found["legend"]
        self.check(f"markup: {found}", right and found["ready"])

    def reports(self, scenes):
        """The reports of validate and converge."""
        report, study = os.path.join(self.folder, "report.html"), os.path.join(self.folder, "study")
        scene = os.path.join(scenes, "torus.toml")
        self.command("validate", scene, "--resolution", 16, "-o", report)
        self.command("converge", scene, "--resolutions", "8,12,16", "-o", study, "--force")
        for name, page in (("validate", report), ("converge", os.path.join(study, "converge.html"))):
            for width, is_dark in ((390, False), (1440, True)):
                self.browser.size(width, 800)
                self.browser.dark(is_dark)
                self.browser.open(page, ready=False)
                wide = self.browser.run("document.documentElement.scrollWidth")
                self.check(f"{name} at {width}: {wide}", wide <= width)
                self.quiet(name)
        self.browser.dark(False)


def main(program, *scenes):
    browser_program = chrome()
    if not browser_program:
        print("skipped: no browser; name one as CHROME")
        return 0
    folder = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "scenes")
    every = list(scenes) or sorted(glob.glob(os.path.join(folder, "*.toml")))
    with tempfile.TemporaryDirectory(prefix="voxlathe-pages-") as place:
        browser = Browser(browser_program)
        checks = Checks(os.path.abspath(program), browser, place)
        try:
            with concurrent.futures.ThreadPoolExecutor(2) as ahead:
                made = [ahead.submit(checks.made, path, "--resolution", RESOLUTION) for path in every]
                for path, one in zip(every, made):
                    checks.scene(path, one.result())
            page = checks.goblet(folder)
            checks.thin_walls(folder)
            checks.large(folder)
            checks.fallbacks(page, folder)
            for width, height, touch in ((1440, 900, False), (820, 1100, True), (390, 844, True)):
                checks.layout("goblet", page, width, height, touch)
            checks.use(page)
            checks.names()
            checks.reports(folder)
        finally:
            browser.close()
    print(f"{checks.passed} passed, {len(checks.wrong)} failed")
    return 1 if checks.wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
