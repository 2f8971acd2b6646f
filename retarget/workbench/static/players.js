// Who could play: drawings of the folder and built-in ones, what works as it is first; one click lets one play.
import { button, make } from "./dom.js";

const WAYS = {
  play: ["Play", "Let it play as it is"],
  propose: ["Propose", "It has one pose: all key drawings are made from it, for you to correct"],
};
const BUILT_IN = "built-in:";

export function makePlayers(bench, desk, { changed, load, accepts, says }) {
  const offers = () => bench.state.stage.offers ?? [];
  const known = () => new Set(offers().flatMap(({ files }) => files));

  function play(files = [...desk.chosen]) {
    if (!files.length || bench.running) return;
    says("Learning the drawings…");
    bench.act("stage.play", { files });
  }

  function propose(files = [...desk.chosen]) {
    if (files.length && !bench.running) bench.work("stage.propose", { files });
  }

  function row(offer, first) {
    const { name, files, how, fits } = offer;
    const box = make("input", { type: "checkbox", checked: files.every((file) => desk.chosen.has(file)) });
    box.onchange = () => {
      for (const file of files) desk.chosen[box.checked ? "add" : "delete"](file);
      changed();
    };
    const [verb, what] = WAYS[how];
    const go = button(verb, "", () => (how === "play" ? play(files) : propose(files)), first ? "primary" : "");
    go.title = what;
    go.setAttribute("aria-label", `${verb === "Play" ? "Let" : "Propose keys from"} ${name}${verb === "Play" ? " play" : ""}`);
    go.disabled = Boolean(bench.running);
    const keys = fits && files.length > 1 && make("small", {}, `${files.length} keys`);
    return make("li.offer", {}, make("label.choice", {}, box, make("span", { title: name }, name), keys), go);
  }

  function panel() {
    const asked = make("input", { type: "file", multiple: true, hidden: true, accept: accepts });
    asked.onchange = () => load([...asked.files]);
    const there = known();
    desk.chosen = new Set([...desk.chosen].filter((name) => there.has(name)));
    const groups = [...Map.groupBy(offers(), ({ where }) => where)];
    const wantsOne = !bench.state.stage.cast && !desk.chosen.size;
    const list = groups.flatMap(([where, inner], n) => [
      where && make("li.where", {}, where === BUILT_IN ? "Built in" : where),
      ...inner.map((offer, m) => row(offer, wantsOne && !n && !m)),
    ]);
    const chosen = desk.chosen.size > 0;
    const together = button("Let it play", "Enter", () => play(), bench.state.stage.cast ? "" : "primary");
    const keyed = button("Propose keys", "", () => propose());
    keyed.title = "Make all key drawings from the one that is chosen, for you to correct";
    together.disabled = keyed.disabled = Boolean(bench.running);
    keyed.disabled ||= [...desk.chosen].some((file) => !/\.(svg|png|jpe?g|webp)$/i.test(file));
    return [
      make("h2", {}, "Who plays"),
      make("ul.choices", {}, ...list.filter(Boolean)),
      make("div.row", {}, button("Load a drawing…", "", () => asked.click()), chosen && together, chosen && keyed, asked),
    ];
  }

  return { panel, play };
}
