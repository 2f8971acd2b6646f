// Models on the stage seen from anywhere, drawn by the graphics card of the page on the same pixels as the picture they
// stand in for.  Besides them the ground, and the plane of the picture with its camera.
import { makeCanvas, sized } from "../shared/canvas.js";
import { dropArray, makeArray, makeCard, makeTexture, normalsOf, refill } from "../shared/card.js";
import { makeSpace } from "./space.js";

const LINES = 16; // of the ground, across the stage
const DEEP = 80; // times the stage's longer edge is what the card tells near from far in
const SETTLED = 200; // ms without another performance: a slider that is dragged makes many
const GROUND = [0.62, 0.66, 0.72, 0.28];
const PLANE = [0.94, 0.69, 0.29, 0.9]; // the clip's own camera looks through this

export function makeOrbit(place, view, bench) {
  const canvas = makeCanvas(place, { tabIndex: -1, "aria-hidden": "true" }, "beneath");
  place.insertBefore(canvas, view.canvas);
  const orbit = { canvas, works: true, turn: 0, tilt: 0, pivot: [0, 0, 0], shift: [0, 0], frame: -1, number: 0, last: 0, scenery: true };
  const space = makeSpace(bench);
  orbit.space = space;
  let card = null;
  let drawn = []; // by role: what the card has of it
  let scenery = null;
  let prepared = 0; // the number of the performance that the card has
  let asked = false;

  space.came = () => orbit.came?.();
  orbit.turned = () => orbit.turn !== 0 || orbit.tilt !== 0;

  // The performance that is on the stage now; its models are fetched once it stays for a moment.
  let timer = 0;
  orbit.of = (number, frames) => {
    if (number === orbit.number) return;
    orbit.number = number;
    orbit.last = frames - 1;
    clearTimeout(timer);
    timer = setTimeout(() => orbit.works && space.of(orbit.number), SETTLED);
  };

  orbit.home = () => Object.assign(orbit, { turn: 0, tilt: 0, shift: [0, 0] });

  // Turn on, about what is seen: the middle of the models stays where it is on the screen.
  orbit.grab = () => {
    const held = middle();
    const at = orbit.place(held);
    return (turn, tilt) => {
      Object.assign(orbit, { turn, tilt });
      const now = orbit.place(held);
      orbit.shift = [orbit.shift[0] + at[0] - now[0], orbit.shift[1] + at[1] - now[1]];
    };
  };

  // Where a place of the stage (x, y, z) is once turned.
  orbit.place = (at) => {
    const [x, y, z] = at.map((value, axis) => value - orbit.pivot[axis]);
    const [cos, sin, up, down] = [Math.cos(orbit.turn), Math.sin(orbit.turn), Math.cos(orbit.tilt), Math.sin(orbit.tilt)];
    const [right, near] = [cos * x - sin * z, sin * x + cos * z];
    const [px, py, pz] = orbit.pivot;
    return [right + px + orbit.shift[0], up * y + down * near + py + orbit.shift[1], up * near - down * y + pz];
  };

  function middle() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const { points } of drawn) {
      for (let n = 0; n < (points?.length ?? 0); n++) {
        low[n % 3] = Math.min(low[n % 3], points[n]);
        high[n % 3] = Math.max(high[n % 3], points[n]);
      }
    }
    return low.map((least, axis) => (Number.isFinite(least) ? (least + high[axis]) / 2 : orbit.pivot[axis]));
  }

  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    forget();
    card = null;
    orbit.works = false; // until it is there again, Python draws
    orbit.came?.();
  });
  canvas.addEventListener("webglcontextrestored", () => {
    orbit.works = true;
    asked = false;
    orbit.came?.();
  });

  const forget = () => {
    if (card) for (const one of [...drawn, scenery]) one?.array && dropArray(card.gl, one.array);
    if (card) for (const one of drawn) [...(one.textures ?? []), one.picture].forEach((texture) => texture && card.gl.deleteTexture(texture));
    drawn = [];
    scenery = null;
    prepared = 0;
  };

  // Draw frame t; true where that was done, false where Python must.
  orbit.draw = (t) => {
    if (!orbit.works || !space.shown) return false;
    if (!asked) {
      asked = true;
      card = makeCard(canvas);
      orbit.works = Boolean(card);
    }
    if (!card) return false;
    const size = sized(canvas);
    if (!size || card.gl.isContextLost()) return false;
    if (prepared !== space.shown) prepare();
    const here = drawn.map((one, who) => (one.solid ? placed(one, who, t) : layered(one, who, t)));
    if (here.every(Boolean)) orbit.frame = t;
    paint(t, size);
    return true;
  };
  orbit.clear = () => {
    if (card && sized(canvas)) card.gl.clear(card.gl.COLOR_BUFFER_BIT);
  };

  function prepare() {
    const { gl } = card;
    forget();
    prepared = space.shown;
    orbit.frame = -1;
    const [width, height] = space.size;
    orbit.pivot = [(width - 1) / 2, (height - 1) / 2, 0];
    drawn = space.roles.map((role) => {
      if (!role.solid) return { ...role, picture: null, at: -1 };
      const normals = new Float32Array(3 * role.corners);
      const colors = role.colors ?? new Float32Array(4 * role.corners).fill(1);
      const array = makeArray(gl, { at: [normals, 3], normal: [normals, 3], uv: [role.uv, 2], color: [colors, 4] }, role.faces, ["at", "normal"]);
      const textures = role.textures.map((bitmap) => bitmap && makeTexture(gl, bitmap));
      return { ...role, array, textures, normals, points: null, at: -1 };
    });
    scenery = sceneryOf(gl, width, height, space.ground);
  }

  // A model's points in frame t on the card; false while they are on their way.
  function placed(one, who, t) {
    if (one.at === t || !one.visible[t]) return true;
    const points = space.points(who, t, orbit.last);
    if (!points) return false;
    normalsOf(one, points, one.normals);
    refill(card.gl, one.array.buffers.at, points);
    refill(card.gl, one.array.buffers.normal, one.normals);
    Object.assign(one, { points, at: t });
    return true;
  }

  function layered(one, who, t) {
    if (one.at === t || !one.visible[t]) return true;
    const bitmap = space.layer(who, t);
    if (!bitmap) return false;
    if (one.picture) card.gl.deleteTexture(one.picture);
    Object.assign(one, { picture: makeTexture(card.gl, bitmap, false), at: t });
    return true;
  }

  function paint(t, [wide, tall]) {
    const { gl } = card;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.frontFace(gl.CW); // the stage's y goes down
    const [cos, sin, up, down] = [Math.cos(orbit.turn), Math.sin(orbit.turn), Math.cos(orbit.tilt), Math.sin(orbit.tilt)];
    const shared = {
      turn: [cos, down * sin, up * sin, 0, up, -down, -sin, down * cos, up * cos], // column by column
      page: [(2 * view.scale) / wide, (-2 * view.scale) / tall, (2 * (view.x + view.scale / 2)) / wide - 1, 1 - (2 * (view.y + view.scale / 2)) / tall],
      deep: DEEP * Math.max(...space.size),
    };
    const seen = drawn.filter(({ visible }) => visible[t]);
    const towards = shared.turn[8] < 0 ? -1 : 1;
    const flat = seen.filter((one) => !one.solid && one.picture).map((one) => [one, towards * layer(one, seen, t)]);
    flat.sort((a, b) => a[1] - b[1]);
    begin(card.sheet, shared);
    if (orbit.scenery) lines();
    for (const [one, near] of flat) if (near < 0) sheet(one, towards * near); // first: a clear model shows them
    begin(card.solid, shared);
    for (const one of seen) if (one.solid && one.points) solid(one);
    begin(card.sheet, shared);
    for (const [one, near] of flat) if (near >= 0) sheet(one, towards * near);
    gl.bindVertexArray(null);
  }

  function begin({ made, at }, { turn, page, deep }) {
    const { gl } = card;
    gl.useProgram(made);
    gl.uniformMatrix3fv(at.turn, false, turn);
    gl.uniform3fv(at.pivot, orbit.pivot);
    gl.uniform3f(at.shift, ...orbit.shift, 0);
    gl.uniform3f(at.eye, 0, 0, 0);
    gl.uniform4fv(at.page, page);
    gl.uniform1f(at.deep, deep);
    gl.uniform1i(at.picture, 0);
  }

  // Of a clear model first only how near, then colours where it is nearest: no far side shows through, as in its picture.
  function solid(one) {
    const { gl } = card;
    const { at } = card.solid;
    const eye = one.eye === null ? [0, 0, 0] : orbit.place(one.middles[one.at]);
    gl.uniform3f(at.eye, eye[0], eye[1], one.eye === null ? 0 : eye[2] + one.eye);
    gl.bindVertexArray(one.array.made);
    const clear = one.materials.some(({ color }) => color[3] < 1);
    for (const pass of clear ? [0, 1] : [1]) {
      gl.colorMask(pass === 1, pass === 1, pass === 1, pass === 1);
      gl.depthFunc(clear && pass ? gl.LEQUAL : gl.LESS);
      for (const [material, first, count] of one.spans) {
        const look = one.materials[material];
        gl.uniform4fv(at.paint, look.color);
        gl.uniform1i(at.textured, look.textured ? 1 : 0);
        gl.uniform1i(at.cut, look.cut_out ? 1 : 0);
        gl.bindTexture(gl.TEXTURE_2D, one.textures[material]);
        gl.drawElements(gl.TRIANGLES, 3 * count, gl.UNSIGNED_INT, 12 * first);
      }
    }
    gl.depthFunc(gl.LESS);
  }

  function lines() {
    const { gl } = card;
    const { at } = card.sheet;
    gl.uniform1i(at.textured, 0);
    gl.bindVertexArray(scenery.array.made);
    for (const { color, first, count } of scenery.spans) {
      gl.uniform4fv(at.paint, color);
      gl.drawArrays(gl.LINES, first, count);
    }
  }

  function sheet(one, z) {
    const { gl } = card;
    const { at } = card.sheet;
    gl.uniform1i(at.textured, 1);
    gl.bindTexture(gl.TEXTURE_2D, one.picture);
    const moved = orbit.place([orbit.pivot[0], orbit.pivot[1], z]); // the layer lies z before the picture's plane
    gl.uniform3fv(at.shift, moved.map((value, axis) => value - orbit.pivot[axis]));
    gl.bindVertexArray(scenery.array.made);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, scenery.sheet, 4);
    gl.depthMask(true);
  }
  return orbit;
}

