// What the page holds: the material's planes and height, and tables of directions (theory 23.2).

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

/** What pictures of a direction need, as a table of units has it. */
class Units {
  constructor(name, means, offsets, weights) {
    const told = material[name];
    this.means = wordsOf(means, false);
    this.offsets = wordsOf(offsets, true);
    this.weights = new Int8Array(bytesOf(weights).buffer);
    this.told = told;
    // Units of U such that planes are from -1/2 to 1/2, and what their middles add to the offset.
    this.units = told.weightUnits.map((unit, k) => unit * material.planeRange[k]);
    this.middles = told.weightUnits.map((unit, k) => unit * material.planeMiddle[k]);
    this.sums = new Float64Array(material.planes);
  }

  /** Writes a weighted sum of rows as the shader takes it: of each colour log(mean / l_z), offset, 0, 0, then U. Layers
      are `stride` numbers apart. */
  write(rows, shares, used, target, at, stride) {
    const { sums, weights, means, offsets, units, middles, told } = this, { planes, colours } = material;
    const layers = Math.ceil(planes / 4);
    for (let colour = 0; colour < colours; ++colour) {
      let mean = 0, offset = 0, whole = 0;
      sums.fill(0);
      for (let i = 0; i < used; ++i) {
        const row = rows[i] * colours + colour, share = shares[i];
        whole += share;
        mean += share * means[row];
        offset += share * offsets[row];
        for (let k = 0, from = row * planes; k < planes; ++k) sums[k] += share * weights[from + k];
      }
      offset *= told.offsetUnit;
      for (let k = 0; k < planes; ++k) offset += sums[k] * middles[k];
      let place = at + colour * (layers + 1) * stride;
      target[place] = whole * told.meanLow + told.meanStep * mean;
      target[place + 1] = offset;
      for (let k = 0; k < planes; ++k) {
        if (k % 4 === 0) place += stride;
        target[place + (k % 4)] = sums[k] * units[k];
      }
    }
  }
}

/** Directions on a lattice, [view][light]: points of two squares that the concentric map lays onto discs. */
class DirectionLattice {
  constructor() {
    this.units = new Units("lattice", "lattice-means", "lattice-offsets", "lattice-weights");
    this.side = material.side;
    this.count = this.side * this.side;
    this.corners = new Int32Array(16);
    this.shares = new Float64Array(16);
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
    if (sector % 2 === 0) return sector === 0 ? [half + out, half + along] : [half - out, half - along];
    return sector === 1 ? [half - along, half + out] : [half + along, half - out];
  }

  /** Linear along all four axes. */
  write(view, light, target, at, stride) {
    const side = this.side, v = this.place(view, material.steepestView, false),
      l = this.place(light, material.steepestLight, true);
    const column = Math.min(Math.floor(v[0]), side - 2), row = Math.min(Math.floor(v[1]), side - 2);
    const lightColumn = Math.min(Math.floor(l[0]), side - 2), lightRow = Math.min(Math.floor(l[1]), side - 2);
    let used = 0;
    for (let i = 0; i < 16; ++i) {
      const a = i & 1, b = (i >> 1) & 1, c = (i >> 2) & 1, d = i >> 3;
      const share = Math.abs(1 - a - v[0] + column) * Math.abs(1 - b - v[1] + row) *
        Math.abs(1 - c - l[0] + lightColumn) * Math.abs(1 - d - l[1] + lightRow);
      if (share === 0) continue;
      this.shares[used] = share;
      this.corners[used++] = ((row + b) * side + column + a) * this.count + (lightRow + d) * side + lightColumn + c;
    }
    this.units.write(this.corners, this.shares, used, target, at, stride);
  }
}

/** The pairs that were measured, between which thin plates are laid (theory 21.3). */
class MeasuredPairs {
  constructor() {
    this.units = new Units("measured", "measured-means", "measured-offsets", "measured-weights");
    const indices = wordsOf("measured-pairs", false), count = indices.length / 2, trueLights = material.trueLights;
    this.points = new Float64Array(6 * count);
    for (let i = 0; i < count; ++i) {
      const [theta, phi] = trueLights ? trueLights[i] : material.lights[indices[2 * i + 1]];
      const view = material.views[indices[2 * i]];
      this.points.set(this.point({ theta: view[0], phi: view[1] }, { theta, phi }), 6 * i);
    }
    this.squares = new Float64Array(count);
  }

