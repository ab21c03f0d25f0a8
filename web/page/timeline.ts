// A state with what it was before, so that every change can be taken back.

export interface Timeline<T> {
  past: T[];
  present: T;
  future: T[];
}

/** Most states that are kept, and most characters of their texts together. */
const MOST_STATES = 100;
const MOST_CHARACTERS = 4 << 20;

export const startOf = <T>(present: T): Timeline<T> => ({ past: [], present, future: [] });

/** With another state. A change that continues the one before it takes its place: a drag is one step. */
export function changed<T>(
  { past, present }: Timeline<T>,
  next: T,
  continues: boolean,
  size: (state: T) => number,
): Timeline<T> {
  const before = continues && past.length > 0 ? [...past] : [...past, present];
  let characters = before.reduce((sum, state) => sum + size(state), size(next));
  while (before.length > 1 && (before.length > MOST_STATES || characters > MOST_CHARACTERS)) {
    characters -= size(before[0]);
    before.shift();
  }
  return { past: before, present: next, future: [] };
}

export function undone<T>({ past, present, future }: Timeline<T>): Timeline<T> {
  const before = past.at(-1);
  if (before === undefined) return { past, present, future };
  return { past: past.slice(0, -1), present: before, future: [present, ...future] };
}

export function redone<T>({ past, present, future }: Timeline<T>): Timeline<T> {
  const [next, ...later] = future;
  if (next === undefined) return { past, present, future };
  return { past: [...past, present], present: next, future: later };
}
