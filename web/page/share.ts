// A plan in the fragment of the address: compressed, and never sent to a server.

import { deflateSync, inflateSync, strFromU8, strToU8 } from "fflate";

/** What an address holds: the texts of the plan, and the errors that the sliders state. */
export interface Shared {
  machine: string;
  plan: string;
  values: Record<string, number>;
}

/** Largest text that a fragment may hold, bytes: a fragment comes from anywhere. */
const LARGEST = 1 << 20;
/** Longest fragment, characters: it may unpack to a thousand times its size. */
const LONGEST = 1 << 18;

/** The fragment of a plan; undefined if it is too large for an address. */
export function toFragment(shared: Shared): string | undefined {
  const bytes = strToU8(JSON.stringify(shared));
  if (bytes.length > LARGEST) return undefined;
  const packed = deflateSync(bytes, { level: 9 });
  const binary = Array.from(packed, (byte) => String.fromCharCode(byte)).join("");
  const fragment = `#plan=${btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "")}`;
  return fragment.length <= LONGEST ? fragment : undefined;
}

/** The plan of a fragment; undefined if it holds none. */
export function fromFragment(fragment: string): Shared | undefined {
  const packed = fragment.match(/^#plan=([\w-]+)$/)?.[1];
  if (!packed || fragment.length > LONGEST) return undefined;
  try {
    const binary = atob(packed.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(binary, (character) => character.charCodeAt(0));
    const text = inflateSync(bytes, { out: new Uint8Array(LARGEST) });
    const found = JSON.parse(strFromU8(text));
    if (typeof found.machine !== "string" || typeof found.plan !== "string") return undefined;
    const values = Object.entries(found.values ?? {}).filter(([, value]) => Number.isFinite(value));
    return { machine: found.machine, plan: found.plan, values: Object.fromEntries(values) as Record<string, number> };
  } catch {
    return undefined;
  }
}
