// The page's state, and what moves it: pointer, keys, sliders, the address.

const FIRST = { shape: "sphere", view: { theta: 0, phi: 0 }, light: { theta: 45 * DEGREE, phi: 135 * DEGREE }, exposure: 1, zoom: 1 };
const LOWEST = 85 * DEGREE;  // directions that are set by hand
const state = { ...FIRST, moving: "light" };
const byId = (id) => document.getElementById(id);
const canvas = byId("picture");
let painter = null, fixedSize = null, waiting = false;

/** Directions on the unit disc of theta. */
function onDisc(direction) {
  const out = direction.theta / (Math.PI / 2);
  return [out * Math.cos(direction.phi), out * Math.sin(direction.phi)];
}
function ofDisc([x, y]) {
  return { theta: Math.min(Math.hypot(x, y) * (Math.PI / 2), LOWEST), phi: Math.atan2(y, x) };
}

/** "45,135" in degrees. */
function textOf(direction) {
  const phi = ((direction.phi / DEGREE) % 360 + 360) % 360;
  const rounded = (x) => String(Math.round(x * 10) / 10);
  return `${rounded(direction.theta / DEGREE)},${rounded(phi) === "360" ? "0" : rounded(phi)}`;
}
function directionOf(text) {
  const [theta, phi] = text.split(",").map(Number);
  if (!(theta >= 0 && theta <= 89) || !Number.isFinite(phi)) return null;
  return { theta: theta * DEGREE, phi: phi * DEGREE };
}

function readAddress() {
  const words = new URLSearchParams(location.hash.slice(1));
  if (["plane", "sphere"].includes(words.get("shape"))) state.shape = words.get("shape");
  for (const key of ["view", "light"]) {
    const direction = words.has(key) ? directionOf(words.get(key)) : null;
    if (direction) state[key] = direction;
  }
  for (const [key, low, high] of [["exposure", 1 / 16, 16], ["zoom", 0.25, 16]]) {
    const value = Number(words.get(key));
    if (words.has(key) && value >= low && value <= high) state[key] = value;
  }
  const size = /^(\d{1,4})x(\d{1,4})$/.exec(words.get("size") || "");
  fixedSize = size && size[1] > 0 && size[2] > 0 ? [Number(size[1]), Number(size[2])] : null;
}

let written = "";
function writeAddress() {
  const number = (x) => String(Math.round(x * 1000) / 1000);
  const words = [`shape=${state.shape}`, `view=${textOf(state.view)}`, `light=${textOf(state.light)}`];
  if (state.exposure !== 1) words.push(`exposure=${number(state.exposure)}`);
  if (state.zoom !== 1) words.push(`zoom=${number(state.zoom)}`);
  if (fixedSize) words.push(`size=${fixedSize.join("x")}`);
  written = "#" + words.join("&");
  try {
    history.replaceState(null, "", written);
  } catch {
    // Browsers limit how often; the next change writes it.
  }
}

const SVG = "http://www.w3.org/2000/svg";
function add(parent, name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return parent.appendChild(element);
}
function fillDisc(disc, measured) {
  add(disc, "circle", { class: "disc", r: 1 });
  for (const theta of [30, 60]) add(disc, "circle", { class: "ring", r: theta / 90 });
  for (const [theta, phi] of measured) {
    const [x, y] = onDisc({ theta, phi });
    add(disc, "circle", { class: "measured", r: 0.025, cx: x.toFixed(3), cy: (-y).toFixed(3) });
  }
  add(disc, "circle", { class: "here", r: 0.09 });
}
function tellDirection(key) {
  const [x, y] = onDisc(state[key]), disc = byId(`${key}-disc`), here = disc.querySelector(".here");
  here.setAttribute("cx", x.toFixed(4));
  here.setAttribute("cy", (-y).toFixed(4));
  const [theta, phi] = textOf(state[key]).split(",");
  byId(`${key}-text`).textContent = `${theta}°, ${phi}°`;
  disc.setAttribute("aria-valuenow", theta);
  disc.setAttribute("aria-valuetext", `${theta} degrees from the normal, ${phi} degrees around it`);
}
function tell() {
  tellDirection("light");
  tellDirection("view");
  for (const shape of ["sphere", "plane"]) byId(shape).setAttribute("aria-pressed", state.shape === shape);
  for (const what of ["light", "view"]) byId(`move-${what}`).setAttribute("aria-pressed", state.moving === what);
  byId("exposure").value = Math.log2(state.exposure);
  byId("exposure-text").textContent = `× ${Number(state.exposure.toPrecision(3))}`;
  canvas.classList.toggle("turning", state.moving === "view");
  canvas.setAttribute("aria-label", `${material.title} on a ${state.shape}, light from ${byId("light-text").textContent}, ` +
    `seen from ${byId("view-text").textContent}`);
}

