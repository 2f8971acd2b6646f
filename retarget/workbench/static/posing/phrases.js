// Beats of the music and of a dance: which beat sounds at a moment, and which phrase is danced then.

// How many beats of the music there were after so many seconds, and back.
export function beatAt(seconds, times, bpm) {
  if (!times?.length) return (seconds * bpm) / 60;
  let n = 0;
  while (n + 2 < times.length && times[n + 1] <= seconds) n++;
  const last = times.length - 1;
  if (seconds < times[0]) return ((seconds - times[0]) * bpm) / 60;
  if (seconds > times[last]) return last + ((seconds - times[last]) * bpm) / 60;
  return n + (seconds - times[n]) / (times[n + 1] - times[n]);
}

export function secondsAt(beat, times, bpm) {
  if (!times?.length) return (beat * 60) / bpm;
  const last = times.length - 1;
  if (beat >= last) return times[last] + ((beat - last) * 60) / bpm;
  const n = Math.max(0, Math.floor(beat));
  return times[n] + (Math.max(beat, 0) - n) * (times[n + 1] - times[n]);
}

const slow = ({ half }) => (half ? 2 : 1);
const lasts = (phrase) => phrase.beats * phrase.repeats * slow(phrase);

// {phrase, beat} that is danced on a beat of the music; after the last phrase the first again.
export function dancedAt(beat, phrases) {
  const all = phrases.reduce((sum, phrase) => sum + lasts(phrase), 0);
  if (!(all > 0)) return { phrase: 0, beat: 0 };
  let left = ((beat % all) + all) % all;
  for (const [n, phrase] of phrases.entries()) {
    if (left < lasts(phrase)) return { phrase: n, beat: (left / slow(phrase)) % phrase.beats };
    left -= lasts(phrase);
  }
  return { phrase: 0, beat: 0 };
}

// The first beat of the music on which a beat of a phrase is danced.
export function beatOf({ phrase, beat }, phrases) {
  const before = phrases.slice(0, phrase).reduce((sum, one) => sum + lasts(one), 0);
  return before + beat * slow(phrases[phrase]);
}
