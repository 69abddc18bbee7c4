// Paints a state of the page into its canvas.

const LONGITUDES = 48, LATITUDES = 25;
// Sine of the diagonal of a step of the grid: entries about what is seen and lit are no further behind.
const BESIDE = Math.sin(Math.SQRT2 * 7.5 * DEGREE);
const XYZ_TO_RGB = [3.2404542, -0.969266, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.041556, 1.0572252];

class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("This browser has no WebGL 2, which the page needs, or has switched it off.");
    this.lattice = new DirectionLattice();
    this.pairs = new MeasuredPairs();
    this.layers = Math.ceil(material.planes / 4);
    const [width, height] = material.size;
    const words = wordsOf("height-data", false);
    this.heights = Float32Array.from(words, (word) => material.heightLow + material.heightStep * word);
    this.planes = bytesOf("planes-data");
    this.tile = [width, height];
    this.setUp();
  }

  setUp() {
    const gl = this.gl, layers = this.layers, colours = material.colours;
    const vertex = "#version 300 es\nvoid main() {\n  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);\n" +
      "  gl_Position = vec4(4.0 * corner - 1.0, 0.0, 1.0);\n}\n";
    const fragment = `#version 300 es\n#define COLOURS ${colours}\n#define LAYERS ${layers}\n` +
      document.getElementById("fragment-shader").textContent;
    this.program = this.build(vertex, fragment);
    gl.useProgram(this.program);
    this.places = new Map();
    this.largest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (Math.max(...this.tile) > this.largest)
      throw new Error(`The material has ${this.tile.join(" × ")} pixels, and this device shows ${this.largest} at most.`);
    this.texture(0, gl.TEXTURE_2D, "heights", gl.REPEAT, gl.REPEAT);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16F, ...this.tile, 0, gl.RED, gl.FLOAT, this.heights);
    this.texture(1, gl.TEXTURE_2D_ARRAY, "planes", gl.REPEAT, gl.REPEAT);
    gl.texImage3D(gl.TEXTURE_2D_ARRAY, 0, gl.RGBA8, ...this.tile, layers, 0, gl.RGBA, gl.UNSIGNED_BYTE, this.planes);
    this.texture(2, gl.TEXTURE_2D_ARRAY, "table", gl.REPEAT, gl.CLAMP_TO_EDGE);
    gl.uniform2f(this.place("tile"), ...this.tile);
    gl.uniform1f(this.place("lowest"), material.heightLow);
    gl.uniform1f(this.place("highest"), material.heightLow + 65535 * material.heightStep);
    gl.uniformMatrix3fv(this.place("to_rgb"), false, material.space === "xyz" ? XYZ_TO_RGB : [1, 0, 0, 0, 1, 0, 0, 0, 1]);
    gl.uniform2f(this.place("steepest"), Math.cos(material.steepestView), Math.sin(material.steepestView));
  }

  build(...sources) {
    const gl = this.gl, program = gl.createProgram();
    sources.forEach((source, i) => {
      const shader = gl.createShader(i === 0 ? gl.VERTEX_SHADER : gl.FRAGMENT_SHADER);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
        throw new Error("The shader was refused: " + gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error("The program was refused: " + gl.getProgramInfoLog(program));
    return program;
  }

  place(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name);
  }

  texture(unit, target, name, across, down) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(target, gl.createTexture());
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(target, gl.TEXTURE_WRAP_S, across);
    gl.texParameteri(target, gl.TEXTURE_WRAP_T, down);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.uniform1i(this.place(name), unit);
  }

  /** Entries of the directions at each place of the grid that is seen and lit, into the texture. A plane has but one:
      there is time for thin plates. */
  fillTable(state, camera, light) {
    const gl = this.gl, sphere = state.shape === "sphere";
    const columns = sphere ? LONGITUDES : 1, rows = sphere ? LATITUDES : 1;
    const layers = material.colours * (this.layers + 1), stride = 4 * columns * rows;
    if (!this.values || this.values.length !== layers * stride) this.values = new Float32Array(layers * stride);
    if (!sphere) {
      this.pairs.write(state.view, state.light, this.values, 0, stride);
    } else {
      this.frames = this.frames || Array.from({ length: columns * rows }, (_, i) =>
        placeFrame((TURN * (i % columns)) / columns, Math.PI * (Math.floor(i / columns) / (rows - 1) - 0.5)));
      this.frames.forEach((frame, i) => {
        if (dot(frame.out, camera.to) <= -BESIDE || dot(frame.out, light) <= -BESIDE) return;
        this.lattice.write(seenFrom(frame, camera.to), seenFrom(frame, light), this.values, 4 * i, stride);
      });
    }
    gl.activeTexture(gl.TEXTURE2);
    gl.texImage3D(gl.TEXTURE_2D_ARRAY, 0, gl.RGBA16F, columns, rows, layers, 0, gl.RGBA, gl.FLOAT, this.values);
    gl.uniform2f(this.place("grid"), columns, rows);
  }

  /** `ratio`: pixels of the canvas to one of the page. */
  paint(state, ratio) {
    const gl = this.gl, { width, height } = this.canvas, [columns, rows] = this.tile;
    if (gl.isContextLost()) return;
    const camera = cameraFrame(state.view), light = vectorOf(state.light), shorter = Math.min(width, height);
    this.fillTable(state, camera, light);
    const around = Math.max(1, Math.round((TURN * 0.45 * shorter) / (ratio * columns)));
    const scale = 1 / (ratio * state.zoom), to = camera.to, more = 1 / (to[2] * (1 + to[2]));
    const middle = (picture, tile) => (picture - 1) / 2 - Math.floor((picture - 1) / 2 - (tile - 1) / 2 + 0.5);
    gl.viewport(0, 0, width, height);
    gl.uniform2f(this.place("picture"), width, height);
    gl.uniform2f(this.place("origin"), middle(width, columns), middle(height, rows));
    gl.uniform1i(this.place("sphere"), state.shape === "sphere" ? 1 : 0);
    gl.uniform3f(this.place("camera_right"), ...camera.right);
    gl.uniform3f(this.place("camera_up"), ...camera.up);
    gl.uniform3f(this.place("camera_to"), ...camera.to);
    gl.uniform3f(this.place("light"), ...light);
    gl.uniform3f(this.place("stretch"), scale * (1 + more * to[0] * to[0]), scale * more * to[0] * to[1],
      scale * (1 + more * to[1] * to[1]));
    gl.uniform1f(this.place("radius"), 0.45 * shorter * state.zoom);
    gl.uniform1f(this.place("texels"), (around * columns) / TURN);
    gl.uniform1f(this.place("exposure"), state.exposure);
    gl.uniform1f(this.place("background"), material.background / state.exposure);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
