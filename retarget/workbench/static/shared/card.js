// What a graphics card is told: programs, buffers and textures of WebGL 2.  Light and colours are those of the exported
// picture (retarget/stage/zbuffer.py), so that a model looks the same from its own side.

const SEEN = `#version 300 es
precision highp float;
uniform mat3 turn;
uniform vec3 pivot;
uniform vec3 shift;
uniform vec3 eye; // after turning; z = 0 sees without perspective
uniform vec4 page; // from the stage's pixels to the card's: scale, then where the first pixel is
uniform float deep;
vec3 turned(vec3 at) { return turn * (at - pivot) + pivot + shift; }
vec4 seen(vec3 at) {
  if (eye.z == 0.0) return vec4(at.xy * page.xy + page.zw, -at.z / deep, 1.0);
  float grown = eye.z / max(eye.z - at.z, 1e-6 * eye.z);
  vec2 flat_ = eye.xy + (at.xy - eye.xy) * grown;
  return vec4(flat_ * page.xy + page.zw, -eye.z * (grown - 1.0) / deep, 1.0) / grown;
}`;

const SOLID = {
  corner: `${SEEN}
in vec3 at;
in vec3 normal;
in vec2 uv;
in vec4 color;
centroid out vec3 facing;
centroid out vec2 on;
centroid out vec4 tint;
void main() {
  gl_Position = seen(turned(at));
  facing = turn * normal;
  on = uv;
  tint = color;
}`,
  pixel: `#version 300 es
precision highp float;
uniform vec4 paint;
uniform sampler2D picture;
uniform bool textured;
uniform bool cut;
centroid in vec3 facing;
centroid in vec2 on;
centroid in vec4 tint;
out vec4 color;
void main() {
  vec4 own = paint * vec4(tint.rgb, 1.0);
  if (textured) {
    vec4 texel = texture(picture, on);
    if (cut && texel.a < 0.5) discard;
    own.rgb *= texel.rgb / max(texel.a, 1e-6);
  }
  vec3 way = normalize(facing) * (gl_FrontFacing ? 1.0 : -1.0);
  float light = 0.22 + 0.75 * max(dot(way, normalize(vec3(-0.55, -0.65, 0.75))), 0.0)
    + 0.2 * max(dot(way, normalize(vec3(0.9, 0.1, 0.45))), 0.0);
  color = vec4(min(own.rgb * pow(light, 1.0 / 2.2), 1.0), 1.0) * own.a;
}`,
};

const SHEET = {
  corner: `${SEEN}
in vec3 at;
in vec2 uv;
centroid out vec2 on;
void main() {
  gl_Position = seen(turned(at));
  on = uv;
}`,
  pixel: `#version 300 es
precision highp float;
uniform vec4 paint;
uniform sampler2D picture;
uniform bool textured;
centroid in vec2 on;
out vec4 color;
void main() {
  color = textured ? texture(picture, on) : vec4(paint.rgb, 1.0) * paint.a;
}`,
};
const PLACES = { at: 0, normal: 1, uv: 2, color: 3 };

// The card, or null where there is none.
export function makeCard(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true, powerPreference: "high-performance" });
  if (!gl) return null;
  try {
    return { gl, solid: program(gl, SOLID), sheet: program(gl, SHEET) };
  } catch {
    return null; // a card on a blocklist may fail only here
  }
}

// A program of two shaders, with attributes at these places; an error where the card does not take it.
export function linked(gl, corner, pixel, places = {}) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, corner], [gl.FRAGMENT_SHADER, pixel]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  for (const [name, place] of Object.entries(places)) gl.bindAttribLocation(made, place, name);
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) ?? "the card took no program");
  return made;
}

function program(gl, { corner, pixel }) {
  const made = linked(gl, corner, pixel, PLACES);
  const at = {};
  for (let n = 0; n < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); n++) {
    const { name } = gl.getActiveUniform(made, n);
    at[name] = gl.getUniformLocation(made, name);
  }
  return { made, at };
}

// An array of attributes: {name: [numbers, how many a corner]}; `moves` names those that change with every frame.
export function makeArray(gl, attributes, faces = null, moves = []) {
  const array = { made: gl.createVertexArray(), buffers: {} };
  gl.bindVertexArray(array.made);
  for (const [name, [numbers, size]] of Object.entries(attributes)) {
    array.buffers[name] = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, array.buffers[name]);
    gl.bufferData(gl.ARRAY_BUFFER, numbers, moves.includes(name) ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
    gl.enableVertexAttribArray(PLACES[name]);
    gl.vertexAttribPointer(PLACES[name], size, gl.FLOAT, false, 0, 0);
  }
  if (faces) {
    array.buffers.faces = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, array.buffers.faces);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  }
  gl.bindVertexArray(null);
  return array;
}

export function refill(gl, buffer, numbers) {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferSubData(gl.ARRAY_BUFFER, 0, numbers);
}

export function dropArray(gl, { made, buffers }) {
  Object.values(buffers).forEach((buffer) => gl.deleteBuffer(buffer));
  gl.deleteVertexArray(made);
}

// A picture as a texture; one that repeats is made in ever smaller sizes too, so that it does not flicker.
export function makeTexture(gl, bitmap, repeats = true) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
  const wrap = repeats ? gl.REPEAT : gl.CLAMP_TO_EDGE;
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, repeats ? gl.LINEAR_MIPMAP_LINEAR : gl.LINEAR);
  if (repeats) gl.generateMipmap(gl.TEXTURE_2D);
  return texture;
}

// The normals (3 corners) of a mesh as it lies now: at each corner the sum of those of the faces beside it.
export function normalsOf({ corners, faces, first, beside }, points, out = new Float32Array(3 * corners)) {
  const count = faces.length / 3;
  const own = new Float64Array(3 * count);
  for (let face = 0; face < count; face++) {
    const [a, b, c] = [3 * faces[3 * face], 3 * faces[3 * face + 1], 3 * faces[3 * face + 2]];
    const x1 = points[b] - points[a], y1 = points[b + 1] - points[a + 1], z1 = points[b + 2] - points[a + 2];
    const x2 = points[c] - points[a], y2 = points[c + 1] - points[a + 1], z2 = points[c + 2] - points[a + 2];
    own[3 * face] = y1 * z2 - z1 * y2;
    own[3 * face + 1] = z1 * x2 - x1 * z2;
    own[3 * face + 2] = x1 * y2 - y1 * x2;
  }
  for (let corner = 0; corner < corners; corner++) {
    let x = 0, y = 0, z = 0;
    for (let n = first[corner]; n < first[corner + 1]; n++) {
      const face = 3 * beside[n];
      x += own[face];
      y += own[face + 1];
      z += own[face + 2];
    }
    const length = Math.hypot(x, y, z) || 1;
    out[3 * corner] = x / length;
    out[3 * corner + 1] = y / length;
    out[3 * corner + 2] = z / length;
  }
  return out;
}
