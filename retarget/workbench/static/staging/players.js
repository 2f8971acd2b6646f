// Who could play: drawings of the folder and built-in ones, what works as it is first; one click lets one play.
import { button, make } from "../shared/dom.js";

const BUILT_IN = "built-in:";

export function makePlayers(bench, desk, { changed, load, accepts, says }) {
  const offers = () => bench.state.stage.offers ?? [];
  const known = () => new Set(offers().flatMap(({ files }) => files));

  function play(files = [...desk.chosen]) {
    if (!files.length || bench.running) return;
    desk.learning = true;
    says("Learning the drawings…");
    bench.act("stage.play", { files }).then((done) => {
      desk.learning = false;
      if (done) changed();
      else says(bench.state.stage.cast ? "" : hint());
    });
  }

  function propose(files = [...desk.chosen]) {
    if (files.length && !bench.running) bench.work("stage.propose", { files });
  }

  // What is ticked, together: as it is, or where that is one drawing for many keys, with keys proposed.
  function wantsKeys() {
    const whole = offers().find(({ files }) => files.length === desk.chosen.size && files.every((file) => desk.chosen.has(file)));
    return whole?.how === "propose";
  }

  // Drawings are shown small beside their names; each is asked for once, one after the other.
  const pictures = new Map(); // file -> address
  let asking = Promise.resolve();
  function small(file) {
    const image = make("img.small", { alt: "" });
    if (pictures.has(file)) image.src = pictures.get(file);
    else {
      asking = asking.then(async () => {
        if (!pictures.has(file)) pictures.set(file, await seen(file));
        image.src = pictures.get(file);
      });
    }
    return image;
  }

  async function seen(file) {
    try {
      const { event, view } = await bench.look("stage.small", { file });
      return URL.createObjectURL(new Blob([new Uint8Array(view.buffer, view.byteOffset, view.byteLength)], { type: event.type }));
    } catch {
      return "data:,"; // a model, or what is no drawing after all: its name must do
    }
  }

  function row(offer, isNext, isPlaying) {
    const { name, files, how, fits } = offer;
    const box = make("input", { type: "checkbox", checked: files.every((file) => desk.chosen.has(file)) });
    box.onchange = () => {
      for (const file of files) desk.chosen[box.checked ? "add" : "delete"](file);
      changed();
    };
    const go = button(isPlaying ? "Plays" : "Play", "", () => (how === "play" ? play(files) : propose(files)), isNext ? "primary" : "");
    go.title = how === "play" ? "Let it play" : "Let it play; its other key drawings are proposed, for you to correct";
    go.setAttribute("aria-label", `${go.textContent}: ${name}`);
    go.disabled = Boolean(bench.running);
    const what = how === "propose" ? "keys proposed" : fits && files.length > 1 ? `${files.length} keys` : "as it is";
    const label = make("label.choice", {}, box, small(files[0]), make("span", { title: name }, name, make("small", {}, what)));
    return make("li.offer", {}, label, go);
  }

  function panel() {
    const asked = make("input", { type: "file", multiple: true, hidden: true, accept: accepts });
    asked.onchange = () => load([...asked.files]);
    const there = known();
    desk.chosen = new Set([...desk.chosen].filter((name) => there.has(name)));
    const groups = [...Map.groupBy(offers(), ({ where }) => where)];
    const plays = new Set(bench.state.stage.plays);
    const wantsOne = !bench.state.stage.cast && !desk.chosen.size;
    const list = groups.flatMap(([where, inner], n) => [
      where && make("li.where", {}, where === BUILT_IN ? "Built in" : where),
      ...inner.map((offer, m) => row(offer, wantsOne && !n && !m, offer.files.every((file) => plays.has(file)))),
    ]);
    const chosen = desk.chosen.size > 0;
    const together = button("Let it play", "Enter", () => play(), bench.state.stage.cast || wantsKeys() ? "" : "primary");
    const keyed = button("Propose keys", "", () => propose(), wantsKeys() ? "primary" : "");
    keyed.title = "Make all key drawings from the one that is chosen, for you to correct";
    together.disabled = keyed.disabled = Boolean(bench.running);
    keyed.disabled ||= [...desk.chosen].some((file) => !/\.(svg|png|jpe?g|webp)$/i.test(file));
    return [
      make("h2", {}, "Who plays"),
      make("ul.choices", {}, ...list.filter(Boolean)),
      make("div.row", {}, button("Load a drawing…", "", () => asked.click()), chosen && together, chosen && keyed, asked),
    ];
  }

  // What there is to say while nobody plays.
  function hint() {
    const keys = Math.max(...bench.state.stage.motion.parts.map((part) => part.keys.length));
    const fits = offers().some((offer) => offer.fits);
    if (bench.running === "stage.propose") return "Proposing the key drawings…";
    if (fits || keys === 1) return "Who plays it? Choose a drawing, a picture or a model at the right, or drop one here.";
    return `Nobody here is drawn in ${keys} keys: let one play, and its keys are proposed. Or drop your own drawing here.`;
  }

  return { panel, play: () => (wantsKeys() ? propose() : play()), hint };
}
