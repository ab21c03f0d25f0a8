// The layout of a file of readings: guessed from its first lines, and written as `format` and `columns` of a test.

import { withValue } from "./plan-text";

/** A column that the library reads: its name without the unit, and the units. */
export interface Own {
  stem: string;
  units: string[];
}

export type Separator = "," | ";" | "\t" | "|" | ":";
export type Decimal = "." | ",";
export type Encoding = "utf-8" | "windows-1252" | "utf-16le" | "utf-16be";

export interface Layout {
  separator: Separator;
  decimal: Decimal;
  encoding: Encoding;
  header: boolean;
  /** Lines above the header. */
  skip: number;
  /** The name of each column, if it is used. */
  columns: (string | undefined)[];
  /** The header as it stands in the file. */
  names: string[];
}

export const SEPARATORS = [
  [",", "comma"],
  [";", "semicolon"],
  ["\t", "tab"],
  ["|", "|"],
  [":", "colon"],
] as const satisfies readonly (readonly [Separator, string])[];

export const ENCODINGS = [
  ["utf-8", "UTF-8"],
  ["windows-1252", "Windows-1252, Latin-1"],
  ["utf-16le", "UTF-16, little endian"],
  ["utf-16be", "UTF-16, big endian"],
] as const satisfies readonly (readonly [Encoding, string])[];

/** Bytes that a guess looks at. */
const LOOKED_AT = 1 << 16;
const LINES = 60;

function linesOf(bytes: Uint8Array, encoding: Encoding): string[] {
  const text = new TextDecoder(encoding).decode(bytes.subarray(0, LOOKED_AT));
  const lines = text.split(/\r\n|\n|\r/);
  // The last line may be cut.
  if (bytes.length > LOOKED_AT) lines.pop();
  return lines.slice(0, LINES);
}

function guessedEncoding(bytes: Uint8Array): Encoding {
  if (bytes[0] === 0xff && bytes[1] === 0xfe) return "utf-16le";
  if (bytes[0] === 0xfe && bytes[1] === 0xff) return "utf-16be";
  // Up to a line end, so that no character is cut.
  const end = bytes.length > LOOKED_AT ? bytes.subarray(0, LOOKED_AT).lastIndexOf(10) + 1 || LOOKED_AT : bytes.length;
  try {
    new TextDecoder("utf-8", { fatal: true }).decode(bytes.subarray(0, end));
    return "utf-8";
  } catch {
    return "windows-1252";
  }
}

