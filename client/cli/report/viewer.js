// Draws triangles that know their item (element), its quality and which sides are edges.

const RAMP = [[165, 0, 38], [244, 109, 67], [254, 224, 144], [116, 173, 209], [49, 54, 149]];
const INVERTED = [214, 0, 147];
const rgb = (c) => `rgb(${c.join(" ")})`;

const VERTEX_SHADER = `#version 300 es
uniform mat4 view, projection;
in vec3 position;
in float quality;  // mean ratio; below 0: inverted
in uint item;
in uint edges;     // bits 0 to 2: sides that are edges; 3 and above: marks
out vec3 seen, place, corner;
out float value;
flat out uint itemId, sides;
void main() {
  vec4 eye = view * vec4(position, 1.0);
  seen = eye.xyz;
  place = position;
  int n = gl_VertexID % 3;
  corner = vec3(n == 0, n == 1, n == 2);
  value = quality;
  itemId = item;
  sides = edges;
  gl_Position = projection * eye;
}`;

const FRAGMENT_SHADER = `#version 300 es
precision highp float;
precision highp int;
uniform vec4 plane;           // what lies beyond is cut off
uniform vec3 ramp[5], inverted, plain, edgeColour;
uniform float opacity, edgeStrength;
uniform bool byQuality, picking;
uniform uint chosen;
uniform uint kind;
in vec3 seen, place, corner;
in float value;
flat in uint itemId, sides;
out vec4 colour;
void main() {
  if (dot(plane.xyz, place) > plane.w) discard;
  if (picking) {
    uvec3 bytes = uvec3(itemId, itemId >> 8, itemId >> 16) & 255u;
    colour = vec4(vec3(bytes) / 255.0, float(kind) / 255.0);
    return;
  }
  vec3 base = plain;
  if (byQuality) {
    float t = clamp(value, 0.0, 1.0) * 4.0;
    int low = min(int(t), 3);
    base = value < 0.0 ? inverted : mix(ramp[low], ramp[low + 1], t - float(low));
  }
  if ((sides & 8u) != 0u && mod(gl_FragCoord.x + gl_FragCoord.y, 9.0) < 2.5) base *= 0.25;
  if ((sides & 32u) != 0u && all(lessThan(mod(gl_FragCoord.xy, 9.0), vec2(3.0)))) base *= 0.25;
  if ((sides & 16u) != 0u && mod(gl_FragCoord.x - gl_FragCoord.y, 9.0) < 2.5) base = vec3(1.0);
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float facing = abs(dot(normal, normalize(seen)));
  vec3 light = normalize(vec3(0.35, 0.6, 1.0));
  vec3 shaded = base * (0.62 + 0.25 * abs(dot(normal, light)) + 0.2 * facing);
  float alpha = opacity >= 1.0 ? 1.0 : mix(opacity, min(1.0, 2.2 * opacity), pow(1.0 - facing, 3.0));
  vec3 distances = corner / fwidth(corner);
  float nearest = 1e9;
  if ((sides & 1u) != 0u) nearest = min(nearest, distances.z);
  if ((sides & 2u) != 0u) nearest = min(nearest, distances.x);
  if ((sides & 4u) != 0u) nearest = min(nearest, distances.y);
  float line = edgeStrength * (1.0 - smoothstep(0.4, 1.4, nearest));
  bool isChosen = itemId == chosen;
  if (isChosen) line = 1.0 - smoothstep(1.2, 2.4, nearest);
  shaded = mix(shaded, isChosen ? vec3(1.0, 0.85, 0.0) : edgeColour, line);
  if (isChosen) shaded = mix(shaded, vec3(1.0), 0.25 * (1.0 - line));
  colour = vec4(shaded, max(alpha, line * min(1.0, 0.25 + 2.0 * alpha)));
}`;

