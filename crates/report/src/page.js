"use strict";
(() => {
  const failures = [];
  window.addEventListener("error", (event) => failures.push(event.message || `${event.target.id || event.target.tagName} did not load`), true);
  window.addEventListener("unhandledrejection", (event) => failures.push(String(event.reason)));

  const find = (id) => document.getElementById(id);
  const data = JSON.parse(find("data").textContent);
  const section = find("viewer");

  // --- Radiance, and how it is brought to a display: twins of the functions of the same names in crates/lobes/src/tonemap.rs. ---

  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
  const rows = (m, r, g, b) => m.map((row) => row[0] * r + row[1] * g + row[2] * b);
  const ACES_IN = [[0.59719, 0.35458, 0.04823], [0.076, 0.90834, 0.01566], [0.0284, 0.13383, 0.83777]];
  const ACES_OUT = [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
  const AGX_IN = [
    [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
    [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
    [0.0423756549057051, 0.0784336, 0.879142973793104],
  ];
  const AGX_OUT = [
    [1.19687900512017, -0.0980208811401368, -0.0990297440797205],
    [-0.0528968517574562, 1.15190312990417, -0.0989611768448433],
    [-0.0529716355144438, -0.0980434501171241, 1.15107367264116],
  ];
  const CURVES = {
    none: (r, g, b) => [r, g, b],
    aces: (r, g, b) => rows(ACES_OUT, ...rows(ACES_IN, r, g, b).map((c) => (c * (c + 0.0245786) - 0.000090537) / (c * (0.983729 * c + 0.432951) + 0.238081))),
    agx: (r, g, b) => {
      const curved = rows(AGX_IN, r, g, b).map((value) => {
        const x = clamp((Math.log2(Math.max(value, 1e-10)) + 12.47393) / 16.5, 0, 1), x2 = x * x, x4 = x2 * x2;
        return 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
      });
      return rows(AGX_OUT, ...curved).map((value) => clamp(value, 0, 1) ** 2.2);
    },
  };
  const encode = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
  /** sRGB bytes of linear values, fine enough that none is a level off. */
  const BYTES = Uint8ClampedArray.from({ length: 65536 }, (_, index) => Math.round(255 * encode(index / 65535)));
  const MAX_INPUT = 1e6;

  /** RGB triples of a picture whose lower half holds exponents. */
  function decodeRadiance(image) {
    const width = image.naturalWidth, height = image.naturalHeight / 2;
    const canvas = Object.assign(document.createElement("canvas"), { width, height: 2 * height });
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    const bytes = context.getImageData(0, 0, width, 2 * height).data, count = width * height;
    const values = new Float32Array(3 * count);
    for (let index = 0; index < count; index += 1) {
      const exponent = bytes[4 * (index + count)];
      const scale = exponent === 0 ? 0 : 2 ** (exponent - 128 - 8);
      for (let channel = 0; channel < 3; channel += 1) values[3 * index + channel] = bytes[4 * index + channel] * scale;
    }
    return { width, height, values };
  }

  const held = new Map();
  /** The radiance of a picture by its key; null where it has not loaded. */
  function radianceOf(key) {
    if (!held.has(key)) {
      const image = find(`radiance-${key}`);
      if (!image || !image.complete || !image.naturalWidth) return null;
      held.set(key, decodeRadiance(image));
    }
    return held.get(key);
  }

  const view = { curve: data.view ? data.view.curve : "agx", exposure: data.view ? data.view.exposure : 0 };
  /** Draws a picture at the present exposure. */
  function expose(key) {
    const radiance = radianceOf(key), canvas = find(`picture-${key}-picture`);
    if (!radiance || !canvas) return;
    const { width, height, values } = radiance;
    const shown = new ImageData(width, height), scale = 2 ** view.exposure, curve = CURVES[view.curve] || CURVES.none;
    for (let index = 0; index < width * height; index += 1) {
      const at = 3 * index;
      const mapped = curve(Math.min(values[at] * scale, MAX_INPUT), Math.min(values[at + 1] * scale, MAX_INPUT), Math.min(values[at + 2] * scale, MAX_INPUT));
      for (let channel = 0; channel < 3; channel += 1) shown.data[4 * index + channel] = BYTES[Math.round(65535 * clamp(mapped[channel], 0, 1))];
      shown.data[4 * index + 3] = 255;
    }
    canvas.getContext("2d", { willReadFrequently: true }).putImageData(shown, 0, 0);
  }
  const keys = data.variants ? ["reference", ...data.variants.map((_, index) => String(index))] : [];

  const viewer = section ? makeViewer() : null;
  if (location.hash === "#selftest") window.addEventListener("load", () => selftest());

  function makeViewer() {
    section.hidden = false;
    const canvas = find("canvas"), handle = find("handle"), stage = find("stage");
    const context = canvas.getContext("2d", { willReadFrequently: location.hash === "#selftest" });
    const pixel = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
    const sides = [{ key: "reference", name: "Reference", size: data.reference.picture }];
    data.variants.forEach((variant, index) => sides.push({ key: String(index), name: variant.name, size: variant.picture }));
    const last = sides.length - 1;
    const state = { a: last > 1 ? 1 : 0, b: last > 1 ? 2 : last, layer: "picture", mode: "wipe", wipe: 0.5, zoom: 0, x: 0, y: 0 };

    const size = () => sides[state.a].size;
    const element = (side, layer) => find(`picture-${side.key}-${layer}`);
    /** The map of a side, or its picture where it has no such map; the words say which. */
    function shown(side) {
      const map = element(side, state.layer);
      if (map || state.layer === "picture") return { image: map, words: side.name };
      return { image: element(side, "picture"), words: `${side.name} (no such map: picture)` };
    }
    /** Canvases are always ready, images once they have loaded. */
    const ready = (image) => image && (image.naturalWidth === undefined ? image.width : image.naturalWidth) > 0;
    const paneWidth = () => (state.mode === "side" ? canvas.width / 2 : canvas.width);
    const fitting = () => Math.min(paneWidth() / size().width, canvas.height / size().height);
    const zoom = () => state.zoom || fitting();
    /** Left edge of the pane at a place of the canvas. */
    const paneAt = (x) => (state.mode === "side" && x >= canvas.width / 2 ? canvas.width / 2 : 0);
    /** Where the upper left corner of the picture lies for a pane: on a whole pixel, so that what is read is what is drawn. */
    function corner(left) {
      return [Math.round(left + paneWidth() / 2 - state.x * zoom()), Math.round(canvas.height / 2 - state.y * zoom())];
    }
    function toPicture(x, y) {
      const [left, top] = corner(paneAt(x));
      return [(x - left) / zoom(), (y - top) / zoom()];
    }

    function drawPane(side, left, clipFrom, clipTo) {
      const { image } = shown(side);
      if (!ready(image) || clipTo <= clipFrom) return;
      const scale = zoom();
      context.save();
      context.beginPath();
      context.rect(clipFrom, 0, clipTo - clipFrom, canvas.height);
      context.clip();
      context.imageSmoothingEnabled = scale < 1;
      context.imageSmoothingQuality = "high";
      const [x, y] = corner(left);
      context.drawImage(image, x, y, Math.round(side.size.width * scale), Math.round(side.size.height * scale));
      context.restore();
    }

    function draw() {
      const a = sides[state.a], b = sides[state.b];
      context.clearRect(0, 0, canvas.width, canvas.height);
      if (state.mode === "side") {
        const half = canvas.width / 2;
        drawPane(a, 0, 0, half - 1);
        drawPane(b, half, half + 1, canvas.width);
      } else {
        const edge = Math.round(state.wipe * canvas.width);
        drawPane(a, 0, 0, edge);
        drawPane(b, 0, edge, canvas.width);
      }
      handle.hidden = state.mode === "side";
      handle.style.left = `${state.wipe * 100}%`;
      handle.setAttribute("aria-valuenow", Math.round(state.wipe * 100));
      handle.setAttribute("aria-valuetext", `${Math.round(state.wipe * 100)} % ${a.name}, the rest ${b.name}`);
      find("name-a").textContent = `A: ${shown(a).words}`;
      find("name-b").textContent = `B: ${shown(b).words}`;
      find("zoom").textContent = `${Math.round(zoom() * 100)} %`;
      canvas.setAttribute("aria-label", `${state.layer} of ${a.name} and of ${b.name}, ${state.mode === "side" ? "side by side" : "with a wipe"}`);
      for (const name of ["mode", "layer"]) {
        for (const button of section.querySelectorAll(`[data-${name}]`)) {
          button.setAttribute("aria-pressed", String(button.dataset[name] === state[name]));
        }
      }
    }

    function resize() {
      const ratio = window.devicePixelRatio || 1;
      const width = Math.max(stage.clientWidth, 64);
      const panes = state.mode === "side" ? 2 : 1;
      const wanted = width / panes * (size().height / Math.max(size().width, 1));
      const height = Math.max(160, Math.min(wanted, window.innerHeight * 0.8));
      canvas.style.height = `${height}px`;
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      draw();
    }

    function centre() {
      state.zoom = 0;
      state.x = size().width / 2;
      state.y = size().height / 2;
    }

    /** Zooms so that the place under (x, y) of the canvas stays there. */
    function zoomTo(value, x = paneWidth() / 2, y = canvas.height / 2) {
      const [px, py] = toPicture(x, y);
      state.zoom = Math.min(64, Math.max(Math.min(fitting(), 1) / 4, value));
      const [qx, qy] = toPicture(x, y);
      move(px - qx, py - qy);
    }

    function move(dx, dy) {
      state.x = Math.min(size().width, Math.max(0, state.x + dx));
      state.y = Math.min(size().height, Math.max(0, state.y + dy));
      draw();
    }

    function setWipe(value) {
      state.wipe = Math.min(1, Math.max(0, value));
      draw();
    }

    function place(event) {
      const box = canvas.getBoundingClientRect();
      return [(event.clientX - box.left) * canvas.width / box.width, (event.clientY - box.top) * canvas.height / box.height];
    }

    function colour(image, x, y) {
      pixel.clearRect(0, 0, 1, 1);
      pixel.drawImage(image, x, y, 1, 1, 0, 0, 1, 1);
      return [...pixel.getImageData(0, 0, 1, 1).data].slice(0, 3);
    }

    function read(event) {
      const [x, y] = toPicture(...place(event)).map(Math.floor);
      if (x < 0 || y < 0 || x >= size().width || y >= size().height) {
        find("readout").textContent = "outside of the picture";
        return;
      }
      const words = ["a", "b"].map((name) => {
        const side = sides[state[name]], { image } = shown(side), radiance = radianceOf(side.key);
        if (!ready(image)) return `${name.toUpperCase()} missing`;
        const as = colour(image, x, y).join(" ");
        if (state.layer !== "picture" || !radiance) return `${name.toUpperCase()} ${as}`;
        const values = [0, 1, 2].map((channel) => Number(radiance.values[3 * (y * radiance.width + x) + channel].toPrecision(2)));
        return `${name.toUpperCase()} ${values.join(" ")} (shown ${as})`;
      });
      const unit = state.layer === "picture" ? "radiance RGB to about 1 %, and as shown, of 255" : "RGB as shown, of 255";
      find("readout").textContent = `x ${x}, y ${y} (from the upper left) · ${words.join(" · ")} · ${unit}`;
    }

    /** Follows the pointer from its press to its release. A pointer that cannot be captured is followed all the same. */
    function drag(target, moved) {
      let from = null;
      target.addEventListener("pointerdown", (event) => {
        from = place(event);
        try { target.setPointerCapture(event.pointerId); } catch { /* a pointer made by a script */ }
      });
      target.addEventListener("pointermove", (event) => {
        if (!from) return;
        const to = place(event);
        moved(to, from);
        from = to;
      });
      for (const end of ["pointerup", "pointercancel"]) target.addEventListener(end, () => { from = null; });
    }

    function onKeys(target, actions) {
      target.addEventListener("keydown", (event) => {
        const action = event.ctrlKey || event.metaKey || event.altKey ? null : actions[event.key];
        if (!action) return;
        event.preventDefault();
        action(event.shiftKey ? 10 : 1);
      });
    }

    for (const [id, name] of [["choose-a", "a"], ["choose-b", "b"]]) {
      sides.forEach((side, index) => find(id).append(new Option(side.name, index)));
      find(id).value = state[name];
      find(id).addEventListener("change", (event) => { state[name] = Number(event.target.value); resize(); });
    }
    find("swap").addEventListener("click", () => {
      [state.a, state.b] = [state.b, state.a];
      find("choose-a").value = state.a;
      find("choose-b").value = state.b;
      draw();
    });
    for (const button of section.querySelectorAll("[data-mode]")) {
      button.addEventListener("click", () => { state.mode = button.dataset.mode; resize(); });
    }
    for (const button of section.querySelectorAll("[data-layer]")) {
      button.disabled = !sides.some((side) => element(side, button.dataset.layer));
      button.addEventListener("click", () => { state.layer = button.dataset.layer; draw(); });
    }
    const fit = () => { centre(); draw(); }, one = () => zoomTo(1);
    const closer = () => zoomTo(zoom() * 1.5), farther = () => zoomTo(zoom() / 1.5);
    find("zoom-in").addEventListener("click", closer);
    find("zoom-out").addEventListener("click", farther);
    find("zoom-fit").addEventListener("click", fit);
    find("zoom-one").addEventListener("click", one);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      zoomTo(zoom() * Math.exp(-Math.max(-240, Math.min(240, event.deltaY)) / 400), ...place(event));
    }, { passive: false });
    canvas.addEventListener("pointermove", read);
    drag(canvas, (to, from) => move((from[0] - to[0]) / zoom(), (from[1] - to[1]) / zoom()));
    drag(handle, (to) => setWipe(to[0] / canvas.width));
    onKeys(handle, {
      ArrowLeft: (times) => setWipe(state.wipe - 0.01 * times), ArrowRight: (times) => setWipe(state.wipe + 0.01 * times),
      ArrowDown: (times) => setWipe(state.wipe - 0.01 * times), ArrowUp: (times) => setWipe(state.wipe + 0.01 * times),
      PageDown: () => setWipe(state.wipe - 0.1), PageUp: () => setWipe(state.wipe + 0.1), Home: () => setWipe(0), End: () => setWipe(1),
    });
    const step = (times) => 24 * times / zoom();
    onKeys(canvas, {
      ArrowLeft: (times) => move(-step(times), 0), ArrowRight: (times) => move(step(times), 0),
      ArrowUp: (times) => move(0, -step(times)), ArrowDown: (times) => move(0, step(times)),
      "+": closer, "=": closer, "-": farther, 0: fit, 1: one,
    });
    // All pictures of the page follow the exposure: the two that are looked at at once, the others when there is time.
    let waiting = 0;
    function setView(changes, all = false) {
      Object.assign(view, changes);
      find("curve").value = view.curve;
      find("exposure").value = view.exposure;
      find("stops").textContent = `${view.exposure >= 0 ? "+" : "−"}${Math.abs(view.exposure).toFixed(2)} stops`;
      find("exposure").setAttribute("aria-valuetext", find("stops").textContent);
      const first = [sides[state.a].key, sides[state.b].key];
      for (const key of all ? keys : first) expose(key);
      clearTimeout(waiting);
      if (!all) waiting = setTimeout(() => keys.filter((key) => !first.includes(key)).forEach(expose), 120);
      draw();
    }
    const own = () => {
      const graphs = [state.a, state.b].map((index) => data.variants[index - 1]);
      const graph = graphs.find((variant) => variant && variant.tone) || data.variants.find((variant) => variant.tone);
      return graph ? graph.tone : null;
    };
    function middleGrey() {
      const { values } = radianceOf("reference") || { values: [] };
      let sum = 0;
      for (let at = 0; at < values.length; at += 3) sum += 0.2126 * values[at] + 0.7152 * values[at + 1] + 0.0722 * values[at + 2];
      if (sum > 0) setView({ exposure: clamp(Math.log2(0.18 * values.length / 3 / sum), -20, 20) });
    }
    find("as-graph").disabled = !own();
    find("curve").addEventListener("change", (event) => setView({ curve: event.target.value }));
    find("exposure").addEventListener("input", (event) => setView({ exposure: Number(event.target.value) }));
    find("darker").addEventListener("click", () => setView({ exposure: clamp(view.exposure - 1, -20, 20) }));
    find("brighter").addEventListener("click", () => setView({ exposure: clamp(view.exposure + 1, -20, 20) }));
    find("as-graph").addEventListener("click", () => setView({ curve: own().curve, exposure: own().exposure }));
    find("auto").addEventListener("click", middleGrey);
    find("exposure").step = "any";
    window.addEventListener("resize", resize);
    window.addEventListener("load", () => { setView({}, true); resize(); });
    centre();
    resize();
    return { setView, own, state, canvas, context, handle, sides, shown, toPicture, colour, zoomTo, zoom, draw };
  }

  /**
   * Works the page as a person would and writes what failed into an element; run by adding #selftest to the address. It runs in
   * one piece on load: a browser without a window may write the page out before anything later ends.
   */
  let tones = [];
  function selftest() {
    const expect = (condition, words) => { if (!condition) failures.push(words); };
    const images = [...document.images];
    for (const image of images) {
      expect(image.complete && image.naturalWidth > 0, `${image.id} has not loaded`);
      expect(image.naturalWidth === Number(image.getAttribute("width")), `${image.id} is ${image.naturalWidth} pixels wide`);
      expect(image.alt.length > 0, `${image.id} has no alternative text`);
    }
    for (const fault of document.querySelectorAll(".fault")) failures.push(fault.textContent);
    let distinct = 0;
    try {
      if (viewer) distinct = workViewer(expect);
    } catch (error) {
      failures.push(String(error));
    }
    const plots = [...document.querySelectorAll(".plots svg")];
    for (const plot of plots) expect(plot.getBoundingClientRect().width > 100, "a plot has no size");
    const wide = document.documentElement.scrollWidth > window.innerWidth;
    expect(!wide, `the page is ${document.documentElement.scrollWidth} pixels wide in a window of ${window.innerWidth}`);
    const table = document.querySelector("table.metrics");
    const inside = table ? table.getBoundingClientRect().right <= window.innerWidth : true;
    const result = { ok: failures.length === 0, images: images.length, plots: plots.length, distinct, tones, inside, failures };
    const output = Object.assign(document.createElement("output"), { id: "selftest", textContent: JSON.stringify(result) });
    document.body.append(output);
    document.title = result.ok ? "selftest passed" : "selftest failed";
  }

  /** Returns at how many places two different colours were told apart. */
  function workViewer(expect) {
    const { state, canvas, context, handle, sides, shown, toPicture, colour, zoomTo, zoom, setView, own } = viewer;
    let distinct = 0;
    const press = (target, key) => target.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
    const pointer = (target, type, share) => {
      const box = canvas.getBoundingClientRect();
      target.dispatchEvent(new PointerEvent(type, { clientX: box.left + box.width * share, clientY: box.top + box.height / 2, pointerId: 1 }));
    };
    /** The canvas at a share of its width must hold the pixel of the side that belongs there. */
    const holds = (share, name, words) => {
      const x = Math.floor(canvas.width * share), y = Math.floor(canvas.height / 2);
      const [px, py] = toPicture(x + 0.5, y + 0.5).map(Math.floor);
      const images = ["a", "b"].map((one) => shown(sides[state[one]]).image);
      const [a, b] = images.map((image) => colour(image, px, py));
      const expected = name === "a" ? a : b;
      const found = [...context.getImageData(x, y, 1, 1).data].slice(0, 3);
      const near = (one, other) => one.every((value, channel) => Math.abs(value - other[channel]) <= 2);
      if (!near(a, b)) distinct += 1;
      expect(near(found, expected), `${words}: the canvas holds ${found}, ${name} holds ${expected} at ${px} ${py}`);
    };
    for (const layer of ["picture", "error", "flip"]) {
      const button = section.querySelector(`[data-layer="${layer}"]`);
      if (button.disabled) continue;
      button.click();
      section.querySelector('[data-mode="wipe"]').click();
      // More than the canvas, so that every place below lies inside of the picture.
      zoomTo(Math.max(8, Math.ceil(2 * zoom())));
      expect(!context.imageSmoothingEnabled || zoom() >= 1, "a magnified picture is smoothed");
      pointer(handle, "pointerdown", 0.5);
      pointer(handle, "pointermove", 0.25);
      pointer(handle, "pointerup", 0.25);
      expect(Math.abs(state.wipe - 0.25) < 0.01, `the dragged wipe is at ${state.wipe}`);
      for (const share of [0.1, 0.2]) holds(share, "a", `${layer}, wiped`);
      for (const share of [0.4, 0.8]) holds(share, "b", `${layer}, wiped`);
      const before = state.wipe;
      press(handle, "ArrowRight");
      expect(state.wipe > before && handle.getAttribute("aria-valuenow") === "26", "the arrow key does not move the wipe");
      press(handle, "End");
      holds(0.8, "a", `${layer}, wiped to the end`);
      section.querySelector('[data-mode="side"]').click();
      holds(0.2, "a", `${layer}, side by side`);
      holds(0.8, "b", `${layer}, side by side`);
      find("zoom-fit").click();
    }
    // What the exposure does to pixels of the reference, for whoever knows what they hold.
    setView({}, true);
    const place = find("picture-reference-picture").getContext("2d", { willReadFrequently: true });
    const pixels = (curve, exposure) => {
      setView({ curve, exposure }, true);
      return [0, 1, 2, 3].map((x) => [...place.getImageData(x, 0, 1, 1).data].slice(0, 3));
    };
    tones = ["agx", "aces", "none"].map((curve) => [-3, 0, 4].map((exposure) => pixels(curve, exposure)));
    find("exposure").value = "1.5";
    find("exposure").dispatchEvent(new Event("input"));
    expect(view.exposure === 1.5 && find("stops").textContent === "+1.50 stops", "the slider does not set the exposure");
    find("as-graph").click();
    const tone = own();
    expect(!tone || (view.curve === tone.curve && view.exposure === tone.exposure), "the graph's own curve is not taken");
    setView({ curve: data.view.curve, exposure: data.view.exposure }, true);
    const before = zoom();
    canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -120, clientX: 40, clientY: 40, cancelable: true }));
    expect(zoom() > before, "the wheel does not zoom");
    press(canvas, "0");
    pointer(canvas, "pointermove", 0.25);
    expect(/^x \d+, y \d+/.test(find("readout").textContent), `the read-out says ${find("readout").textContent}`);
    section.querySelector('[data-mode="wipe"]').click();
    section.querySelector('[data-layer="picture"]').click();
    return distinct;
  }
})();
