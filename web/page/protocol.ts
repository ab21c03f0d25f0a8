// What page and worker tell each other.

/** Why a call failed: the text of the library, with its place in a file. */
export interface Fault {
  message: string;
  help?: string | null;
  file?: string | null;
  line?: number | null;
  column?: number | null;
}

/** The end of a call, or its progress in words. */
export type Answer = { result: unknown } | { fault: Fault } | { progress: string };

/** Start of the message after a fault of the module itself. */
export const BROKEN = "the computation ended abnormally";
