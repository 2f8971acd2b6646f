// A drawn figure: pieces of a drawing moved by its parts, v' = sum of shares times maps, painted under the joints.
// A picture's pieces are textured triangles (WebGL, or the plain canvas where there is none), a vector drawing's curves.
import { linked } from "../shared/card.js";

const COLUMNS = 7; // of a part: a map [a, b, x, c, d, y] to metres, y up, and the order of its limb
const LEAST = 1e-4; // a smaller share of a point is none

export function makePuppet(sticks) {
  const puppet = { parts: null, mesh: null };
  let canvas = null;
  let painter = null;

  // What `posing.mesh` and `posing.texture` gave; nothing for a figure that is not drawn.
  puppet.show = (mesh) => {
    if (mesh === puppet.mesh) return;
    puppet.mesh = mesh;
    puppet.parts = null;
    canvas?.remove();
    canvas = painter = null;
    sticks.floor = !mesh;
    if (!mesh) return;
    canvas = document.createElement("canvas");
    canvas.className = "under paper";
    canvas.setAttribute("aria-hidden", "true");
    sticks.canvas.before(canvas);
    painter = mesh.picture ? (triangles(canvas, mesh) ?? plainTriangles(canvas, mesh)) : curves(canvas, mesh);
  };

  // Corners of all that is drawn, as places.
  puppet.bounds = (parts = puppet.parts) => {
    let [left, low, right, high] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const piece of puppet.mesh.pieces) {
      const at = moved(piece, parts);
      for (let n = 0; n < at.length; n += 2) {
        [left, right] = [Math.min(left, at[n]), Math.max(right, at[n])];
        [low, high] = [Math.min(low, at[n + 1]), Math.max(high, at[n + 1])];
      }
    }
    return [[left, low, 0], [right, high, 0]];
  };

  puppet.draw = () => {
    if (!painter || !puppet.parts) return;
    const dense = window.devicePixelRatio || 1;
    const [wide, tall] = [sticks.canvas.clientWidth, sticks.canvas.clientHeight];
    if (canvas.width !== Math.round(wide * dense) || canvas.height !== Math.round(tall * dense)) {
      canvas.width = Math.round(wide * dense);
      canvas.height = Math.round(tall * dense);
    }
    const { scale, middle } = sticks;
    const view = { wide, tall, dense, scale, x: wide / 2 - middle[0] * scale, y: tall / 2 + middle[1] * scale };
    const parts = puppet.parts;
    const order = (piece) => (piece.behind ? -Infinity : parts[piece.first * COLUMNS + 6]);
    painter([...puppet.mesh.pieces].sort((a, b) => order(a) - order(b) || a.number - b.number), parts, view);
  };
  return puppet;
}

// The numbers of a mesh, taken apart.
export function meshOf({ event, view }, bitmap) {
  const numbers = new Float32Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength));
  let at = 0;
  const next = (count) => numbers.subarray(at, (at += count));
  const pieces = event.pieces.map((told, number) => {
    const rest = next(2 * told.points);
    const shares = next(told.points * event.parts);
    const faces = Uint16Array.from(next(3 * told.faces));
    return { ...told, number, rest, faces, ...sparse(shares, told.points, event.parts), at: new Float32Array(2 * told.points) };
  });
  return { pieces, picture: event.picture, bitmap };
}

function sparse(shares, points, parts) {
  const [starts, which, much] = [[0], [], []];
  for (let n = 0; n < points; n++) {
    for (let part = 0; part < parts; part++) {
      const share = shares[n * parts + part];
      if (share < LEAST) continue;
      which.push(part * COLUMNS);
      much.push(share);
    }
    starts.push(which.length);
  }
  return { starts, which: Uint32Array.from(which), much: Float32Array.from(much) };
}

// Where a piece's points go, in metres.
function moved(piece, parts) {
  const { rest, starts, which, much, at } = piece;
  for (let n = 0; n < piece.points; n++) {
    const [x, y] = [rest[2 * n], rest[2 * n + 1]];
    let [u, v, all] = [0, 0, 0];
    for (let k = starts[n]; k < starts[n + 1]; k++) {
      const [m, share] = [which[k], much[k]];
      u += share * (parts[m] * x + parts[m + 1] * y + parts[m + 2]);
      v += share * (parts[m + 3] * x + parts[m + 4] * y + parts[m + 5]);
      all += share;
    }
    at[2 * n] = u / all;
    at[2 * n + 1] = v / all;
  }
  return at;
}

