// Files that come to those that are open. Nothing that is open is mixed with another session.

import { beside, FileFault, type FileMap, LARGEST_FOLDER, sessionsIn, text } from "./files";
import { machineFile } from "./plan-text";

export interface Together {
  files: FileMap;
  /** The folder of the added files, with a slash at its end; empty if they lie beside the others. */
  folder: string;
  added: string[];
  replaced: string[];
}

function isSame(one: Uint8Array | undefined, other: Uint8Array): boolean {
  return one === other || (one?.length === other.length && one.every((byte, k) => byte === other[k]));
}

/** Whether the files hold a session with its machine, so that it needs none of those that are open. */
function isWhole(files: FileMap): boolean {
  return sessionsIn(files).some((session) => {
    const machine = machineFile(text(files, session));
    return machine === undefined || files.has(beside(session, machine));
  });
}

/** The names of the tests of a session. */
const testNames = (files: FileMap, session: string): string[] =>
  [...text(files, session).matchAll(/^[ \t]*name[ \t]*=[ \t]*["']([^"'\n]*)/gm)].map(([, name]) => name);

/** Whether the sessions of files are those that are open in a folder, perhaps changed: they have tests in common. */
function isVersion(files: FileMap, open: FileMap, folder: string): boolean {
  return sessionsIn(files).every((session) => {
    const known = new Set(open.has(`${folder}${session}`) ? testNames(open, `${folder}${session}`) : []);
    return testNames(files, session).some((name) => known.has(name));
  });
}

/**
 * The files that are open, and others with them. Files without a session of their own, and newer versions of what is
 * open, take the places of those with their names. Another session gets a folder of its own.
 */
export function together(open: FileMap, others: FileMap): Together {
  const at = (folder: string) => [...others].map(([path, bytes]) => [`${folder}${path}`, bytes] as const);
  const isFree = (folder: string) =>
    at(folder).every(([path, bytes]) => !open.has(path) || isSame(open.get(path), bytes)) ||
    (at(folder).every(([path]) => open.has(path)) && isVersion(others, open, folder));
  let folder = "";
  if (isWhole(others)) for (let number = 2; !isFree(folder); number++) folder = `session-${number}/`;
  const files = new Map(open);
  const [added, replaced]: [string[], string[]] = [[], []];
  for (const [path, bytes] of at(folder)) {
    const before = open.get(path);
    if (before === undefined) added.push(path);
    else if (!isSame(before, bytes)) replaced.push(path);
    files.set(path, before !== undefined && isSame(before, bytes) ? before : bytes);
  }
  const bytes = [...files.values()].reduce((sum, { length }) => sum + length, 0);
  if (bytes > LARGEST_FOLDER) {
    const limit = `${LARGEST_FOLDER >> 20} MiB, the limit of this page`;
    throw new FileFault(`with these files more would be open than ${limit}; close the open ones first`);
  }
  return { files, folder, added, replaced };
}

/**
 * The files that are open, with what was made from others; undefined if what was made takes the place of a file that is
 * not open as it was then.
 */
export function withMade(open: FileMap, from: FileMap, made: FileMap): FileMap | undefined {
  const own = [...made].filter(([path, bytes]) => from.get(path) !== bytes);
  const isOpen = ([path]: [string, Uint8Array]) => {
    const [now, then] = [open.get(path), from.get(path)];
    return then === undefined ? now === undefined : isSame(now, then);
  };
  return own.every(isOpen) ? new Map([...open, ...own]) : undefined;
}

/** Paths in words: the first three, and how many more. */
function listed(paths: string[]): string {
  const [first, more] = [paths.slice(0, 3), paths.length - 3];
  return more > 0 ? `${first.join(", ")} and ${more} more` : first.join(", ");
}

/** What came to what was open, in words. */
export function told({ added, replaced }: Together): string {
  const parts = [
    added.length > 0 ? `added ${listed(added)}` : "",
    replaced.length > 0 ? `replaced ${listed(replaced)}` : "",
  ];
  return parts.filter((words) => words !== "").join("; ") || "these files are open already";
}
