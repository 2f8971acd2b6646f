// The posing desk: joints dragged on springs, postures mixed, kept and put on beats; a clip beside it made rubber.
import { makeBeats } from "./beats.js";
import { bodyOf, COLUMNS, makeBody } from "./body.js";
import { button, calm, fill, icon, iconButton, make, place } from "../shared/dom.js";
import { makeHandles } from "../shared/handles.js";
import { key, ownKey, press } from "../shared/keys.js";
import { makeMusic } from "./music.js";
import { beatAt, beatOf, dancedAt, secondsAt } from "./phrases.js";
import { makePhraseBar } from "./phrasebar.js";
import { makePointer } from "./pointer.js";
import { makeSide } from "./side.js";
import { makePuppet, meshOf } from "./puppet.js";
import { makeSticks, placesAt } from "./sticks.js";

export const title = "Pose";

const MODES = { pose: "Pose", dance: "Dance", rubber: "Rubber" };
const LONG = 20; // seconds of a dance of which at first only what comes next is made anew
const [AHEAD, SETTLED] = [3, 350]; // so many seconds of it, and the rest when a slider has been still for so many ms

export function mount(el, bench) {
  const side = make("aside.side");
  const hint = make("p.hint", { role: "status" });
  const picture = make("div.picture");
  const below = make("footer.below");
  const rail = make("div.rail", { role: "toolbar", "aria-label": "What is done" });
  el.classList.add("posing");
  el.append(rail, make("div.stage", {}, hint, picture), side, below);
  const sticks = makeSticks(picture);
  place(sticks.canvas, "The figure");
  const puppet = makePuppet(sticks);
  const body = makeBody(sticks);
  const desk = { mode: "pose", hover: -1, drag: null, ready: false, meshes: new Map(), played: null, clip: null, problem: "", frame: 0, playing: false, began: [0, 0], open: "", seed: 0 };

  const now = () => bench.state.posing ?? {};
  const act = (name, fields, options) => bench.act(`posing.${name}`, fields, options);
  const music = makeMusic(bench, { changed: () => (panel.draw(), desk.playing && restart()) });
  const tempo = () => now().music?.bpm ?? now().feel?.bpm ?? 120;
  const times = () => now().music?.times;

  const play = iconButton("play", "Play (Space)", toggle);
  const clock = make("output.frame");
  const seed = button("Make one up", "", () => act("invent", { seed: desk.seed++ }));
  const phraseBar = make("div.phrase");
  below.append(make("div.transport", {}, play, clock, seed, phraseBar));
  const beats = makeBeats(below, {
    move: (step, to) => act("move", { step, ...to }),
    drop: (step, phrase) => act("drop", { step, phrase }),
    put: (posture, { phrase, beat }) => act("put", { posture, phrase, beat }),
    went: (at) => desk.mode === "dance" && stopAt(secondsAt(beatOf(at, beats.phrases), times(), tempo())),
    seek: (seconds) => desk.mode !== "pose" && (desk.playing && desk.mode === "dance" ? go(Math.round(seconds * (desk.played?.fps ?? 24)), true) : stopAt(seconds)),
  });
  const bar = makePhraseBar(phraseBar, { act, beats, now });
  beats.picked = () => bar.draw();
  const panel = makeSide(side, bench, desk, { act, felt, beats, music });
  const pointer = makePointer(sticks, bench, desk, { act, now, show, unready: () => bench.say("The springs are being made ready, once on this machine: joints can be dragged in some seconds.") });

  const handles = makeHandles(bench, {
    what: "joint",
    count: () => (desk.mode === "pose" ? now().pose?.length ?? 0 : 0),
    place: (joint) => now().pose[joint],
    chosen: (joint) => ((desk.hover = joint), explain(), sticks.draw()),
    send: (joint, to, gesture) => act("drag", { joint, to }, { newest: "joint", gesture }),
    way: (right, down) => sticks.way(4 * right, 4 * down),
  });

  const modes = {};
  for (const [name, text] of Object.entries(MODES)) {
    modes[name] = make("button.tool", { type: "button", onclick: () => choose(name) }, text);
    rail.append(modes[name]);
  }
  function choose(name) {
    handles.leave();
    Object.assign(desk, { mode: name, played: null, playing: name !== "pose" && !calm(), frame: 0, problem: "" });
    for (const [other, element] of Object.entries(modes)) element.setAttribute("aria-pressed", String(other === name));
    beats.clip = 0;
    seed.hidden = name === "rubber";
    bar.draw(name !== "rubber");
    if (name === "dance") music.list();
    panel.draw();
    panel.line();
    restart();
    want();
    if (name === "pose") fitPose(); // the figure may have been opened while another mode was looked at
    show();
    explain();
  }

  function felt(slider, value, gesture) {
    const beat = beatAt(desk.frame / 24, times(), tempo());
    if (bench.state.posing) bench.state.posing.feel = { ...now().feel, [slider]: value };
    if (slider === "bpm") desk.frame = Math.round(24 * secondsAt(beat, times(), value));
    if (slider === "bpm" && desk.playing) restart();
    act("feel", { slider, value }, { newest: `feel ${slider}`, gesture });
  }

  // What is played: asked for anew whenever a slider or the dance changes, and it plays on meanwhile.

  let [asking, again, settles] = [false, false, 0];
  async function want() {
    again = true;
    if (asking) return;
    asking = true;
    while (again && desk.mode !== "pose" && now().figure) {
      again = false;
      const mode = desk.mode;
      try {
        await (mode === "rubber" ? wantRubber() : wantDance());
      } catch (error) {
        if (desk.mode === mode) Object.assign(desk, { problem: error.message, played: null });
      }
      show();
      explain();
    }
    asking = false;
  }
  async function wantRubber() {
    const clip = desk.clip ?? (await fetched("posing.clip", {}));
    const played = await fetched("posing.rubber", {});
    if (desk.mode === "rubber") become({ ...played, clip });
  }
  async function wantDance() {
    const old = desk.played;
    if (old && old.shape[0] > LONG * old.fps && !old.stale) {
      const start = Math.max(0, desk.frame / old.fps - 0.1);
      const some = await fetched("posing.danced", { start, seconds: AHEAD });
      if (desk.played === old && some.shape[1] === old.shape[1] && some.first + some.shape[0] <= old.shape[0]) {
        if (some.parts) carryOn(old, some);
        old.points.set(some.points, some.first * old.shape[1] * old.shape[2]);
      }
      clearTimeout(settles);
      settles = setTimeout(() => ((old.stale = true), want()), SETTLED);
      return;
    }
    const played = await fetched("posing.danced", {});
    if (played.parts) await meshFor(played.parts);
    if (desk.mode === "dance") become(played);
  }
  // How far a drawing has walked is counted from where the stretch begins: it goes on from where it was.
  function carryOn(old, some) {
    const size = old.shape[1] * old.shape[2];
    const across = ({ points }, at) => points[at] * some.root[0] + points[at + 1] * some.root[1] + points[at + 2];
    const by = across(old, some.first * size) - across(some, 0);
    for (let at = 2; at < some.points.length; at += old.shape[2]) some.points[at] += by;
  }
  function become(played) {
    const first = !desk.played;
    Object.assign(desk, { played, problem: "", clip: played.clip ?? desk.clip });
    if (first) frameAll();
    if (first && desk.playing) restart();
  }
  async function fetched(look, fields) {
    const { event, view } = await bench.look(look, fields);
    return { ...event, points: new Float32Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength)) };
  }

  // The drawing's pieces, for the parts that move it; those of a pose and of a dance may be others.
  async function meshFor(parts = null) {
    const key = `${now().figure.drawn} ${parts?.join("|") ?? ""}`;
    if (!desk.meshes.has(key)) {
      const told = await bench.look("posing.mesh", parts ? { parts } : {});
      const bitmap = told.event.picture ? (await bench.picture("posing.texture")).bitmap : null;
      desk.meshes.set(key, meshOf(told, bitmap));
    }
    return desk.meshes.get(key);
  }
  const meshOfNow = (parts) => desk.meshes.get(`${now().figure?.drawn} ${parts?.join("|") ?? ""}`) ?? null;
  async function drawing() {
    const { figure } = now();
    if (!figure?.drawn && !figure?.body) return;
    try {
      if (figure.drawn) await meshFor();
      else desk.meshes.set(figure.body, bodyOf(await bench.look("posing.body")));
      if (desk.mode === "pose") fitPose();
      else show();
    } catch (error) {
      bench.say(error.message);
    }
  }

  const apart = () => {
    const { points, shape } = desk.clip;
    let wide = 0;
    for (let joint = 0; joint < shape[1]; joint++) wide = Math.max(wide, Math.abs(points[3 * joint] - points[0]));
    return Math.max(1, 2.4 * wide);
  };
  function partsAt(t) {
    const size = desk.played.shape[1] * desk.played.shape[2];
    return desk.played.points.subarray(t * size, (t + 1) * size);
  }

  function frameAll() {
    const [all, last] = [[], desk.played.shape[0] - 1];
    const mesh = desk.played.parts && meshOfNow(desk.played.parts);
    if (mesh) puppet.show(mesh);
    const boundsAt = (t) => (mesh ? puppet.bounds(partsAt(t)) : (fleshBounds(desk.mode === "dance" && partsAt(t)) ?? figuresAt(t).flatMap(({ places }) => places)));
    for (let t = 0; t <= last; t += Math.max(1, Math.floor(last / 12))) all.push(...boundsAt(t));
    sticks.fit(all);
  }
  function fitPose() {
    const { pose, parts, figure } = now();
    if (!pose) return;
    const mesh = figure.drawn ? meshOfNow() : null;
    puppet.show(mesh);
    Object.assign(sticks, mesh ? { turn: 0, tilt: 0 } : { turn: 0.35, tilt: 0.12 });
    sticks.fit(mesh ? puppet.bounds(parts) : (fleshBounds(now().joints) ?? pose));
    show();
  }

  const sideOf = (name) => (/[Ll]eft|^[Ll][A-Z_]/.test(name) ? "#ffb03b" : /[Rr]ight|^[Rr][A-Z_]/.test(name) ? "#5b9dff" : "#d7d9dd");
  function figuresAt(t) {
    const { figure } = now();
    if (desk.mode === "dance") return [{ places: figure.body ? jointsAt(partsAt(t)) : placesAt(desk.played, t), parents: figure.parents, color: (joint) => sideOf(figure.names[joint] ?? "") }];
    const off = apart() / 2;
    const shift = (places, by) => places.map(([x, y, z]) => [x + by, y, z]);
    const clip = { places: shift(placesAt(desk.clip, Math.min(t, desk.clip.shape[0] - 1)), -off), parents: desk.clip.parents, color: () => "#8d9199" };
    return [clip, { places: shift(placesAt(desk.played, t), off), parents: desk.played.parents, color: () => "#f0b04a", seamless: true }];
  }

  const fleshBounds = (joints) => {
    const mesh = joints && desk.meshes.get(now().figure.body);
    return mesh ? body.bounds(mesh, joints) : null;
  };
  const jointsAt = (joints) => now().figure.names.map((_, joint) => [...joints.slice(COLUMNS * joint + 12, COLUMNS * joint + 15)]);

  // A model's own mesh instead of sticks, where it is here and can be shown.
  function fleshed(joints) {
    const shown = body.show((joints && desk.meshes.get(now().figure.body)) || null);
    if (shown) body.joints = joints;
    return shown;
  }

  function show() {
    const { figure } = now();
    sticks.figures = [];
    const joints = figure?.body && desk.mode !== "rubber" ? (desk.mode === "pose" ? now().joints : desk.played && partsAt(Math.min(desk.frame, desk.played.shape[0] - 1))) : null;
    const flesh = fleshed(joints);
    const drawn = figure?.drawn && desk.mode !== "rubber";
    if (!figure || desk.mode === "pose" || !desk.played) {
      puppet.show(drawn ? meshOfNow(desk.played?.parts) ?? puppet.mesh : null);
      if (desk.mode === "pose") puppet.parts = drawn ? now().parts : null;
      if (figure && desk.mode === "pose" && !drawn && !flesh) sticks.figures = [{ places: pointer.pose(), parents: figure.parents, color: (joint) => sideOf(figure.names[joint]) }];
      clock.textContent = "";
    } else {
      desk.frame = Math.min(desk.frame, desk.played.shape[0] - 1);
      puppet.show(drawn ? meshOfNow(desk.played.parts) : null);
      if (drawn) puppet.parts = partsAt(desk.frame);
      else if (!flesh) sticks.figures = figuresAt(desk.frame);
      const seconds = desk.frame / desk.played.fps;
      clock.textContent = `${seconds.toFixed(2)} s`;
      beats.seconds = seconds;
      beats.clip = desk.mode === "rubber" ? desk.played.shape[0] / desk.played.fps : 0;
      if (desk.mode === "dance") beats.at = dancedAt(beatAt(seconds, times(), tempo()), beats.phrases);
      beats.draw();
    }
    sticks.draw();
  }
  sticks.painters.push(() => (puppet.draw(), body.draw()));
  sticks.painters.push(pointer.paint);

  // The time: the music's where it is heard, else the clock's.

  const heard = () => desk.mode === "dance" && music.seconds();
  function restart() {
    desk.began = [performance.now(), desk.frame];
    music.stop();
    if (!desk.playing) return;
    if (desk.mode === "dance" && desk.played) music.play(desk.frame / desk.played.fps);
    if (!ticking) requestAnimationFrame(tick);
    ticking = true;
  }
  let ticking = false;
  function tick(moment) {
    ticking = desk.playing && !el.hidden;
    if (!ticking) return music.stop();
    if (desk.played) {
      const { fps, shape } = desk.played;
      const sound = heard();
      const at = typeof sound === "number" ? Math.floor(sound * fps) : desk.began[1] + Math.floor(((moment - desk.began[0]) / 1000) * fps);
      if (at >= shape[0]) {
        desk.frame = 0;
        restart();
      } else if (Math.max(at, 0) !== desk.frame) {
        desk.frame = Math.max(at, 0);
        show();
      }
    }
    requestAnimationFrame(tick);
  }
  function toggle() {
    if (desk.mode === "pose") return choose("dance");
    desk.playing = !desk.playing;
    restart();
    explain();
  }
  function go(frame, plays = false) {
    if (!desk.played) return;
    desk.playing = plays;
    desk.frame = Math.min(Math.max(frame, 0), desk.played.shape[0] - 1);
    restart();
    show();
    explain();
  }
  const stopAt = (seconds) => go(Math.round(seconds * (desk.played?.fps ?? 24)));

  // Words.

  function explain() {
    const { figure } = now();
    let text;
    if (!figure) text = "Whom to pose? Take a figure at the right, or open a .bvh file.";
    else if (desk.problem && desk.mode !== "pose") text = desk.problem;
    else if (desk.mode === "pose" && !desk.ready) text = "Getting the springs ready: some seconds, once on this machine…";
    else if (desk.mode === "pose" && desk.hover >= 0 && handles.open) text = `${figure.names[desk.hover]}: P pins it. ${handles.hint()}`;
    else if (desk.mode === "pose") text = `Drag a joint; Shift-click or P pins one. Drag beside the figure to ${figure.drawn ? "move the paper" : "turn round it"}.`;
    else if (!desk.played) text = desk.mode === "rubber" ? "Stretching…" : "Dancing…";
    else if (desk.mode === "dance") text = "Double click in the beats puts the posture there; drag steps, up or down for their extent; Ctrl and the wheel zoom.";
    else text = "Grey is what was captured, yellow what is made of it.";
    hint.textContent = text;
    hint.title = text;
    fill(play, icon(desk.playing ? "stop" : "play"));
    play.title = desk.playing ? "Stop (Space)" : "Play (Space)";
    play.setAttribute("aria-label", play.title);
  }

  bench.on("progress", panel.draw);
  bench.on("ended", panel.draw);

  function changed(sections) {
    const { figure, dance, feel, music: song } = now();
    const own = Object.keys(sections?.posing ?? {});
    if (own.length && figure && own.every((name) => name === "pose" || name === "parts" || name === "joints")) return show(); // a drag: as little as can be
    const open = figure ? `${bench.state.folder.at.open} ${figure.file} ${figure.drawn}` : "";
    if (open !== desk.open) opened(open, figure);
    if (dance) Object.assign(beats, { phrases: dance.phrases, music: song ?? null, bpm: feel.bpm, phrase: Math.min(beats.phrase, dance.phrases.length - 1) });
    if (song?.file !== (music.file || undefined)) music.load();
    bar.draw();
    beats.draw();
    if (desk.mode !== "pose" && (!sections || ["dance", "pool", "feel", "music", "figure"].some((name) => own.includes(name)))) {
      if (desk.played && own.some((name) => name === "music")) desk.played.stale = true;
      want();
    }
    panel.draw();
    show();
    explain();
  }
  function opened(open, figure) {
    Object.assign(desk, { open, clip: null, played: null, drag: null, ready: false, frame: 0 });
    desk.meshes.clear();
    panel.list();
    if (!figure) return;
    fitPose();
    drawing();
    bench.look("posing.ready").then(() => desk.open === open && ((desk.ready = true), explain()), (error) => bench.say(error.message));
  }

  choose("pose");

  const step = (event) => (event.shiftKey ? 10 : 1);
  const keys = [
    ...handles.keys,
    key(" ", "Play and stop", toggle),
    key("ArrowLeft", "A frame back; with Shift ten", (event) => go(desk.frame - step(event))),
    key("ArrowRight", "A frame on; with Shift ten", (event) => go(desk.frame + step(event))),
    key("Home", "The beginning", () => go(0)),
    key("End", "The end", () => go(1e9)),
    key("1-9", `${Object.values(MODES).join(", ")}`, (event) => (Object.keys(MODES)[event.key - 1] ? choose(Object.keys(MODES)[event.key - 1]) : false), "1–3"),
    key("p", "Pin the joint, or let it go", () => pointer.pin(desk.hover)),
    key("t", "Tap the tempo of a dance", () => (desk.mode === "dance" ? music.tap(heard() || desk.frame / 24) : false)),
    key("Delete", "Take the chosen step out of a dance", () => desk.mode === "dance" && beats.dropChosen()),
    key("Backspace", "The same", () => desk.mode === "dance" && beats.dropChosen()),
    key("0", "All of the figure", () => (desk.played ? frameAll() : fitPose())),
  ];

  return {
    changed,
    shown: () => (changed(), restart(), desk.mode === "pose" && fitPose()),
    hidden: () => ((desk.playing = false), music.stop()),
    dropped: (files) => Boolean(now().figure) && desk.mode === "dance" && music.takes(files),
    keys,
    key: (event) => !ownKey(event) && press(keys, event),
  };
}
