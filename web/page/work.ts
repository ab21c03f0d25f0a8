// What the views keep beyond a reload, and whether leaving would lose something.

import { createContext } from "preact";
import { useContext, useEffect } from "preact/hooks";
import type { Kept, Store } from "./store";

/** What is not saved to a disk: by view. */
const unsaved = new Map<string, boolean>();

export interface Keeping {
  store: Store;
  /** What was kept before this page was loaded. */
  kept?: Kept;
}

const Context = createContext<Keeping | undefined>(undefined);
export const KeepingProvider = Context.Provider;

export function useKeeping(): Keeping {
  const keeping = useContext(Context);
  if (!keeping) throw new Error("the page has no store");
  return keeping;
}

/** A value that was kept; undefined if there is none. */
export const keptValue = <T>({ kept }: Keeping, name: string): T | undefined => kept?.values.get(name) as T | undefined;

/** Tells whether leaving would lose something of a view: changes that are on no disk, or work that runs. */
export function useUnsaved(view: string, isUnsaved: boolean): void {
  useEffect(() => {
    unsaved.set(view, isUnsaved);
  }, [view, isUnsaved]);
}

/** Asks before the page is left with unsaved work. */
export function askBeforeLeaving(): void {
  addEventListener("beforeunload", (event) => {
    if ([...unsaved.values()].some((isUnsaved) => isUnsaved)) event.preventDefault();
  });
}
