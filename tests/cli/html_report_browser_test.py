"""Reports in HTML, seen by a headless Chromium that reaches no network."""

import json
import unittest

from chromium import PROGRAM, Chromium
from programs import CliTest, main
from test_main import needs_peers

WIDTH, HEIGHT = 1280, 1000

# The next frames, after which the drawing shows what was asked for.
NEXT_FRAMES = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => r(true))))"
DRAWN = """new Promise((resolve) => {
  const look = () => page && page.viewer.frames > 0 ? resolve(true) : requestAnimationFrame(look);
  look();
})"""
# Positions of the window at which a few of the shown elements are seen: [[x, y, id], …].
PLACES = """(() => {
  const box = byId("canvas").getBoundingClientRect(), found = [];
  for (const element of page.ranks[page.state].slice(0, Number(byId("count").value))) {
    const [x, y] = page.camera.project(page.report.centre(element, page.state), page.viewer.aspect);
    if (page.viewer.pick(x, y)?.item !== element.index) continue;
    if (found.length === 8) break;
    found.push([box.left + x * box.width, box.top + y * box.height, String(element.id)]);
  }
  return found;
})()"""
CHOSEN = "byId('chosen').textContent"


@needs_peers
@unittest.skipUnless(PROGRAM, "not installed: chromium")
class HtmlReportInBrowser(CliTest):
    def setUp(self):
        super().setUp()
        self.browser = Chromium(width=WIDTH, height=HEIGHT)
        self.addCleanup(self.browser.__exit__)

    def open(self, *arguments):
        report = self.path("report.html")
        self.run_cli(*arguments, "--html", report)
        self.browser.open(report)
        self.browser.evaluate(DRAWN)
        self.browser.evaluate("byId('canvas').scrollIntoView()")
        return report

    def smooth(self, name, **mesh):
        return self.open("smooth", self.generate(name, **mesh), "-o", self.path("out.vtu"))

    def picture(self):
        self.browser.evaluate(NEXT_FRAMES)
        return self.browser.screenshot()

    def middle(self):
        box = json.loads(self.browser.evaluate(
            "JSON.stringify(byId('canvas').getBoundingClientRect())"))
        return box["left"] + box["width"] / 2, box["top"] + box["height"] / 2

    def colours(self):
        """How many colours the drawing has."""
        return self.browser.evaluate("""(() => {
          page.viewer.draw();
          const {gl, canvas} = page.viewer, bytes = new Uint8Array(4 * canvas.width * canvas.height);
          gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
          return new Set(new Uint32Array(bytes.buffer)).size;
        })()""")

    def check_quiet(self, report):
        self.assertEqual(self.browser.messages, [])
        self.assertEqual(self.browser.requests, [f"file://{report}"])

    def test_draws_turns_and_tells_ids(self):
        report = self.smooth("in.vtu", nodes=3000, tangle=0.1)
        pictures = [self.picture()]
        self.assertGreater(self.colours(), 50)
        x, y = self.middle()

        def shows_something_else(what):
            pictures.append(self.picture())
            self.assertNotEqual(pictures[-1], pictures[-2], what)

        self.browser.drag(x, y, x + 120, y + 40)
        shows_something_else("dragging")
        self.assertIn("No element", self.browser.evaluate(CHOSEN))
        self.browser.mouse("mouseWheel", x, y, deltaX=0, deltaY=-300)
        shows_something_else("the wheel")
        self.browser.evaluate("byId('canvas').focus()")
        for key in ("ArrowLeft", "+", "Home"):
            self.browser.key(key)
            shows_something_else(key)
        for change in ("document.querySelector('input[value=before]').click()",
                       "byId('by-quality').click()", "byId('edges').click()",
                       "byId('axis').value = '0', byId('axis').dispatchEvent(new Event('input'))",
                       "byId('cut').value = 300, byId('cut').dispatchEvent(new Event('input'))",
                       "byId('flip').click()",
                       "byId('opacity').value = 60, byId('opacity').dispatchEvent(new Event('input'))",
                       "byId('count').value = 5, byId('count').dispatchEvent(new Event('input'))"):
            self.browser.evaluate(change)
            shows_something_else(change)
        self.check_quiet(report)

    def test_a_click_tells_the_element_of_the_file(self):
        report = self.smooth("in.vtu", nodes=1000)
        self.browser.evaluate(NEXT_FRAMES)
        places = self.browser.evaluate(PLACES)
        self.assertEqual(len(places), 8)
        for x, y, element in places:
            self.browser.click(x, y)
            self.assertIn(f"Element {element}Type", self.browser.evaluate(CHOSEN))
        with self.subTest("the worst, after it was chosen from the table"):
            worst = json.loads(self.run_cli("quality", self.path("out.vtu"), "--json").stdout)["worst_elements"]
            self.browser.evaluate("document.querySelector('button[data-element]').click()")
            self.browser.evaluate(NEXT_FRAMES)
            self.browser.click(*self.middle())
            chosen = self.browser.evaluate(CHOSEN)
            self.assertIn(f"Element {worst[0]['element']}Type", chosen)
            self.assertIn(f"{worst[0]['mean_ratio']:.4f}", chosen)
        self.check_quiet(report)

    def test_marks_locked_and_limited_elements(self):
        report = self.open("smooth", self.generate("in.vtu", nodes=500), "-o", self.path("out.vtu"),
                           "--report-below", "0.75")
        for mark in ("locked", "limited"):
            self.assertFalse(self.browser.evaluate(f"byId('{mark}-legend').hidden"))
        marked = self.picture()
        self.browser.evaluate("page.report.elements.forEach((e) => { e.limited = false; }), page.setElements()")
        self.assertNotEqual(self.picture(), marked)
        self.browser.evaluate(
            "page.show(page.report.elements.find((e) => { e.limited = !e.locked; return e.limited; }))")
        self.assertIn("limited by connectivity", self.browser.evaluate(CHOSEN))
        self.check_quiet(report)

    def test_a_click_on_a_surface_tells_its_elements(self):
        report = self.open("quality", self.generate("in.vtu", shape="square", nodes=300))
        self.browser.click(*self.middle())
        self.assertRegex(self.browser.evaluate(CHOSEN), r"^Element \d+")
        self.check_quiet(report)

    def test_follows_the_colour_scheme(self):
        report = self.smooth("in.vtu", nodes=500)
        light = self.picture()
        self.browser.dark()
        self.assertNotEqual(self.picture(), light)
        self.check_quiet(report)

    def test_draws_every_kind_of_mesh(self):
        for shape in ("mixed --nodes 500", "square --nodes 500", "layer --elements wedge"):
            with self.subTest(shape=shape):
                self.run_cli("generate", *shape.split(), "-o", self.path("in.vtu"))
                self.open("smooth", self.path("in.vtu"), "-o", self.path("out.vtu"))
                self.assertGreater(self.colours(), 20)
        self.assertEqual(self.browser.messages, [])

    def test_draws_the_cube_of_the_paper(self):
        report = self.open("quality", self.generate("in.vtu", nodes=100000))
        self.assertGreater(self.colours(), 50)
        self.check_quiet(report)

    def test_prints(self):
        self.smooth("in.vtu", nodes=500)
        self.assertTrue(self.browser.call("Page.printToPDF")["data"].startswith("JVBERi"))  # %PDF


@needs_peers
@unittest.skipUnless(PROGRAM, "not installed: chromium")
class WithoutWebGl(CliTest):
    def test_tables_and_histograms_remain(self):
        report = self.path("report.html")
        self.run_cli("quality", self.generate("in.vtu", nodes=300), "--html", report)
        with Chromium("--disable-3d-apis") as browser:
            browser.open(report)
            self.assertEqual(browser.evaluate("page"), None)
            self.assertTrue(browser.evaluate("byId('view').hidden && !byId('no-view').hidden"))
            self.assertGreater(browser.evaluate("document.querySelectorAll('rect').length"), 20)
            self.assertEqual(browser.messages, [])


if __name__ == "__main__":
    main()
