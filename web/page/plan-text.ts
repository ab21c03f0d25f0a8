// Edits of the text of a plan that keep comments and everything else. The library reads and checks the result.

// Expressions stay in their line and never try a blank twice: a text may be large, and come from anywhere.

/** The start and end of each `[[test]]` in a text, without its heading line. */
function blocks(text: string): [number, number][] {
  const headers = [...text.matchAll(/^[ \t]*\[[^\n]*$/gm)].filter((line) => /^\s*\[+\s*[\w.-]+\s*\]+/.test(line[0]));
  const found: [number, number][] = [];
  let inTest = false;
  const end = (at: number) => {
    const last = found.at(-1);
    if (inTest && last) last[1] = at;
  };
  for (const header of headers) {
    if (/^\s*\[\s*test\./.test(header[0])) continue;
    end(header.index);
    inTest = /^\s*\[\[\s*test\s*\]\]/.test(header[0]);
    if (inTest) found.push([header.index + header[0].length, text.length]);
  }
  return found;
}

export const tests = (text: string): number => blocks(text).length;

/** Where the value of a key stands in a part of a text. A comment after it, without quotes, does not belong to it. */
function place(part: string, key: string): [number, number] | undefined {
  const line = new RegExp(`^[ \\t]*${key}[ \\t]*=[ \\t]*`, "m").exec(part);
  if (!line) return undefined;
  const start = line.index + line[0].length;
  const lineEnd = part.indexOf("\n", start);
  const rest = part.slice(start, lineEnd < 0 ? part.length : lineEnd);
  const comment = rest.indexOf("#", Math.max(rest.lastIndexOf('"'), rest.lastIndexOf("'")) + 1);
  return [start, start + (comment < 0 ? rest : rest.slice(0, comment)).trimEnd().length];
}

function valueIn(part: string, key: string): string | undefined {
  const at = place(part, key);
  return at && part.slice(...at);
}

/** The value of a key of a test, as written. */
export function value(text: string, test: number, key: string): string | undefined {
  return valueIn(text.slice(...(blocks(text)[test] ?? [0, 0])), key);
}

function partWith(part: string, key: string, written: string): string {
  const at = place(part, key);
  return at ? part.slice(0, at[0]) + written + part.slice(at[1]) : `\n${key} = ${written}${part}`;
}

/** The text with another text of each test, which gets it and its number. */
function withEach(text: string, edit: (part: string, test: number) => string): string {
  const pieces: string[] = [];
  let from = 0;
  for (const [test, [start, end]] of blocks(text).entries()) {
    pieces.push(text.slice(from, start), edit(text.slice(start, end), test));
    from = end;
  }
  return pieces.join("") + text.slice(from);
}

/** The text with another value of a key of a test. */
export function withValue(text: string, test: number, key: string, written: string): string {
  return withEach(text, (part, other) => (other === test ? partWith(part, key, written) : part));
}

/** The text with another place of a ball, in every test in which it stays mounted. */
export function withBall(
  text: string,
  test: number,
  ball: "workpiece_ball_mm" | "spindle_ball_mm",
  written: string,
): string {
  const key = ball === "workpiece_ball_mm" ? "setup" : "spindle_setup";
  const mounted = value(text, test, key);
  return withEach(text, (part, other) => {
    const same = other === test || (mounted !== undefined && valueIn(part, key) === mounted);
    return same ? partWith(part, ball, written) : part;
  });
}

/** A field of the form of a test: a key, and in an inline table one of its parts. */
export interface Field {
  test: number;
  key?: string;
  part?: string;
}

/** The field in which a place of a text lies; line and column from 1. */
export function fieldAt(text: string, line: number, column = 1): Field | undefined {
  let start = 0;
  for (let k = 1; k < line; k++) start = text.indexOf("\n", start) + 1 || text.length;
  // A heading names its test as a whole.
  const lineEnd = text.indexOf("\n", start);
  const heading = /^[ \t]*\[\[/.test(text.slice(start, start + 80));
  const at = heading ? (lineEnd < 0 ? text.length : lineEnd) : start + column - 1;
  const test = blocks(text).findIndex(([from, to]) => from <= at && at <= to);
  if (test < 0) return undefined;
  const before = text.slice(blocks(text)[test][0], lineEnd < 0 ? text.length : lineEnd);
  // A value may go on for lines: the last key before.
  const key = [...before.matchAll(/^[ \t]*([\w-]+)[ \t]*=/gm)].at(-1);
  if (heading || !key) return { test };
  const inTable = [...text.slice(start, at + 1).matchAll(/[{,][ \t]*([\w-]+)/g)].at(-1);
  return { test, key: key[1], part: inTable?.[1] };
}

/** A number in an inline table: `from_deg` of `sweep = { … }`. */
export function part(written: string | undefined, key: string): number | undefined {
  const found = new RegExp(`\\b${key}\\s*=\\s*([-+.\\deE]+)`).exec(written ?? "");
  return found ? Number(found[1]) : undefined;
}

/** The inline table with another number. */
export function withPart(written: string, key: string, number: number): string {
  return written.replace(new RegExp(`(\\b${key}\\s*=\\s*)[-+.\\deE]+`), `$1${number}`);
}

/** The text with a copy of a test at its end, under another name. */
export function withCopy(text: string, test: number, name: string): string {
  const block = blocks(text)[test];
  if (!block) return text;
  const copy = `${text.trimEnd()}\n\n[[test]]${text.slice(...block).trimEnd()}\n`;
  return withValue(copy, tests(copy) - 1, "name", JSON.stringify(name));
}

/** The text without a test. */
export function withoutTest(text: string, test: number): string {
  const block = blocks(text)[test];
  if (!block) return text;
  const heading = text.lastIndexOf("[[", block[0]);
  return `${text.slice(0, heading).trimEnd()}\n\n${text.slice(block[1])}`;
}

/** The path of the machine file that a session names. */
export const machineFile = (text: string): string | undefined =>
  /^[ \t]*file[ \t]*=[ \t]*["']([^"'\n]+)["']/m.exec(text)?.[1];

/** The session as a plan beside `machine.toml`: tests that move by themselves need no data. */
export function asPlan(text: string): string {
  const plan = text.replace(/^([ \t]*file[ \t]*=[ \t]*)["'][^"'\n]+["']/m, '$1"machine.toml"');
  return withEach(plan, (part) => {
    const moves = valueIn(part, "sweep") ?? valueIn(part, "path");
    return moves ? part.replace(/^[ \t]*data[ \t]*=.*\n/m, "") : part;
  });
}
