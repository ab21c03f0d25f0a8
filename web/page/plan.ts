// A plan: its texts, and what the library says of it.

import { filesOf } from "./bundled";
import { beside, type FileMap, text } from "./files";
import type { Opened } from "./main";
import { asPlan, machineFile } from "./plan-text";
import type { SetUp } from "./scene";
import type { Shared } from "./share";

export interface PlannedTest extends SetUp {
  name: string;
  bar_mm: number | null;
  moves: string[];
  readings: number;
  /** The names of the coordinates of a reading; one for a length. */
  coordinates: string[];
}

export interface Parameter {
  id: string;
  unit: string;
  setup: boolean;
}

/** A key of a file: what it is, and the type of its value. */
export interface Key {
  description?: string;
  type?: string | string[];
}

export interface Description {
  machine: string;
  chain: string;
  axes: { name: string; unit: "deg" | "mm" }[];
  tests: PlannedTest[];
  parameters: Parameter[];
  warnings: string[];
  /** The keys of a test of this instrument, from the schema; those of its motion. */
  test_keys: Record<string, Key>;
  motion_keys: Record<string, Key>;
  abscissae: Float64Array[];
}

/** A test that the library proposes. */
export interface ProposedTest {
  test: string;
  after: number | null;
  duration_min: number;
  name: string;
  session_toml: string;
}

export interface Improvement {
  criterion: string;
  before: number | null;
  steps: ProposedTest[];
}

export const TEMPLATES = [
  "hermle-c600u/chapter5.toml",
  "hermle-c600u/chapter4.toml",
  "hermle-c600u/chapter6.toml",
  "table-and-head/session.toml",
  "tilting-head/session.toml",
];

/** The texts of a session as a plan. */
export function planOf({ files, session }: Opened): Shared {
  const own = text(files, session);
  const named = machineFile(own);
  const path = named === undefined ? undefined : beside(session, named);
  const machine = path !== undefined && files.has(path) ? text(files, path) : "";
  return { machine, plan: asPlan(own), values: {} };
}

export function templateOf(path: string): Shared {
  return planOf({ files: filesOf(path), session: path.slice(path.lastIndexOf("/") + 1) });
}

/** What the library reads of a plan, as one text. */
export const textsOf = ({ machine, plan }: Shared): string => `${machine}\0${plan}`;

/** The session folder of a plan. */
export function folderOf({ machine, plan }: Shared): FileMap {
  const encode = new TextEncoder();
  return new Map([
    ["machine.toml", encode.encode(machine)],
    ["plan.toml", encode.encode(plan)],
  ]);
}

/** The name, or one like it that no test has. */
export function freeName(description: Description, name: string): string {
  const taken = new Set(description.tests.map((test) => test.name));
  let free = name;
  for (let number = 2; taken.has(free); number++) free = `${name}-${number}`;
  return free;
}