const VERTEX = `attribute vec2 place, spot; uniform vec4 view; varying vec2 there;
void main() { there = spot; gl_Position = vec4(place * view.xy + view.zw, 0.0, 1.0); }`;
const FRAGMENT = `precision mediump float; uniform sampler2D picture; varying vec2 there;
void main() { gl_FragColor = texture2D(picture, there); }`;

function triangles(canvas, { pieces, picture, bitmap }) {
  const gl = canvas.getContext("webgl2", { premultipliedAlpha: true, antialias: true });
  if (!gl) return null;
  const program = linked(gl, VERTEX, FRAGMENT);
  gl.useProgram(program);
  gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
  gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  for (const edge of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, edge, gl.CLAMP_TO_EDGE);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  const filled = (target, data, use) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, use);
    return buffer;
  };
  const buffers = pieces.map(({ rest, faces, at }) => ({
    spots: filled(gl.ARRAY_BUFFER, rest.map((value, n) => (value + 0.5) / picture[n % 2]), gl.STATIC_DRAW),
    places: filled(gl.ARRAY_BUFFER, at, gl.DYNAMIC_DRAW),
    faces: filled(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW),
  }));
  const [place, spot] = ["place", "spot"].map((name) => gl.getAttribLocation(program, name));
  gl.enableVertexAttribArray(place);
  gl.enableVertexAttribArray(spot);
  const seen = gl.getUniformLocation(program, "view");
  return (ordered, parts, { wide, tall, scale, x, y }) => {
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.uniform4f(seen, (2 * scale) / wide, (2 * scale) / tall, (2 * x) / wide - 1, 1 - (2 * y) / tall);
    for (const piece of ordered) {
      const own = buffers[piece.number];
      gl.bindBuffer(gl.ARRAY_BUFFER, own.places);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, moved(piece, parts));
      gl.vertexAttribPointer(place, 2, gl.FLOAT, false, 0, 0);
      gl.bindBuffer(gl.ARRAY_BUFFER, own.spots);
      gl.vertexAttribPointer(spot, 2, gl.FLOAT, false, 0, 0);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, own.faces);
      gl.drawElements(gl.TRIANGLES, piece.faces.length, gl.UNSIGNED_SHORT, 0);
    }
  };
}

function plainTriangles(canvas, { bitmap }) {
  const context = canvas.getContext("2d");
  return (ordered, parts, view) => {
    const { dense, scale, x, y } = view;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    for (const piece of ordered) {
      const at = moved(piece, parts);
      for (let f = 0; f < piece.faces.length; f += 3) {
        const corners = [0, 1, 2].map((n) => piece.faces[f + n]);
        const here = corners.map((n) => [dense * (x + scale * at[2 * n]), dense * (y - scale * at[2 * n + 1])]);
        const map = affine(corners.map((n) => [piece.rest[2 * n] + 0.5, piece.rest[2 * n + 1] + 0.5]), here);
        if (!map) continue;
        const middle = [0, 1].map((axis) => (here[0][axis] + here[1][axis] + here[2][axis]) / 3);
        context.save();
        context.beginPath();
        for (const [u, v] of here) {
          const away = Math.hypot(u - middle[0], v - middle[1]) || 1; // a little larger, so that no seam shows
          context.lineTo(u + (0.7 * (u - middle[0])) / away, v + (0.7 * (v - middle[1])) / away);
        }
        context.clip();
        context.setTransform(...map);
        context.drawImage(bitmap, 0, 0);
        context.restore();
      }
    }
  };
}

function curves(canvas, { pieces }) {
  const context = canvas.getContext("2d", { willReadFrequently: true }); // drawn by the processor, as the joints over it are
  for (const piece of pieces) {
    let start = 0;
    for (const path of piece.paths) {
      path.from = start;
      start += path.starts.at(-1);
    }
  }
  return (ordered, parts, view) => {
    const { dense, scale, x, y } = view;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    const size = dense * scale * Math.hypot(parts[0], parts[3]); // of a pixel of the drawing: its root keeps its size
    for (const piece of ordered) {
      const at = moved(piece, parts);
      const point = (n) => [dense * (x + scale * at[2 * n]), dense * (y - scale * at[2 * n + 1])];
      for (const path of piece.paths) paintPath(context, path, piece, point, size);
    }
  };
}

