// A model under the joints of a figure: its mesh carried by them, seen as the sticks are, with light from the viewer's left.
import { linked } from "../shared/card.js";

export const COLUMNS = 15; // of a joint: the rows of a map, and its place

const VERTEX = `#version 300 es
in vec3 place, color; uniform vec3 middle; uniform vec4 turn; uniform vec3 size; out vec3 seen, tint;
void main() {
  vec3 at = place - middle;
  float right = at.x * turn.x + at.z * turn.y, near = at.z * turn.x - at.x * turn.y;
  seen = vec3(right, at.y * turn.z - near * turn.w, near * turn.z + at.y * turn.w);
  tint = color;
  gl_Position = vec4(seen * size, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float; in vec3 seen, tint; out vec4 color;
void main() {
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  color = vec4(tint * (0.42 + 0.58 * max(dot(normal, normalize(vec3(-0.5, 0.7, 0.8))), 0.0)), 1.0);
}`;

export function makeBody(sticks) {
  const body = { joints: null, mesh: null };
  let [canvas, painter] = [null, null];

  // Whether the mesh can be shown; without WebGL there are sticks.
  body.show = (mesh) => {
    if (mesh === body.mesh) return Boolean(painter);
    canvas?.remove();
    Object.assign(body, { mesh, joints: null });
    canvas = painter = null;
    if (!mesh) return false;
    canvas = document.createElement("canvas");
    canvas.className = "under";
    canvas.setAttribute("aria-hidden", "true");
    painter = made(canvas, mesh);
    if (painter) sticks.canvas.before(canvas);
    return Boolean(painter);
  };
  // Corners of all that is drawn, as places.
  body.bounds = (mesh, joints) => {
    const [points, low, high] = [carried(mesh, joints), [1e9, 1e9, 1e9], [-1e9, -1e9, -1e9]];
    points.forEach((value, n) => {
      low[n % 3] = Math.min(low[n % 3], value);
      high[n % 3] = Math.max(high[n % 3], value);
    });
    return [low, high];
  };
  body.draw = () => {
    if (!painter || !body.joints) return;
    const dense = window.devicePixelRatio || 1;
    const [wide, tall] = [Math.round(sticks.canvas.clientWidth * dense), Math.round(sticks.canvas.clientHeight * dense)];
    if (canvas.width !== wide || canvas.height !== tall) Object.assign(canvas, { width: wide, height: tall });
    painter(carried(body.mesh, body.joints), sticks);
  };
  return body;
}

// The numbers of `posing.body`, taken apart.
export function bodyOf({ event, view }) {
  const numbers = new Float32Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength));
  let at = 0;
  const next = (count) => numbers.subarray(at, (at += count));
  const { points, faces } = event;
  return { rest: next(3 * points), colors: next(3 * points), which: Uint32Array.from(next(4 * points)), much: next(4 * points), faces: Uint32Array.from(next(3 * faces)), at: new Float32Array(3 * points) };
}

function carried({ rest, which, much, at }, joints) {
  for (let n = 0; 3 * n < rest.length; n++) {
    const [x, y, z] = [rest[3 * n], rest[3 * n + 1], rest[3 * n + 2]];
    at[3 * n] = at[3 * n + 1] = at[3 * n + 2] = 0;
    for (let k = 4 * n; k < 4 * n + 4; k++) {
      const share = much[k];
      if (!share) continue;
      const m = which[k] * COLUMNS;
      for (let axis = 0; axis < 3; axis++) {
        const row = m + 4 * axis;
        at[3 * n + axis] += share * (joints[row] * x + joints[row + 1] * y + joints[row + 2] * z + joints[row + 3]);
      }
    }
  }
  return at;
}

function made(canvas, { at, colors, faces }) {
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) return null;
  const program = linked(gl, VERTEX, FRAGMENT);
  gl.useProgram(program);
  gl.enable(gl.DEPTH_TEST);
  const filled = (target, data, use, name) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, use);
    if (name) {
      const spot = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(spot);
      gl.vertexAttribPointer(spot, 3, gl.FLOAT, false, 0, 0);
    }
    return buffer;
  };
  filled(gl.ARRAY_BUFFER, colors, gl.STATIC_DRAW, "color");
  const places = filled(gl.ARRAY_BUFFER, at, gl.DYNAMIC_DRAW, "place");
  filled(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  const [middle, turn, size] = ["middle", "turn", "size"].map((name) => gl.getUniformLocation(program, name));
  return (points, sticks) => {
    let deep = 1; // no point is farther from the middle
    for (let n = 0; n < points.length; n++) deep = Math.max(deep, 2 * Math.abs(points[n] - sticks.middle[n % 3]));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindBuffer(gl.ARRAY_BUFFER, places);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, points);
    gl.uniform3f(middle, ...sticks.middle);
    gl.uniform4f(turn, Math.cos(sticks.turn), Math.sin(sticks.turn), Math.cos(sticks.tilt), Math.sin(sticks.tilt));
    gl.uniform3f(size, (2 * sticks.scale) / sticks.canvas.clientWidth, (2 * sticks.scale) / sticks.canvas.clientHeight, -1 / deep);
    gl.drawElements(gl.TRIANGLES, faces.length, gl.UNSIGNED_INT, 0);
  };
}
