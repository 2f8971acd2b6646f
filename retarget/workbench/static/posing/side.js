// The posing desk's panel at the side: postures of a pose; how a dance moves, and its music; how rubbery a clip is.
import { button, fill, make, slider } from "../shared/dom.js";
import { madeOf } from "../shared/made.js";

export const DANCE = {
  bpm: ["Tempo", { min: 40, max: 220, step: 1 }],
  quick: ["Quickness", { min: 0.5, max: 6, step: 0.1 }],
  damping: ["Damping", { min: 0.05, max: 1.5, step: 0.05 }],
  clumsy: ["Clumsy", { min: -1, max: 1, step: 0.1 }],
  stiff: ["Stiff", { min: -1, max: 1, step: 0.1 }],
  wild: ["Wild", { min: -1, max: 1, step: 0.1 }],
  extent: ["Extent", { min: 0, max: 2, step: 0.05 }],
};
export const RUBBER = {
  omega: ["Omega", { min: 1, max: 8, step: 0.1 }],
  sigma: ["Sigma (s)", { min: 0.03, max: 0.6, step: 0.01 }],
  follow: ["Follow-through", { min: 0, max: 1, step: 0.05 }],
  squash: ["Squash", { min: 0, max: 1, step: 0.05 }],
  hose: ["Hose", { min: 0, max: 1, step: 0.05 }],
};
const BUILT_IN = ["human", "flower", "lamp"];

