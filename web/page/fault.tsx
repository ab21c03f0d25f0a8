// A fault with its place and what to do.

import type { ComponentChildren } from "preact";
import { EngineError } from "./engine";
import { FileFault } from "./files";
import type { Fault } from "./protocol";

/** What went wrong, as a fault. */
export function faultOf(error: unknown): Fault {
  if (error instanceof EngineError) return error.fault;
  if (error instanceof FileFault) return { message: error.message };
  return { message: error instanceof Error ? error.message : String(error) };
}

interface Props {
  fault: Fault;
  /** Goes to the place of the fault. */
  go?: (fault: Fault) => void;
  /** What can be done besides. */
  children?: ComponentChildren;
}

export function FaultBox({ fault, go, children }: Props) {
  const place = [fault.file, fault.line, fault.column].filter((part) => part != null).join(":");
  return (
    <div class="fault" role="alert">
      <strong>Error</strong>{" "}
      {place && (go && fault.line ? <button onClick={() => go(fault)}>{place}</button> : <code>{place}</code>)}{" "}
      {fault.message}
      {fault.help && <p>{fault.help}</p>}
      {children}
    </div>
  );
}