const NUMBER = /^[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?$/;
const cells = (line: string, separator: string) =>
  line.split(separator).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
const numbers = (row: string[]) => row.filter((cell) => NUMBER.test(cell)).length;

/** The separator that makes the most lines rows of as many numbers. */
function guessedSeparator(lines: string[]): Separator {
  const score = (separator: Separator) => {
    const counts = new Map<number, number>();
    for (const line of lines) {
      const row = cells(line, separator);
      if (row.length > 1 && numbers(row) === row.length) counts.set(row.length, (counts.get(row.length) ?? 0) + 1);
    }
    return Math.max(0, ...[...counts].map(([columns, count]) => count + columns / 1000));
  };
  const order: Separator[] = ["\t", ";", "|", ",", ":"];
  return order.reduce((best, one) => (score(one) > score(best) ? one : best), order[0]);
}

/** The rows of a file from its header, or from its first row. */
export function rowsOf(bytes: Uint8Array, layout: Pick<Layout, "separator" | "encoding" | "skip">): string[][] {
  const lines = linesOf(bytes, layout.encoding).slice(layout.skip);
  return lines
    .filter((line) => line.trim() !== "" && !line.trimStart().startsWith("#"))
    .map((line) => cells(line, layout.separator));
}

/** Whether a file is rows of numbers: readings of another program, whatever their layout. */
export function isReadings(path: string, bytes: Uint8Array): boolean {
  if (!/\.(csv|tsv|txt|dat|asc|prn)$/i.test(path)) return false;
  const lines = linesOf(bytes, guessedEncoding(bytes));
  const separator = guessedSeparator(lines);
  return lines.filter((line) => numbers(cells(line, separator)) > 1).length > 1;
}

const UNITS: [RegExp, string][] = [
  [/µm|μm|\bum\b|_um$|micron/i, "um"],
  [/\bmil\b|_mil$/i, "mil"],
  [/\binch|\bin\b|_in$|"/i, "in"],
  [/mm/i, "mm"],
  [/\brad\b|_rad$/i, "rad"],
  [/°|deg|grad/i, "deg"],
  [/\bs\b|_s$|sec|sek/i, "s"],
];

/** Words of headers for a column, besides its own name. */
const WORDS: Record<string, RegExp> = {
  time: /^(t|time|zeit|timestamp)\b/i,
  run: /^(run|lauf|pass|cycle)\b/i,
  length: /^(length|länge|laenge|l|dbb|bar|reading)\b/i,
  deviation: /^(deviation|abweichung|dev|delta|dl|error|fehler)\b/i,
  temperature: /^(temp|temperature|temperatur)\b/i,
};

/** Our name for a column of this header. */
function guessedName(header: string, own: Own[]): string | undefined {
  const word = header.trim();
  const bare = word
    .toLowerCase()
    .replace(/[[(].*$/, "")
    .replace(/_[a-zµ°]+$/, "")
    .trim();
  const axis = bare
    .replace(/^(axis|achse|pos|position)[ _]*/, "")
    .replace(/[ _-]*(axis|achse|pos|position|ist|act|actual)$/, "");
  const found =
    own.find(({ stem, units }) => units.some((unit) => word.toLowerCase() === `${stem}_${unit}`)) ??
    own.find(({ stem }) => stem === bare || stem === axis) ??
    own.find(({ stem }) => WORDS[stem]?.test(bare));
  if (!found) return undefined;
  if (found.units.length === 0) return found.stem;
  const stated = UNITS.find(
    ([pattern, unit]) => found.units.includes(unit) && pattern.test(word.slice(found.stem === bare ? bare.length : 0)),
  )?.[1];
  return `${found.stem}_${stated ?? (found.stem === "deviation" ? "um" : found.units[0])}`;
}

/** The layout of a file; what is stated is not guessed. */
export function guess(bytes: Uint8Array, own: Own[], stated?: Layout): Layout {
  const encoding = stated?.encoding ?? guessedEncoding(bytes);
  const lines = linesOf(bytes, encoding);
  const separator = stated?.separator ?? guessedSeparator(lines);
  const rows = lines.map((line) => cells(line, separator));
  const isData = (row: string[]) => row.length > 1 && numbers(row) === row.length;
  const first = Math.max(0, rows.findIndex(isData));
  const width = rows[first]?.length ?? 0;
  const above = rows[first - 1];
  const header = stated?.header ?? (above !== undefined && above.length === width && above.some((cell) => cell !== ""));
  const skip = stated?.skip ?? Math.max(0, header ? first - 1 : first);
  const own_rows = rowsOf(bytes, { separator, encoding, skip });
  const names = header ? (own_rows[0] ?? []) : [];
  const data = own_rows.slice(header ? 1 : 0);
  const commas = data.flat().filter((cell) => /^[-+]?\d*,\d+$/.test(cell)).length;
  const points = data.flat().filter((cell) => /^[-+]?\d*\.\d+/.test(cell)).length;
  const decimal = stated?.decimal ?? (separator !== "," && commas > points ? "," : ".");
  const columns: (string | undefined)[] = [];
  for (let k = 0; k < Math.max(width, names.length); k++) {
    const name = names[k] === undefined ? undefined : guessedName(names[k], own);
    columns.push(name !== undefined && columns.includes(name) ? undefined : name);
  }
  return { separator, decimal, encoding, header, skip, columns, names };
}

/** The text of a session in which a test has this file and this layout. */
export function written(session: string, test: number, name: string, layout: Layout): string {
  const quoted = (words: string) => JSON.stringify(words);
  const format = [
    `separator = ${quoted(layout.separator)}`,
    `decimal = ${quoted(layout.decimal)}`,
    `header = ${layout.header}`,
    `encoding = ${quoted(layout.encoding)}`,
    `skip_lines = ${layout.skip}`,
  ];
  const columns = layout.columns.flatMap((own, k) => {
    if (!own) return [];
    return [`${/^[\w-]+$/.test(own) ? own : quoted(own)} = ${layout.header ? quoted(layout.names[k]) : k + 1}`];
  });
  let next = withValue(session, test, "columns", `{ ${columns.join(", ")} }`);
  next = withValue(next, test, "format", `{ ${format.join(", ")} }`);
  return withValue(next, test, "data", quoted(name));
}
