// The curves of the tests of a plan.

import { COLOURS, type Curve } from "./chart";
import type { CallOptions } from "./engine";
import type { Description } from "./plan";

/** A call of the worker. */
export type Call = <T>(method: string, args?: unknown[], options?: CallOptions) => Promise<T>;

/**
 * The curves of each coordinate of each test: the sum of all changes and each change alone, or the derivative by each
 * error.
 */
export async function computedCurves(
  found: Description,
  values: Float64Array,
  kind: "patterns" | "sensitivities",
  call: Call,
): Promise<Curve[][][]> {
  const errors = found.parameters.flatMap(({ setup }, j) => (setup ? [] : [j]));
  const alone = kind === "sensitivities" ? errors : [...values.keys()].filter((j) => values[j] !== 0);
  const numbers = await call<Float64Array>(kind, [values, Uint32Array.from(alone)]);
  const each = alone.map((j): Omit<Curve, "values"> => ({ colour: COLOURS[j % COLOURS.length], width: 1.2 }));
  const styles = kind === "sensitivities" ? each : [{ colour: "", width: 2 }, ...each];
  let at = 0;
  return found.tests.map(({ coordinates }, k) => {
    const length = found.abscissae[k].length * coordinates.length;
    const each = styles.map((style) => ({ style, all: numbers.subarray(at, (at += length)) }));
    // The coordinates of a reading are consecutive.
    const one = (all: Float64Array, coordinate: number) => all.filter((_, i) => i % coordinates.length === coordinate);
    return coordinates.map((_, coordinate) =>
      each.map(({ style, all }) => ({ ...style, values: coordinates.length === 1 ? all : one(all, coordinate) })),
    );
  });
}
