// The parts of the page as files beside it.

import url from "../pkg/abbe_bg.wasm?url";
import EngineWorker from "./worker?worker";

/** The bytes of the module. */
export async function moduleBytes(): Promise<ArrayBuffer> {
  const answer = await fetch(url).catch((error: unknown) => ({ ok: false as const, status: String(error) }));
  if (!answer.ok) throw new Error(`a part of this page cannot be loaded: ${answer.status}; try again with a network`);
  return answer.arrayBuffer();
}

/** A new worker. */
export const startWorker = (): Worker => new EngineWorker();

/** Makes the page work without a network. */
export function keepOffline(): void {
  if (import.meta.env.PROD && "serviceWorker" in navigator) {
    // Without a service worker (private windows, file systems) the page works while it is open.
    navigator.serviceWorker.register("./service-worker.js").catch(() => undefined);
  }
}
