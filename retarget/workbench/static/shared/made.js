// What was exported: where it is, how it looks, and a copy of it to take along.
import { button, make } from "./dom.js";

// The latest exports of what is open that were made at a desk and that `are` wanted, as elements of a panel.
export function madeOf(bench, desk, { most = 1, are = () => true } = {}) {
  const { made = [], number = 0 } = bench.state[desk] ?? {};
  return made.filter(are).slice(0, most).map((one, n) => {
    const looks = /^(image|video)\//.test(one.type) && one.type !== "video/quicktime";
    const isNew = one.of === number;
    const look = button("Look at it", "", (event) => show(bench, desk, one, event.currentTarget.closest(".tooncap")), n || !isNew ? "" : "primary");
    const save = button("Save a copy…", "", () => saveCopy(bench, desk, one));
    return make("div.made.result", {},
      make("b", { title: one.path }, one.file),
      make("p", {}, one.said.slice(one.said.indexOf(": ") + 2), isNew ? "" : " (It was changed since: export it again.)"),
      make("p.path", { title: one.path }, one.path),
      one.type !== "folder" && make("div.row", {}, looks && look, save));
  });
}

async function fetched(bench, desk, { file, type }) {
  const pieces = [];
  for (let at = 0, size = 1; at < size; ) {
    const { event, view } = await bench.look(`${desk}.made`, { file, at });
    pieces.push(new Uint8Array(view.buffer, view.byteOffset, view.byteLength).slice());
    at += view.byteLength;
    size = event.size;
    if (!view.byteLength) break;
  }
  return URL.createObjectURL(new Blob(pieces, { type }));
}

async function saveCopy(bench, desk, one) {
  try {
    const url = await fetched(bench, desk, one);
    make("a", { href: url, download: one.file.split("/").at(-1) }).click();
    setTimeout(() => URL.revokeObjectURL(url), 60_000);
  } catch (error) {
    bench.say(error.message);
  }
}

// The file itself, over the page, until one has seen enough.
async function show(bench, desk, one, root) {
  try {
    const url = await fetched(bench, desk, one);
    const seen = one.type.startsWith("video/")
      ? make("video", { src: url, controls: true, autoplay: true, loop: true, muted: true })
      : make("img", { src: url, alt: one.said });
    const close = button("Close", "Esc", () => dialog.close(), "primary");
    const dialog = make("dialog.shown", { "aria-label": one.file }, seen,
      make("div.row", {}, make("b", {}, one.file), make("span.path", {}, one.path), button("Save a copy…", "", () => saveCopy(bench, desk, one)), close));
    root.append(dialog);
    dialog.addEventListener("keydown", (event) => event.stopPropagation()); // the desk's keys are not for now
    dialog.addEventListener("close", () => (dialog.remove(), URL.revokeObjectURL(url)));
    dialog.showModal();
  } catch (error) {
    bench.say(error.message);
  }
}
