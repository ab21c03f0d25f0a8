// Work that is repeated while what it depends on changes.

import { useRef } from "preact/hooks";

/** Runs a task, one at a time. A request while it runs makes it run once more with what is then wanted. */
export function useLatest(task: (isLatest: () => boolean) => Promise<void>): () => void {
  const run = useRef({ task, running: false, again: false });
  run.current.task = task;
  return () => {
    const job = run.current;
    if (job.running) {
      job.again = true;
      return;
    }
    job.running = true;
    const loop = async () => {
      do {
        job.again = false;
        await job.task(() => !job.again);
      } while (job.again);
    };
    void loop().finally(() => {
      job.running = false;
    });
  };
}
