// The worker: holds a folder and a plan, and calls the module.

import init, { Analysis, Folder, Import, Plan, filesOfCode, instruments, makePool, workInPool } from "../pkg/abbe.js";
import { BROKEN, type Fault } from "./protocol";

/** What a worker needs: the module, and the channel to the page for faults of its other workers. */
interface Start {
  module: WebAssembly.Module;
  faults: string;
}
interface Join extends Start {
  memory: WebAssembly.Memory;
}

export type Files = [path: string, contents: Uint8Array][];

let ready: Promise<WebAssembly.Memory> | undefined;
let memory: WebAssembly.Memory | undefined;
/** Threads of the module. */
let processors = 1;
let folder: Folder | undefined;
let plan: Plan | undefined;

function held<T>(value: T | undefined): T {
  if (value === undefined) throw JSON.stringify({ message: "there is no plan yet" });
  return value;
}

/** What the memory of the module holds at first, pages of 64 KiB: at least what the module asks for. */
const INITIAL = 64;
/** What it may reach, pages: a browser of 32 bits refuses the first. */
const LARGEST = [65536, 32768, 16384, 8192];
/** Most threads: each has a stack and its share of a computation in memory. */
const MOST_THREADS = 8;

/** The memory of the module. Only an isolated page may give it to other workers. */
function newMemory(): WebAssembly.Memory {
  let refused: unknown;
  for (const maximum of LARGEST) {
    try {
      return new WebAssembly.Memory({ initial: INITIAL, maximum, shared: true });
    } catch (error) {
      refused = error;
    }
  }
  throw refused;
}

/** Starts the module with a thread for each processor; with one if the page is not isolated. */
async function start({ module, faults }: Start): Promise<WebAssembly.Memory> {
  const memory = newMemory();
  await init({ module_or_path: module, memory });
  const others = crossOriginIsolated ? Math.min(navigator.hardwareConcurrency, MOST_THREADS) - 1 : 0;
  const joined = await Promise.all(Array.from({ length: others }, () => isJoined({ module, memory, faults })));
  processors += joined.filter(Boolean).length;
  makePool(processors);
  return memory;
}

/** Starts a worker of the pool; false if the browser gives none, or not the memory that it needs. */
function isJoined(join: Join): Promise<boolean> {
  return new Promise((resolve) => {
    const worker = new Worker(location.href, { type: "module" });
    worker.onmessage = ({ data }: MessageEvent<boolean>) => resolve(data);
    worker.onerror = () => resolve(false);
    worker.postMessage({ join });
  });
}

/** Works as a thread of the pool until it is ended. The worker that computes waits for it and hears of no fault. */
async function join({ module, memory, faults }: Join): Promise<void> {
  const isReady = await init({ module_or_path: module, memory }).then(
    () => true,
    () => false,
  );
  postMessage(isReady);
  if (!isReady) return;
  try {
    workInPool();
  } catch (error) {
    new BroadcastChannel(faults).postMessage(faultOf(error));
  }
}

/** What a result took: the memory of the module, which never shrinks, bytes, and its threads. */
const used = () => ({ bytes: memory?.buffer.byteLength ?? 0, processors });

/** Replaces the folder. */
function open(files: Files): void {
  folder?.free();
  folder = new Folder();
  for (const [path, contents] of files) folder.add(path, contents);
}

/** Everything of a result as texts, so that it outlives the worker; the result itself is freed. */
function texts(result: Analysis) {
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
  fit: (session: string) => texts(Analysis.run("fit", held(folder), session, '{"allow_implausible": true}', 1)),
  trace(session: string) {
    const trace = Analysis.run("trace", held(folder), session, '{"allow_implausible": true}', 1);
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
  if (data.join) return join(data.join);
  if (data.module) {
    ready = start(data);
    return;
  }
  try {
    memory = await ready;
    if (data.files) open(data.files as Files);
    const answer = await methods[data.method](...(data.args as never[]));
    const transfer = answer instanceof Float64Array ? [answer.buffer] : [];
    postMessage({ result: answer }, { transfer });
  } catch (error) {
    postMessage({ fault: faultOf(error) });
  }
};
