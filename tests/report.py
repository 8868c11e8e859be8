#!/usr/bin/python3
"""The report of a capture, opened in a real browser: every control, names, contrast, keys, and the lit ball against
goniocam's own picture.

    tests/report.py GONIOCAM PROJECT
"""
import base64
import os
import subprocess
import sys
import tempfile

import browser
import cv2
import numpy as np

failed = 0


def check(what, good, more=""):
    global failed
    failed += not good
    print("%-66s %s" % (what, "ok" if good else "FAILED %s" % (more,)))


# ---- contrast of all text that is shown, by WCAG 2.1: [text, ratio, needed] of what falls short

CONTRAST = """
const parse = (c) => { const m = c.match(/[\\d.]+/g).map(Number); return m.length < 4 ? [...m.slice(0, 3), 1] : m; };
const over = (top, under) => [0, 1, 2].map((i) => top[i] * top[3] + under[i] * (1 - top[3]));
const light = (c) => { const v = c.map((x) => x / 255 <= .03928 ? x / 255 / 12.92 : ((x / 255 + .055) / 1.055) ** 2.4);
                       return .2126 * v[0] + .7152 * v[1] + .0722 * v[2]; };
function ground(e) {
  const layers = [];
  for (; e; e = e.parentElement) {
    const c = parse(getComputedStyle(e).backgroundColor);
    layers.push(c);
    if (c[3] === 1) break;
  }
  return layers.reverse().reduce((under, c) => over(c, under), [255, 255, 255]);
}
const poor = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const e = walker.currentNode.parentElement, style = getComputedStyle(e);
  if (!walker.currentNode.textContent.trim() || !e.getClientRects().length || e.closest('script, title, option')) continue;
  const svg = e instanceof SVGElement, color = parse(svg ? style.fill : style.color), size = parseFloat(style.fontSize);
  const big = size >= 24 || (size >= 18.66 && +style.fontWeight >= 700), need = big ? 3 : 4.5;
  const [a, b] = [light(over(color, ground(e))), light(ground(e))].sort((x, y) => y - x);
  if ((a + .05) / (b + .05) < need) poor.push([e.textContent.trim().slice(0, 40), ((a + .05) / (b + .05)).toFixed(2), need]);
}
return poor;
"""


def check_contrast(b):
    b.js("delete document.documentElement.dataset.theme")
    for dark in (False, True):
        b.screen(1280, dark=dark)
        poor = b.js(CONTRAST)
        check("contrast AA, %s" % ("dark" if dark else "light"), not poor, poor[:5])


def check_names(b):
    b.js("document.querySelectorAll('details').forEach((e) => { e.open = true; })")
    nameless = [e for e in b.elements("a, button, select, input, canvas, summary, main svg[role], [tabindex='0']")
                if b.js("return arguments[0].checkVisibility()", browser.element(e)) and not b.label(e).strip()]
    nameless = [b.js("return arguments[0].outerHTML.slice(0, 120)", browser.element(e)) for e in nameless]
    check("everything that can be used has a name", not nameless, nameless[:3])
    bad = b.js("return [...document.images].filter((i) => i.id !== 'large-picture' && !i.alt.trim()).length")
    check("pictures have text alternatives", bad == 0 and b.js("return document.images.length") > 6)
    check("one title, one h1, headings in order",
          b.js("""const h = [...document.querySelectorAll('h1, h2, h3')].map((e) => +e.tagName[1]);
                  return h[0] === 1 && h.filter((x) => x === 1).length === 1
                         && h.every((x, i) => !i || x <= h[i - 1] + 1) && document.title.length > 5"""))


def check_sizes(b):
    for width in (390, 768, 1280):
        b.screen(width)
        check("no sideways scrolling at %d" % width, b.js("return document.documentElement.scrollWidth") <= width)
    b.screen(1280)


# ---- the ball

def set_value(b, selector, value):
    """As a hand would: value, then events; waits until the ball is drawn again."""
    before = b.js("return document.getElementById('sphere').dataset.drawn")
    b.js("""const e = document.querySelector(arguments[0]);
            if (e.type === 'radio' || e.type === 'checkbox') e.click();
            else { e.value = arguments[1]; e.dispatchEvent(new Event('input', {bubbles: true})); }""", selector, value)
    if b.js("return Boolean(document.querySelector(arguments[0]).closest('#viewer-controls'))", selector):
        b.wait("return document.getElementById('sphere').dataset.drawn !== '%s'" % before)


