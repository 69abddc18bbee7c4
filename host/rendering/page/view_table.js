// What the page holds: the material's planes and height, and a table of directions (theory 21.6).

const TURN = 2 * Math.PI;
const DEGREE = Math.PI / 180;

const material = JSON.parse(document.getElementById("material").textContent);

/** Bytes of a script element that holds base64, which is let go of. */
function bytesOf(id) {
  const element = document.getElementById(id);
  const text = atob(element.textContent.trim());
  element.textContent = "";
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** Numbers of 16 bits, the lower byte first. */
function wordsOf(id, signed) {
  const bytes = bytesOf(id);
  const view = new DataView(bytes.buffer);
  const words = signed ? new Int16Array(bytes.length / 2) : new Uint16Array(bytes.length / 2);
  for (let i = 0; i < words.length; ++i) words[i] = signed ? view.getInt16(2 * i, true) : view.getUint16(2 * i, true);
  return words;
}

function vectorOf(direction) {
  const sine = Math.sin(direction.theta);
  return [sine * Math.cos(direction.phi), sine * Math.sin(direction.phi), Math.cos(direction.theta)];
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** The table of directions: [view][light] on two squares that the concentric map lays onto discs. */
class DirectionTable {
  constructor() {
    this.side = material.side;
    this.count = this.side * this.side;
    this.planes = material.planes;
    this.colours = material.colours;
    this.layers = Math.ceil(this.planes / 4);
    this.means = wordsOf("means-data", false);
    this.offsets = wordsOf("offsets-data", true);
    this.weights = new Int8Array(bytesOf("weights-data").buffer);
    // Units of U such that planes are from -1/2 to 1/2, and what their middles add to the offset.
    this.units = material.weightUnits.map((unit, k) => unit * material.planeRange[k]);
    this.middles = material.weightUnits.map((unit, k) => unit * material.planeMiddle[k]);
    this.corners = new Int32Array(16);
    this.shares = new Float64Array(16);
    this.sums = new Float64Array(this.planes);
  }

  /** Column and row on the square. Between two rings, lights go by the tangent of theta. */
  place(direction, steepest, tangents) {
    const half = (this.side - 1) / 2, step = steepest / half;
    let out = steepest > 0 ? half * Math.min(direction.theta / steepest, 1) : 0;
    if (tangents && out < half) {
      const ring = Math.floor(out), below = Math.tan(ring * step), above = Math.tan((ring + 1) * step);
      out = ring + (Math.tan(direction.theta) - below) / (above - below);
    }
    const turn = direction.phi / TURN + 0.125, eighths = 8 * (turn - Math.floor(turn));
    const sector = Math.min(Math.floor(eighths / 2), 3), along = (eighths - 2 * sector - 1) * out;
    return [half + [out, -along, -out, along][sector], half + [along, out, -along, -out][sector]];
  }

  /** Writes an entry as the shader takes it: of each colour log(mean / l_z), offset, 0, 0, then U. Layers are
      `stride` numbers apart. */
  write(view, light, target, at, stride) {
    const side = this.side, v = this.place(view, material.steepestView, false),
      l = this.place(light, material.steepestLight, true);
    const low = [v[0], v[1], l[0], l[1]].map((x) => Math.min(Math.floor(x), side - 2));
    const part = [v[0] - low[0], v[1] - low[1], l[0] - low[2], l[1] - low[3]];
    let used = 0;
    for (let i = 0; i < 16; ++i) {
      const a = i & 1, b = (i >> 1) & 1, c = (i >> 2) & 1, d = i >> 3;
      const share = (a ? part[0] : 1 - part[0]) * (b ? part[1] : 1 - part[1]) *
        (c ? part[2] : 1 - part[2]) * (d ? part[3] : 1 - part[3]);
      if (share === 0) continue;
      this.shares[used] = share;
      this.corners[used++] = ((low[1] + b) * side + low[0] + a) * this.count + (low[3] + d) * side + low[2] + c;
    }
    const { planes, sums, shares, corners, weights } = this;
    for (let colour = 0; colour < this.colours; ++colour) {
      let mean = 0, offset = 0;
      sums.fill(0);
      for (let i = 0; i < used; ++i) {
        const row = corners[i] * this.colours + colour, share = shares[i];
        mean += share * this.means[row];
        offset += share * this.offsets[row];
        for (let k = 0, from = row * planes; k < planes; ++k) sums[k] += share * weights[from + k];
      }
      offset *= material.offsetUnit;
      for (let k = 0; k < planes; ++k) offset += sums[k] * this.middles[k];
      let place = at + colour * (this.layers + 1) * stride;
      target[place] = material.meanLow + material.meanStep * mean;
      target[place + 1] = offset;
      for (let k = 0; k < planes; ++k) {
        if (k % 4 === 0) place += stride;
        target[place + (k % 4)] = sums[k] * this.units[k];
      }
    }
  }
}

/** Right and up of a picture from a view: the camera goes there the shortest way. */
function cameraFrame(view) {
  const to = vectorOf(view), x = to[0] / (1 + to[2]), y = to[1] / (1 + to[2]);
  return { right: [1 - x * to[0], -x * to[1], -to[0]], up: [-x * to[1], 1 - y * to[1], -to[1]], to };
}

/** Frame of a place on a sphere with poles at ±y. */
function placeFrame(longitude, latitude) {
  const sine = Math.sin(longitude), cosine = Math.cos(longitude), level = Math.cos(latitude), north = Math.sin(latitude);
  return {
    east: [cosine, 0, -sine],
    north: [-sine * north, level, -cosine * north],
    out: [sine * level, north, cosine * level],
  };
}

function seenFrom(frame, direction) {
  const x = dot(frame.east, direction), y = dot(frame.north, direction), z = dot(frame.out, direction);
  return { theta: Math.min(Math.atan2(Math.hypot(x, y), z), Math.PI / 2 - 1e-3), phi: Math.atan2(y, x) };
}