class Viewer {
  /** Throws where there is no WebGL 2. */
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.camera = camera;
    // Kept, so that the page prints with it.
    const gl = canvas.getContext("webgl2", {alpha: false, antialias: true, preserveDrawingBuffer: true});
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl;
    this.program = this.link();
    this.layers = {surface: null, elements: null, chosen: null};
    this.look = {opacity: 0.2, edgeStrength: 0, byQuality: false, plain: [0.55, 0.62, 0.7], paper: [1, 1, 1],
                 ink: [0, 0, 0], plane: [0, 0, 0, 1], chosen: null};
    this.frames = 0;
  }

  link() {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    this.at = new Proxy({}, {get: (cache, name) => cache[name] ??= gl.getUniformLocation(program, name)});
    return program;
  }

  /** Replaces a layer: arrays of one value (position: three) for each corner of its triangles. */
  setLayer(name, arrays) {
    const gl = this.gl, old = this.layers[name];
    if (old) {
      old.buffers.forEach((buffer) => gl.deleteBuffer(buffer));
      gl.deleteVertexArray(old.array);
    }
    const array = gl.createVertexArray(), buffers = [];
    gl.bindVertexArray(array);
    for (const [attribute, values] of Object.entries(arrays)) {
      const location = gl.getAttribLocation(this.program, attribute), buffer = gl.createBuffer();
      buffers.push(buffer);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      if (values instanceof Float32Array) {
        gl.vertexAttribPointer(location, attribute === "position" ? 3 : 1, gl.FLOAT, false, 0, 0);
      } else {
        gl.vertexAttribIPointer(location, 1, values instanceof Uint8Array ? gl.UNSIGNED_BYTE : gl.UNSIGNED_INT, 0, 0);
      }
    }
    this.layers[name] = {array, buffers, count: arrays.item.length};
  }

  resize() {
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
  }

  get aspect() { return this.canvas.width / this.canvas.height; }

  prepare(picking) {
    const gl = this.gl, at = this.at;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(at.view, false, this.camera.view());
    gl.uniformMatrix4fv(at.projection, false, this.camera.projection(this.aspect));
    gl.uniform3fv(at["ramp[0]"], RAMP.flat().map((c) => c / 255));
    gl.uniform3fv(at.inverted, INVERTED.map((c) => c / 255));
    gl.uniform1i(at.picking, picking);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.clearColor(...(picking ? [0, 0, 0, 0] : [...this.look.paper, 1]));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  drawLayer(name) {
    const layer = this.layers[name], gl = this.gl, at = this.at, look = this.look;
    if (!layer || layer.count === 0) return;
    const elements = name !== "surface";
    gl.bindVertexArray(layer.array);
    // Elements are cut as a whole, by what is in the layer.
    gl.uniform4fv(at.plane, elements ? [0, 0, 0, 1] : look.plane);
    gl.uniform1f(at.opacity, elements ? 1 : look.opacity);
    gl.uniform1f(at.edgeStrength, elements ? 0.75 : look.edgeStrength);
    gl.uniform1i(at.byQuality, elements || look.byQuality);
    gl.uniform3fv(at.plain, look.plain);
    gl.uniform3fv(at.edgeColour, elements ? [0.08, 0.08, 0.1] : look.ink);
    gl.uniform1ui(at.kind, elements ? 1 : 2);
    gl.uniform1ui(at.chosen, look.chosen?.layer === (elements ? "elements" : name) ? look.chosen.item : 0xffffffff);
    gl.drawArrays(gl.TRIANGLES, 0, layer.count);
  }

  /** In front of all others, which may hide it. */
  drawChosen() {
    if (!this.layers.chosen?.count) return;
    this.gl.clear(this.gl.DEPTH_BUFFER_BIT);
    this.drawLayer("chosen");
  }

  draw() {
    const gl = this.gl, solid = this.look.opacity >= 1;
    this.resize();
    this.prepare(false);
    // Elements of the surface lie in it.
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(-1, -1);
    this.drawLayer("elements");
    gl.disable(gl.POLYGON_OFFSET_FILL);
    if (this.look.opacity > 0) {
      if (!solid) {
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
        gl.depthMask(false);
      }
      this.drawLayer("surface");
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    }
    this.drawChosen();
    this.frames += 1;
  }

  /** What is drawn at a position given in shares of the view: {layer, item} or null. */
  pick(x, y) {
    const gl = this.gl, {width, height} = this.canvas;
    const frame = gl.createFramebuffer(), colour = gl.createRenderbuffer(), depth = gl.createRenderbuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    for (const [buffer, format, point] of [[colour, gl.RGBA8, gl.COLOR_ATTACHMENT0],
                                           [depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, point, gl.RENDERBUFFER, buffer);
    }
    const column = Math.min(width - 1, Math.floor(x * width)), row = Math.min(height - 1, Math.floor((1 - y) * height));
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(column, row, 1, 1);
    this.prepare(true);
    if (this.look.opacity > 0) this.drawLayer("surface");
    // One sees elements through a translucent surface, and takes them through it.
    if (this.look.opacity < 1) gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(-1, -1);
    this.drawLayer("elements");
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.depthFunc(gl.LESS);
    this.drawChosen();
    const bytes = new Uint8Array(4);
    gl.disable(gl.SCISSOR_TEST);
    gl.readPixels(column, row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    gl.deleteRenderbuffer(colour);
    gl.deleteRenderbuffer(depth);
    if (bytes[3] === 0) return null;
    return {layer: bytes[3] === 1 ? "elements" : "surface", item: bytes[0] | bytes[1] << 8 | bytes[2] << 16};
  }
}