def canvas(b):
    url = b.js("return document.getElementById('sphere').toDataURL('image/png')")
    return cv2.imdecode(np.frombuffer(base64.b64decode(url.split(",")[1]), np.uint8), cv2.IMREAD_UNCHANGED).astype(float)


def own_picture(goniocam, brdf, path):
    subprocess.check_call([goniocam, "plot", brdf, "--what", "sphere", "--fits", "0", "-o", path])
    return cv2.imread(path).astype(float)[20:620, 20:620]


def difference(shown, own):
    ball = shown[:, :, 3] > 0
    return np.abs(shown[:, :, :3] - own)[ball].mean(), ball.mean()


def check_ball(b, goniocam, out):
    set_value(b, "#split", "100")
    mean, part = difference(canvas(b), own_picture(goniocam, out, out + "/own.png"))
    check("the ball by the table is goniocam's picture: %.3f of 255" % mean, mean < 2 and abs(part - np.pi / 4) < 0.01)
    set_value(b, "#split", "0")
    mean, _ = difference(canvas(b), own_picture(goniocam, out + "/fits.yaml", out + "/own.png"))
    check("the ball by the best fit is goniocam's picture: %.3f of 255" % mean, mean < 2)
    fits = b.js("return document.getElementById('right').length")
    with open(out + "/fits.yaml") as file:
        check("every fit is offered", fits == 1 + sum(line.startswith("- name:") for line in file))
    seen = []
    for k in range(fits):
        set_value(b, "#right", str(k))
        seen.append(canvas(b))
    check("fits differ from each other", np.abs(seen[1] - seen[-1]).max() > 8)
    set_value(b, "#right", "1")


def check_viewer(b):
    before = canvas(b)
    for what, selector, value in (("exposure", "#exposure", "1"), ("ring", "input[name=shape][value='1']", None),
                                  ("studio", "input[name=light][value='1']", None)):
        set_value(b, selector, value)
        check("%s changes the picture" % what, np.abs(canvas(b) - before).mean() > 0.5)
        before = canvas(b)
    for drag in ("view", "lamp"):
        set_value(b, "input[name=drag][value=%s]" % drag, None)
        if drag == "lamp":
            set_value(b, "input[name=light][value='0']", None)
        before = canvas(b)
        drawn = b.js("return document.getElementById('sphere').dataset.drawn")
        b.drag("#sphere", 60, 30)
        b.wait("return document.getElementById('sphere').dataset.drawn !== '%s'" % drawn)
        check("dragging moves the %s" % drag, np.abs(canvas(b) - before).mean() > 0.2)
    before = b.js("return document.getElementById('lamp-note').textContent")
    b.js("document.getElementById('sphere').focus()")
    b.keys("\ue012", "\ue012", "\ue013")  # left, left, up
    check("arrow keys move the lamp", b.js("return document.getElementById('lamp-note').textContent") != before)
    b.js("document.getElementById('start-again').click()")
    check("reset", b.js("return document.getElementById('lamp-note').textContent") == "The lamp is 30\u00b0 off the view.")


# ---- the rest of the page

def check_plots(b):
    shown = lambda: b.js("return [...document.querySelectorAll('#lobes [data-theta]')].filter((e) => !e.hidden)"
                         ".map((e) => e.dataset.theta)")
    angles = b.js("return document.getElementById('theta').length")
    ok = angles >= 5
    for k in range(angles):
        set_value(b, "#theta", str(k))
        ok = ok and shown() == [str(k)]
    check("each angle shows its own lobes", ok)
    visible = """return [...document.querySelectorAll('#lobes .ch1 path, #lobes .fit1 path')]
                 .filter((e) => e.getClientRects().length).length"""
    counts = [b.js(visible)]
    for box in ("hide-1", "hide-fit1"):
        set_value(b, "input[data-hides=%s]" % box, None)
        counts.append(b.js(visible))
    check("channels and fits go and come", counts[1] < counts[0] and counts[2] > counts[1], counts)
    set_value(b, "input[data-hides=hide-1]", None)
    for selector, out in (("#lobes [data-theta]:not([hidden]) svg[data-kind=cartesian]", "#lobe-readout"),
                          ("svg[data-slices]", "#reflectance .wide .readout")):
        before = b.js("return document.querySelector(arguments[0]).textContent", out)
        b.drag(selector, 5, 3)
        text = b.wait("""const t = document.querySelector('%s').textContent;
                         return t !== %r && t""" % (out, before))
        check("numbers under the pointer: %s" % text[:34], "1/sr" in text)


