"""Script for pages whose WebGL is computed in software: fewer pixels while the view moves, more when it is at rest.

Without a graphics card a browser spends most of an update on pixels, and twice as much with multisampling. viser can
neither switch that off nor change the resolution by itself, so the page does it. For a quarter of a second after each
update viser draws in every frame, though nothing has changed: while the view moves, those frames are left out; the
first frame at rest is always drawn. Positions of a pressed mouse are thinned out, since the panel is laid out anew for
each. Browsers that draw with a graphics card are left as they are.
"""

from __future__ import annotations

import gzip
from typing import Any

from warpjld.page.quick_normals import QUICK_NORMALS

__all__ = ["add_to_page"]

_SCRIPT = """<script>
(() => {
  const MOVING = 0.5, AT_REST = 1.5;  // canvas pixels per CSS pixel; at rest instead of multisampling
  const REST = 350;  // without change, after which the view is at rest [ms]
  const BETWEEN_MOVES = 51;  // of a pressed mouse [ms]: viser sends a position each 50 ms, at once if it waits for one
  const POLL = 100;  // until the scene is there [ms]
  const own = HTMLCanvasElement.prototype.getContext;
  const probe = own.call(document.createElement("canvas"), "webgl2");
  const info = probe && probe.getExtension("WEBGL_debug_renderer_info");
  const renderer = probe ? String(probe.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : probe.RENDERER)) : "";
  if (probe) probe.getExtension("WEBGL_lose_context")?.loseContext();
  if (!/swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer)) return;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return own.call(this, kind, /webgl/.test(kind) ? {...options, antialias: false} : options);
  };
  if (new URLSearchParams(location.search).has("fixedDpr")) return;  // viser's parameter: the user chose
  const settings = () => window.__viserTestpoints?.devSettings;
  const resolve = ratio => settings()?.set?.({fixedDpr: ratio});
  let timer = 0, changed = -Infinity, counted = false, held = false, inMotion = false;
  const rest = () => {
    if (settings() && !held) {
      inMotion = false;  // before the next frame: it is drawn in any case
      resolve(Math.max(AT_REST, devicePixelRatio));
    } else timer = setTimeout(rest, REST);
  };
  const moving = () => {
    inMotion = true;
    resolve(MOVING);
    clearTimeout(timer);
    timer = setTimeout(rest, REST);
  };
  for (const pointer of ["pointer", "mouse"]) {  // what is dragged is laid out anew at each: not more than needed
    let last = -Infinity, delay = 0, waiting = null;
    const flush = () => {  // the last position, at the latest before the mouse is released
      const given = waiting;
      clearTimeout(delay);
      waiting = null;
      last = -Infinity;
      given?.();
    };
    addEventListener(pointer + "move", event => {
      const left = last + BETWEEN_MOVES - performance.now(), target = event.target;
      clearTimeout(delay);
      waiting = null;
      if (event.buttons === 0 || left <= 0) { last = performance.now(); return; }
      event.stopImmediatePropagation();
      const again = new event.constructor(event.type, event);
      waiting = () => target.dispatchEvent(again);
      delay = setTimeout(flush, left);
    }, true);
    for (const kind of ["up", "cancel"]) addEventListener(pointer + kind, flush, true);
    addEventListener("blur", flush, true);
  }
  addEventListener("pointermove", event => { if (held = event.buttons > 0) moving(); }, true);
  for (const kind of ["pointerup", "pointercancel", "blur"]) addEventListener(kind, () => { held = false; }, true);
  addEventListener("wheel", event => { if (event.target instanceof HTMLCanvasElement) moving(); }, true);
  for (const name of ["bufferData", "bufferSubData"]) {  // surfaces that change in frame after frame
    const original = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...given) {
      if (!counted) {
        counted = true;
        const now = performance.now(), again = now - changed < REST;
        changed = now;
        setTimeout(() => { counted = false; if (again) moving(); });
      }
      return original.apply(this, given);
    };
  }
  const state = (scene, camera, canvas) => {  // what a picture depends on, as a list of numbers and identifiers
    const found = [canvas.width, canvas.height, ...camera.matrixWorld.elements, ...camera.projectionMatrix.elements];
    scene.traverseVisible(one => {
      found.push(one.id, ...one.matrixWorld.elements);
      if (one.geometry) {
        found.push(one.geometry.id, one.geometry.index?.version, one.instanceMatrix?.version, one.count);
        for (const attribute of Object.values(one.geometry.attributes)) found.push(attribute.version);
      }
      for (const material of one.material ? [one.material].flat() : [])
        found.push(material.id, material.version, material.visible, material.opacity, material.color?.getHex());
    });
    return found;
  };
  const skip = () => {
    const scene = window.__viserMutable?.scene, drawer = scene?.__r3f?.root?.getState?.().gl;
    if (!drawer) { setTimeout(skip, POLL); return; }
    const draw = drawer.render;
    let last = [];
    drawer.render = function (drawn, camera) {
      if (inMotion && drawn === scene && !this.getRenderTarget()) {
        scene.updateMatrixWorld();
        const now = state(scene, camera, this.domElement);
        if (now.length === last.length && now.every((one, k) => one === last[k])) return;
        last = now;
      } else if (drawn === scene) last = [];
      draw.call(this, drawn, camera);
    };
  };
  skip();
  rest();
})();
</script>
"""


def add_to_page(response: Any, known: dict[bytes, bytes]) -> None:
    """Put this script and ``QUICK_NORMALS`` into the head of an HTTP response that is viser's page; leave others.

    Args:
        response: Response of ``websockets``.
        known: Pages that have been changed already, by what they were.
    """
    if "text/html" not in response.headers.get("Content-Type", "") or not response.body:
        return
    packed = response.headers.get("Content-Encoding") == "gzip"
    if response.body not in known:
        page = (gzip.decompress(response.body) if packed else response.body).replace(
            b"<head>", b"<head>\n" + (_SCRIPT + QUICK_NORMALS).encode(), 1
        )
        known[response.body] = gzip.compress(page) if packed else page
    response.body = known[response.body]
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(response.body))
