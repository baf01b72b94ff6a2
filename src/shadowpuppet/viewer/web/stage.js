"use strict";
// The scene in space, drawn with WebGL 2: bodies, lines, points, cameras and their images; a view that turns; joints and cameras to click.

// An array from `content.packed`.
function unpack(packed) {
  const kinds = {f4: Float32Array, f8: Float64Array, i1: Int8Array, i2: Int16Array, i4: Int32Array, u1: Uint8Array, u4: Uint32Array};
  const text = atob(packed.data), bytes = new Uint8Array(text.length);
  for (let n = 0; n < text.length; n++) bytes[n] = text.charCodeAt(n);
  return new kinds[packed.type](bytes.buffer);
}

// Vectors and 4 x 4 matrices (column by column).
const V = {
  add: (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]],
  sub: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  unit: a => { const size = Math.hypot(...a) || 1; return [a[0] / size, a[1] / size, a[2] / size]; },
};
function multiplied(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}
function seenAt(m, p) {  // clip coordinates
  return [0, 1, 2, 3].map(r => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
}

const BODY_VERTEX = `#version 300 es
in vec3 place; in vec3 normal; in vec3 colour; in float joint; in float limb;
uniform mat4 view; uniform sampler2D joints; uniform vec3 shift; uniform float pale[8];
out vec3 outward; out vec3 paint; out float faint;
vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
void main() {
  int j = int(joint + 0.5);
  vec4 q = texelFetch(joints, ivec2(0, j), 0), at = texelFetch(joints, ivec2(1, j), 0);
  outward = turned(q, normal); paint = colour; faint = pale[int(limb + 0.5)];
  gl_Position = at.w < 0.5 ? vec4(0, 0, 2, 1) : view * vec4(turned(q, place) + at.xyz + shift, 1);
}`;
const BODY_FRAGMENT = `#version 300 es
precision highp float;
in vec3 outward; in vec3 paint; in float faint;
uniform vec3 toward; uniform vec3 fade; uniform float scale; uniform float opacity;
out vec4 seen;
void main() {
  if (faint > 0.5 && mod(gl_FragCoord.x + gl_FragCoord.y, 8.0 * scale) < 4.0 * scale) discard;
  vec3 n = normalize(outward);
  if (dot(n, toward) < 0.0) n = -n;
  float light = 0.50 + 0.16 * n.z + 0.38 * max(dot(n, normalize(toward + vec3(0.25, 0.15, 0.55))), 0.0);
  seen = vec4(mix(paint * light, fade, faint * 0.2), opacity);
}`;
const LINE_VERTEX = `#version 300 es
in vec2 corner; in vec3 start; in vec3 end; in vec4 colour; in float width;
uniform mat4 view; uniform vec2 size;
out vec4 paint;
void main() {
  vec4 a = view * vec4(start, 1), b = view * vec4(end, 1);
  float near = 0.01;
  if (a.w < near && b.w < near) { gl_Position = vec4(0, 0, 2, 1); return; }
  if (a.w < near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * size;
  float extent = length(along);
  vec2 aside = extent > 1e-6 ? vec2(-along.y, along.x) / extent : vec2(0, 1);
  vec4 at = corner.x < 0.5 ? a : b;
  at.xy += aside * corner.y * width / size * at.w;
  gl_Position = at; paint = colour;
}`;
const LINE_FRAGMENT = `#version 300 es
precision highp float; in vec4 paint; out vec4 seen; void main() { seen = paint; }`;
const POINT_VERTEX = `#version 300 es
in vec3 place; in vec3 colour; uniform mat4 view; uniform float wide; out vec4 paint;
void main() { gl_Position = view * vec4(place, 1); gl_PointSize = clamp(wide / gl_Position.w, 1.5, 12.0); paint = vec4(colour, 1); }`;
const IMAGE_VERTEX = `#version 300 es
in vec3 place; in vec2 at; uniform mat4 view; out vec2 where; void main() { where = at; gl_Position = view * vec4(place, 1); }`;
const IMAGE_FRAGMENT = `#version 300 es
precision highp float; in vec2 where; uniform sampler2D pictures; uniform sampler2D silhouettes; uniform vec2 shown;
uniform vec3 person; uniform float opacity; out vec4 seen;
void main() {
  float inside = texture(silhouettes, where).r;
  vec3 dimmed = texture(pictures, where).rgb * (shown.y > 0.5 ? mix(0.65, 1.0, inside) : 1.0);
  seen = shown.x > 0.5 ? vec4(dimmed, opacity) : vec4(person, mix(0.10, 0.85, inside) * opacity);
}`;
const LAYERS = ["pictures", "silhouettes"];

class Stage {
  constructor(data, canvas, labels, acts) {
    this.data = data; this.canvas = canvas; this.labels = labels; this.acts = acts;
    this.gl = canvas.getContext("webgl2", {antialias: true, alpha: false});
    if (!this.gl) throw new Error("this browser shows no WebGL 2");
    this.programs = {
      body: this.program(BODY_VERTEX, BODY_FRAGMENT), line: this.program(LINE_VERTEX, LINE_FRAGMENT),
      point: this.program(POINT_VERTEX, LINE_FRAGMENT), image: this.program(IMAGE_VERTEX, IMAGE_FRAGMENT),
    };
    this.figures = data.figures.map(each => this.figure(each));
    this.cameras = data.cameras.map(each => this.camera(each));
    this.shown = {cameras: true, images: true, pictures: true, silhouettes: true, keypoints: true, rays: false, intervals: true, hull: false, particles: false};
    this.kinds = {};
    this.chosen = null;      // {figure, joint}
    this.through = null;     // index of a camera
    this.extra = {hull: null, particles: null};
    this.target = [0, 0, 0]; this.turn = [0, 0.3]; this.far = 4;
    this.lineArray = this.gl.createBuffer();
    this.corners = this.buffer(new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]));
    this.marks();
    this.control();
    this.colours();
  }

  // Buffers, programs, textures

  program(vertex, fragment) {
    const gl = this.gl, made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  }
  buffer(values, kind = this.gl.ARRAY_BUFFER) {
    const made = this.gl.createBuffer();
    this.gl.bindBuffer(kind, made); this.gl.bufferData(kind, values, this.gl.STATIC_DRAW);
    return made;
  }
  texture(filter) {
    const gl = this.gl, made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, filter);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    return made;
  }
  attribute(program, name, buffer, size, {stride = 0, offset = 0, type = this.gl.FLOAT, scaled = false, each = 0} = {}) {
    const gl = this.gl, at = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, type, scaled, stride, offset);
    gl.vertexAttribDivisor(at, each);
  }
  uniform(program, name) { return this.gl.getUniformLocation(program, name); }

  figure(each) {
    const gl = this.gl, made = {...each};
    this.move(made, each);
    if (each.mesh) {
      const mesh = Object.fromEntries(Object.entries(each.mesh).map(([name, values]) => [name, unpack(values)]));
      made.array = gl.createVertexArray();
      gl.bindVertexArray(made.array);
      const program = this.programs.body;
      this.attribute(program, "place", this.buffer(mesh.points), 3);
      this.attribute(program, "normal", this.buffer(mesh.normals), 3);
      this.attribute(program, "colour", this.buffer(mesh.colours), 3, {type: gl.UNSIGNED_BYTE, scaled: true});
      this.attribute(program, "joint", this.buffer(mesh.joints), 1);
      this.attribute(program, "limb", this.buffer(mesh.limbs), 1);
      this.buffer(mesh.triangles, gl.ELEMENT_ARRAY_BUFFER);
      gl.bindVertexArray(null);
      made.corners = mesh.triangles.length;
      made.texture = this.texture(gl.NEAREST);
    }
    return made;
  }
  // A figure's frames, from `content.motion_content`.
  move(figure, each) {
    for (const name of ["frames", "turns", "places", "named", "sd", "doubtful"]) figure[name] = each[name] ? unpack(each[name]) : null;
    this.stale = true;
  }
  camera(each) {
    const R = each.pose, centre = [R[0][3], R[1][3], R[2][3]];
    const axis = n => [R[0][n], R[1][n], R[2][n]];
    const layers = Object.fromEntries(LAYERS.map(layer => [layer, {texture: this.texture(this.gl.LINEAR), ready: false}]));
    return {...each, centre, right: axis(0), down: axis(1), ahead: axis(2), layers, keypoints: each.keypoints && unpack(each.keypoints)};
  }
  // A place of a camera's picture, from -1 to 1 in both directions, at a distance before it.
  ahead(camera, distance, [x, y]) {
    const [wide, high] = camera.tan, at = V.add(camera.centre, camera.ahead, distance);
    return V.add(V.add(at, camera.right, x * wide * distance), camera.down, y * high * distance);
  }
  cornersOf(camera, distance) { return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(at => this.ahead(camera, distance, at)); }
  setImage(n, layer, image) {
    const gl = this.gl, own = this.cameras[n].layers[layer];
    own.ready = image !== null;
    if (image) {
      gl.bindTexture(gl.TEXTURE_2D, own.texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    }
    this.stale = true;
  }

  // The view

  get size() { const [low, high] = this.data.box; return Math.max(Math.hypot(...V.sub(high, low)), 1); }
  get middle() { const [low, high] = this.data.box; return low.map((value, n) => (value + high[n]) / 2); }
  get reach() { return Math.min(Math.max(0.22 * this.size, 0.18), 0.75); }

  boxCorners() {
    const low = V.add(this.data.box[0], [0.2, 0.2, 0.1], -1), high = V.add(this.data.box[1], [0.2, 0.2, 0.15]);
    return [0, 1, 2, 3, 4, 5, 6, 7].map(n => [0, 1, 2].map(axis => (n >> axis & 1 ? high : low)[axis]));
  }
  // Everything in view: the body in all its frames and, if wanted, all cameras.
  frameAll(withCameras = true) {
    this.look(null);
    const points = this.boxCorners();
    if (withCameras) for (const camera of this.cameras) points.push(camera.centre, ...this.cornersOf(camera, this.reach));
    const low = [0, 1, 2].map(n => Math.min(...points.map(p => p[n]))), high = [0, 1, 2].map(n => Math.max(...points.map(p => p[n])));
    this.target = low.map((value, n) => (value + high[n]) / 2);
    const [x, y, z] = this.data.direction;
    let around = Math.atan2(y, x), up = Math.min(Math.max(Math.atan2(z, Math.hypot(x, y)), 0.15), 0.6);
    if (this.cameras.length == 1) {  // beside the line of sight, so that camera and person are both seen
      const away = V.sub(this.cameras[0].centre, this.middle);
      around = Math.atan2(away[1], away[0]) + 1.0; up = 0.3;
    }
    this.turn = [around, up];
    const tan = this.tangents();
    this.far = 1;
    for (let step = 0; step < 3; step++) {  // the target moves to the middle of what is seen
      const [right, above, back] = this.axes();
      this.far = 0.5;
      for (const point of points) {
        const p = V.sub(point, this.target);
        for (const [axis, n] of [[right, 0], [above, 1]])
          this.far = Math.max(this.far, V.dot(p, back) + Math.abs(V.dot(p, axis)) / (0.92 * tan[n]));
      }
      if (step == 2) break;
      for (const [axis, n] of [[right, 0], [above, 1]]) {
        const seen = points.map(point => { const p = V.sub(point, this.target); return V.dot(p, axis) / (this.far - V.dot(p, back)); });
        this.target = V.add(this.target, axis, (Math.min(...seen) + Math.max(...seen)) / 2 * this.far);
      }
    }
    this.far *= 1.04;
    this.stale = true;
  }
  look(n) {
    this.through = n; this.stale = true;
    this.acts.looked(n);
  }
  // From looking through a camera to a free view from its place.
  leave() {
    const back = V.sub(this.eye, this.middle);
    this.target = this.middle; this.far = Math.hypot(...back);
    this.turn = [Math.atan2(back[1], back[0]), Math.asin(V.unit(back)[2])];
    this.look(null);
  }
  axes() {
    if (this.through !== null) {
      const camera = this.cameras[this.through];
      return [camera.right, camera.down.map(value => -value), camera.ahead.map(value => -value)];
    }
    const [around, up] = this.turn;
    const back = [Math.cos(up) * Math.cos(around), Math.cos(up) * Math.sin(around), Math.sin(up)];
    const right = V.unit(V.cross([0, 0, 1], back));
    return [right, V.cross(back, right), back];
  }
  get eye() { return this.through !== null ? this.cameras[this.through].centre : V.add(this.target, this.axes()[2], this.far); }
  tangents() {
    const shape = (this.canvas.clientWidth || 1) / (this.canvas.clientHeight || 1);
    if (this.through !== null) {
      const [wide, high] = this.cameras[this.through].tan.map(value => 1.02 * value);
      return shape > wide / high ? [high * shape, high] : [wide, wide / shape];
    }
    const high = Math.tan(0.42);
    return [high * shape, high];
  }
  matrix() {
    const [right, above, back] = this.axes(), eye = this.eye, [wide, high] = this.tangents();
    const turn = new Float32Array([right[0], above[0], back[0], 0, right[1], above[1], back[1], 0, right[2], above[2], back[2], 0,
      -V.dot(right, eye), -V.dot(above, eye), -V.dot(back, eye), 1]);
    const near = 0.05, far = 20 * this.size + 4 * this.far + 100;
    const lens = new Float32Array([1 / wide, 0, 0, 0, 0, 1 / high, 0, 0, 0, 0, -(far + near) / (far - near), -1, 0, 0, -2 * far * near / (far - near), 0]);
    return multiplied(lens, turn);
  }
  onScreen(point, matrix = this.matrix()) {
    const [x, y, , w] = seenAt(matrix, point);
    return w < 0.02 ? null : [(x / w + 1) / 2 * this.canvas.clientWidth, (1 - y / w) / 2 * this.canvas.clientHeight];
  }

  // Drawing

  colours() {
    const style = getComputedStyle(document.documentElement);
    this.paint = name => {
      const text = style.getPropertyValue(name).trim();
      return [1, 3, 5].map(n => parseInt(text.slice(n, n + 2), 16) / 255);
    };
    this.stale = true;
  }
  draw(frame) {
    const gl = this.gl, scale = Math.min(window.devicePixelRatio || 1, 2);
    const size = [Math.round(this.canvas.clientWidth * scale), Math.round(this.canvas.clientHeight * scale)];
    if (this.canvas.width != size[0] || this.canvas.height != size[1]) [this.canvas.width, this.canvas.height] = size;
    this.frame = frame; this.stale = false; this.pixels = size; this.scale = scale;
    const matrix = this.matrix();
    gl.viewport(0, 0, ...size);
    gl.clearColor(...this.paint("--paper"), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    if (this.through !== null) this.drawImage(this.through, matrix, 1, true);
    this.drawLines(this.floor(), matrix);
    for (const each of this.figures) this.drawFigure(each, frame, matrix);
    if (this.shown.hull && this.extra.hull) this.drawPoints(this.extra.hull, matrix);
    if (this.shown.cameras) {
      this.drawLines(this.cameras.flatMap((camera, n) => n == this.through ? [] : this.frustum(camera)), matrix);
      if (this.shown.images && this.through === null) {
        this.cameras.forEach((camera, n) => this.drawImage(n, matrix, 0.9));
        this.drawLines(this.cameras.flatMap(camera => this.crossLines(camera, frame)), matrix);
      }
    }
    gl.disable(gl.DEPTH_TEST);
    const crosses = this.through === null ? [] : this.crossLines(this.cameras[this.through], frame);
    this.drawLines([...this.rays(frame), ...this.particleLines(), ...this.figures.flatMap(each => this.linesOf(each, frame)), ...crosses], matrix);
    this.place(matrix);
  }
  // Index of a figure's own frame that is shown at a frame of the timeline; -1 for none.
  at(figure, frame) { return this.kinds[figure.kind] === false ? -1 : figure.frames[frame]; }

  drawFigure(figure, frame, matrix) {
    const n = this.at(figure, frame), gl = this.gl;
    if (!figure.array || n < 0) return;
    const J = figure.joints, texels = new Float32Array(8 * J);
    for (let j = 0; j < J; j++) {
      for (let k = 0; k < 4; k++) texels[8 * j + k] = figure.turns[4 * (n * J + j) + k] / 32767;
      const known = Number.isFinite(figure.places[3 * (n * J + j)]);
      for (let k = 0; k < 3; k++) texels[8 * j + 4 + k] = known ? figure.places[3 * (n * J + j) + k] : 0;
      texels[8 * j + 7] = known ? 1 : 0;
    }
    const program = this.programs.body, pale = new Float32Array(8);
    if (figure.doubtful) for (let k = 0; k < figure.limbs; k++) pale[k] = figure.doubtful[n * figure.limbs + k];
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, figure.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 2, J, 0, gl.RGBA, gl.FLOAT, texels);
    gl.uniformMatrix4fv(this.uniform(program, "view"), false, matrix);
    gl.uniform3fv(this.uniform(program, "shift"), figure.shift);
    gl.uniform1fv(this.uniform(program, "pale"), pale);
    gl.uniform3fv(this.uniform(program, "toward"), this.axes()[2]);
    gl.uniform3fv(this.uniform(program, "fade"), this.paint("--paper"));
    gl.uniform1f(this.uniform(program, "scale"), this.scale);
    gl.uniform1f(this.uniform(program, "opacity"), this.through === null ? 1 : 0.5);
    gl.bindVertexArray(figure.array);
    gl.drawElements(gl.TRIANGLES, figure.corners, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }
  // Lines are [start, end, [r, g, b, a], width in pixels].
  drawLines(lines, matrix) {
    if (!lines.length) return;
    const gl = this.gl, program = this.programs.line, values = new Float32Array(11 * lines.length);
    lines.forEach(([a, b, colour, width], n) => values.set([...a, ...b, ...colour, width * this.scale], 11 * n));
    gl.useProgram(program);
    gl.bindVertexArray(null);
    for (let n = 0; n < 8; n++) gl.disableVertexAttribArray(n);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineArray); gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    this.attribute(program, "corner", this.corners, 2);
    [["start", 3, 0], ["end", 3, 12], ["colour", 4, 24], ["width", 1, 40]].forEach(([name, size, offset]) =>
      this.attribute(program, name, this.lineArray, size, {stride: 44, offset, each: 1}));
    gl.uniformMatrix4fv(this.uniform(program, "view"), false, matrix);
    gl.uniform2fv(this.uniform(program, "size"), this.pixels);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.length);
    for (const name of ["start", "end", "colour", "width"]) gl.vertexAttribDivisor(gl.getAttribLocation(program, name), 0);
  }
  drawPoints(points, matrix) {
    const gl = this.gl, program = this.programs.point, count = points.length / 4, values = new Float32Array(6 * count);
    const paints = this.cameras.map(camera => hexColour(camera.colour));
    for (let n = 0; n < count; n++) values.set([...points.subarray(4 * n, 4 * n + 3), ...paints[points[4 * n + 3]]], 6 * n);
    gl.useProgram(program);
    gl.bindVertexArray(null);
    for (let n = 0; n < 8; n++) gl.disableVertexAttribArray(n);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineArray); gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    this.attribute(program, "place", this.lineArray, 3, {stride: 24});
    this.attribute(program, "colour", this.lineArray, 3, {stride: 24, offset: 12});
    gl.uniformMatrix4fv(this.uniform(program, "view"), false, matrix);
    gl.uniform1f(this.uniform(program, "wide"), 0.012 * this.pixels[1] / this.tangents()[1] / 2);
    gl.drawArrays(gl.POINTS, 0, count);
  }
  drawImage(n, matrix, opacity, behind = false) {
    const camera = this.cameras[n], gl = this.gl, program = this.programs.image;
    const shown = LAYERS.map(layer => this.shown[layer] && camera.layers[layer].ready ? 1 : 0);
    if (!shown[0] && !shown[1]) return;
    const away = behind ? Math.hypot(...V.sub(camera.centre, this.middle)) + this.size : this.reach;
    const [a, b, c, d] = this.cornersOf(camera, away);
    const values = new Float32Array([...a, 0, 0, ...b, 1, 0, ...d, 0, 1, ...c, 1, 1]);
    gl.useProgram(program);
    gl.bindVertexArray(null);
    for (let k = 0; k < 8; k++) gl.disableVertexAttribArray(k);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineArray); gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    this.attribute(program, "place", this.lineArray, 3, {stride: 20});
    this.attribute(program, "at", this.lineArray, 2, {stride: 20, offset: 12});
    LAYERS.forEach((layer, k) => {
      gl.activeTexture(gl.TEXTURE0 + k); gl.bindTexture(gl.TEXTURE_2D, camera.layers[layer].texture);
      gl.uniform1i(this.uniform(program, layer), k);
    });
    gl.activeTexture(gl.TEXTURE0);
    gl.uniformMatrix4fv(this.uniform(program, "view"), false, matrix);
    gl.uniform2fv(this.uniform(program, "shown"), shown);
    gl.uniform1f(this.uniform(program, "opacity"), opacity);
    gl.uniform3fv(this.uniform(program, "person"), this.paint("--mask"));
    if (behind) gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
  }

  // A detector's keypoints in a camera's picture: [x, y], from -1 to 1, the side's colour, 0..255, the confidence.
  crosses(camera, frame) {
    const {keypoints, sides} = camera, out = [];
    for (let k = 0; keypoints && this.shown.keypoints && k < sides.length; k++) {
      const [x, y, sure] = [0, 1, 2].map(n => keypoints[3 * (frame * sides.length + k) + n] / 10000);
      if (sure) out.push([[x, y], this.data.sides[sides[k]], sure]);
    }
    return out;
  }
  crossLines(camera, frame) {
    const arm = 0.03, slim = arm * camera.tan[1] / camera.tan[0], away = 0.99 * this.reach;
    return this.crosses(camera, frame).flatMap(([[x, y], colour, sure]) => [[slim, 0], [0, arm]].map(([dx, dy]) =>
      [this.ahead(camera, away, [x - dx, y - dy]), this.ahead(camera, away, [x + dx, y + dy]), [...colour.map(value => value / 255), sure], 1]));
  }
  rays(frame) {
    return !this.shown.rays ? [] : this.cameras.flatMap(camera => this.crosses(camera, frame).map(([at, colour, sure]) =>
      [camera.centre, this.ahead(camera, Math.hypot(...V.sub(camera.centre, this.middle)) + this.size / 2, at), [...colour.map(value => value / 255), sure / 2], 0.6]));
  }

  floor() {
    const [low, high] = this.data.box, colour = [...this.paint("--grid"), 1], z = this.data.floor, out = [];
    const side = Math.ceil(Math.max(high[0] - low[0], high[1] - low[1]) + 2.5) / 2;
    const [x, y] = [Math.round(this.middle[0]), Math.round(this.middle[1])];
    for (let at = -Math.ceil(side); at <= side; at += 0.5) {
      const width = at % 1 ? 0.5 : 0.9, end = Math.ceil(side);
      out.push([[x + at, y - end, z], [x + at, y + end, z], colour, width], [[x - end, y + at, z], [x + end, y + at, z], colour, width]);
    }
    return out;
  }
  frustum(camera) {
    const corners = this.cornersOf(camera, this.reach), colour = [...hexColour(camera.colour), 1];
    return corners.flatMap((corner, n) => [[camera.centre, corner, colour, 1.2], [corner, corners[(n + 1) % 4], colour, 1.2]]);
  }
  joint(figure, n, j) {
    if (!figure.named || n < 0) return null;
    const k = 3 * (n * figure.jointNames.length + j), at = [figure.named[k], figure.named[k + 1], figure.named[k + 2]];
    return Number.isFinite(at[0] + at[1] + at[2]) ? V.add(at, figure.shift) : null;
  }
  // What is drawn over the bodies: the truth's bones, intervals, the chosen joint.
  linesOf(figure, frame) {
    const n = this.at(figure, frame), out = [];
    if (n < 0) return out;
    const truth = figure.kind == "truth", over = this.through !== null && !truth;
    if (over)  // the body shows what is behind it: its bones in the sides' colours, those of doubtful limbs dashed
      for (const [width, paint] of [[3.6, () => [0, 0, 0]], [2.6, joint => this.data.sides[figure.jointSides[joint]]]])
        for (const [a, b] of figure.bones) {
          const [start, end] = [this.joint(figure, n, a), this.joint(figure, n, b)], along = start && end && V.sub(end, start);
          const pieces = figure.doubtful && figure.doubtful[n * figure.limbs + figure.jointLimbs[b]] ? 7 : 1;
          for (let k = 0; along && k < pieces; k += 2)
            out.push([V.add(start, along, k / pieces), V.add(start, along, (k + 1) / pieces), [...paint(b).map(value => value / 255), 1], width]);
        }
    if (truth && !figure.array)
      for (const [width, colour] of [[1.9, [...this.paint("--paper"), 0.9]], [0.9, [...this.paint("--truth"), 1]]])
        for (const [a, b] of figure.bones) {
          const [start, end] = [this.joint(figure, n, a), this.joint(figure, n, b)];
          if (start && end) out.push([start, end, colour, width]);
        }
    if (this.shown.intervals && figure.sd && figure.kind != "truth") {
      const colour = [...this.paint("--lost"), 1];
      for (let j = 0; j < figure.jointNames.length; j++) {
        const at = this.joint(figure, n, j);
        for (let axis = 0; at && axis < 3; axis++) {
          const reach = this.data.interval * figure.sd[3 * (n * figure.jointNames.length + j) + axis];
          if (!Number.isFinite(reach)) continue;
          const along = [0, 0, 0]; along[axis] = reach;
          out.push([V.add(at, along, -1), V.add(at, along), colour, 0.8]);
        }
      }
    }
    if (this.chosen && this.chosen.figure === figure) {
      const at = this.joint(figure, n, this.chosen.joint), [right, above] = this.axes(), r = 0.012 * Math.hypot(...V.sub(at || this.eye, this.eye));
      for (let k = 0; at && k < 16; k++) {
        const [a, b] = [k, k + 1].map(m => V.add(V.add(at, right, r * Math.cos(m * Math.PI / 8)), above, r * Math.sin(m * Math.PI / 8)));
        out.push([a, b, [...this.paint("--ink"), 1], 1.5]);
      }
    }
    return out;
  }
  particleLines() {
    const values = this.shown.particles ? this.extra.particles : null, out = [];
    for (let n = 0; values && n < values.length; n += 7) {
      const weight = values[n + 6];
      out.push([values.subarray(n, n + 3), values.subarray(n + 3, n + 6), [0.66 + 0.2 * weight, 0.69 - 0.53 * weight, 0.75 - 0.44 * weight, 0.8], 0.7]);
    }
    return out;
  }

  // Names of cameras and people, and clicks

  marks() {
    this.named = [];
    this.cameras.forEach((camera, n) => {
      const mark = element("button", {textContent: camera.name, title: `Look through ${camera.name}`});
      mark.addEventListener("click", () => this.acts.look(n));
      this.named.push({mark, at: () => this.shown.cameras && this.through === null ? camera.centre : null});
    });
    for (const label of this.data.labels) this.named.push({mark: element("span", {textContent: label.text}), at: () => label.at});
    const people = this.figures.filter(each => each.kind != "truth" && each.kind != "mean");
    if (people.length > 1) for (const each of people)
      this.named.push({mark: element("span", {textContent: each.name}), at: frame => {
        const n = this.at(each, frame), top = n < 0 ? null : [0, 0, -Infinity];
        for (let j = 0; top && j < each.jointNames.length; j++) {
          const at = this.joint(each, n, j);
          if (at && at[2] > top[2]) [top[0], top[1], top[2]] = at;
        }
        return top && Number.isFinite(top[2]) ? V.add(top, [0, 0, 0.3]) : null;
      }});
    this.labels.replaceChildren(...this.named.map(each => each.mark));
  }
  place(matrix) {
    for (const {mark, at} of this.named) {
      const point = at(this.frame), pixel = point && this.onScreen(point, matrix);
      mark.hidden = !pixel;
      if (!pixel) continue;
      const x = Math.min(Math.max(pixel[0] - mark.offsetWidth / 2, 2), this.canvas.clientWidth - mark.offsetWidth - 2);
      const y = Math.min(Math.max(pixel[1] - mark.offsetHeight - 4, 2), this.canvas.clientHeight - mark.offsetHeight - 2);
      mark.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
  // The joint nearest to a point of the canvas, in pixels; null beyond 40 of them.
  jointAt(x, y) {
    const matrix = this.matrix();
    let best = null, least = 40;
    for (const figure of this.figures) {
      const n = figure.kind == "truth" ? -1 : this.at(figure, this.frame);
      for (let j = 0; n >= 0 && j < figure.jointNames.length; j++) {
        const at = this.joint(figure, n, j), pixel = at && this.onScreen(at, matrix);
        const off = pixel ? Math.hypot(pixel[0] - x, pixel[1] - y) : Infinity;
        if (off < least) [best, least] = [{figure, joint: j}, off];
      }
    }
    return best;
  }
  control() {
    const fingers = new Map(), canvas = this.canvas;
    let moved = 0;
    const free = () => { if (this.through !== null) this.leave(); };
    canvas.addEventListener("pointerdown", event => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, event); moved = fingers.size > 1 ? 99 : 0;
    });
    canvas.addEventListener("pointermove", event => {
      const last = fingers.get(event.pointerId);
      if (!last) return;
      const [dx, dy] = [event.clientX - last.clientX, event.clientY - last.clientY];
      moved += Math.abs(dx) + Math.abs(dy);
      if (moved < 4) return;
      free();
      if (fingers.size > 1) {
        const other = [...fingers.values()].find(each => each.pointerId != event.pointerId);
        const apart = each => Math.hypot(each.clientX - other.clientX, each.clientY - other.clientY);
        this.zoom(apart(last) / Math.max(apart(event), 1));
        this.pan(dx / 2, dy / 2);
      } else if (event.buttons & 6 || event.shiftKey) this.pan(dx, dy);
      else this.orbit(dx, dy);
      fingers.set(event.pointerId, event);
    });
    const up = event => {
      const was = fingers.delete(event.pointerId);
      if (was && event.type == "pointerup" && moved < 4) this.acts.chose(this.jointAt(event.offsetX, event.offsetY));
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("wheel", event => { event.preventDefault(); free(); this.zoom(Math.exp(0.0012 * event.deltaY)); }, {passive: false});
    canvas.addEventListener("keydown", event => {
      const turns = {ArrowLeft: [-24, 0], ArrowRight: [24, 0], ArrowUp: [0, -24], ArrowDown: [0, 24]};
      if (event.key in turns) { free(); this.orbit(...turns[event.key]); event.preventDefault(); }
      if (event.key == "+" || event.key == "-") { free(); this.zoom(event.key == "+" ? 0.85 : 1.18); }
    });
  }
  orbit(dx, dy) {
    this.turn = [this.turn[0] - 0.008 * dx, Math.min(Math.max(this.turn[1] + 0.008 * dy, -1.5), 1.5)];
    this.stale = true;
  }
  pan(dx, dy) {
    const [right, above] = this.axes(), step = 2 * this.far * this.tangents()[1] / this.canvas.clientHeight;
    this.target = V.add(V.add(this.target, right, -dx * step), above, dy * step);
    this.stale = true;
  }
  zoom(by) { this.far = Math.min(Math.max(this.far * by, 0.3), 60 * this.size); this.stale = true; }
}

function hexColour(text) { return [1, 3, 5].map(n => parseInt(text.slice(n, n + 2), 16) / 255); }
function element(tag, values = {}, ...children) {
  const made = Object.assign(document.createElement(tag), values);
  made.append(...children);
  return made;
}