export function makeSide(side, bench, desk, { act, felt, beats, music }) {
  const panel = { posture: "", kind: {} };
  const now = () => bench.state.posing ?? {};
  let [panelOf, movedAt, others] = ["", 0, []];

  panel.list = async () => {
    const { view } = await bench.look("posing.others");
    others = JSON.parse(new TextDecoder().decode(view));
    panel.draw();
  };

  panel.draw = () => {
    const { figure, pool = [], extents = {}, pinned = [], feel = {}, music: song, made = [] } = now();
    const key = JSON.stringify([desk.mode, figure?.file, figure?.kinds, pool, pinned.length > 0, bench.running, made, others, song?.file, song?.pace, song?.bpm, music.songs, music.problem]);
    if (key !== panelOf) {
      panelOf = key;
      fill(side, ...(!figure ? figures() : desk.mode === "pose" ? posing(figure, pool, pinned) : desk.mode === "dance" ? dancing(figure, pool, song) : rubber(figure)));
    }
    set(desk.mode === "pose" ? extents : feel);
  };

  // What is not being moved by hand shows what is so now.
  function set(values) {
    for (const label of side.querySelectorAll(".slider")) {
      const [input, output] = [label.querySelector("input"), label.querySelector("output")];
      if (input.matches(":active") || (input.matches(":focus") && performance.now() - movedAt < 500)) continue;
      input.value = values[label.dataset.slider] ?? 0;
      output.textContent = input.value;
    }
  }

  // One slider: what comes of one hold of it is one step to undo.
  function held(name, text, range, moved) {
    let gesture = "";
    let idle = 0;
    const label = slider(text, { ...range, value: 0 }, (value, done) => {
      gesture = gesture || bench.gesture();
      clearTimeout(idle);
      idle = setTimeout(() => (gesture = ""), 800);
      movedAt = performance.now();
      moved(value, gesture, done);
    });
    label.dataset.slider = name;
    return label;
  }
  const feelings = (known) => Object.entries(known).map(([name, [text, range]]) => held(name, text, range, (value, gesture) => felt(name, value, gesture)));

  function figures() {
    const made = BUILT_IN.map((who) => button(`The ${who}`, "", () => act("begin", { who })));
    const found = others.map((who) => make("button.file", { type: "button", onclick: () => act("begin", { who }) }, who));
    return [make("h2", {}, "Figures"), make("div.row", {}, ...made), found.length ? make("h2", {}, "In this folder") : null, ...found,
      make("p.none", {}, "A .bvh, a model with a skin, or a drawing whose joints are marked can be posed.")];
  }

  function another(figure) {
    const names = [...new Set([figure.file, ...BUILT_IN, ...others])];
    const select = make("select", { "aria-label": "Figure" }, ...names.map((name) => make("option", { value: name, selected: name === figure.file }, BUILT_IN.includes(name) ? `the ${name}` : name)));
    select.onchange = () => act("begin", { who: select.value });
    return make("div.row", {}, select);
  }

  function posing(figure, pool, pinned) {
    const name = make("input", { type: "text", placeholder: "its name", maxLength: 60, "aria-label": "Name of the posture" });
    const keep = button("Keep pose", "", () => act("keep", { name: name.value.trim() || `pose ${pool.length + 1}` }));
    const sliders = pool.map((posture) => held(posture, posture, { min: 0, max: 1.5, step: 0.05 }, (extent, gesture) => act("mix", { posture, extent }, { newest: "mix", gesture })));
    const frames = figure.frames ? make("div.row", {}, frameInput(figure.frames), make("span.none", {}, `of ${figure.frames - 1} in the clip`)) : null;
    const save = () => act("save_pose", { kind: panel.kind.pose });
    return [another(figure),
      make("div.row", {}, figure.drawn ? button("As drawn", "", () => act("undrag")) : null, button("Stand at rest", "", () => act("stand")), pinned.length ? button("Unpin all", "", () => act("unpin")) : null),
      frames, make("h2", {}, "Postures"), make("div.postures", {}, ...sliders), make("div.row", {}, name, keep),
      ...exports(figure, "pose", "Save pose", save)];
  }

  function dancing(figure, pool, song) {
    if (!pool.includes(panel.posture)) panel.posture = pool[0];
    const select = make("select", { "aria-label": "Posture to put" }, ...pool.map((name) => make("option", { value: name, selected: name === panel.posture }, name)));
    select.onchange = () => ((panel.posture = select.value), panel.line());
    panel.line();
    const put = () => act("put", { posture: panel.posture, phrase: beats.at.phrase, beat: Math.min(Math.round(beats.at.beat * 4) / 4, beats.phrases[beats.at.phrase].beats - 0.25) });
    const { bpm, ...rest } = DANCE;
    return [make("h2", {}, "Music"), ...music.panel(Boolean(bench.running)), ...feelings(song ? {} : { bpm }),
      make("h2", {}, "How it moves"), ...feelings(rest),
      make("h2", {}, "Posture to put"), make("div.row", {}, select, button("On this beat", "", put)), ...exports(figure, "dance")];
  }

  function rubber(figure) {
    if (!figure.frames) return [make("h2", {}, "Rubber"), make("p.none", {}, "Rubber is made of motion capture: open a .bvh file."), another(figure)];
    return [make("h2", {}, "How rubbery"), ...feelings(RUBBER), ...exports(figure, "rubber")];
  }

  function exports(figure, what, text = "Export", run = () => bench.work("posing.export", { what, kind: panel.kind[what] })) {
    const known = figure.kinds[what];
    if (!known.some(([kind]) => kind === panel.kind[what])) panel.kind[what] = known[0][0];
    const kinds = make("select", { "aria-label": what === "pose" ? "Save as" : "Export as" }, ...known.map(([kind, words]) => make("option", { value: kind, selected: kind === panel.kind[what] }, words)));
    kinds.onchange = () => (panel.kind[what] = kinds.value);
    const go = button(text, "", run, what === "pose" ? "" : "primary");
    go.disabled = what !== "pose" && Boolean(bench.running);
    return [make("div.export", {}, make("h2", {}, "Export"), make("div.row", {}, kinds, go), ...madeOf(bench, "posing", { are: ({ file }) => file.split("/").at(-1).includes(`.${what}.`) }))];
  }

  function frameInput(count) {
    const input = make("input", { type: "number", min: 0, max: count - 1, value: 0, "aria-label": "Frame of the clip" });
    input.onchange = () => act("take", { frame: Math.max(0, Math.round(Number(input.value) || 0)) });
    return input;
  }

  panel.line = () => {
    beats.chosen = desk.mode === "dance" ? panel.posture : "";
    beats.draw();
  };
  return panel;
}
