#!/usr/bin/env python3
"""browser.py CHROMIUM PAGE FOLDER: opens a report in a headless Chromium and uses it as a reader would.

Speaks the DevTools protocol over a pipe: no port, no network. Prints one JSON object of what it saw; screenshots
go into FOLDER. Python's standard library only.
"""
import base64
import hashlib
import json
import os
import select
import subprocess
import sys
import tempfile
import time

LIMIT = 60  # s for one answer: a software renderer on a busy machine is slow


class Browser:
    def __init__(self, program, profile):
        # the browser reads commands from its descriptor 3 and answers on 4
        command_read, self.command = os.pipe()
        self.answers, answer_write = os.pipe()

        def wire():
            os.dup2(command_read, 103)
            os.dup2(answer_write, 104)
            os.dup2(103, 3)
            os.dup2(104, 4)

        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--user-data-dir=" + profile,
             "--no-first-run", "--disable-gpu-sandbox", "--enable-unsafe-swiftshader", "--use-gl=angle",
             "--use-angle=swiftshader", "--hide-scrollbars", "--window-size=1200,900", "--disable-dev-shm-usage",
             "--disable-background-networking", "--disable-component-update", "--disable-sync", "about:blank"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, close_fds=False,
            preexec_fn=wire)
        os.close(command_read)
        os.close(answer_write)
        self.buffer, self.next, self.session = b"", 0, None
        self.events = []

    def message(self, until):
        while b"\0" not in self.buffer:
            left = until - time.monotonic()
            if left <= 0 or not select.select([self.answers], [], [], left)[0]:
                return None
            more = os.read(self.answers, 1 << 20)
            if not more:
                raise RuntimeError("the browser ended")
            self.buffer += more
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, **parameters):
        self.next += 1
        request = {"id": self.next, "method": method, "params": parameters}
        if self.session:
            request["sessionId"] = self.session
        os.write(self.command, json.dumps(request).encode() + b"\0")
        until = time.monotonic() + LIMIT
        while True:
            answer = self.message(until)
            if answer is None:
                raise RuntimeError(method + ": no answer")
            if answer.get("id") == self.next:
                if "error" in answer:
                    raise RuntimeError(method + ": " + answer["error"]["message"])
                return answer["result"]
            self.events.append(answer)

    def open(self, address):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Network", "Runtime", "Log", "Page"):
            self.call(domain + ".enable")
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete'")

    def run(self, text):
        result = self.call("Runtime.evaluate", expression=text, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(text + ": " + json.dumps(result["exceptionDetails"]))
        return result["result"].get("value")

    def wait(self, condition):
        until = time.monotonic() + LIMIT
        while not self.run(condition):
            if time.monotonic() > until:
                raise RuntimeError("did not come: " + condition)
            time.sleep(0.05)

    def key(self, name):
        text = {"Enter": {"text": "\r", "windowsVirtualKeyCode": 13}, "Tab": {"windowsVirtualKeyCode": 9}}.get(name, {})
        self.call("Input.dispatchKeyEvent", type="keyDown", key=name, code=name, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=name, code=name)

    def shot(self, path):
        data = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=False)["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

    def pixels(self):
        """A fingerprint of each robot's canvas after the next frame."""
        texts = self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done("
                         "[...document.querySelectorAll('canvas')].map((each) => each.toDataURL())))))")
        return [hashlib.sha256(text.encode()).hexdigest() for text in texts]

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
            self.process.wait(timeout=10)
        except Exception:
            self.process.kill()
            self.process.wait()


SET = "(() => { const input = document.getElementById('%s'); input.%s = %s; input.dispatchEvent(new Event('%s')); })()"


# What the first view's scene holds: a name, and the box around it in the scene's own coordinates, m.
WORLD = """(() => {
  const list = [];
  limax.views[0].world.traverse((thing) => {
    if (!thing.isMesh || thing.name === "robot") return;
    thing.geometry.computeBoundingBox();
    const box = thing.geometry.boundingBox.clone().translate(thing.position);
    list.push({ name: thing.name, low: box.min.toArray(), high: box.max.toArray() });
  });
  return list;
})()"""

# Wind and current in the first view: name, direction, and how high above the scene's middle, m.
FLOWS = """limax.views[0].flows.children.map((arrow) => ({ name: arrow.name, height: arrow.position.z,
  way: new THREE.Vector3(0, 1, 0).applyQuaternion(arrow.quaternion).toArray() }))"""

# Centre of the block, which has the last six faces of the robot's mesh, and the up of the world as it is shown.
BLOCK = """(() => {
  const shape = limax.views[0].shape.slice(-72);
  return [0, 1, 2].map((c) => shape.filter((_, k) => k % 3 === c).reduce((a, b) => a + b) / 24);
})()"""
UP = "new THREE.Vector3(0, 0, 1).applyQuaternion(limax.views[0].tilt.quaternion).toArray()"


def robots(browser, folder, seen):
    browser.wait("document.querySelector('.robots').dataset.ready")
    if browser.run("document.querySelector('.robots').dataset.ready") != "yes":
        raise RuntimeError(browser.run("document.querySelector('.robots').textContent"))
    browser.run("document.getElementById('robots').scrollIntoView()")
    still = browser.pixels()
    seen["views"] = len(still)
    seen["world"] = browser.run(WORLD)
    seen["flows"], seen["key"] = browser.run(FLOWS), browser.run("document.getElementById('key').textContent")
    browser.shot(folder + "/robots.png")
    seen["up"], seen["block"] = browser.run(UP), [browser.run(BLOCK)]
    seen["still"] = browser.pixels() == still
    # play and pause by keyboard
    browser.run("document.getElementById('play').focus()")
    browser.key("Enter")
    browser.wait("Number(document.getElementById('time').value) > 0.2")
    browser.key("Enter")
    moved = browser.pixels()
    seen["moved"] = [a != b for a, b in zip(still, moved)]
    seen["paused"] = browser.pixels() == moved
    browser.run(SET % ("time", "value", "0", "input"))
    seen["scrubbed_back"] = browser.pixels() == still
    browser.run(SET % ("time", "value", "1e9", "input"))
    end = browser.pixels()
    seen["block"].append(browser.run(BLOCK))
    seen["scrubbed_to_end"] = [a != b for a, b in zip(still, end)]
    seen["clock"] = browser.run("document.getElementById('clock').textContent")
    for mode in ("strain", "phase"):
        browser.run(SET % ("colours", "value", "'%s'" % mode, "change"))
        seen[mode] = [a != b for a, b in zip(end, browser.pixels())]
        browser.shot(folder + "/%s.png" % mode)
    before = browser.pixels()
    browser.run("document.querySelector('canvas').focus()")
    browser.key("ArrowLeft")
    seen["turned_by_key"] = browser.pixels()[0] != before[0]
    before = browser.pixels()
    for name in ("ground", "trail"):
        browser.run(SET % (name, "checked", "false", "change"))
        after = browser.pixels()
        seen["without_" + name] = [a != b for a, b in zip(before, after)]
        before = after


def charts(browser, seen):
    seen["charts"] = browser.run(
        "[...document.querySelectorAll('figure.chart:not(.key)')].map((figure) => ({ data:"
        " JSON.parse(figure.querySelector('script').textContent), drawn:"
        " [...figure.querySelectorAll('polyline')].map((line) => line.points.numberOfItems) }))")
    browser.run("document.querySelector('figure.chart .scroll').focus()")
    browser.key("End")
    seen["read_out"] = browser.run("document.querySelector('figure.chart output').textContent")


# What has the focus: its element, and whether a line around it shows that.
FOCUS = """(() => {
  const at = document.activeElement;
  const style = getComputedStyle(at);
  const box = at.getBoundingClientRect();
  return { name: at.id || at.className || at.tagName.toLowerCase(), seen: box.width > 0 && box.right > 0,
    outlined: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1 };
})()"""


def keyboard(browser, seen):
    """Walks through the page with Tab; each element with focus needs an accessible name."""
    # from the top: Tab continues from the last focus
    browser.run("document.body.tabIndex = -1; document.body.focus(); document.body.removeAttribute('tabindex')")
    seen["focus"] = []
    for _ in range(200):
        browser.key("Tab")
        at = browser.run(FOCUS)
        if at["name"] == "body":
            break  # once around
        seen["focus"].append(at)
    unnamed = []
    for node in browser.call("Accessibility.getFullAXTree")["nodes"]:
        focusable = any(each["name"] == "focusable" and each["value"].get("value") for each in node.get("properties", []))
        if focusable and not node.get("name", {}).get("value") and node["role"]["value"] != "RootWebArea":
            unnamed.append(node["role"]["value"])
    seen["unnamed"] = unnamed


def without_scripts(browser, page, folder, seen):
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    browser.call("Page.navigate", url="file://" + page)
    browser.wait("document.readyState === 'complete'")
    seen["plain"] = browser.run(
        "({ robots: getComputedStyle(document.querySelector('.robots') || document.head).display,"
        " curves: [...document.querySelectorAll('figure.chart polyline')].filter((line) =>"
        " line.getBoundingClientRect().width > 0).length,"
        " strips: [...document.querySelectorAll('.figure-row svg')].filter((strip) =>"
        " strip.getBoundingClientRect().width > 0).length })")
    browser.shot(folder + "/plain.png")
    browser.call("Emulation.setScriptExecutionDisabled", value=False)


def main(program, page, folder):
    # a browser that has just ended may still hold a file or two
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        print(json.dumps(look(Browser(program, profile), page, folder)))


def look(browser, page, folder):
    seen = {}
    try:
        browser.open("file://" + page)
        seen["title"] = browser.run("document.title")
        charts(browser, seen)
        if browser.run("document.querySelector('.robots') !== null"):
            robots(browser, folder, seen)
        browser.run("window.scrollTo(0, 0)")
        browser.shot(folder + "/top.png")
        browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        browser.shot(folder + "/dark.png")
        browser.call("Emulation.setDeviceMetricsOverride", width=320, height=740, deviceScaleFactor=1, mobile=True)
        # a page that is too wide widens the window that it reports
        seen["overflow"] = browser.run("document.documentElement.scrollWidth - 320")
        browser.shot(folder + "/narrow.png")
        browser.call("Emulation.clearDeviceMetricsOverride")
        keyboard(browser, seen)
        seen["images"] = browser.run("document.images.length")
        seen["alerted"] = browser.run("window.alerted === true")
        without_scripts(browser, page, folder, seen)
        events = browser.events
        seen["requests"] = [event["params"]["request"]["url"] for event in events
                            if event.get("method") == "Network.requestWillBeSent"]
        seen["problems"] = [json.dumps(event["params"]) for event in events
                            if event.get("method") in ("Runtime.exceptionThrown",)
                            or event.get("method") == "Log.entryAdded"
                            and event["params"]["entry"]["level"] == "error"
                            or event.get("method") == "Runtime.consoleAPICalled"
                            and event["params"]["type"] == "error"]
    finally:
        browser.close()
    return seen


main(*sys.argv[1:])
