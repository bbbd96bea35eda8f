#!/usr/bin/env python3
"""The gateway's page in a headless Chromium: from the file to its result, by mouse and by keyboard."""

import json
import os
import unittest
from pathlib import Path

from chromium import PROGRAM, Chromium
from gateway_program import GatewayTest, main
from test_main import needs_peers

ENTER = {"windowsVirtualKeyCode": 13, "text": "\r"}
TAB = {"windowsVirtualKeyCode": 9}
DROP = """((name, text) => {
  const dropped = new DataTransfer();
  dropped.items.add(new File([text], name));
  for (const type of ["dragover", "drop"])
    $("drop").dispatchEvent(new DragEvent(type, {dataTransfer: dropped, cancelable: true, bubbles: true}));
  return $("mesh").files[0].name;
})"""
ENDED = """new Promise((resolve) => {
  const look = () => !$("start").disabled && ($("result-section").hidden ? $("state").className.includes("bad") : true)
    ? resolve($("result-section").hidden ? $("state").textContent : "") : setTimeout(look, 20);
  look();
})"""
# What the page shows, and the files that it offers, whose addresses its policy lets it not read.
WATCH = """(() => {
  window.shown = [], window.files = {};
  const make = URL.createObjectURL;
  URL.createObjectURL = (file) => {
    const address = make(file);
    files[address] = file;
    return address;
  };
  new MutationObserver(() => shown.push($("state").textContent)).observe($("state"), {childList: true});
})()"""


@needs_peers
@unittest.skipUnless(PROGRAM, "not installed: chromium")
class Page(GatewayTest):
    def setUp(self):
        super().setUp()
        self.browser = Chromium("--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1")
        self.addCleanup(self.browser.__exit__)
        self.browser.visit(f"http://127.0.0.1:{self.gateway.port}/")
        self.browser.evaluate(WATCH)
        self.data = self.mesh("part.mesh", nodes=3000).decode()

    def drop(self, name, text):
        self.assertEqual(self.browser.evaluate(f"{DROP}({json.dumps(name)}, {json.dumps(text)})"), name)

    def check_result(self, name, *arguments):
        self.assertEqual(self.browser.evaluate(ENDED), "")
        expected = self.path("expected" + Path(name).suffix)
        self.run_cli("smooth", self.path("part.mesh"), "-o", expected, "--server", self.server.address, *arguments)
        self.assertEqual(self.browser.evaluate("$('download').download"), name)
        text = self.browser.evaluate("files[$('download').href].text()")
        self.assertEqual(text, Path(expected).read_text())
        summary = json.loads(self.browser.evaluate("files[$('summary').href].text()"))
        self.assertTrue(summary["convergence"])
        self.assertIn("<canvas", self.browser.evaluate("$('report').srcdoc"))
        self.assertEqual(self.browser.evaluate("document.activeElement.id"), "download")

    def check_quiet(self):
        self.assertEqual(self.browser.messages, [])
        self.assertEqual([url for url in self.browser.requests
                          if not url.startswith((f"http://127.0.0.1:{self.gateway.port}/", "blob:", "about:"))], [])
        self.check_nothing_left()

    def picture(self, name):
        """For eyes, where somebody asks for it."""
        if folder := os.environ.get("MESHSMOOTH_PICTURES"):
            Path(folder, name).write_bytes(self.browser.screenshot(whole_page=True))

    def test_a_dropped_file_is_smoothed_shown_and_downloaded(self):
        self.picture("page.png")
        self.drop("part.mesh", self.data)
        self.browser.evaluate("$('goal').value = 'worst', $('to').value = 'inp'")
        self.browser.evaluate("$('start').click()")
        self.check_result("part-smooth.inp", "--goal", "worst")
        self.assertTrue(self.browser.evaluate("shown.some((text) => text.includes('iteration'))"),
                        self.browser.evaluate("shown"))
        self.picture("page-result.png")
        self.check_quiet()

    def test_the_keyboard_suffices(self):
        root = self.browser.call("DOM.getDocument")["root"]["nodeId"]
        field = self.browser.call("DOM.querySelector", nodeId=root, selector="#mesh")["nodeId"]
        self.browser.call("DOM.setFileInputFiles", files=[self.path("part.mesh")], nodeId=field)
        self.browser.evaluate("$('mesh').focus()")
        reached = []
        while "start" not in reached:
            self.browser.key("Tab", **TAB)
            reached.append(self.browser.evaluate("document.activeElement.id"))
            self.assertLess(len(reached), 20, reached)
        self.assertEqual(reached, ["goal", "boundary", "tangled", "to", "token", "start"])
        self.browser.key("Enter", **ENTER)
        self.check_result("part-smooth.mesh")
        self.check_quiet()

    def test_a_refusal_is_shown_and_another_try_works(self):
        self.drop("part.mesh", self.data[:500])
        self.browser.evaluate("$('start').click()")
        self.assertRegex(self.browser.evaluate(ENDED), r"mesh\.mesh: .*\([A-Z_]+\)")
        self.picture("page-problem.png")
        self.drop("part.mesh", self.data)
        self.browser.evaluate("$('start').click()")
        self.check_result("part-smooth.mesh")
        self.check_quiet()

    def test_a_job_is_cancelled(self):
        self.drop("part.mesh", self.mesh("long.mesh", nodes=60000).decode())
        self.browser.evaluate("$('goal').value = 'worst'")
        self.browser.evaluate("$('start').click()")
        self.browser.evaluate("""new Promise((resolve) => {
          const look = () => shown.some((text) => text.includes("iteration")) ? resolve(true) : setTimeout(look, 20);
          look();
        })""")
        self.browser.evaluate("$('cancel').click()")
        self.assertIn("cancelled", self.browser.evaluate(ENDED).lower())
        self.check_quiet()


if __name__ == "__main__":
    main()
