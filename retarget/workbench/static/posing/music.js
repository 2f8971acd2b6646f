// Music in the page: its sound, played in time with the dance, and where it is; how it is chosen and put right.
import { button, make } from "../shared/dom.js";
import { arrived, send } from "../shared/sending.js";

const KINDS = ".wav,.mp3,.ogg,.oga,.opus,.flac,.m4a,.aac,.mid,.midi";
const FORGOTTEN = 2500; // ms after which the next tap begins anew
const [SLOWEST, FASTEST] = [40, 240];

export function makeMusic(bench, { changed }) {
  const music = { file: "", songs: [], muted: false, problem: "" };
  const now = () => bench.state.posing?.music;
  let [context, sound, source, began] = [null, null, null, 0];

  // The sound of what is chosen now, once for each piece.
  music.load = async () => {
    const file = now()?.file ?? "";
    if (file === music.file) return;
    music.stop();
    Object.assign(music, { file, problem: "" });
    sound = null;
    if (!file) return;
    try {
      const { view } = await bench.look("posing.heard");
      const bytes = view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength);
      const decoded = await new OfflineAudioContext(1, 1, 44100).decodeAudioData(bytes);
      if (music.file === file) sound = decoded;
    } catch (error) {
      music.problem = error.message;
    }
    changed();
  };

  music.play = (from) => {
    music.stop();
    if (!sound || from >= sound.duration) return;
    context ??= new AudioContext();
    context.resume();
    source = context.createBufferSource();
    source.buffer = sound;
    source.connect(context.destination);
    source.start(0, from);
    began = context.currentTime - from;
  };
  music.stop = () => {
    source?.stop();
    source?.disconnect();
    source = null;
  };
  // Where the music is, in seconds, as it is heard; null where none is to be heard.
  music.seconds = () => (source && context.state === "running" ? Math.max(0, context.currentTime - began - (context.outputLatency || 0)) : null);
  music.sounds = () => Boolean(source);

  music.list = async () => {
    const { view } = await bench.look("posing.songs");
    music.songs = JSON.parse(new TextDecoder().decode(view));
    changed();
  };

  async function bring(file) {
    if (!(await send(bench, "posing.load", file))) return;
    await music.list();
    const { file: name } = await arrived(bench, file.name); // of another file of that name
    bench.work("posing.hear", { file: name });
  }
  music.takes = (files) => {
    const one = [...files].find(({ name }) => KINDS.split(",").some((kind) => name.toLowerCase().endsWith(kind)));
    if (one) bring(one);
    return Boolean(one);
  };

  // Four taps tell a tempo; each further one makes it surer.
  let taps = [];
  music.tap = (at) => {
    const moment = performance.now();
    if (moment - (taps.at(-1)?.moment ?? 0) > FORGOTTEN) taps = [];
    taps.push({ moment, at });
    if (taps.length < 4) return;
    const bpm = (60000 * (taps.length - 1)) / (moment - taps[0].moment);
    if (bpm < SLOWEST || bpm > FASTEST) return;
    const step = 60 / bpm;
    const first = taps.reduce((sum, tap, n) => sum + tap.at - n * step, 0) / taps.length;
    bench.act("posing.tap", { bpm, first: ((first % step) + step) % step }, { newest: "tap", gesture: `tap ${taps[0].moment}` });
  };

  music.panel = (busy) => {
    const chosen = now();
    const names = [...new Set([...(chosen ? [chosen.file] : []), ...music.songs])];
    const select = make("select", { "aria-label": "Music", disabled: busy }, make("option", { value: "" }, "no music"),
      ...names.map((name) => make("option", { value: name, selected: name === chosen?.file }, name)));
    select.onchange = () => (select.value ? bench.work("posing.hear", { file: select.value }) : bench.act("posing.hush"));
    const asked = make("input", { type: "file", accept: KINDS, hidden: true, onchange: () => music.takes(asked.files) });
    const parts = [make("div.row", {}, select, button("Load…", "", () => asked.click()), asked)];
    if (chosen) {
      const half = button("Half", "", () => bench.act("posing.pace", { by: "half" }));
      const twice = button("Double", "", () => bench.act("posing.pace", { by: "double" }));
      half.disabled = chosen.pace <= 0.25;
      twice.disabled = chosen.pace >= 2;
      parts.push(make("p.none", {}, `${chosen.times.length} beats, ${Math.round(chosen.bpm)} a minute. T taps the tempo.`), make("div.row", {}, half, twice));
    } else parts.push(make("p.none", {}, "T taps the tempo."));
    if (music.problem) parts.push(make("p.none", {}, `It cannot be heard here: ${music.problem}`));
    return parts;
  };
  return music;
}
