// A point of an outline that is dragged takes its neighbours along.

// As the server has it (parts.dragged), so that the hand sees at once what will be kept.
export function dragged(outline, index, to, reach) {
  const steps = outline.map(([x, y], n) => {
    const [nextX, nextY] = outline[(n + 1) % outline.length];
    return Math.hypot(nextX - x, nextY - y);
  });
  const at = [0];
  for (const step of steps) at.push(at.at(-1) + step);
  const around = at.at(-1);
  const [byX, byY] = [to[0] - outline[index][0], to[1] - outline[index][1]];
  return outline.map(([x, y], n) => {
    const straight = Math.abs(at[n] - at[index]);
    const away = Math.min(straight, around - straight);
    const share = n === index ? 1 : away < reach ? 0.5 + 0.5 * Math.cos((Math.PI * away) / reach) : 0;
    return [x + share * byX, y + share * byY];
  });
}
