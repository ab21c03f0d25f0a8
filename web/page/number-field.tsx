// A number that counts when it is complete: with Enter, when the field is left, or by a step of its arrows.

import { useEffect, useId, useRef, useState } from "preact/hooks";

interface Props {
  id?: string;
  /** What the number is, if no label names the field. */
  label?: string;
  title?: string;
  value: number | undefined;
  /** What the value belongs to: with another one the field shows its value again. */
  of?: unknown;
  min?: number;
  max?: number;
  step?: number;
  /** Why a number cannot be used. */
  refused?: (number: number) => string | undefined;
  /** Why the number that was given last cannot be used. */
  fault?: string;
  set: (number: number) => void;
}

export function NumberField({ id, label, title, value, of, min, max, step, refused, fault, set }: Props) {
  const input = useRef<HTMLInputElement>(null);
  const isTyping = useRef(false);
  const [own, setOwn] = useState("");
  const message = useId();
  const show = () => {
    isTyping.current = false;
    if (input.current) input.current.value = value === undefined ? "" : String(value);
    setOwn("");
  };
  useEffect(() => {
    // What is being typed stays, whatever else changes meanwhile.
    if (!isTyping.current) show();
  }, [value, of]);
  const commit = (element: HTMLInputElement) => {
    isTyping.current = false;
    const number = element.valueAsNumber;
    const why = Number.isFinite(number) ? refused?.(number) : "this is no number";
    setOwn(why ? `${why}; ${value ?? "the value before"} stays` : "");
    if (!why && number !== value) set(number);
  };
  const why = own || fault;
  return (
    <>
      <input
        ref={input}
        id={id}
        type="number"
        step={step ?? "any"}
        min={min}
        max={max}
        aria-label={label}
        aria-invalid={why ? true : undefined}
        aria-describedby={why ? message : undefined}
        title={title}
        onInput={() => {
          isTyping.current = true;
        }}
        onChange={(event) => commit(event.currentTarget)}
        onBlur={() => {
          isTyping.current = false;
        }}
        onKeyDown={(event) => {
          if (event.key === "Escape") show();
        }}
      />
      {why && (
        <span class="why" id={message} role={own ? "alert" : undefined}>
          {why}
        </span>
      )}
    </>
  );
}