def check_rest(b):
    b.js("document.getElementById('theme').click()")
    check("light and dark by hand", b.js("return document.documentElement.dataset.theme") == "dark")
    b.js("document.getElementById('theme').click()")
    rig = "return document.getElementById('rig').innerHTML"
    before, seen = b.js(rig), set()
    for button in ("top", "side", "reset"):
        b.js("document.querySelector('[data-rig=%s]').click()" % button)
        seen.add(b.js(rig))
    check("the sketch turns by buttons", len(seen) == 3 and before in seen)
    b.drag("#rig", 40, 20)
    check("and by dragging", b.js(rig) not in seen)
    b.js("document.getElementById('rig').focus()")
    before = b.js(rig)
    b.keys("\ue014", "+")
    check("and by keys", b.js(rig) != before)
    check("it shows six cameras, a lamp, the board",
          b.js("""const t = [...document.querySelectorAll('#rig title')].map((e) => e.textContent).join();
                  return ['shot 6', 'lamp', 'board', 'white patch', 'sample'].every((w) => t.includes(w))"""))
    zooms = b.js("return document.querySelectorAll('.zoom').length")
    b.js("document.querySelector('#photographs .zoom').click()")
    opened = b.js("return document.getElementById('large').open && document.getElementById('large-picture').alt")
    b.js("document.getElementById('large-close').click()")
    check("photographs and predictions, large and back", zooms == 12 and "Shot 1" in opened
          and not b.js("return document.getElementById('large').open"), zooms)
    b.js("document.querySelectorAll('summary').forEach((e) => e.click())")
    check("all sections have content", b.js("""return [...document.querySelectorAll('main section')]
                                               .every((s) => s.textContent.trim().length > 80)"""))
    check("every link leads somewhere", b.js("""return [...document.querySelectorAll('a')]
                                                .every((a) => document.getElementById(a.hash.slice(1)))"""))
    check("nothing is fetched", b.js("""return performance.getEntriesByType('resource')
                                        .every((r) => r.name.startsWith('data:') || r.name.startsWith('blob:'))"""))


def check_keyboard(b):
    b.js("document.activeElement.blur(); scrollTo(0, 0)")
    met = set()
    for _ in range(14):
        b.keys("\ue004")  # tab
        met.add(b.js("const e = document.activeElement; return e.id || e.textContent.trim()"))
    check("tab leads through links to the ball and its controls", {"theme", "sphere", "left", "right"} <= met, met)


def check_without_webgl(b, path):
    b.devtools("Page.addScriptToEvaluateOnNewDocument", source="HTMLCanvasElement.prototype.getContext = () => null")
    b.open(path)
    check("without WebGL2: a still picture, and words", b.js("""const s = document.getElementById('still');
          return !s.hidden && s.naturalWidth > 100 && document.getElementById('sphere').hidden
                 && document.getElementById('viewer-controls').textContent.includes('WebGL2')"""))


def main():
    goniocam, project = sys.argv[1:3]
    if not browser.there():
        print("no chromium and chromedriver here: skipped")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        capture, out = folder + "/capture", folder + "/out"
        quiet = dict(stdout=subprocess.DEVNULL)
        subprocess.check_call([goniocam, "render", project + "/samples/tiny.yaml", "-o", capture, "--quiet"], **quiet)
        subprocess.check_call([goniocam, "reconstruct", capture, "-o", out, "--quiet"], **quiet)
        path = out + "/report.html"
        check("reconstruct writes report.html, 6 shots in 4 MB", 3e5 < os.path.getsize(path) < 4e6, os.path.getsize(path))
        first = open(path, "rb").read()
        subprocess.check_call([goniocam, "report", out, "--quiet"])
        check("goniocam report writes it again, the same", open(path, "rb").read() == first)
        b = browser.Browser()
        try:
            b.screen(1280)
            b.open(path)
            b.wait("return document.getElementById('sphere').dataset.drawn")
            check("a verdict", "measurement" in b.js("return document.getElementById('verdict').textContent"))
            check_keyboard(b)
            check_ball(b, goniocam, out)
            check_viewer(b)
            check_plots(b)
            check_rest(b)
            check_names(b)
            check_contrast(b)
            check_sizes(b)
            check_without_webgl(b, path)
            complaints = b.complaints()
            check("the console stays silent", not complaints, complaints[:3])
        finally:
            b.close()
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
