// What is seen while nothing is open: what to do first.
import { button, fill, make } from "./dom.js";

const WHAT = { shot: "shot", clip: "clip", motion: "captured motion", cast: "cast", bvh: "motion capture" };

export function filesPanel(el, bench) {
  const list = make("ul.files");
  const example = button("Try it on the built-in frog", "", () => bench.work("folder.example"), "primary");
  const figure = button("Pose a figure", "", () => bench.act("posing.begin", { who: "human" }));
  const hint = make("p");
  el.append(make("div.card", {}, make("h1", {}, "Which cartoon?"), hint, list, make("div.row", {}, example, figure)));
  return {
    changed() {
      const { folder, files } = bench.state;
      if (!folder?.files) return;
      const shown = folder.files.filter(({ kind }) => WHAT[kind]);
      hint.textContent = shown.length
        ? `In ${folder.at.folder}:`
        : `There is no clip in ${folder.at.folder} yet. Put an mp4, webm, gif or a folder of pictures there and reload, or begin with the frog.`;
      fill(
        list,
        ...shown.map(({ file, kind }) =>
          make("li", {}, make("button.file", { type: "button", onclick: () => bench.act("folder.open", { file }) }, make("span", {}, file), make("small", {}, WHAT[kind]))),
        ),
      );
      example.hidden = shown.some(({ file }) => file === "frog.mp4");
    },
  };
}
