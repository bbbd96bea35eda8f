"use strict";
// A turntable camera: z stays upright. Lengths are those of the scene, which lies in [-1, 1].

const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

class Camera {
  /** half: half of the sizes of the scene's bounding box. */
  constructor(half) {
    this.half = half;
    this.radius = Math.hypot(...half) || 1;
    this.flat = Math.min(...half) < 1e-6 * Math.max(...half);
    this.tangent = Math.tan(15 * Math.PI / 180);  // of half the field of view
    this.reset();
  }

  reset() {
    const top = this.flat && this.half[2] <= this.half[0] && this.half[2] <= this.half[1];
    this.yaw = top ? -Math.PI / 2 : -1.05;
    this.pitch = top ? Math.PI / 2 : 0.42;
    this.target = [0, 0, 0];
    this.distance = (top ? 1.1 : 1.02 * this.radius) / Math.sin(Math.atan(this.tangent));
  }

  /** Unit vectors to the right, upwards, and from the target to the eye. */
  get basis() {
    const [sa, ca] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const [sb, cb] = [Math.sin(this.pitch), Math.cos(this.pitch)];
    return [[-sa, ca, 0], [-sb * ca, -sb * sa, cb], [cb * ca, cb * sa, sb]];
  }

  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + dy));
  }

  /** By shares of the height of the view. */
  shift(dx, dy) {
    const [right, up] = this.basis;
    const size = 2 * this.tangent * this.distance;
    this.target = add(add(this.target, right, -dx * size), up, dy * size);
  }

  zoom(factor) {
    this.distance = Math.min(20 * this.radius, Math.max(1e-5 * this.radius, this.distance * factor));
  }

  lookAt(point, size) {
    this.target = [...point];
    this.distance = Math.max(6 * size, 1e-5 * this.radius) / this.tangent;
  }

  /** The view matrix, by columns. */
  view() {
    const [r, u, d] = this.basis;
    const eye = add(this.target, d, this.distance);
    return [r[0], u[0], d[0], 0, r[1], u[1], d[1], 0, r[2], u[2], d[2], 0,
            -dot(r, eye), -dot(u, eye), -dot(d, eye), 1];
  }

  /** The projection matrix, by columns. A view that is higher than wide keeps its width. */
  projection(aspect) {
    const depth = Math.hypot(...this.target) + this.radius;
    const near = Math.max(this.distance - depth, 0.02 * this.distance), far = this.distance + 2 * depth;
    const f = 1 / this.tangent * Math.min(1, aspect);
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
            0, 0, 2 * far * near / (near - far), 0];
  }

  /** Where a point is in the view, in shares of its width and height from the upper left corner. */
  project(point, aspect) {
    const [r, u, d] = this.basis;
    const way = add(point, add(this.target, d, this.distance), -1);
    const f = 1 / this.tangent * Math.min(1, aspect), depth = -dot(way, d);
    return [0.5 + 0.5 * f / aspect * dot(way, r) / depth, 0.5 - 0.5 * f * dot(way, u) / depth];
  }
}

/** Lets pointer, wheel and keys move a camera. changed: called after; clicked: with the position. */
function controlCamera(canvas, camera, changed, clicked) {
  const pointers = new Map();
  let travelled = 0;

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (pointers.size === 0) travelled = 0;
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - last[0], now[1] - last[1]];
    travelled += Math.hypot(dx, dy);
    const height = canvas.clientHeight;
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const span = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
      camera.zoom(span(last) / span(now));
      camera.shift(dx / 2 / height, dy / 2 / height);
    } else if (event.shiftKey || event.buttons & 6) {
      camera.shift(dx / height, dy / height);
    } else {
      camera.turn(dx * 0.008, dy * 0.008);
    }
    pointers.set(event.pointerId, now);
    changed();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (pointers.delete(event.pointerId) && pointers.size === 0 && travelled < 4 && event.button === 0) {
      const box = canvas.getBoundingClientRect();
      clicked((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
    }
  });
  canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)));
    changed();
  }, {passive: false});
  canvas.addEventListener("keydown", (event) => {
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    if (way && event.shiftKey) camera.shift(way[0] * 0.05, way[1] * 0.05);
    else if (way) camera.turn(way[0] * 0.1, way[1] * 0.1);
    else if (event.key === "+" || event.key === "=") camera.zoom(0.85);
    else if (event.key === "-") camera.zoom(1 / 0.85);
    else if (event.key === "Home") camera.reset();
    else return;
    event.preventDefault();
    changed();
  });
}
