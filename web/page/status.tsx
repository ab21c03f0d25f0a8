// What is done now: in words with their counts, and for how long.

import { useEffect, useState } from "preact/hooks";

/** Work that runs: what it does, and when it began, ms of `performance.now()`. */
export interface Work {
  words: string;
  since: number;
}

export const begun = (words: string): Work => ({ words, since: performance.now() });

interface Props {
  work?: Work;
  /** What is told while nothing runs. */
  note?: string;
}

export function Status({ work, note = "" }: Props) {
  const [now, setNow] = useState(0);
  useEffect(() => {
    if (!work) return;
    const tick = () => setNow(performance.now());
    tick();
    const timer = setInterval(tick, 250);
    return () => clearInterval(timer);
  }, [work?.since]);
  const counts = /(\d+) of (\d+)/.exec(work?.words ?? "");
  return (
    <span class="status">
      <span role="status">{work?.words ?? note}</span>
      {work && (
        <>
          {/* Not told by screen readers, which would speak each second. */}
          <span class="time" aria-hidden="true">
            {Math.max(0, (now - work.since) / 1000).toFixed(0)} s
          </span>
          {counts && <progress aria-label="Progress" value={Number(counts[1])} max={Number(counts[2])} />}
        </>
      )}
    </span>
  );
}
