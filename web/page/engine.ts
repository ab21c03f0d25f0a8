// The library in a worker: one request at a time, progress in words, and an end at any moment.

import { moduleBytes, startWorker } from "#assets";
import { type Answer, BROKEN, type Fault } from "./protocol";

export class EngineError extends Error {
  constructor(readonly fault: Fault) {
    super(fault.message);
  }
}

/** Why a call failed that was stopped. */
export const STOPPED = "stopped";

/** Whether a call ended because it was stopped, which is no fault. */
export const isStopped = (error: unknown): boolean => error instanceof EngineError && error.fault.message === STOPPED;

interface Waiting {
  resolve: (result: never) => void;
  reject: (fault: EngineError) => void;
  progress?: (words: string) => void;
}

/** What a call may have besides its arguments. */
export interface CallOptions {
  /** The folder in which it works; that of the call before if there is none. */
  files?: Iterable<[path: string, contents: Uint8Array]>;
  progress?: (words: string) => void;
}

let compiled: Promise<WebAssembly.Module> | undefined;

/** The module is compiled once; every worker has an instance of it. */
function compiledModule(): Promise<WebAssembly.Module> {
  compiled ??= moduleBytes().then((bytes) => WebAssembly.compile(bytes));
  // The next call tries again: perhaps the network was away.
  compiled.catch(() => {
    compiled = undefined;
  });
  return compiled;
}

export class Engine {
  private worker?: Worker;
  /** Hears of faults in the other workers of the module. */
  private faults?: BroadcastChannel;
  private waiting: Waiting[] = [];
  /** How often it was stopped: a call that waits for its worker meanwhile is stopped too. */
  private stops = 0;

  /** Calls a method of the worker. */
  async call<T>(method: string, args: unknown[] = [], { files, progress }: CallOptions = {}): Promise<T> {
    const stops = this.stops;
    const worker = await this.started();
    if (stops !== this.stops) throw new EngineError({ message: STOPPED });
    return new Promise<T>((resolve, reject) => {
      this.waiting.push({ resolve: resolve as (result: never) => void, reject, progress });
      worker.postMessage({ method, args, files: files && [...files] });
    });
  }

  /** Ends the worker, whatever it does. The next call starts another. */
  stop(why = STOPPED): void {
    this.stops += 1;
    this.worker?.terminate();
    this.worker = undefined;
    this.faults?.close();
    const waiting = this.waiting.splice(0);
    for (const one of waiting) one.reject(new EngineError({ message: why }));
  }

  private async started(): Promise<Worker> {
    if (this.worker) return this.worker;
    const module = await compiledModule();
    if (this.worker) return this.worker;
    const worker = startWorker();
    const faults = `abbe-${Math.random()}`;
    this.faults = new BroadcastChannel(faults);
    this.faults.onmessage = ({ data }: MessageEvent<Fault>) => this.broken(data);
    worker.postMessage({ module, faults });
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if (worker === this.worker) this.answered(data);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      if (worker === this.worker) this.stop(`the computation failed: ${event.message}`);
    };
    this.worker = worker;
    return worker;
  }

  private answered(answer: Answer): void {
    if ("progress" in answer) {
      this.waiting[0]?.progress?.(answer.progress);
      return;
    }
    const one = this.waiting.shift();
    if (!one) return;
    if ("result" in answer) {
      one.resolve(answer.result as never);
      return;
    }
    one.reject(new EngineError(answer.fault));
    if (answer.fault.message.startsWith(BROKEN)) this.broken(answer.fault);
  }

  /** After a fault of the module itself its memory is not trusted. */
  private broken(fault: Fault): void {
    this.waiting.shift()?.reject(new EngineError(fault));
    this.stop(fault.message);
  }
}
