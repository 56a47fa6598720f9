"""Rate of the studio from end to end: a slider is dragged in headless Chromium, and drawn surfaces are counted.

    python -m tests.benchmarks.studio [--resolutions 8000,20000] [--seconds 6] [--colors skin]

Chromium draws by WebGL in software, on the cores that the studio computes on. The mouse moves at every frame that the
browser draws. A surface counts as shown when the browser begins the frame after the one in which its vertices went to
WebGL and were drawn; its delay is that of single moves of a mouse that waits for each.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

__all__ = ["FLAGS", "WATCH", "Measured", "measure", "processor_times"]

FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
]


@dataclass(frozen=True)
class Measured:
    """What came of a drag.

    Attributes:
        rate: Updates shown a second.
        drawn: Frames the browser drew a second.
        delay: Median time from a move of the mouse to the frame that shows it [s].
        spent: Processor time for each update that was shown [s], by process: what is left on a busy machine of what
            two free cores would do.
    """

    rate: float
    drawn: float
    delay: float
    spent: dict[str, float]


WATCH = """
window.shown = {uploads: 0, drawn: 0, frames: 0, times: [], pending: false};
for (const name of ['bufferSubData', 'bufferData']) {
  const original = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...args) {
    const data = args.find(one => ArrayBuffer.isView(one));
    if (data instanceof Float32Array && data.byteLength >= LEAST) { shown.uploads++; shown.pending = true; }
    return original.apply(this, args);
  };
}
(function frame() {
  requestAnimationFrame(frame);
  shown.frames++;
  if (shown.pending) { shown.pending = false; shown.drawn++; shown.times.push(performance.now()); }
})();
"""
"""Counts the frames in which large arrays of vertices went to WebGL; LEAST is their size in bytes."""

_DRAG = """async ([id, seconds, alone]) => {
  const track = document.getElementById(id).querySelector('.mantine-Slider-track');
  const box = track.getBoundingClientRect(), y = box.top + box.height / 2;
  const at = share => ({clientX: box.left + share * box.width, clientY: y, bubbles: true, button: 0, buttons: 1});
  const root = document.getElementById(id).querySelector('.mantine-Slider-trackContainer') || track;
  const next = () => new Promise(done => requestAnimationFrame(done));
  root.dispatchEvent(new MouseEvent('mousedown', at(0.4)));
  const first = {drawn: shown.drawn, frames: shown.frames, time: performance.now()}, delays = [];
  let k = 0;
  while (performance.now() - first.time < 1000 * seconds) {
    const before = shown.drawn, began = performance.now();
    const there = at(0.4 + 0.55 * Math.abs(((k++ / 20) % 2) - 1));
    document.dispatchEvent(new PointerEvent('pointermove', there));
    document.dispatchEvent(new MouseEvent('mousemove', there));
    await next();
    while (alone && shown.drawn === before && performance.now() - began < 3000) await next();
    if (alone) delays.push(performance.now() - began);
  }
  document.dispatchEvent(new PointerEvent('pointerup', at(0.5)));
  document.dispatchEvent(new MouseEvent('mouseup', at(0.5)));
  const spent = (performance.now() - first.time) / 1000;
  delays.sort((a, b) => a - b);
  const drawn = shown.drawn - first.drawn;
  return {shown: drawn, rate: drawn / spent, fps: (shown.frames - first.frames) / spent,
          delay: delays.length ? delays[delays.length >> 1] : NaN, moves: k};
}"""


def processor_times() -> dict[str, float]:
    """Processor time of the processes that a browser started by this one has had [s], by their kind."""
    ticks, parents, found = os.sysconf("SC_CLK_TCK"), {}, {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
            arguments = (stat.parent / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue  # it has ended
        number = int(stat.parent.name)
        kind = arguments.partition("--type=")[2].partition(" ")[0] or "browser"
        parents[number] = int(fields[1])
        found[number] = kind, (int(fields[11]) + int(fields[12])) / ticks
    out: dict[str, float] = {}
    for number, (kind, spent) in found.items():
        above = parents[number]
        while above not in (0, os.getpid()):
            above = parents.get(above, 0)
        if above == os.getpid():
            out[kind] = out.get(kind, 0.0) + spent
    out["studio"] = time.process_time()
    return out


def measure(browser: Any, resolution: int, seconds: float, coloring: str) -> Measured:
    """Drag the slider of a hand with so many vertices."""
    from warpjld.studio.opening import opened_document
    from warpjld.studio.room import Room

    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "hand.jld"
        script.write_text(f"HAND LEFT BUILTIN RESOLUTION {resolution}\nPOSE LEFT RELAXED 0\n")
        room = Room(opened_document(script, Path(folder) / "out"), port=0)
        room.state.coloring = coloring  # type: ignore[assignment]
        page = browser.new_page(viewport={"width": 900, "height": 800})
        try:
            page.add_init_script(WATCH.replace("LEAST", str(6 * resolution)))
            page.goto(room.address)
            page.get_by_text("Joints", exact=True).wait_for(timeout=60_000)
            page.wait_for_function("shown.drawn > 0", timeout=60_000)
            page.wait_for_timeout(2000)  # the first frames compile shaders
            label = page.locator("label", has_text="base flexion").locator("visible=true").first
            slider = label.get_attribute("for")
            page.locator(f'[id="{slider}"]').scroll_into_view_if_needed()
            page.evaluate(_DRAG, [slider, 1.0, False])
            before = processor_times()
            dragged = page.evaluate(_DRAG, [slider, seconds, False])
            after = processor_times()
            single = page.evaluate(_DRAG, [slider, seconds / 2, True])
        finally:
            page.close()
            room.stop()
    spent = {kind: (after[kind] - before.get(kind, 0.0)) / max(dragged["shown"], 1) for kind in after}
    return Measured(dragged["rate"], dragged["fps"], 1e-3 * single["delay"], spent)


@click.command()
@click.option("--resolutions", default="8000,20000", show_default=True, help="Vertices, with commas between.")
@click.option("--seconds", default=6.0, show_default=True, help="How long each drag takes.")
@click.option("--colors", default="skin", show_default=True, help="What skin is coloured by.")
def main(resolutions: str, seconds: float, colors: str) -> None:
    """Measure and print."""
    from playwright.sync_api import sync_playwright

    from warpjld.runtime.quiet import silence_warp

    silence_warp()
    found = os.environ.get("WARPJLD_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=FLAGS)
        for resolution in map(int, resolutions.split(",")):
            got = measure(browser, resolution, seconds, colors)
            spent = ", ".join(f"{kind} {1e3 * s:.1f}" for kind, s in got.spent.items() if s > 5e-4)
            click.echo(
                f"{resolution} vertices, {colors}: {got.rate:.1f} updates shown a second of {got.drawn:.1f} frames "
                f"drawn, delay {1e3 * got.delay:.0f} ms, load {os.getloadavg()[0]:.1f}; "
                f"processor time an update [ms]: {spent}"
            )
        browser.close()


if __name__ == "__main__":
    main()