// How near a drawing is: before all models that it covers, or behind those that cover it.
function layer(one, seen, t) {
  const solid = seen.filter((other) => other.solid && other.points);
  const rank = seen.filter((other) => !other.solid && other.order[t] < one.order[t]).length;
  let deep = 0;
  for (const { points } of solid) for (let n = 2; n < points.length; n += 3) deep = Math.max(deep, Math.abs(points[n]));
  const front = solid.every((other) => other.order[t] <= one.order[t]);
  return front ? deep + 2 + 4 * rank : -deep - 2 - 4 * (seen.length - rank);
}

// The ground, the picture's plane and its camera as lines, and a sheet that drawings lie on.
function sceneryOf(gl, width, height, ground) {
  const [left, right, top, bottom] = [-0.5, width - 0.5, -0.5, height - 0.5];
  const at = [];
  const step = width / LINES;
  for (let n = 0; n <= LINES; n++) at.push([left + n * step, ground, -width / 2], [left + n * step, ground, width / 2]);
  for (let n = 0; n <= LINES; n++) at.push([left, ground, (n - LINES / 2) * step], [right, ground, (n - LINES / 2) * step]);
  const lines = at.length;
  const corners = [[left, top, 0], [right, top, 0], [right, bottom, 0], [left, bottom, 0]];
  corners.forEach((corner, n) => at.push(corner, corners[(n + 1) % 4]));
  const [x, y, z] = [(left + right) / 2, (top + bottom) / 2, width * 0.45];
  const [wide, tall] = [width / 24, height / 24];
  const lens = [[x - wide, y - tall, z], [x + wide, y - tall, z], [x + wide, y + tall, z], [x - wide, y + tall, z]];
  lens.forEach((corner, n) => at.push(corner, lens[(n + 1) % 4], corner, [x, y, z + 2 * wide]));
  const plane = at.length - lines;
  at.push([left, top, 0], [right, top, 0], [left, bottom, 0], [right, bottom, 0]);
  const uv = new Float32Array(2 * at.length);
  uv.set([0, 0, 1, 0, 0, 1, 1, 1], 2 * (at.length - 4));
  const array = makeArray(gl, { at: [new Float32Array(at.flat()), 3], uv: [uv, 2] });
  return { array, sheet: at.length - 4, spans: [{ color: GROUND, first: 0, count: lines }, { color: PLANE, first: lines, count: plane }] };
}
