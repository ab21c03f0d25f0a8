// The parts of the page inside it: one file that opens from a disk.

import url from "../pkg/abbe_bg.wasm?url";
import EngineWorker from "./worker?worker&inline";

/** The bytes of the module. */
export async function moduleBytes(): Promise<ArrayBuffer> {
  const text = atob(url.slice(url.indexOf(",") + 1));
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}

/** A new worker. */
export const startWorker = (): Worker => new EngineWorker();

/** A file on a disk needs no network. */
export function keepOffline(): void {}
