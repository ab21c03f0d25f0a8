// A text with line numbers, in which a fault has its line.

import { useEffect, useRef } from "preact/hooks";
import type { Fault } from "./protocol";

interface Props {
  name: string;
  text: string;
  fault?: Fault;
  change: (text: string) => void;
}

/** Where a line starts and ends in a text. */
function span(text: string, line: number): [number, number] {
  let start = 0;
  for (let i = 1; i < line; i++) start = text.indexOf("\n", start) + 1 || text.length;
  const end = text.indexOf("\n", start);
  return [start, end < 0 ? text.length : end];
}

/** The numbers of the lines from the first to before the last, as one text: an element for each line is slow. */
const numbers = (from: number, to: number): string =>
  Array.from({ length: Math.max(0, to - from) }, (_, k) => `${from + k}\n`).join("");

export function Editor({ name, text, fault, change }: Props) {
  const area = useRef<HTMLTextAreaElement>(null);
  const gutter = useRef<HTMLPreElement>(null);
  const lines = text.split("\n").length;
  const marked = Math.min(fault?.line ?? 0, lines);
  useEffect(() => {
    const element = area.current;
    if (!element || !fault?.line) return;
    const [start, end] = span(text, fault.line);
    element.setSelectionRange(Math.min(start + (fault.column ?? 1) - 1, end), end);
    element.scrollTop = Math.max(0, fault.line - 4) * (element.scrollHeight / Math.max(1, lines));
  }, [fault]);
  const scrolled = () => {
    if (gutter.current && area.current) gutter.current.scrollTop = area.current.scrollTop;
  };
  return (
    <div class="editor">
      <pre ref={gutter} aria-hidden="true">
        {numbers(1, marked)}
        {marked > 0 && <span class="marked">{`${marked}\n`}</span>}
        {numbers(marked + 1, lines + 1)}
      </pre>
      <textarea
        ref={area}
        aria-label={`Text of ${name}`}
        aria-invalid={marked > 0}
        spellcheck={false}
        wrap="off"
        value={text}
        onScroll={scrolled}
        onInput={(event) => change(event.currentTarget.value)}
      />
    </div>
  );
}
