"""What Chromium makes of a page, as JSON: console, requests, the accessible tree, where things stand, the DOM.

browser.py PAGE [--size WxH] [--dark] [--media print] [--no-script] [--press SELECTOR…] [--boxes SELECTOR…]
           [--picture FILE.png]
browser.py -: the same for each line, which is a JSON list of such words, with one browser until the last line.

Speaks Chrome's DevTools protocol through a pipe, so that no port is opened.
"""

import argparse
import base64
import fcntl
import json
import os
import pathlib
import subprocess
import sys
import tempfile


class Browser:
    def __init__(self, home):
        self.events = []
        self.number = 0
        self.tab = None
        self.rest = b""
        read_here, write_there = os.pipe()
        read_there, self.commands = os.pipe()
        self.answers = read_here

        # Chromium reads from 3 and writes to 4, either of which may be taken here.
        ends = [fcntl.fcntl(fd, fcntl.F_DUPFD, 10) for fd in (read_there, write_there)]
        self.process = subprocess.Popen(
            [
                "bash",
                "-c",
                f'exec "$@" 3<&{ends[0]} 4>&{ends[1]}',
                "bash",
                "chromium",
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--in-process-gpu",
                "--hide-scrollbars",
                "--remote-debugging-pipe",
                f"--user-data-dir={home}/profile",
            ],
            env={**os.environ, "HOME": home},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=ends,
        )
        for end in (read_there, write_there, *ends):
            os.close(end)

    def receive(self):
        while b"\0" not in self.rest:
            chunk = os.read(self.answers, 1 << 20)
            if not chunk:
                raise SystemExit("Chromium ended early")
            self.rest += chunk
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def ask(self, method, session=None, **words):
        self.number += 1
        message = {"id": self.number, "method": method, "params": words}
        if session:
            message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.commands, data) :]
        while True:
            answer = self.receive()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise SystemExit(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def session(self):
        """Of the one tab, which shows all pages: a process for each takes longer than to show it."""
        if self.tab is None:
            target = self.ask("Target.createTarget", url="about:blank")["targetId"]
            self.tab = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        return self.tab

    def wait(self, method):
        while not any(event.get("method") == method for event in self.events):
            self.events.append(self.receive())


def look(browser, words):
    browser.events.clear()
    session = browser.session()

    def ask(method, **parameters):
        return browser.ask(method, session, **parameters)

    width, height = (int(side) for side in words.size.split("x"))
    ask(
        "Emulation.setDeviceMetricsOverride",
        width=width,
        height=height,
        deviceScaleFactor=1,
        mobile=False,
    )
    scheme = {"name": "prefers-color-scheme", "value": "dark" if words.dark else "light"}
    ask("Emulation.setEmulatedMedia", media=words.media, features=[scheme])
    ask("Emulation.setScriptExecutionDisabled", value=words.no_script)
    for domain in ("Page", "Runtime", "Log", "Network", "DOM", "Accessibility"):
        ask(f"{domain}.enable")
    ask("Page.navigate", url=pathlib.Path(words.page).resolve().as_uri())
    browser.wait("Page.loadEventFired")

    for selector in words.press:
        ask(
            "Runtime.evaluate",
            expression=f"document.querySelector({json.dumps(selector)}).click()",
        )

    root = ask("DOM.getDocument")["root"]["nodeId"]

    def boxes(selector):
        found = []
        for node in ask("DOM.querySelectorAll", nodeId=root, selector=selector)["nodeIds"]:
            quads = ask("DOM.getContentQuads", nodeId=node)["quads"]
            found += [[min(q[::2]), min(q[1::2]), max(q[::2]), max(q[1::2])] for q in quads]
        return found

    tree = ask("Accessibility.getFullAXTree")["nodes"]
    text = {"value": ""}
    tree = [
        [node.get("role", text)["value"], node.get("name", text)["value"]]
        for node in tree
        if not node["ignored"]
    ]
    told = {
        "tree": tree,
        "boxes": {selector: boxes(selector) for selector in words.boxes},
        "size": ask("Page.getLayoutMetrics")["cssContentSize"],
        "dom": ask("DOM.getOuterHTML", nodeId=root)["outerHTML"],
    }
    if words.picture:
        picture = ask("Page.captureScreenshot", format="png")["data"]
        pathlib.Path(words.picture).write_bytes(base64.b64decode(picture))
    own = [event for event in browser.events if event.get("sessionId") == session]
    told["console"] = [
        event["params"]
        for event in own
        if event.get("method")
        in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
    ]
    told["requests"] = [
        event["params"]["request"]["url"]
        for event in own
        if event.get("method") == "Network.requestWillBeSent"
    ]
    return told


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("page")
    parser.add_argument("--size", default="1400x1000")
    parser.add_argument("--dark", action="store_true")
    parser.add_argument("--media", default="")
    parser.add_argument("--no-script", action="store_true")
    parser.add_argument("--boxes", nargs="*", default=[])
    parser.add_argument("--press", nargs="*", default=[])
    parser.add_argument("--picture")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        browser = Browser(home)
        try:
            lines = map(json.loads, sys.stdin) if sys.argv[1:] == ["-"] else [sys.argv[1:]]
            for words in lines:
                print(json.dumps(look(browser, parser.parse_args(words))), flush=True)
            browser.ask("Browser.close")
            browser.process.wait(timeout=20)
        finally:
            browser.process.kill()


main()
