// The phrase that is worked on: how long it is, how often it comes; and more of them.
import { button, fill, make } from "../shared/dom.js";

export function makePhraseBar(el, { act, beats, now }) {
  const bar = {};
  let [barOf, wanted] = ["", true];

  bar.draw = (shown = wanted) => {
    wanted = shown;
    const { figure, dance } = now();
    el.hidden = !figure || !dance || !wanted;
    if (el.hidden) return;
    const number = Math.min(beats.phrase, dance.phrases.length - 1);
    const phrase = dance.phrases[number];
    const { steps, ...plain } = phrase;
    const key = JSON.stringify([number, dance.phrases.length, plain]);
    if (key === barOf) return;
    barOf = key;
    const set = (fields) => act("set_phrase", { phrase: number, ...fields });
    const many = (name, text, least, most) => {
      const input = make("input", { type: "number", min: least, max: most, step: 1, value: phrase[name] });
      input.onchange = async () => {
        const done = await set({ [name]: Math.min(Math.max(Math.round(Number(input.value) || least), least), most) });
        if (!done) input.value = phrase[name];
      };
      return make("label", {}, text, input);
    };
    const whether = (name, text, title) => {
      const input = make("input", { type: "checkbox", checked: phrase[name] });
      input.onchange = () => set({ [name]: input.checked });
      return make("label", { title }, input, text);
    };
    fill(el,
      make("span", {}, `Phrase ${number + 1} of ${dance.phrases.length}`),
      many("beats", "beats", 1, 64), many("repeats", "times", 1, 64),
      whether("mirror", "mirrored", "Every second time with left and right swapped"),
      whether("half", "half time", "Its beats are every second beat of the music"),
      button("Copy", "", () => act("copy_phrase", { phrase: number })),
      button("Add", "", async () => (await act("add_phrase")) && pick(dance.phrases.length)),
      button("Remove", "", () => act("drop_phrase", { phrase: number })));
  };
  function pick(number) {
    beats.phrase = number;
    bar.draw();
    beats.draw();
  }
  return bar;
}
