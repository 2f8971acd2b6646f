// Keys as tables of {on, said, what, act}: the same table is acted by and is what "?" lists.

// key("f", "Mend this frame", act): a letter in any case, or the browser's name of a key; "1-9" is any digit, "Arrows" any.
// `act` gets the event; where it returns false the key was not taken after all.
export const key = (on, what, act, said = on.length === 1 ? on.toUpperCase() : on) => ({ on, said, what, act });

const SPOKEN = { " ": "Space", ArrowLeft: "←", ArrowRight: "→" };
export const spoken = (said) => SPOKEN[said] ?? said;

const is = (on, event) => (on === "1-9" ? /^[1-9]$/.test(event.key) : on === "Arrows" ? event.key.startsWith("Arrow") : on === event.key || (on.length === 1 && on === event.key.toLowerCase()));

export function press(table, event) {
  return table.some(({ on, act }) => is(on, event) && act(event) !== false);
}

// Whether what has the focus wants a key for itself: a button its Space and Enter, a slider its arrows.
export function ownKey(event) {
  const on = event.target;
  if (event.key === "Enter") return Boolean(on.matches?.("button, summary, a"));
  if (event.key === " ") return Boolean(on.matches?.("button, summary, input"));
  return Boolean(on.matches?.("input") && /^(Arrow|Home|End|Page)/.test(event.key));
}
