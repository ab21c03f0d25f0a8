// Tabs: the arrow keys, Home and End go from one to the other, as a tab list of ARIA does.

import { useRef } from "preact/hooks";

interface Props<Name extends string> {
  label: string;
  names: readonly Name[];
  shown: Name;
  show: (name: Name) => void;
}

/** Which tab a key goes to, by number. */
function target(key: string, at: number, count: number): number | undefined {
  if (key === "ArrowRight" || key === "ArrowDown") return (at + 1) % count;
  if (key === "ArrowLeft" || key === "ArrowUp") return (at + count - 1) % count;
  if (key === "Home") return 0;
  return key === "End" ? count - 1 : undefined;
}

export function Tabs<Name extends string>({ label, names, shown, show }: Props<Name>) {
  const list = useRef<HTMLDivElement>(null);
  const press = (event: KeyboardEvent) => {
    const next = target(event.key, names.indexOf(shown), names.length);
    if (next === undefined) return;
    event.preventDefault();
    show(names[next]);
    list.current?.querySelectorAll("button")[next]?.focus();
  };
  return (
    <div class="tabs" role="tablist" aria-label={label} ref={list} onKeyDown={press}>
      {names.map((name) => (
        <button
          key={name}
          role="tab"
          aria-selected={shown === name}
          aria-controls={name}
          // One stop for the Tab key.
          tabIndex={shown === name ? 0 : -1}
          onClick={() => show(name)}
        >
          {name}
        </button>
      ))}
    </div>
  );
}
