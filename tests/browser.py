"""A real browser for tests: headless Chromium by chromedriver's WebDriver protocol, with the standard library alone."""
import json
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request

FLAGS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--window-size=1280,900", "--hide-scrollbars", "--disable-dev-shm-usage"]


def there():
    return shutil.which("chromium") and shutil.which("chromedriver")


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def element(found):
    """One of elements(), as an argument of a script."""
    return {"element-6066-11e4-a52e-4f735466cecf": found}


class Browser:
    def __init__(self):
        self.base = "http://127.0.0.1:%d" % free_port()
        self.driver = subprocess.Popen(["chromedriver", "--port=" + self.base.rsplit(":", 1)[1]],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wanted = {"goog:chromeOptions": {"args": FLAGS}, "goog:loggingPrefs": {"browser": "ALL"}}
        self.session = "/session/" + self.begin({"capabilities": {"alwaysMatch": wanted}})["sessionId"]

    def begin(self, wanted):
        for _ in range(200):
            try:
                return self.call("POST", "/session", wanted)
            except urllib.error.URLError:
                time.sleep(0.05)  # the driver is not listening yet
        raise RuntimeError("chromedriver does not answer")

    def call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as problem:
            raise RuntimeError("%s: %s" % (path, problem.read().decode()[:600]))

    def open(self, path):
        self.call("POST", self.session + "/url", {"url": "file://" + path})

    def js(self, script, *args):
        return self.call("POST", self.session + "/execute/sync", {"script": script, "args": list(args)})

    def devtools(self, command, **params):
        return self.call("POST", self.session + "/goog/cdp/execute", {"cmd": command, "params": params})

    def wait(self, script, seconds=30):
        """Until the script says something true; that."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.js(script)
            if value:
                return value
            time.sleep(0.05)
        raise RuntimeError("waited in vain for " + script)

    def screen(self, width, height=900, dark=False):
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                      mobile=width < 600)
        self.devtools("Emulation.setEmulatedMedia",
                      features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def keys(self, *names):
        """Press keys, by their WebDriver code points, where the focus is."""
        actions = [{"type": kind, "value": key} for key in names for kind in ("keyDown", "keyUp")]
        self.call("POST", self.session + "/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def drag(self, selector, dx, dy):
        at = self.js("""const e = document.querySelector(arguments[0]); e.scrollIntoView({block: 'center'});
                        const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]""", selector)
        move = lambda x, y, ms: {"type": "pointerMove", "x": round(x), "y": round(y), "duration": ms}
        actions = [move(at[0], at[1], 0), {"type": "pointerDown", "button": 0}, move(at[0] + dx, at[1] + dy, 50),
                   {"type": "pointerUp", "button": 0}]
        self.call("POST", self.session + "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": actions}]})

    def elements(self, selector):
        found = self.call("POST", self.session + "/elements", {"using": "css selector", "value": selector})
        return [next(iter(e.values())) for e in found]

    def label(self, element):
        """The name that a screen reader says, as the browser computes it."""
        return self.call("GET", self.session + "/element/%s/computedlabel" % element)

    def complaints(self):
        """Errors and warnings of the console since the last time, but for the drawing by software."""
        log = self.call("POST", self.session + "/se/log", {"type": "browser"})
        return [l["message"] for l in log if l["level"] in ("SEVERE", "WARNING") and "GPU stall" not in l["message"]
                and "ReadPixels" not in l["message"]]

    def close(self):
        try:
            self.call("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait()
