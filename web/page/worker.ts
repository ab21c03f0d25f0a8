// The worker: holds a folder and a plan, and calls the module.

import init, { type InitOutput, Fit, Folder, Import, Plan, Trace, filesOfCode, instruments } from "../pkg/abbe.js";
import { BROKEN, type Fault } from "./protocol";

export type Files = [path: string, contents: Uint8Array][];

let ready: Promise<InitOutput> | undefined;
let memory: WebAssembly.Memory | undefined;
let folder: Folder | undefined;
let plan: Plan | undefined;

function held<T>(value: T | undefined): T {
  if (value === undefined) throw JSON.stringify({ message: "there is no plan yet" });
  return value;
}

/** The memory of the module, which never shrinks, bytes. */
const used = () => ({ bytes: memory?.buffer.byteLength ?? 0 });

/** Replaces the folder. */
function open(files: Files): void {
  folder?.free();
  folder = new Folder();
  for (const [path, contents] of files) folder.add(path, contents);
}

/** Everything of a result as texts, so that it outlives the worker; the result itself is freed. */
function texts(result: Fit | Trace) {
  try {
    const [json, report, csv] = [result.json(), result.report(), result.csv()];
    return { json, report, csv, residuals: result.residuals(), model: result.model(), ...used() };
  } finally {
    result.free();
  }
}

const methods: Record<string, (...args: never[]) => unknown> = {
  instruments,
  /** Foreign files as a session: how they are understood, and the files to write. */
  import(asked: unknown) {
    const made = Import.of(held(folder), JSON.stringify(asked));
    try {
      const { names, ...shown } = JSON.parse(made.shown());
      return { ...shown, files: names.map((name: string, k: number) => [name, made.contents(k)]) };
    } finally {
      made.free();
    }
  },
  check: (session: string) => JSON.parse(held(folder).check(session)),
  fit: (session: string) => texts(Fit.of(held(folder), session, 1)),
  trace(session: string) {
    const trace = Trace.of(held(folder), session, 1);
    return { session: trace.session(), ...texts(trace) };
  },
  filesOfCode: (code: string) => JSON.parse(filesOfCode(code)),
  /** Reads a plan and returns what it is. */
  plan(session: string) {
    const next = Plan.of(held(folder), session);
    plan?.free();
    plan = next;
    const description = JSON.parse(plan.description());
    const abscissae = description.tests.map((_: unknown, test: number) => held(plan).abscissae(test));
    return { ...description, abscissae };
  },
  patterns: (values: Float64Array, alone: Uint32Array) => held(plan).patterns(values, alone),
  sensitivities: (values: Float64Array, of: Uint32Array) => held(plan).sensitivities(values, of),
  analysis: () => JSON.parse(held(plan).analysis()),
  improve: () => JSON.parse(held(plan).improve()),
  equation: (test: number) => held(plan).equation(test),
};

Object.assign(globalThis, { abbeProgress: (words: string) => postMessage({ progress: words }) });

/** The fault of a call: errors of the library are JSON texts. */
function faultOf(error: unknown): Fault {
  if (typeof error === "string") {
    try {
      return JSON.parse(error) as Fault;
    } catch {
      return { message: error };
    }
  }
  const words = error instanceof Error ? error.message : String(error);
  const memory = /memory|allocation|unreachable/i.test(words);
  return {
    message: `${BROKEN}: ${words}`,
    help: memory ? "perhaps the memory of the browser did not suffice; the command `abbe` has no such limit" : null,
  };
}

onmessage = async ({ data }: MessageEvent) => {
  if (data.module) {
    ready = init({ module_or_path: data.module });
    return;
  }
  try {
    memory = (await ready)?.memory;
    if (data.files) open(data.files as Files);
    const answer = await methods[data.method](...(data.args as never[]));
    const transfer = answer instanceof Float64Array ? [answer.buffer] : [];
    postMessage({ result: answer }, { transfer });
  } catch (error) {
    postMessage({ fault: faultOf(error) });
  }
};
