// What is on the stage, for a card to draw: models by what stays of them, and where their points are in frames near the
// one that is seen; drawings as pictures.  Of points at most BYTES are kept, the least recently used go first.

const BYTES = 256 * 2 ** 20;
const PIECE = 4 * 2 ** 20; // of points in one answer
const AHEAD = 2; // pieces
const LAYERS = 48; // pictures of drawings that are kept

export function makeSpace(bench) {
  const space = { shown: 0, roles: [], ground: 0, size: [1, 1], held: 0, came: () => {} }; // shown: the performance's number
  const pieces = new Map(); // "who first" -> {points, first, count}
  const layers = new Map(); // "who frame" -> bitmap
  const loading = new Set();
  let number = 0;

  // Another performance: its models are fetched, and `came` is called when they are here; until then the old ones stay.
  space.of = async (played) => {
    if (played === number) return;
    number = played;
    if (!played) return clear({ roles: [], shown: 0 });
    try {
      const { view } = await bench.look("stage.space");
      const told = JSON.parse(new TextDecoder().decode(new Uint8Array(view.buffer, view.byteOffset, view.byteLength)));
      const roles = await Promise.all(told.roles.map((role, who) => (role.solid ? solid(role, who) : role)));
      if (played !== number) return;
      if (told.number === number) clear({ ...told, roles, shown: number });
      else number = 0; // it was another one already: what is played now is asked for next
    } catch (error) {
      if (played === number) bench.say(error.message);
    }
    space.came();
  };

  function clear(fields) {
    Object.assign(space, fields, { held: 0 });
    pieces.clear();
    layers.forEach((bitmap) => bitmap.close());
    layers.clear();
    loading.clear();
  }

  async function solid(role, who) {
    const { event, view } = await bench.look("stage.solid", { who });
    let at = 0;
    const take = (Kind, count) => {
      const from = view.byteOffset + at;
      at += 4 * count;
      return new Kind(view.buffer.slice(from, from + 4 * count)); // a notebook's channel may put it anywhere
    };
    const { corners, faces, beside, colored } = event;
    const mesh = { corners, faces: take(Uint32Array, 3 * faces), first: take(Uint32Array, corners + 1), beside: take(Uint32Array, beside) };
    mesh.uv = take(Float32Array, 2 * corners);
    mesh.colors = colored ? take(Float32Array, 4 * corners) : null;
    const textures = await Promise.all(role.materials.map(({ textured }, material) => (textured ? texture(who, material) : null)));
    return { ...role, ...mesh, textures, per: Math.max(1, Math.floor(PIECE / (12 * corners))) };
  }

  async function texture(who, material) {
    const { event, view } = await bench.look("stage.texture", { who, material });
    const bytes = new Uint8Array(view.buffer, view.byteOffset, view.byteLength);
    return createImageBitmap(new Blob([bytes], { type: event.type }), { premultiplyAlpha: "premultiply", colorSpaceConversion: "none" });
  }

  // Where a model's corners are in frame t, float32 (3 corners), or null while they are on their way.
  space.points = (who, t, last) => {
    const { per, corners } = space.roles[who];
    const first = per * Math.floor(t / per);
    const count = Math.ceil((last + 1) / per);
    for (let ahead = 0; ahead <= AHEAD; ahead++) fetchPoints(who, per * ((first / per + ahead) % count), per);
    const piece = pieces.get(`${who} ${first}`);
    if (!piece || t - first >= piece.count) return null;
    pieces.delete(`${who} ${first}`);
    pieces.set(`${who} ${first}`, piece);
    return piece.points.subarray(3 * corners * (t - first), 3 * corners * (t - first + 1));
  };

  async function fetchPoints(who, first, count) {
    const name = `${who} ${first}`;
    if (pieces.has(name) || loading.has(name) || space.shown !== number) return;
    const of = number;
    loading.add(name);
    try {
      const { event, view } = await bench.look("stage.places", { who, first, count });
      if (of !== number || event.number !== number) return;
      const points = new Float32Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength));
      pieces.set(name, { points, count: event.count });
      space.held += points.byteLength;
      for (const [oldest, piece] of pieces) {
        if (space.held <= BYTES || oldest === name) break;
        pieces.delete(oldest);
        space.held -= piece.points.byteLength;
      }
      space.came();
    } catch (error) {
      if (of === number) bench.say(error.message);
    } finally {
      if (of === number) loading.delete(name);
    }
  }

  // A drawing's picture in frame t, or null while it is on its way.
  space.layer = (who, t) => {
    const name = `${who} ${t}`;
    if (!layers.has(name)) fetchLayer(name, who, t);
    return layers.get(name) ?? null;
  };

  async function fetchLayer(name, who, t) {
    if (loading.has(name) || space.shown !== number) return;
    const of = number;
    loading.add(name);
    try {
      const { number: drawn, bitmap } = await bench.picture("stage.flat", { who, frame: t });
      if (of !== number || drawn !== number) return bitmap.close();
      layers.set(name, bitmap);
      for (const [oldest, old] of layers) {
        if (layers.size <= LAYERS) break;
        layers.delete(oldest);
        old.close();
      }
      space.came();
    } catch (error) {
      if (of === number) bench.say(error.message);
    } finally {
      if (of === number) loading.delete(name);
    }
  }
  return space;
}
