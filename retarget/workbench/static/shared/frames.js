// Frames of a clip as bitmaps: the one that is wanted now first, then those that come next.

const AHEAD = 24;
const AT_ONCE = 3;
const BYTES = 256 * 2 ** 20;

export function makeFrames(bench, name = "capture.frame") {
  const kept = new Map(); // number -> bitmap, the least recently used first
  const loading = new Set();
  let clip = "";
  let room = 64;
  let wanted = 0;
  let count = 0;
  let way = 1;
  let shown = null;
  const frames = { came: () => {} };

  frames.of = (description) => {
    const key = JSON.stringify([description.name, description.width, description.height, description.frames, description.open]);
    if (key === clip) return;
    clip = key;
    count = description.frames;
    room = Math.max(8, Math.floor(BYTES / (4 * description.width * description.height)));
    kept.forEach(drop);
    kept.clear();
    loading.clear();
  };

  // The bitmap if it is here, or null: then `came` is called when it is.
  frames.want = (number) => {
    way = number < wanted ? -1 : 1;
    wanted = number;
    load();
    const bitmap = kept.get(number) ?? null;
    if (bitmap) {
      kept.delete(number);
      kept.set(number, bitmap);
      shown = bitmap;
    }
    return bitmap;
  };

  // The one that was given last is still on show.
  const drop = (bitmap) => bitmap !== shown && bitmap.close();

  function missing() {
    for (let step = 0; step <= Math.min(AHEAD, room - 2); step++) {
      const number = wanted + way * step;
      if (number >= 0 && number < count && !kept.has(number) && !loading.has(number)) return number;
    }
    return -1;
  }

  async function load() {
    while (loading.size < AT_ONCE) {
      const number = missing();
      if (number < 0) return;
      get(number);
    }
  }

  async function get(number) {
    const of = clip;
    loading.add(number);
    try {
      const { bitmap } = await bench.picture(name, { frame: number });
      if (of !== clip) return bitmap.close();
      kept.set(number, bitmap);
      while (kept.size > room) {
        const [oldest, old] = kept.entries().next().value;
        kept.delete(oldest);
        drop(old);
      }
      frames.came(number);
    } catch (error) {
      if (of === clip && number === wanted) bench.say(error.message);
      return;
    } finally {
      if (of === clip) loading.delete(number);
    }
    load();
  }
  return frames;
}
