// What is seen while nothing is open: what to do first, and what lies in the folder.
import { button, fill, make } from "./shared/dom.js";

const FIRST = ["shot", "motion", "clip", "bvh", "cast"]; // which file of one work is opened: it brings the others
const HAS = { shot: "begun", motion: "captured", cast: "played" };

export function filesPanel(el, bench, arrivals) {
  const list = make("div.files");
  const open = button("Open a clip…", "", () => arrivals.choose(), "primary");
  const example = button("Try it on the built-in frog", "", () => bench.work("folder.example"));
  const figure = button("Pose a figure", "", () => bench.act("posing.begin", { who: "human" }));
  const hint = make("p");
  const more = make("p", { hidden: true });
  el.append(make("div.card", {}, make("h1", {}, "Which cartoon?"), hint, make("div.row", {}, open, example, figure), list, more));
  return {
    changed() {
      const { folder, files, more: left } = bench.state.folder ? { folder: bench.state.folder.at, ...bench.state.folder } : {};
      if (!files) return;
      hint.textContent = `Choose a video, a GIF, a sprite sheet or motion capture (BVH), or drop it here. It is copied into ${folder.path}; nothing leaves this machine.`;
      more.textContent = `Only the first ${files.length} files of this folder are listed.`;
      more.hidden = !left;
      const works = worksOf(files);
      fill(
        list,
        ...[...Map.groupBy(works, ({ where }) => where)].map(([where, inner]) =>
          make("section", { "aria-label": where || folder.folder },
            make("h2", {}, where ? `${folder.folder} / ${where.replaceAll("/", " / ")}` : `In ${folder.folder}`),
            make("ul", {}, ...inner.map((work) =>
              make("li", {}, make("button.file", { type: "button", title: work.file, onclick: () => bench.act("folder.open", { file: work.file }) }, make("span", {}, work.name), make("small", {}, work.what))))))),
      );
      example.hidden = files.some(({ file }) => file === "frog.mp4");
    },
  };
}

const whereOf = (file) => file.slice(0, Math.max(file.lastIndexOf("/"), 0));

// Files of one name are one piece of work: {file to open, name that is read, what is there of it, where}.
function worksOf(files) {
  const works = new Map();
  for (const { file, kind } of files) {
    if (kind === "figure") continue;
    const [where, name] = [whereOf(file), file.slice(file.lastIndexOf("/") + 1)];
    const stem = file.replace(/\.(shot\.toml|motion\.json|cast\.toml)$|\.[^./]+$/, "");
    const work = works.get(stem) ?? { where, all: {} };
    work.all[kind] ??= name;
    works.set(stem, work);
  }
  const figures = files.filter(({ kind }) => kind === "figure").map(({ file }) => ({ where: whereOf(file), what: "figure", name: file.slice(file.lastIndexOf("/") + 1), file }));
  const made = [...works.values()].map(({ where, all }) => {
    const chosen = all[FIRST.find((kind) => all[kind])];
    const has = Object.keys(HAS).filter((kind) => all[kind]).map((kind) => HAS[kind]);
    const what = all.bvh && !all.clip ? "motion capture" : has.join(", ") || (/\.\w+$/.test(all.clip) ? "clip" : "pictures");
    const name = all.clip ?? all.bvh ?? chosen;
    return { where, what, name: name === "." ? "the pictures of this folder" : name, file: where ? `${where}/${chosen}` : chosen };
  });
  return [...made, ...figures].sort((one, other) => Boolean(one.where) - Boolean(other.where)); // the folder's own first
}
