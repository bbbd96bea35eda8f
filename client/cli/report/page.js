// Fills the drawing and its controls from the scene.

const byId = (id) => document.getElementById(id);

/** The values of a base64 string as an array of a type. */
function decode(text, ArrayType) {
  return new ArrayType(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
}

const decodeIds = (part, name) =>
  part[name] !== undefined ? decode(part[name], Uint32Array) : decode(part[name + "64"], BigInt64Array);

/** Positions of both states; one array where they are the same. */
function decodePositions(part) {
  const after = decode(part.after, Float32Array);
  return {after, before: part.before ? decode(part.before, Float32Array) : after};
}

class Report {
  constructor(scene) {
    this.scene = scene;
    this.surface = this.readSurface(scene.surface);
    this.elements = this.readElements(scene.elements);
    this.byFileId = new Map(this.elements.map((element, index) => [String(element.id), index]));
  }

  readSurface(part) {
    const quality = {after: decode(part.qualityAfter, Int8Array)};
    quality.before = part.qualityBefore ? decode(part.qualityBefore, Int8Array) : quality.after;
    return {positions: decodePositions(part), corners: decode(part.corners, Uint32Array),
            edges: decode(part.edges, Uint8Array), ids: decodeIds(part, "ids"), quality};
  }

  readElements(part) {
    this.positions = decodePositions(part);
    const ids = decodeIds(part, "ids"), nodeIds = decodeIds(part, "nodeIds"), nodes = decode(part.nodes, Uint32Array);
    const types = decode(part.types, Uint8Array), marks = decode(part.marks, Uint8Array);
    const quality = decode(part.quality, Float32Array);
    let first = 0;
    return Array.from(types, (number, index) => {
      const type = this.scene.types[number], [q0, q1, s0, s1] = quality.subarray(4 * index, 4 * index + 4);
      const own = Array.from(nodes.subarray(first, first + type.nodeCount));
      first += type.nodeCount;
      const has = (bit) => (marks[index] & bit) !== 0;
      return {index, id: ids[index], type, nodes: own, nodeIds: own.map((node) => nodeIds[node]),
              meanRatio: {before: q0, after: q1}, scaledJacobian: {before: s0, after: s1},
              locked: has(1), blocks: has(2), notMoved: has(4), limited: has(128),
              inverted: {before: has(8), after: has(16)}, degenerate: {before: has(32), after: has(64)}};
    });
  }

  point(node, state) {
    return Array.from(this.positions[state].subarray(3 * node, 3 * node + 3));
  }

  /** The centre of an element in the scene. */
  centre(element, state) {
    return element.nodes.reduce((sum, node) => add(sum, this.point(node, state), 1 / element.nodes.length), [0, 0, 0]);
  }

  /** In the mesh's own coordinates. */
  unscaled(point) {
    return point.map((c, axis) => this.scene.centre[axis] + c * this.scene.scale);
  }

  /** Largest distance of a node from its position before, in the mesh's unit. */
  largestMove(element) {
    const move = (node) => Math.hypot(...add(this.point(node, "after"), this.point(node, "before"), -1));
    return this.scene.scale * Math.max(...element.nodes.map(move));
  }

  /** The elements from worst to best in a state; inverted ones first. */
  ranked(state) {
    const rank = (element) => element.meanRatio[state] - (element.inverted[state] ? 2 : 0);
    return [...this.elements].sort((a, b) => rank(a) - rank(b) || a.index - b.index);
  }

  surfaceLayer(state) {
    const {corners, edges, quality} = this.surface, from = this.surface.positions[state];
    const count = corners.length;
    const layer = {position: new Float32Array(3 * count), quality: new Float32Array(count),
                   item: new Uint32Array(count), edges: new Uint8Array(count)};
    for (let n = 0; n < count; ++n) {
      const triangle = Math.floor(n / 3);
      layer.position.set(from.subarray(3 * corners[n], 3 * corners[n] + 3), 3 * n);
      layer.quality[n] = quality[state][triangle] / 127;
      layer.item[n] = triangle;
      layer.edges[n] = edges[triangle];
    }
    return layer;
  }

  elementLayer(elements, state) {
    const position = [], quality = [], item = [], edges = [];
    for (const element of elements) {
      const marks = (element.locked ? 8 : 0) | (element.blocks ? 16 : 0) | (element.limited ? 32 : 0);
      const value = element.inverted[state] ? -1 : Math.max(0, element.meanRatio[state]);
      const triangle = (a, b, c, sides) => {
        for (const node of [a, b, c]) {
          position.push(...this.point(element.nodes[node], state));
          quality.push(value);
          item.push(element.index);
          edges.push(sides | marks);
        }
      };
      for (const facet of element.type.facets) {
        triangle(facet[0], facet[1], facet[2], facet.length === 3 ? 7 : 3);
        if (facet.length === 4) triangle(facet[0], facet[2], facet[3], 6);
      }
    }
    return {position: new Float32Array(position), quality: new Float32Array(quality),
            item: new Uint32Array(item), edges: new Uint8Array(edges)};
  }
}

const number = (value) => Number(value.toPrecision(6)).toString();
const change = (before, after, show) => (before === after ? show(after) : `${show(before)} → ${show(after)}`);

/** Shows rows of [term, text] of an element; the texts come from files, so that they are no HTML. */
function showChosen(title, rows) {
  const list = document.createElement("dl"), heading = document.createElement("h3");
  heading.textContent = title;
  for (const [term, text] of rows) {
    list.append(Object.assign(document.createElement("dt"), {textContent: term}),
                Object.assign(document.createElement("dd"), {textContent: text}));
  }
  byId("chosen").replaceChildren(heading, list);
}

function describeElement(report, element, state) {
  const ratio = (v) => v.toFixed(4), {meanRatio, scaledJacobian} = element;
  const condition = (s) => (element.inverted[s] ? "inverted" : element.degenerate[s] ? "degenerate" : "valid");
  const rows = [["Type", element.type.name],
                ["State", change(condition("before"), condition("after"), String)],
                ["Mean ratio", change(meanRatio.before, meanRatio.after, ratio)],
                ["Scaled Jacobian", change(scaledJacobian.before, scaledJacobian.after, ratio)],
                ["Centre", report.unscaled(report.centre(element, state)).map(number).join(", ")],
                ["Nodes", element.nodeIds.join(", ")]];
  if (report.scene.hasBefore) rows.push(["Largest move", number(report.largestMove(element))]);
  const marks = [element.locked && "locked: all its nodes are fixed", element.blocks && "would be inverted by a longer step",
                 element.limited && "limited by connectivity: no move of one of its nodes would help",
                 !element.locked && element.notMoved && report.scene.hasBefore && "none of its nodes moved"].filter(Boolean);
  if (marks.length) rows.push(["Note", marks.join("; ")]);
  showChosen(`Element ${element.id}`, rows);
}

function describeTriangle(report, triangle, state) {
  const ratio = report.surface.quality[state][triangle] / 127;
  showChosen(`Element ${report.surface.ids[triangle]}`,
             [["Mean ratio", `about ${ratio.toFixed(2)}`], ["Note", "not among the worst elements"]]);
}

/** The colours of the page, for the drawing. */
function pageColours() {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim().match(/\w\w/g).map((h) => parseInt(h, 16) / 255);
  const dark = colour("--paper")[0] < 0.5;
  return {paper: dark ? [0.085, 0.1, 0.125] : [1, 1, 1], plain: dark ? [0.62, 0.7, 0.8] : [0.5, 0.58, 0.68],
          ink: dark ? [0.75, 0.8, 0.88] : [0.2, 0.25, 0.32]};
}

class Page {
  constructor(report) {
    const {half, dimension, hasBefore} = report.scene;
    this.report = report;
    this.camera = new Camera(half);
    this.viewer = new Viewer(byId("canvas"), this.camera);
    this.state = "after";
    this.ranks = {before: report.ranked("before"), after: report.ranked("after")};
    this.chosen = null;
    byId("state").hidden = !hasBefore;
    for (const mark of ["locked", "limited"]) byId(`${mark}-legend`).hidden = !report.elements.some((element) => element[mark]);
    byId("inverted-colour").style.background = rgb(INVERTED);
    byId("ramp").style.background = `linear-gradient(to right, ${RAMP.map(rgb)})`;
    byId("count").max = report.elements.length;
    byId("count").value = Math.max(20, Math.min(500, report.elements.length / 10));
    byId("opacity").value = dimension === 2 ? 100 : 16;
    byId("by-quality").checked = dimension === 2;
    byId("edges").checked = dimension === 2;
    byId("view").hidden = false;
    byId("no-view").hidden = true;
    this.listen();
    this.setState();
  }

  listen() {
    controlCamera(byId("canvas"), this.camera, () => this.redraw(), (x, y) => this.choose(this.viewer.pick(x, y)));
    byId("state").addEventListener("change", (event) => {
      this.state = event.target.value;
      this.setState();
    });
    for (const id of ["count", "axis", "cut", "flip", "opacity", "edges", "by-quality"]) {
      byId(id).addEventListener("input", () => this.setElements());
    }
    byId("controls").addEventListener("submit", (event) => event.preventDefault());
    byId("reset").addEventListener("click", () => {
      this.camera.reset();
      this.redraw();
    });
    document.addEventListener("click", (event) => {
      const id = event.target.dataset?.element;
      if (id !== undefined) this.show(this.report.elements[this.report.byFileId.get(id)]);
    });
    new ResizeObserver(() => this.redraw()).observe(byId("canvas"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.setElements());
    byId("canvas").addEventListener("webglcontextlost", () => {
      byId("view").hidden = true;
      byId("no-view").hidden = false;
    });
  }

  /** The plane beyond which nothing is drawn. */
  plane() {
    const axis = byId("axis").value, flip = byId("flip").checked, {half, scale, centre} = this.report.scene;
    for (const id of ["cut", "flip"]) byId(id).disabled = axis === "";
    byId("cut-text").value = "";
    if (axis === "") return [0, 0, 0, 1];
    const offset = (byId("cut").value / 500 - 1) * half[axis], plane = [0, 0, 0, flip ? -offset : offset];
    plane[axis] = flip ? -1 : 1;
    byId("cut-text").value = number(centre[axis] + offset * scale);
    return plane;
  }

  setState() {
    this.viewer.setLayer("surface", this.report.surfaceLayer(this.state));
    this.setElements();
    this.choose(this.chosen);
  }

  setElements() {
    const plane = this.plane(), count = Number(byId("count").value), opacity = byId("opacity").value / 100;
    const kept = (element) => dot(plane, this.report.centre(element, this.state)) <= plane[3];
    const shown = this.ranks[this.state].slice(0, count).filter(kept);
    this.viewer.setLayer("elements", this.report.elementLayer(shown, this.state));
    Object.assign(this.viewer.look, pageColours(), {plane, opacity, edgeStrength: byId("edges").checked ? 0.35 : 0,
                                                    byQuality: byId("by-quality").checked});
    byId("count-text").value = count.toLocaleString("en");
    byId("opacity-text").value = `${byId("opacity").value} %`;
    this.redraw();
  }

  choose(found) {
    this.chosen = found;
    this.viewer.look.chosen = found;
    const front = found?.layer === "elements" ? [this.report.elements[found.item]] : [];
    this.viewer.setLayer("chosen", this.report.elementLayer(front, this.state));
    if (!found) byId("chosen").replaceChildren(Object.assign(document.createElement("p"), {className: "note", textContent: "No element is chosen."}));
    else if (found.layer === "elements") describeElement(this.report, this.report.elements[found.item], this.state);
    else describeTriangle(this.report, found.item, this.state);
    this.redraw();
  }

  /** Chooses an element and brings it before the eye. */
  show(element) {
    const {report, state} = this, centre = report.centre(element, state);
    const size = Math.max(...element.nodes.map((node) => Math.hypot(...add(report.point(node, state), centre, -1))));
    const rank = this.ranks[state].indexOf(element) + 1;
    if (byId("count").value < rank) byId("count").value = rank;
    byId("axis").value = "";
    this.setElements();
    this.camera.lookAt(centre, size);
    this.choose({layer: "elements", item: element.index});
    byId("canvas").scrollIntoView({block: "nearest"});
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.viewer.draw();
      this.drawAxes();
    });
  }

  drawAxes() {
    const basis = this.camera.basis, lines = byId("axes").querySelectorAll("line"), texts = byId("axes").querySelectorAll("text");
    for (let axis = 0; axis < 3; ++axis) {
      const [x, y] = [26 * basis[0][axis], -26 * basis[1][axis]];
      for (const [name, value] of [["x2", x], ["y2", y]]) lines[axis].setAttribute(name, value);
      for (const [name, value] of [["x", 1.3 * x], ["y", 1.3 * y]]) texts[axis].setAttribute(name, value);
      texts[axis].style.opacity = Math.hypot(x, y) < 5 ? 0 : 1;
    }
  }
}

let page = null;
try {
  page = new Page(new Report(JSON.parse(byId("scene").textContent)));
} catch (error) {
  byId("view").hidden = true;
  byId("no-view").hidden = false;
  byId("no-view").append(` (${error.message})`);
}
