"""What every report must do in a real browser, without a network."""

from __future__ import annotations

from pathlib import Path

from oed.reports import Page, render
from tests.oed.reports.browser import Browser
from tests.oed.reports.said_once import said_twice

CONTRAST = 4.5
"""Least contrast of text to its ground (WCAG 2.1, level AA)."""

LARGEST = 2_000_000
"""Largest file of a report [bytes]."""

# Opens what is closed and waits until each plot is drawn.
DRAWN = """new Promise((resolve) => {
  document.querySelectorAll("details").forEach((item) => { item.open = true; });
  const until = performance.now() + 20000;
  const look = () => {
    const open = [...document.querySelectorAll(".plot")].filter((item) => !item.dataset.drawn);
    if (!open.length || performance.now() > until) resolve(open.length); else setTimeout(look, 20);
  };
  look();
})"""

# Texts with too little contrast: the colour of each text against the nearest opaque ground behind it.
FAINT = """(() => {
  const numbers = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = (rgb) => rgb.slice(0, 3)
    .map((value) => value / 255)
    .map((value) => (value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4))
    .reduce((sum, value, index) => sum + value * [0.2126, 0.7152, 0.0722][index], 0);
  const ground = (item) => {
    for (let at = item; at; at = at.parentElement) {
      const rgb = numbers(getComputedStyle(at).backgroundColor);
      if (rgb.length === 3 || rgb[3] === 1) return rgb;
    }
    return [255, 255, 255];
  };
  const faint = [];
  for (const item of document.querySelectorAll("body *")) {
    const own = [...item.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    if (!own || ["SCRIPT", "STYLE", "NOSCRIPT"].includes(item.tagName) || !item.getClientRects().length) continue;
    const style = getComputedStyle(item);
    const ink = numbers(item.ownerSVGElement ? style.fill : style.color);
    const [a, b] = [light(ink), light(ground(item))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < LEAST) faint.push(`${item.textContent.trim().slice(0, 40)}: ${contrast.toFixed(2)}`);
  }
  return faint;
})()""".replace("LEAST", str(CONTRAST))

# The address of a figure's data after a click on its link, and the number of its lines.
DATA = """[...document.querySelectorAll("a.data")].map((link) => {
  link.addEventListener("click", (event) => event.preventDefault(), { once: true });
  link.click();
  return [link.href.slice(0, 14), decodeURIComponent(link.href.split(",").slice(1).join(",")).split("\\r\\n").length];
})"""

SETTLED = "new Promise((resolve) => setTimeout(() => requestAnimationFrame(() => resolve(0)), 250))"


def check_page(browser: Browser, page: Page, path: Path) -> None:
    """Checks one page: size, findings once, all drawn, narrow and wide, dark and light, by keyboard, without scripts.

    Args:
        browser: without a network.
        page: the report.
        path: of the file to write.
    """
    path.write_text(render(page), encoding="utf-8")
    assert path.stat().st_size <= LARGEST
    assert said_twice(page) == []
    browser.open(path, width=390)
    browser.resize(390, height=30_000)
    assert browser.run(DRAWN) == 0, "plots that were not drawn"
    assert browser.run("document.querySelectorAll('.plot svg.main-svg').length") >= len(page.pictures)
    assert browser.run("document.querySelectorAll('main table').length") >= sum(len(s.tables) for s in page.sections)
    assert browser.run(f"document.querySelector('.verdict').classList.contains('{page.level}')")
    assert browser.run("document.querySelectorAll('.findings li').length") == len(page.listed)
    for address, lines in browser.run(DATA):
        assert address == "data:text/csv;"
        assert lines > 1, "a figure without data"
    # Widths do not depend on colours, nor colours on widths.
    for width, dark in ((390, False), (1280, True)):
        browser.resize(width, height=30_000)
        browser.theme(dark=dark)
        browser.run(SETTLED)
        assert browser.run("document.documentElement.scrollWidth") <= width, f"wider than {width} px"
        assert browser.run("Math.max(0, ...[...document.querySelectorAll('.plot')].map((p) => p.scrollWidth))") <= width
        assert browser.run(FAINT) == [], f"faint text, {'dark' if dark else 'light'}"
    _check_keyboard(browser)
    assert browser.problems == []
    browser.open(path, width=390, scripts=False)
    _check_without_scripts(browser, page)


def _check_keyboard(browser: Browser) -> None:
    """The tabulator reaches the way to the content first, then closed sections; Enter opens and closes them."""
    browser.run("document.querySelectorAll('details').forEach((item) => { item.open = false; }); window.focus()")
    browser.run("document.activeElement.blur()")
    browser.press("Tab", 9)
    assert browser.run("document.activeElement.className") == "skip"
    wanted = browser.run("document.querySelectorAll('summary, a.data, .contents a').length")
    if not wanted:
        return
    for _ in range(3):
        browser.press("Tab", 9)
        if browser.run("document.activeElement.tagName") == "SUMMARY":
            browser.press("Enter", 13)
            assert browser.run("document.activeElement.parentElement.open"), "Enter opens nothing"
            break
    else:
        assert browser.run("['A', 'BUTTON', 'DIV', 'PRE'].includes(document.activeElement.tagName)"), "nothing to reach"


def _check_without_scripts(browser: Browser, page: Page) -> None:
    # Scripts of the page do not run; those of the test come from outside.
    browser.scripts(allowed=True)
    text = browser.run("document.body.innerText")
    assert page.verdict in " ".join(text.split())
    for finding in page.findings:
        assert " ".join(finding.text.split()) in " ".join(text.split())
    if page.pictures:
        assert "The plots need JavaScript" in text
        assert browser.run("document.querySelectorAll('noscript table').length") == len(page.pictures)
    assert browser.run("document.documentElement.scrollWidth") <= 390