function pixelRatio() {
  return fixedSize ? 1 : Math.min(window.devicePixelRatio || 1, 2);
}
function fitCanvas() {
  const ratio = pixelRatio();
  const [width, height] = fixedSize || [Math.round(window.innerWidth * ratio), Math.round(window.innerHeight * ratio)];
  canvas.style.cssText = fixedSize ? `width: ${width}px; height: ${height}px; margin: auto` : "";
  if (canvas.width !== width) canvas.width = Math.max(width, 1);
  if (canvas.height !== height) canvas.height = Math.max(height, 1);
}
function paintNow() {
  waiting = false;
  if (!painter) return;
  fitCanvas();
  painter.paint(state, pixelRatio());
  tell();
}
/** Shows the state with the browser's next picture. */
function change(values) {
  Object.assign(state, values);
  writeAddress();
  if (!waiting) requestAnimationFrame(paintNow);
  waiting = true;
}
const exposed = (factor) => change({ exposure: Math.min(Math.max(state.exposure * factor, 1 / 16), 16) });
const zoomed = (factor) => change({ zoom: Math.min(Math.max(state.zoom * factor, 0.25), 16) });
const toggleMoving = () => change({ moving: state.moving === "light" ? "view" : "light" });
const reset = () => change({ ...FIRST, moving: "light" });

function save() {
  paintNow();
  canvas.toBlob((blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${material.title}-${state.shape}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });
}

/** The light that shines brightest on a sphere where the pointer is. */
function lightTo(event) {
  const box = canvas.getBoundingClientRect(), radius = 0.45 * Math.min(box.width, box.height);
  const x = (event.clientX - box.left - box.width / 2) / radius, y = (box.top + box.height / 2 - event.clientY) / radius;
  change({ light: { theta: Math.min(Math.asin(Math.min(Math.hypot(x, y), 1)), LOWEST), phi: Math.atan2(y, x) } });
}
/** The shape follows the pointer. */
function turnView(right, down) {
  const box = canvas.getBoundingClientRect(), reach = 0.9 * Math.min(box.width, box.height);
  const [x, y] = onDisc(state.view);
  change({ view: ofDisc([x - right / reach, y + down / reach]) });
}

function listenToPointers() {
  const pointers = new Map();
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    if (pointers.size === 1 && event.button === 0 && state.moving === "light") lightTo(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const right = event.clientX - before.clientX, down = event.clientY - before.clientY;
    const apart = pointers.size === 2 ? spread() : 0;
    pointers.set(event.pointerId, event);
    if (pointers.size === 2) {
      if (apart > 0) zoomed(spread() / apart);
      turnView(right / 2, down / 2);
    } else if (pointers.size === 1) {
      if (event.buttons & 2 || state.moving === "view") turnView(right, down);
      else lightTo(event);
    }
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomed(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)));
  }, { passive: false });
}

function listenToDisc(key) {
  const disc = byId(`${key}-disc`);
  const follow = (event) => {
    const box = disc.getBoundingClientRect();
    change({ [key]: ofDisc([((event.clientX - box.left) / box.width - 0.5) * 2.2, (0.5 - (event.clientY - box.top) / box.height) * 2.2]) });
  };
  disc.addEventListener("pointerdown", (event) => {
    disc.setPointerCapture(event.pointerId);
    follow(event);
  });
  disc.addEventListener("pointermove", (event) => {
    if (disc.hasPointerCapture(event.pointerId)) follow(event);
  });
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || byId("keys").open) return;
  const key = event.key, target = event.target;
  if (ARROWS[key] && target !== byId("exposure")) {
    const what = target === byId("light-disc") ? "light" : target === byId("view-disc") ? "view" : state.moving;
    const step = (event.shiftKey ? 1 : 5) / 90, [x, y] = onDisc(state[what]);
    change({ [what]: ofDisc([x + step * ARROWS[key][0], y + step * ARROWS[key][1]]) });
  } else if (key === "l") toggleMoving();
  else if (key === "p") change({ shape: "plane" });
  else if (key === "s") change({ shape: "sphere" });
  else if (key === "+" || key === "=") zoomed(1.25);
  else if (key === "-") zoomed(0.8);
  else if (key === "[") exposed(1 / Math.SQRT2);
  else if (key === "]") exposed(Math.SQRT2);
  else if (key === "Home" && target !== byId("exposure")) reset();
  else if (key === "h") byId("panel").classList.toggle("hidden");
  else if (key === "d") save();
  else if (key === "?") byId("keys").showModal();
  else return;
  event.preventDefault();
}

function begin() {
  painter = new Painter(canvas);
  fillDisc(byId("light-disc"), material.lights);
  fillDisc(byId("view-disc"), material.views);
  byId("about").textContent = `${material.size.join(" × ")} pixels, a relief of ${(65535 * material.heightStep).toFixed(1)} pixels ` +
    `and ${material.planes} planes, learned from ${painter.pairs.squares.length} pictures.`;
  readAddress();
  listenToPointers();
  listenToDisc("light");
  listenToDisc("view");
  document.addEventListener("keydown", onKey);
  byId("sphere").addEventListener("click", () => change({ shape: "sphere" }));
  byId("plane").addEventListener("click", () => change({ shape: "plane" }));
  byId("move-light").addEventListener("click", () => change({ moving: "light" }));
  byId("move-view").addEventListener("click", () => change({ moving: "view" }));
  byId("exposure").addEventListener("input", (event) => change({ exposure: 2 ** event.target.value }));
  byId("reset").addEventListener("click", reset);
  byId("save").addEventListener("click", save);
  byId("help").addEventListener("click", () => byId("keys").showModal());
  window.addEventListener("resize", () => change({}));
  window.addEventListener("hashchange", () => {
    if (location.hash === written) return;
    readAddress();
    change({});
  });
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    painter.setUp();
    change({});
  });
  paintNow();
}

try {
  begin();
} catch (error) {
  painter = null;
  byId("panel").classList.add("hidden");
  byId("trouble").textContent = error.message;
  byId("trouble").hidden = false;
}