function paintPath(context, path, piece, point, size) {
  const here = [];
  for (let n = 0; n < path.starts.at(-1); n++) here.push(point(path.from + n));
  const trace = () => {
    context.beginPath();
    path.closed.forEach((closed, k) => {
      const [first, last] = [path.starts[k], path.starts[k + 1]];
      context.moveTo(...here[first]);
      for (let n = first + 1; n + 2 < last; n += 3) context.bezierCurveTo(...here[n], ...here[n + 1], ...here[n + 2]);
      if (closed) context.closePath();
    });
  };
  context.globalAlpha = path.opacity;
  for (const [paint, fills] of [[path.fill, true], [path.stroke, false]]) {
    if (!paint) continue;
    context.setTransform(1, 0, 0, 1, 0, 0);
    trace();
    if (!fills) {
      Object.assign(context, { lineWidth: path.width * size, lineCap: path.cap === "projecting" ? "square" : path.cap, lineJoin: path.join });
      context.setLineDash(path.dashes.map((length) => length * size));
    }
    const style = Array.isArray(paint) ? css(paint) : gradient(context, paint, carried(path, piece, here));
    if (fills) {
      context.fillStyle = style;
      context.fill(path.evenodd ? "evenodd" : "nonzero");
    } else {
      context.strokeStyle = style;
      context.stroke();
    }
  }
  context.globalAlpha = 1;
}

const css = ([red, green, blue, alpha]) => `rgb(${255 * red} ${255 * green} ${255 * blue} / ${alpha})`;

// A gradient goes along with its path as a whole, by the affine map that fits its points best.
function gradient(context, { offsets, colors, place, focus }, map) {
  const to = ([u, v]) => {
    const [x, y] = [place[0][0] * u + place[0][1] * v + place[0][2], place[1][0] * u + place[1][1] * v + place[1][2]];
    return [map[0] * x + map[2] * y + map[4], map[1] * x + map[3] * y + map[5]];
  };
  const middle = to([0, 0]);
  const radius = Math.sqrt(Math.abs((to([1, 0])[0] - middle[0]) * (to([0, 1])[1] - middle[1]) - (to([1, 0])[1] - middle[1]) * (to([0, 1])[0] - middle[0])));
  const made = focus ? context.createRadialGradient(...to(focus), 0, ...middle, radius) : context.createLinearGradient(...middle, ...to([1, 0]));
  offsets.forEach((offset, n) => made.addColorStop(Math.min(Math.max(offset, 0), 1), css(colors[n])));
  return made;
}

function carried(path, piece, here) {
  const rest = here.map((_, n) => [piece.rest[2 * (path.from + n)], piece.rest[2 * (path.from + n) + 1]]);
  const mean = (points) => [0, 1].map((axis) => points.reduce((sum, one) => sum + one[axis], 0) / points.length);
  const [from, to] = [mean(rest), mean(here)];
  let [xx, xy, yy, ux, uy, vx, vy] = [1e-9, 0, 1e-9, 0, 0, 0, 0];
  rest.forEach(([x, y], n) => {
    const [dx, dy, du, dv] = [x - from[0], y - from[1], here[n][0] - to[0], here[n][1] - to[1]];
    [xx, xy, yy] = [xx + dx * dx, xy + dx * dy, yy + dy * dy];
    [ux, uy, vx, vy] = [ux + du * dx, uy + du * dy, vx + dv * dx, vy + dv * dy];
  });
  const all = xx * yy - xy * xy || 1e-9;
  const [a, c] = [(ux * yy - uy * xy) / all, (uy * xx - ux * xy) / all];
  const [b, d] = [(vx * yy - vy * xy) / all, (vy * xx - vx * xy) / all];
  return [a, b, c, d, to[0] - a * from[0] - c * from[1], to[1] - b * from[0] - d * from[1]];
}

// The canvas' map [a, b, c, d, e, f] that takes three points to three others.
function affine([p, q, r], [u, v, w]) {
  const [ax, ay, bx, by] = [q[0] - p[0], q[1] - p[1], r[0] - p[0], r[1] - p[1]];
  const all = ax * by - ay * bx;
  if (Math.abs(all) < 1e-9) return null;
  const one = (axis) => {
    const [du, dv] = [v[axis] - u[axis], w[axis] - u[axis]];
    const [x, y] = [(du * by - dv * ay) / all, (dv * ax - du * bx) / all];
    return [x, y, u[axis] - x * p[0] - y * p[1]];
  };
  const [[a, c, e], [b, d, f]] = [one(0), one(1)];
  return [a, b, c, d, e, f];
}