  point(view, light) {
    const v = vectorOf(view), l = vectorOf(light), upward = v[2] + l[2];
    const tangent = Math.tan(light.theta) / Math.tan(75 * DEGREE);
    return [view.theta * Math.cos(view.phi), view.theta * Math.sin(view.phi), tangent * Math.cos(light.phi),
      tangent * Math.sin(light.phi), (2 * (v[0] + l[0])) / upward, (2 * (v[1] + l[1])) / upward];
  }

  /** Indices of the nearest, nearest first. */
  nearest(at, count) {
    const squares = this.squares;
    for (let i = 0; i < squares.length; ++i) {
      let sum = 0;
      for (let k = 0; k < 6; ++k) sum += (this.points[6 * i + k] - at[k]) ** 2;
      squares[i] = sum;
    }
    const bound = Float64Array.from(squares).sort()[Math.min(count, squares.length) - 1], found = [];
    for (let i = 0; i < squares.length; ++i) if (squares[i] <= bound) found.push(i);
    return found.sort((a, b) => squares[a] - squares[b] || a - b).slice(0, count);
  }

  write(view, light, target, at, stride) {
    const place = this.point({ ...view, theta: Math.min(view.theta, material.steepestView) },
      { ...light, theta: Math.min(light.theta, material.steepestLight) });
    const found = this.nearest(place, 80);
    const alone = found.length === 1 || this.squares[found[0]] < 1e-12;
    const shares = alone ? [1] : plateWeights(found.map((i) => Array.from(this.points.subarray(6 * i, 6 * i + 6), (x, k) => x - place[k])));
    this.units.write(found, shares, alone ? 1 : found.length, target, at, stride);
  }
}

/** r² log r of a squared distance. */
function plate(squared) {
  return squared > 0 ? 0.5 * squared * Math.log(squared) : 0;
}

/** Coordinates in which points differ independently: others are linear functions of those. */
function independentAxes(points, means) {
  const moments = means.map((a, i) => means.map((b, j) => points.reduce((sum, p) => sum + (p[i] - a) * (p[j] - b), 0)));
  const axes = [];
  let first = 0;
  while (axes.length < Math.min(means.length, points.length - 2)) {
    let pivot = -1;
    for (let i = 0; i < means.length; ++i)
      if (!axes.includes(i) && (pivot < 0 || moments[i][i] > moments[pivot][pivot])) pivot = i;
    first = first || moments[pivot][pivot];
    if (!(moments[pivot][pivot] > 1e-6 * first)) break;
    axes.push(pivot);
    const row = [...moments[pivot]];
    for (let i = 0; i < means.length; ++i)
      for (let j = 0; j < means.length; ++j) moments[i][j] -= (row[i] * row[j]) / row[pivot];
  }
  return axes;
}

/** Weights of values at points for the value at the origin: thin plates and a linear function. */
function plateWeights(points) {
  const n = points.length, means = points[0].map((_, k) => points.reduce((sum, p) => sum + p[k], 0) / n);
  const axes = independentAxes(points, means), size = n + 1 + axes.length, width = size + 1;
  const system = new Float64Array(size * width);
  points.forEach((p, i) => {
    points.forEach((q, j) => {
      system[i * width + j] = plate(p.reduce((sum, x, k) => sum + (x - q[k]) ** 2, 0));
    });
    [1, ...axes.map((k) => p[k] - means[k])].forEach((value, j) => {
      system[i * width + n + j] = system[(n + j) * width + i] = value;
    });
    system[i * width + size] = plate(p.reduce((sum, x) => sum + x * x, 0));
  });
  [1, ...axes.map((k) => -means[k])].forEach((value, j) => {
    system[(n + j) * width + size] = value;
  });
  return solved(system, size).subarray(0, n);
}

/** Of a square system with its right side as last column, by elimination with the largest pivots. */
function solved(system, size) {
  const width = size + 1;
  for (let k = 0; k < size; ++k) {
    let pivot = k;
    for (let i = k + 1; i < size; ++i)
      if (Math.abs(system[i * width + k]) > Math.abs(system[pivot * width + k])) pivot = i;
    for (let j = k; pivot !== k && j < width; ++j)
      [system[k * width + j], system[pivot * width + j]] = [system[pivot * width + j], system[k * width + j]];
    for (let i = k + 1; i < size; ++i) {
      const factor = system[i * width + k] / system[k * width + k];
      for (let j = k + 1; factor !== 0 && j < width; ++j) system[i * width + j] -= factor * system[k * width + j];
    }
  }
  const result = new Float64Array(size);
  for (let i = size - 1; i >= 0; --i) {
    let sum = system[i * width + size];
    for (let j = i + 1; j < size; ++j) sum -= system[i * width + j] * result[j];
    result[i] = sum / system[i * width + i];
  }
  return result;
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
