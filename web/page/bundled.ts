// The sessions of the repository, inside the page.

import type { FileMap } from "./files";

const texts = import.meta.glob<string>("../../sessions/**/*.{toml,csv}", {
  query: "?raw",
  import: "default",
  eager: true,
});

const ABOUT: Record<string, string> = {
  "hermle-c600u/measured/session.toml": "Five-axis machine, ball bar: four tests with an effect to trace",
  "hermle-c600u/chapter5.toml": "The plan of these tests",
  "r-test/measured/session.toml": "R-test on a B, C machine: steps of a pitch compensation to trace",
  "self-calibration/measured/session.toml": "Rotary table, touch probe on a cylinder",
  "table-and-head/measured/session.toml": "Rotary table and tilting head, ball bar",
  "tilting-head/measured/session.toml": "Tilting head, ball bar",
};

/** Names and descriptions of the bundled sessions. */
export const bundled = Object.entries(ABOUT);

/** The files of the folder of a bundled session. */
export function filesOf(session: string): FileMap {
  const folder = session.slice(0, session.lastIndexOf("/") + 1);
  const encode = new TextEncoder();
  const own = Object.entries(texts)
    .map(([path, text]) => [path.replace("../../sessions/", ""), text] as const)
    .filter(([path]) => path.startsWith(folder) && !path.slice(folder.length).includes("/"));
  return new Map(own.map(([path, text]) => [path.slice(folder.length), encode.encode(text)]));
}

/** The name that a machine file states. */
const named = (text: string): string => /^[ \t]*name[ \t]*=[ \t]*"([^"\n]*)"/m.exec(text)?.[1] ?? "";

/** The machines of the bundled sessions: paths with names, each machine once. */
export const machines: [path: string, name: string][] = (() => {
  const all = Object.entries(texts).filter(([path]) => /\/machine[^/]*\.toml$/.test(path));
  const once = new Map(all.reverse().map(([path, text]) => [text, path] as const));
  return [...once]
    .map(([text, path]): [string, string] => [path.replace("../../sessions/", ""), named(text)])
    .sort(([a], [b]) => a.localeCompare(b));
})();

/** The text of a file of the bundled sessions. */
export const bundledText = (path: string): string => texts[`../../sessions/${path}`] ?? "";
